//! The slaves that do not answer: since when, when each is asked next, and what their stops may take of the line.

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;

/// For each stop of a slave that is off-line, so many times as long on the line no other: they are repeated for as long as
/// it is, and together they take a fifth. If all went ahead of everything, three dead drives would take the whole line from
/// the living.
const STOP_REST: u32 = 4;

/// But for no longer than this: whoever asks for the next may be a person who sees the motor turn.
const LONGEST_STOP_REST: Duration = Duration::from_secs(30);

/// Those that are off-line: the one place that knows.
#[derive(Debug, Default)]
pub(super) struct Offline {
    slaves: BTreeMap<u8, Lost>,
    /// No repeated stop before this.
    stop_at: Option<Instant>,
}

/// One of them.
#[derive(Debug, Clone, Copy)]
struct Lost {
    missed_at: Instant,
    probe_at: Instant,
    backoff: Duration,
    /// A Stop was sent to it in vain: the next is a repetition.
    stopped_in_vain: bool,
}

impl Offline {
    pub(super) fn contains(&self, slave: u8) -> bool {
        self.slaves.contains_key(&slave)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.slaves.len()
    }

    pub(super) fn slaves(&self) -> impl Iterator<Item = u8> {
        self.slaves.keys().copied()
    }

    /// The next on both sides of a slave, the lower first.
    pub(super) fn neighbours(&self, slave: u8) -> [Option<u8>; 2] {
        let lower = self.slaves.range(..slave).next_back();
        [lower, self.slaves.range(slave..).next()].map(|found| found.map(|(slave, _)| *slave))
    }

    /// A slave goes off-line.
    pub(super) fn insert(&mut self, now: Instant, slave: u8, backoff: Duration) {
        let lost = Lost { missed_at: now, probe_at: now + backoff, backoff, stopped_in_vain: false };
        self.slaves.insert(slave, lost);
    }

    /// It answers. False: it was not off-line.
    pub(super) fn remove(&mut self, slave: u8) -> bool {
        self.slaves.remove(&slave).is_some()
    }

    /// It has not answered again. False: it is not off-line.
    pub(super) fn missed_again(
        &mut self,
        now: Instant,
        slave: u8,
        (first, longest): (Duration, Duration),
    ) -> bool {
        let Some(lost) = self.slaves.get_mut(&slave) else { return false };
        lost.missed_at = now;
        lost.backoff = lost.backoff.saturating_mul(2).clamp(first, longest);
        lost.probe_at = now + lost.backoff;
        true
    }

    /// When its backoff is over.
    pub(super) fn probe_at(&self, slave: u8) -> Option<Instant> {
        self.slaves.get(&slave).map(|lost| lost.probe_at)
    }

    /// The same on an idle line, where nothing waits longer than `first` after the last question.
    pub(super) fn idle_probe_at(&self, slave: u8, first: Duration) -> Option<Instant> {
        self.slaves.get(&slave).map(|lost| lost.probe_at.min(lost.missed_at + first))
    }

    /// There is reason to think that it is back: it is asked at once, and soon again.
    pub(super) fn hope(&mut self, now: Instant, slave: u8) {
        if let Some(lost) = self.slaves.get_mut(&slave) {
            lost.probe_at = now;
            lost.backoff = Duration::ZERO;
        }
    }

    /// A probe of it that was under way was given up.
    pub(super) fn probe_again(&mut self, at: Instant, slave: u8) {
        if let Some(lost) = self.slaves.get_mut(&slave) {
            lost.probe_at = at;
        }
    }

    /// A stop to it has failed, and held the others up for so long by itself.
    pub(super) fn stop_failed(&mut self, now: Instant, slave: u8, took: Duration) {
        if let Some(lost) = self.slaves.get_mut(&slave) {
            lost.stopped_in_vain = true;
            self.stop_at = Some(now + (took * STOP_REST).min(LONGEST_STOP_REST));
        }
    }

    /// When the next stop to it may be sent, where that would be a repetition.
    pub(super) fn stop_at(&self, slave: u8) -> Option<Instant> {
        self.stop_at.filter(|_| self.slaves.get(&slave).is_some_and(|lost| lost.stopped_in_vain))
    }
}
