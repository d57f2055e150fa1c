//! The machines of a line in virtual time, to the nanosecond: what the schedule and the timing themselves cost and keep,
//! without tasks, timers and wake-ups.

use std::time::Duration;

use bytes::Bytes;
use drive_bus::{LineConfig, exchange::rtu, master::Master};
use drive_core::{PortError, Terms, serial::SerialSettings};
use tokio::time::Instant;

use crate::{
    Error,
    masters::READ,
    rig::{QUANTITY, exchange},
    simulator::{Counted, TURNAROUND},
};

const SETTINGS: SerialSettings = SerialSettings::MODBUS_DEFAULT;

/// Address, function, count, words.
const ANSWER: usize = 3 + 2 * QUANTITY as usize;

/// One line: the master, and slaves that answer reads after their turnaround or are dead.
struct VirtualLine {
    master: Master<u8>,
    now: Instant,
    dead: Vec<u8>,
    /// What is on its way to the master, and when its last bit is there.
    answer: Option<(Instant, Bytes)>,
    /// When the last character of anybody ended.
    quiet_since: Option<Instant>,
    counted: Counted,
}

impl VirtualLine {
    fn new(dead: &[u8]) -> Self {
        let now = Instant::now();
        let mut master = Master::new(LineConfig::stream(SETTINGS));
        master.handle_up(now);
        let dead = dead.to_vec();
        Self { master, now, dead, answer: None, quiet_since: None, counted: Counted::default() }
    }

    /// Asks one slave; whether that was refused.
    fn read(&mut self, slave: u8) -> Result<(), PortError> {
        self.master.submit(self.now, slave, READ, Terms::default(), slave).map(drop)
    }

    /// Lets everything happen that happens now, and passes the time until something else does. The slaves whose calls
    /// have ended.
    fn step(&mut self) -> Result<Vec<u8>, Error> {
        if let Some((_, bytes)) = self.answer.take_if(|(at, _)| *at <= self.now) {
            self.master.handle_bytes(self.now, &bytes);
            self.quiet_since = Some(self.now);
        }
        self.master.handle_timeout(self.now);
        if let Some(frame) = self.master.poll_transmit(self.now) {
            self.master.handle_sent(self.now);
            self.hear(&frame);
        }
        let mut ended = Vec::new();
        while let Some((slave, outcome)) = self.master.poll_outcome() {
            if outcome.is_err() && !self.dead.contains(&slave) {
                return Err(format!("drive {slave} lives and did not answer").into());
            }
            ended.push(slave);
        }
        if ended.is_empty() {
            let arrival = self.answer.as_ref().map(|(at, _)| *at);
            let next = arrival.into_iter().chain(self.master.deadline()).min();
            self.now = next.ok_or("nothing will ever happen on this line")?.max(self.now);
        }
        Ok(ended)
    }

    /// A request is on the wire from now on.
    fn hear(&mut self, frame: &[u8]) {
        if let Some(quiet_since) = self.quiet_since {
            let kept = self.now.saturating_duration_since(quiet_since);
            self.counted.violations += u64::from(kept < SETTINGS.t3_5());
            self.counted.shortest_silence =
                Some(self.counted.shortest_silence.map_or(kept, |shortest| shortest.min(kept)));
        }
        let ended = self.now + SETTINGS.characters(frame.len());
        self.quiet_since = Some(ended);
        self.counted.requests += 1;
        let slave = frame.first().copied().unwrap_or_default();
        if !self.dead.contains(&slave) {
            let mut pdu = [0; ANSWER - 1];
            pdu[..2].copy_from_slice(&[3, 2 * QUANTITY as u8]);
            let answer = rtu::frame(slave, &pdu);
            self.answer = Some((ended + TURNAROUND + SETTINGS.characters(answer.len()), answer));
        }
    }
}

/// So many reads of a saturated line.
pub(crate) fn saturated(drives: u8, transactions: u64) -> Result<Counted, Error> {
    let mut line = VirtualLine::new(&[]);
    let start = line.now;
    for slave in 1..=drives {
        line.read(slave)?;
    }
    let mut answered = 0;
    while answered < transactions {
        for slave in line.step()? {
            answered += 1;
            line.read(slave)?;
        }
    }
    let slot = exchange(TURNAROUND) + SETTINGS.t3_5();
    // What was sent last may not be answered yet.
    let taken = line.quiet_since.unwrap_or(start) - start + SETTINGS.t3_5();
    Ok(Counted { ideal: slot * u32::try_from(answered)?, taken, ..line.counted })
}

/// The mean time in which all drives are asked once and have answered or failed, the dead ones among them, from `settle`
/// on for `time`.
pub(crate) fn sweep(living: &[u8], dead: &[u8], settle: Duration, time: Duration) -> Result<Duration, Error> {
    let mut line = VirtualLine::new(dead);
    let start = line.now;
    let (mut begin, mut sweeps) = (start, 0_u32);
    while line.now < start + settle + time {
        if begin < start + settle && line.now >= start + settle {
            (begin, sweeps) = (line.now, 0);
        }
        let mut waiting = 0;
        for &slave in living.iter().chain(dead) {
            match line.read(slave) {
                Ok(()) => waiting += 1,
                // It is known to be dead: refused at once.
                Err(PortError::Offline { .. }) => {}
                Err(other) => return Err(other.into()),
            }
        }
        while waiting > 0 {
            waiting -= line.step()?.len();
        }
        sweeps += 1;
    }
    Ok((line.now - begin) / sweeps.max(1))
}
