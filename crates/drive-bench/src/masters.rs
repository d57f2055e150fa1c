//! Masters: ours, the stock tokio-modbus client, and a loop written by hand.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use drive_bus::{Line, Slave, exchange::rtu};
use drive_clock::Timer;
use drive_core::serial::SerialSettings;
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt},
    time::Instant,
};
use tokio_modbus::{Request, client, client::Client, prelude::*};
use tokio_serial::{Parity, SerialPortBuilderExt, SerialStream};

use crate::{
    Error,
    rig::{FIRST, QUANTITY},
};

const SETTINGS: SerialSettings = SerialSettings::MODBUS_DEFAULT;

/// So many answers of a drive may be missed: its simulator is a program too, which a busy machine keeps waiting. More are a fault.
const MISSED: u32 = 30;

/// The one request of all measurements.
pub(crate) const READ: Request<'static> = Request::ReadHoldingRegisters(FIRST, QUANTITY);

/// Polls every slave of a line as fast as it answers, each from a task of its own. How many reads were answered.
pub(crate) async fn saturate(line: &Line, drives: u8, time: Duration) -> Result<u64, Error> {
    let end = Instant::now() + time;
    let polls: Vec<_> = (1..=drives).map(|slave| tokio::spawn(poll(line.slave(slave), end))).collect();
    let mut reads = 0;
    for poll in polls {
        reads += poll.await??;
    }
    Ok(reads)
}

async fn poll(mut slave: Slave, end: Instant) -> Result<u64, Error> {
    let (mut reads, mut missed) = (0, 0);
    while Instant::now() < end {
        match slave.call(READ).await {
            Ok(answer) => {
                answer?;
                reads += 1;
            }
            Err(_) if missed < MISSED => missed += 1,
            Err(error) => return Err(error.into()),
        }
    }
    Ok(reads)
}

/// Reads one drive after another over our line, as the other masters do it. How many reads were answered.
pub(crate) async fn in_turn(line: Line, drives: u8, time: Duration) -> Result<u64, Error> {
    let end = Instant::now() + time;
    let mut slaves: Vec<_> = (1..=drives).map(|slave| line.slave(slave)).collect();
    let mut reads = 0;
    while Instant::now() < end {
        for slave in &mut slaves {
            slave.call(READ).await??;
            reads += 1;
        }
    }
    Ok(reads)
}

/// Asks all `slaves` at once, waits until every one has answered or failed, and begins anew: the mean time of this, from
/// `settle` on for `time`.
pub(crate) async fn sweeps(
    line: &Line,
    slaves: &[u8],
    dead: &[u8],
    settle: Duration,
    time: Duration,
) -> Result<Duration, Error> {
    let start = Instant::now();
    let (mut begin, mut count) = (start, 0_u32);
    while start.elapsed() < settle + time {
        if begin < start + settle && start.elapsed() >= settle {
            (begin, count) = (Instant::now(), 0);
        }
        let reads: Vec<_> = slaves
            .iter()
            .map(|&address| {
                let mut slave = line.slave(address);
                tokio::spawn(async move { (address, slave.call(READ).await) })
            })
            .collect();
        for read in reads {
            let (address, answer) = read.await?;
            if answer.is_err() && !dead.contains(&address) {
                return Err(format!("drive {address} lives and did not answer").into());
            }
        }
        count += 1;
    }
    Ok(begin.elapsed() / count.max(1))
}

pub(crate) fn open(port: &Path) -> Result<SerialStream, Error> {
    Ok(tokio_serial::new(port.to_string_lossy(), 19_200).parity(Parity::Even).open_native_async()?)
}

/// The stock tokio-modbus client, which keeps no silence by itself, with a `sleep(t3.5)` before each request or none.
/// How many reads were answered.
pub(crate) async fn stock(port: PathBuf, drives: u8, time: Duration, silence: bool) -> Result<u64, Error> {
    let mut context = client::rtu::attach(open(&port)?);
    let end = Instant::now() + time;
    let mut reads = 0;
    while Instant::now() < end {
        for slave in 1..=drives {
            context.set_slave(tokio_modbus::Slave(slave));
            if silence {
                tokio::time::sleep(SETTINGS.t3_5()).await;
            }
            context.read_holding_registers(FIRST, QUANTITY).await??;
            reads += 1;
        }
    }
    Ok(reads)
}

/// A loop written by hand for this one request, with a timeout and a check of the CRC: the least that a tokio program can
/// do. How many reads were answered.
pub(crate) async fn by_hand(port: PathBuf, drives: u8, time: Duration) -> Result<u64, Error> {
    let mut port = open(&port)?;
    let end = Instant::now() + time;
    let [high, low] = FIRST.to_be_bytes();
    let mut answer = [0; 5 + 2 * QUANTITY as usize];
    let mut reads = 0;
    while Instant::now() < end {
        for slave in 1..=drives {
            port.write_all(&rtu::frame(slave, &[3, high, low, 0, QUANTITY as u8])).await?;
            tokio::time::timeout(Duration::from_millis(500), port.read_exact(&mut answer)).await??;
            if !rtu::is_frame(&answer) {
                return Err("a damaged answer on a line without faults".into());
            }
            reads += 1;
        }
    }
    Ok(reads)
}

/// The same with the silence of the line before each request, by a timer as precise as that of a line, and no timeout: the least
/// that a lawful task can do for a line. How many reads were answered.
pub(crate) async fn lawful_by_hand(
    mut port: impl AsyncRead + AsyncWrite + Unpin,
    drives: u8,
    time: Duration,
) -> Result<u64, Error> {
    let mut timer = Timer::precise();
    let end = Instant::now() + time;
    let [high, low] = FIRST.to_be_bytes();
    let mut answer = [0; 5 + 2 * QUANTITY as usize];
    let (mut reads, mut free_at) = (0, Instant::now());
    for slave in (1..=drives).cycle() {
        timer.until(free_at).await;
        if Instant::now() >= end {
            break;
        }
        port.write_all(&rtu::frame(slave, &[3, high, low, 0, QUANTITY as u8])).await?;
        port.read_exact(&mut answer).await?;
        free_at = Instant::now() + SETTINGS.t3_5();
        if !rtu::is_frame(&answer) {
            return Err("a damaged answer on a line without faults".into());
        }
        reads += 1;
    }
    Ok(reads)
}
