//! When an answer is worth being awake for.

use std::{ops::Range, time::Duration};

use tokio::time::Instant;

use crate::company;

/// A line may be awake for so much of its time: 5 %.
const SHARE: u32 = 20;

/// How much of that may be saved up.
const MOST_SAVED: Duration = Duration::from_millis(5);

/// The least and the most before and behind the time at which an answer is due.
const HALF: (Duration, Duration) = (Duration::from_micros(40), Duration::from_micros(400));

/// Of so many watches on end, how many may be in vain before it does not pay.
const WATCHES: u32 = 16;
const IN_VAIN: u32 = 8;

/// Where it does not pay it is tried again after so many answers.
const PAUSE: u32 = 64;

/// One line's watches: when it stays awake for the last character of an answer, so that no processor has to be woken for
/// it. Pure: time is an argument.
///
/// At most 5 % of one processor, nothing where the answers do not come when they are expected, and nothing in a process
/// that has many lines.
#[derive(Debug, Clone, Copy)]
pub struct Watch {
    saved: Duration,
    saved_at: Option<Instant>,
    /// Of the watches of late, those that were in vain.
    in_vain: u32,
    watches: u32,
    pause: u32,
}

impl Watch {
    /// Nothing is saved up, nothing is known.
    #[must_use]
    pub const fn new() -> Self {
        Self { saved: Duration::ZERO, saved_at: None, in_vain: 0, watches: 0, pause: 0 }
    }

    /// From when until when to be awake for what is due at `due`, usually give or take `spread`. `None`: not at all.
    pub fn plan(&mut self, now: Instant, due: Instant, spread: Duration) -> Option<Range<Instant>> {
        if !company::is_small() {
            return None;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return None;
        }
        let gained = self.saved_at.map_or(Duration::ZERO, |at| now.saturating_duration_since(at)) / SHARE;
        self.saved = self.saved.saturating_add(gained).min(MOST_SAVED);
        self.saved_at = Some(now);
        let half = (spread * 2).clamp(HALF.0, HALF.1);
        (half * 2 <= self.saved && now + half <= due).then(|| due - half..due + half)
    }

    /// A watch is over: it took so long, and the answer came in it or not.
    pub fn ended(&mut self, took: Duration, came: bool) {
        self.saved = self.saved.saturating_sub(took);
        self.watches += 1;
        self.in_vain += u32::from(!came);
        if self.in_vain > IN_VAIN {
            self.pause = PAUSE;
        }
        if self.in_vain > IN_VAIN || self.watches >= WATCHES {
            (self.watches, self.in_vain) = (0, 0);
        }
    }
}

impl Default for Watch {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);
    const SLOT: Duration = Duration::from_millis(23);
    const DUE: Duration = Duration::from_millis(19);

    /// So many slots, in each of which the answer comes at `arrives` behind the begin of the watch, or not in it; how many
    /// were watched, and how long in all.
    fn slots(
        watch: &mut Watch,
        count: u32,
        spread: Duration,
        arrives: impl Fn(u32) -> Duration,
    ) -> (u32, Duration) {
        let start = Instant::now();
        let (mut watched, mut awake) = (0, Duration::ZERO);
        for slot in 0..count {
            let now = start + SLOT * slot;
            let Some(window) = watch.plan(now, now + DUE, spread) else { continue };
            let whole = window.end - window.start;
            let took = arrives(slot).min(whole);
            watch.ended(took, took < whole);
            watched += 1;
            awake += took;
        }
        (watched, awake)
    }

    #[test]
    fn a_steady_slave_is_watched_in_nearly_every_slot() {
        let (watched, awake) = slots(&mut Watch::new(), 1_000, 10 * US, |_| 40 * US);
        assert!(watched > 990, "{watched}");
        assert!(awake < SLOT * 1_000 / 100, "{awake:?}");
    }

    #[test]
    fn it_never_takes_more_than_a_twentieth() {
        for spread in [0, 50, 200, 1_000, 100_000].map(|micros| micros * US) {
            for arrives in [30 * US, 300 * US, 799 * US] {
                let (_, awake) = slots(&mut Watch::new(), 1_000, spread, |_| arrives);
                assert!(awake <= SLOT * 1_000 / 20, "{spread:?}: {awake:?}");
            }
        }
    }

    #[test]
    fn on_a_fast_line_it_is_still_a_twentieth() {
        let mut watch = Watch::new();
        let (start, slot) = (Instant::now(), 3 * Duration::from_millis(1));
        let mut awake = Duration::ZERO;
        for number in 0..10_000 {
            let now = start + slot * number;
            if let Some(window) = watch.plan(now, now + slot / 2, 300 * US) {
                watch.ended(window.end - window.start - US, true);
                awake += window.end - window.start - US;
            }
        }
        assert!(awake <= slot * 10_000 / 20, "{awake:?}");
    }

    #[test]
    fn a_slave_that_answers_when_it_likes_is_hardly_watched() {
        let (watched, _) = slots(&mut Watch::new(), 10_000, 100 * US, |_| SLOT);
        assert!(watched < 1_500, "{watched}");
    }

    #[test]
    fn what_is_nearly_due_is_not_worth_it() {
        let mut watch = Watch::new();
        let now = Instant::now();
        watch.plan(now, now + DUE, US);
        let later = now + Duration::from_secs(1);
        assert_eq!(watch.plan(later, later + 10 * US, US), None);
        assert!(watch.plan(later, later + 100 * US, US).is_some());
    }
}
