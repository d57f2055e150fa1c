//! The quality of a line, minute by minute.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::stats::{SlaveStats, Stats};
use tokio::time::Instant;

/// Over which time it is counted.
const MINUTE: Duration = Duration::from_secs(60);
/// Fewer bad answers than this in a minute are not told.
const FEW: u64 = 5;
/// Nor is what is less than one in so many.
const RARE: u64 = 100;

/// What went wrong with a slave.
#[derive(Debug, Clone, Copy, Default)]
struct Counted {
    sent: u64,
    /// Answers that were damaged, or were not what was asked for.
    bad: u64,
    /// Answers that did not come in time.
    missing: u64,
}

impl Counted {
    fn of(stats: &SlaveStats) -> Self {
        let outcomes = &stats.outcomes;
        Self { sent: stats.sent, bad: outcomes.damaged + outcomes.mismatches, missing: outcomes.timeouts }
    }

    fn since(self, before: Self) -> Self {
        Self {
            sent: self.sent.saturating_sub(before.sent),
            bad: self.bad.saturating_sub(before.bad),
            missing: self.missing.saturating_sub(before.missing),
        }
    }
}

/// Watches the answers of one line.
#[derive(Debug)]
pub(super) struct Noise {
    since: Instant,
    before: BTreeMap<u8, Counted>,
}

impl Noise {
    pub(super) const fn new(now: Instant) -> Self {
        Self { since: now, before: BTreeMap::new() }
    }

    /// Whether a minute is over.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= MINUTE
    }

    /// What the last minute was like, where that is worth a line. A slave that was away in it is told of elsewhere: what is
    /// missing from it is no noise.
    pub(super) fn minute(
        &mut self,
        now: Instant,
        stats: &Stats,
        was_away: impl Fn(u8) -> bool,
        name: impl Fn(u8) -> String,
    ) -> Option<String> {
        let after: BTreeMap<u8, Counted> =
            stats.slaves.iter().map(|(&slave, stats)| (slave, Counted::of(stats))).collect();
        let before = std::mem::replace(&mut self.before, after);
        self.since = now;
        let mut all = Counted::default();
        let mut worst = (0, 0);
        for (&slave, counted) in &self.before {
            let mut counted = counted.since(before.get(&slave).copied().unwrap_or_default());
            if was_away(slave) {
                counted.sent -= counted.missing.min(counted.sent);
                counted.missing = 0;
            }
            all.sent += counted.sent;
            all.bad += counted.bad;
            all.missing += counted.missing;
            worst = worst.max((counted.bad + counted.missing, slave));
        }
        let wrong = all.bad + all.missing;
        if wrong < FEW || wrong * RARE < all.sent {
            return None;
        }
        let (most, slave) = worst;
        Some(format!(
            "{} of {} answers damaged and {} missing in the last minute, most of {} ({most})",
            all.bad,
            all.sent,
            all.missing,
            name(slave)
        ))
    }
}
