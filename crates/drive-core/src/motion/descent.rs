//! How fast an output comes down from look to look: what tells a ramp that has ended from a cut.

use std::time::Duration;

use tokio::time::Instant;

/// What two readings of an output leave open of its ramp, in hundredths of a hertz: they are rounded, and their moments are those of
/// answers.
const ROUNDING: u32 = 50;

/// How fast an output comes down.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Descent {
    pub(super) last: Option<(Instant, u32)>,
    /// Hundredths of a hertz in a time.
    pub(super) rate: Option<(u32, Duration)>,
    /// The last look showed less than the one before it.
    pub(super) falls: bool,
}

impl Descent {
    pub(super) fn see(&mut self, now: Instant, output: u32) {
        self.falls = false;
        if let Some((then, before)) = self.last {
            self.falls = output < before;
            if output > before {
                self.rate = None;
            } else if output < before && now > then {
                self.rate = Some((before - output, now - then));
            }
        }
        self.last = Some((now, output));
    }

    /// Whether an output that is gone at `now` cannot have come down so fast, or hardly: it was cut, whatever the drive says. A third
    /// faster than it was seen to come down is still a ramp; of one of which nothing was seen its `ramp` is.
    pub(super) fn is_cut(&self, now: Instant, ramp: (u32, Duration)) -> bool {
        let counts_in = |(counts, time)| self.until(now, counts, time, ROUNDING);
        match self.rate {
            Some(rate) => counts_in(rate).is_some_and(|(passed, needed)| passed * 4 < needed * 3),
            None => counts_in(ramp).is_some_and(|(passed, needed)| passed < needed),
        }
    }

    /// Whether an output that is gone at `now` had the time to come down as fast as it was seen to.
    pub(super) fn has_come_down(&self, now: Instant) -> bool {
        let seen = self.rate.and_then(|(counts, time)| self.until(now, counts, time, ROUNDING));
        seen.is_some_and(|(passed, needed)| passed >= needed)
    }

    /// How long ago it was last seen, and how long it takes from there down to an output of `end`, by so many hundredths of a hertz in a
    /// time.
    fn until(&self, now: Instant, counts: u32, time: Duration, end: u32) -> Option<(Duration, Duration)> {
        let (then, output) = self.last?;
        Some((now.saturating_duration_since(then), time * output.saturating_sub(end) / counts.max(1)))
    }
}
