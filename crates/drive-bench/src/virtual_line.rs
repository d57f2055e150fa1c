//! The machines of a line in virtual time, to the nanosecond: what the schedule and the timing themselves cost and keep,
//! without tasks, timers and wake-ups.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use bytes::Bytes;
use drive_bus::{LineConfig, exchange::rtu, master::Master};
use drive_core::{PortError, Terms, serial::SerialSettings};
use tokio::time::Instant;

use crate::{
    Error,
    masters::READ,
    rig::exchange,
    simulator::{Counted, TURNAROUND},
};

const SETTINGS: SerialSettings = SerialSettings::MODBUS_DEFAULT;

/// One line: the master, and slaves that answer reads after their turnaround or are dead.
struct VirtualLine {
    master: Master<u8>,
    now: Instant,
    dead: Vec<u8>,
    /// Those that were dead: what they were asked then may fail.
    lost: Vec<u8>,
    /// Whose calls have not ended.
    waiting: BTreeSet<u8>,
    /// What is on its way to the master, and when its last bit is there.
    answer: Option<(Instant, Bytes)>,
    /// When the last character of anybody ended.
    quiet_since: Option<Instant>,
    counted: Counted,
}

impl VirtualLine {
    fn new(dead: &[u8]) -> Self {
        let now = Instant::now();
        let mut master = Master::new(Instant::now(), LineConfig::stream(SETTINGS));
        master.handle_up(now);
        let (dead, lost) = (dead.to_vec(), dead.to_vec());
        let (waiting, counted) = (BTreeSet::new(), Counted::default());
        Self { master, now, dead, lost, waiting, answer: None, quiet_since: None, counted }
    }

    /// Asks one slave; whether that was refused.
    fn read(&mut self, slave: u8) -> Result<(), PortError> {
        self.master.submit(self.now, slave, READ, Terms::default(), slave).map(drop)
    }

    /// Lets everything happen that happens now, and passes the time until something else does. The slaves whose calls
    /// have ended, and whether they answered.
    fn step(&mut self) -> Result<Vec<(u8, bool)>, Error> {
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
            if outcome.is_err() && !self.lost.contains(&slave) {
                return Err(format!("drive {slave} lives and did not answer").into());
            }
            ended.push((slave, outcome.is_ok()));
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
            let bytes = 2 * frame.get(5).copied().unwrap_or_default();
            let mut pdu = vec![3, bytes];
            pdu.resize(2 + usize::from(bytes), 0);
            let answer = rtu::frame(slave, &pdu);
            self.answer = Some((ended + TURNAROUND + SETTINGS.characters(answer.len()), answer));
        }
    }

    /// Asks all drives, each again as soon as it has answered or the line lets, for `time`: when each answered first.
    fn poll(&mut self, drives: u8, time: Duration) -> Result<BTreeMap<u8, Duration>, Error> {
        let start = self.now;
        let mut first = BTreeMap::new();
        while self.now < start + time {
            for drive in 1..=drives {
                if !self.waiting.contains(&drive) && self.read(drive).is_ok() {
                    self.waiting.insert(drive);
                }
            }
            for (slave, answered) in self.step()? {
                self.waiting.remove(&slave);
                if answered {
                    first.entry(slave).or_insert(self.now - start);
                }
            }
        }
        Ok(first)
    }
}

/// How long the slowest of these takes to answer first.
fn slowest(first: &BTreeMap<u8, Duration>, of: impl IntoIterator<Item = u8>) -> Result<Duration, Error> {
    let times = of.into_iter().map(|drive| first.get(&drive).copied().ok_or("a drive was never found again"));
    Ok(times.collect::<Result<Vec<_>, _>>()?.into_iter().max().unwrap_or_default())
}

/// Times from when drives are there, or have power again, to the status of the last of them.
pub(crate) struct Found {
    /// The living ones, with `lost` that never answered.
    pub(crate) living: Duration,
    /// All that were lost, when their power comes back together.
    pub(crate) together: Duration,
    /// One of them whose power comes back alone, the slowest of some.
    pub(crate) alone: Duration,
}

/// How soon drives are found, on a line of which the first `lost` are dead: they are asked before the others.
pub(crate) fn found(drives: u8, lost: u8) -> Result<Found, Error> {
    let dead: Vec<u8> = (1..=lost).collect();
    let minute = Duration::from_secs(60);
    let mut line = VirtualLine::new(&dead);
    let living = slowest(&line.poll(drives, minute)?, lost + 1..=drives)?;
    let mut alone = Duration::ZERO;
    for drive in dead.iter().copied().step_by(6) {
        line.dead.retain(|dead| *dead != drive);
        alone = alone.max(slowest(&line.poll(drives, minute)?, [drive])?);
        line.dead.push(drive);
        line.poll(drives, minute)?;
    }
    line.dead.clear();
    line.poll(drives, minute)?;
    line.dead.clone_from(&dead);
    line.poll(drives, minute)?;
    line.dead.clear();
    let together = slowest(&line.poll(drives, minute)?, dead)?;
    Ok(Found { living, together, alone })
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
        for (slave, _) in line.step()? {
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
