//! The most that any master can reach on this machine.

use std::{
    fs::OpenOptions,
    io::{self, Read, Write},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    time::{Duration, Instant},
};

use drive_bus::exchange::rtu;
use drive_core::serial::SerialSettings;
use rustix::fs::OFlags;
use tokio_serial::Parity;

use crate::{
    Error,
    rig::{FIRST, QUANTITY},
    usage::monotonic,
};

/// From when a master gave its request to the port until it had the whole answer.
pub(crate) type Span = (Duration, Duration);

/// The longest that a loop waits for an answer: one that was lost is not counted.
const ANSWER: Duration = Duration::from_millis(500);

/// A loop that never sleeps: it spins on the port and on the clock, with a processor for itself, and does nothing else.
/// Those of its reads that were answered.
pub(crate) fn spinning(port: &Path, drives: u8, time: Duration) -> Result<Vec<Span>, Error> {
    let settings = SerialSettings::MODBUS_DEFAULT;
    // The speed stays with the port when this handle goes.
    drop(tokio_serial::new(port.to_string_lossy(), settings.baud()).parity(Parity::Even).open()?);
    let mut port = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32)
        .open(port)?;
    let [high, low] = FIRST.to_be_bytes();
    let (start, mut reads, mut quiet_from) = (Instant::now(), Vec::new(), None);
    for slave in (1..=drives).cycle() {
        if start.elapsed() >= time {
            break;
        }
        let request = rtu::frame(slave, &[3, high, low, 0, QUANTITY as u8]);
        while quiet_from.is_some_and(|from: Instant| from.elapsed() < settings.t3_5()) {
            std::hint::spin_loop();
        }
        let began = monotonic();
        port.write_all(&request)?;
        let (mut answer, mut length) = ([0; 5 + 2 * QUANTITY as usize], 0);
        let asked = Instant::now();
        while length < answer.len() && asked.elapsed() < ANSWER {
            match port.read(&mut answer[length..]) {
                Ok(received) => length += received,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(error.into()),
            }
        }
        quiet_from = Some(Instant::now());
        if length == answer.len() {
            reads.push((began, monotonic()));
        }
    }
    Ok(reads)
}
