//! How a plant is at the end of each of its days: what it holds in memory, how much waits for its lines, how old what it tells has become,
//! and what it has counted, each beside its bound.

use std::time::Duration;

use drive_bus::LineConfig;
use drive_core::Class;
use drive_fleet::{Fleet, Link};
use tokio::time::Instant;

use super::LONGEST;

/// From one day to the next.
const DAY: Duration = Duration::from_secs(86_400);
/// It is looked at this often.
const EVERY: Duration = Duration::from_secs(60);
/// So many requests may wait of each drive: what looks after it asks one thing after the other, beside that stops, and who reads along.
const OF_EACH: usize = 3;
/// Frames of Modbus have no more bytes behind the address.
const LONGEST_PDU: usize = 253;

/// What was seen of a plant since its day began.
pub(super) struct Days {
    begun: Instant,
    looked: Instant,
    days: u32,
    /// The most that waited for one line, and of how many drives.
    queued: (usize, usize),
    oldest: Duration,
    pub(super) lines: Vec<String>,
    pub(super) against: Vec<String>,
}

impl Days {
    pub(super) fn begin() -> Self {
        let now = Instant::now();
        let (lines, against) = (Vec::new(), Vec::new());
        Self { begun: now, looked: now, days: 0, queued: (0, 0), oldest: Duration::ZERO, lines, against }
    }

    /// Looks at the plant, where it is time.
    pub(super) fn look(&mut self, fleet: &Fleet, config: &LineConfig, memory: impl FnOnce() -> Option<u64>) {
        let now = Instant::now();
        if now < self.looked + EVERY {
            return;
        }
        self.looked = now;
        for (name, line) in fleet.lines() {
            let (queued, drives) = (line.stats().queued, fleet.drives_on(&name).len());
            if queued > self.queued.0 {
                self.queued = (queued, drives);
            }
            if queued > OF_EACH * drives {
                self.object(format!("{queued} requests wait for {name} with {drives} drives"));
            }
        }
        for drive in fleet.drives() {
            let seen = drive.snapshot();
            let Some(status) = seen.status.as_ref().filter(|_| seen.link == Link::Connected) else {
                continue;
            };
            let age = now.saturating_duration_since(status.at);
            self.oldest = self.oldest.max(age);
            if age > LONGEST {
                self.object(format!("{} is told as connected, and its status is {age:?} old", drive.name()));
            }
        }
        if now >= self.begun + DAY * (self.days + 1) {
            self.ends(fleet, config, memory());
        }
    }

    fn object(&mut self, what: String) {
        if self.against.len() < 4 {
            self.against.push(what);
        }
    }

    /// A day is over, or all is.
    pub(super) fn ends(&mut self, fleet: &Fleet, config: &LineConfig, memory: Option<u64>) {
        self.days += 1;
        let counters: Vec<_> = fleet.drives().iter().map(|drive| drive.snapshot().counters).collect();
        let [polls, answered, lost, trips, saves] = [
            counters.iter().map(|of| of.polls).sum::<u64>(),
            counters.iter().map(|of| of.answered).sum(),
            counters.iter().map(|of| of.lost).sum(),
            counters.iter().map(|of| of.trips).sum(),
            counters.iter().map(|of| of.saves).sum(),
        ];
        if saves > 0 {
            self.object(format!("{saves} saves to EEPROM, and nobody has asked for one"));
        }
        if answered > polls {
            self.object(format!("{answered} statuses came, and {polls} were due"));
        }
        let stats = fleet.lines().into_iter().map(|(_, line)| line.stats());
        let wait = stats.map(|of| of.class(Class::Stop).wait.max()).max().unwrap_or_default();
        let ((queued, drives), oldest) = (self.queued, self.oldest);
        let line = format!(
            "day {}, after {:.1} h: {} KiB; at the most {queued} of {} requests waited for a line; a status was {:.1} s old, {} s is a find; a stop waited \
             {:.2} s for its line, {:.2} s where no other stop does; {answered} of {polls} statuses came, {lost} losses, {trips} trips, \
             {saves} saves",
            self.days,
            (self.looked - self.begun).as_secs_f64() / 3_600.0,
            memory.unwrap_or_default(),
            OF_EACH * drives,
            oldest.as_secs_f64(),
            LONGEST.as_secs(),
            wait.as_secs_f64(),
            config.worst_case_stop(LONGEST_PDU, LONGEST_PDU).as_secs_f64(),
        );
        eprintln!("{line}");
        self.lines.push(line);
        (self.queued, self.oldest) = ((0, 0), Duration::ZERO);
    }
}
