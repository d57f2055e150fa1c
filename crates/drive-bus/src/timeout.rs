//! The response timeout of one slave, learned from its answers as TCP learns it (RFC 6298).

use std::time::Duration;

/// What the clock and the scheduler of a computer add to any measured time, the G of RFC 6298: a few ticks of 1 ms.
const GRANULARITY: Duration = Duration::from_millis(5);

/// A response timeout: from the end of a request to the first character of its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LearnedTimeout {
    floor: Duration,
    ceiling: Duration,
    smoothed: Option<(Duration, Duration)>,
    doubled: u32,
}

impl LearnedTimeout {
    /// Nothing learned yet: the ceiling holds.
    #[must_use]
    pub fn new(floor: Duration, ceiling: Duration) -> Self {
        Self { floor: floor.min(ceiling), ceiling, smoothed: None, doubled: 0 }
    }

    /// The timeout for the next request.
    #[must_use]
    pub fn current(&self) -> Duration {
        let Some((mean, deviation)) = self.smoothed else { return self.ceiling };
        let learned = mean + (deviation * 4).max(GRANULARITY);
        // Doubling may not outrun the ceiling, so a few times are enough.
        learned.max(self.floor).saturating_mul(1 << self.doubled.min(16)).min(self.ceiling)
    }

    /// The timeout of a short question, to a slave that may not be there: twice what it has needed, and half the floor at
    /// the least. `None`: it has never answered.
    #[must_use]
    pub fn short(&self) -> Option<Duration> {
        let (mean, deviation) = self.smoothed?;
        let learned = mean + (deviation * 4).max(GRANULARITY);
        Some(learned.saturating_mul(2).max(self.floor / 2).min(self.ceiling))
    }

    /// The longest that it can become.
    #[must_use]
    pub const fn ceiling(&self) -> Duration {
        self.ceiling
    }

    /// Whether the slave has ever answered.
    #[must_use]
    pub const fn is_learned(&self) -> bool {
        self.smoothed.is_some()
    }

    /// How long the slave usually takes; the ceiling when nothing is known.
    #[must_use]
    pub fn typical(&self) -> Duration {
        self.smoothed.map_or(self.ceiling, |(mean, _)| mean)
    }

    /// How long the slave usually takes and by how much that varies, once it has answered.
    #[must_use]
    pub const fn learned(&self) -> Option<(Duration, Duration)> {
        self.smoothed
    }

    /// Another ceiling; what was learned stays.
    pub fn limit(&mut self, ceiling: Duration) {
        self.ceiling = ceiling;
        self.floor = self.floor.min(ceiling);
    }

    /// It may become as long as this, too.
    pub fn allow(&mut self, longest: Duration) {
        self.ceiling = self.ceiling.max(longest);
    }

    /// An answer began `after` the end of its request.
    pub fn answered(&mut self, after: Duration) {
        self.doubled = 0;
        self.smoothed = Some(match self.smoothed {
            None => (after, after / 2),
            Some((mean, deviation)) => {
                (mean * 7 / 8 + after / 8, deviation * 3 / 4 + mean.abs_diff(after) / 4)
            }
        });
    }

    /// No answer came in time.
    pub fn missed(&mut self) {
        self.doubled = self.doubled.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn before_the_first_answer_the_ceiling_holds() {
        assert_eq!(LearnedTimeout::new(50 * MS, 500 * MS).current(), 500 * MS);
    }

    #[test]
    fn a_steady_slave_gets_a_short_timeout_but_never_below_the_floor() {
        let mut timeout = LearnedTimeout::new(30 * MS, 500 * MS);
        for _ in 0..100 {
            timeout.answered(5 * MS);
        }
        assert_eq!(timeout.current(), 30 * MS);
        for _ in 0..100 {
            timeout.answered(80 * MS);
        }
        let learned = timeout.current();
        assert!(learned > 80 * MS && learned < 100 * MS, "{learned:?}");
    }

    #[test]
    fn a_ceiling_is_raised_and_never_lowered_by_what_is_allowed() {
        let mut timeout = LearnedTimeout::new(50 * MS, 200 * MS);
        timeout.allow(300 * MS);
        timeout.allow(100 * MS);
        assert_eq!(timeout.ceiling(), 300 * MS);
        timeout.answered(240 * MS);
        assert_eq!(timeout.current(), 300 * MS);
    }

    #[test]
    fn an_unsteady_slave_gets_room() {
        let mut timeout = LearnedTimeout::new(10 * MS, 500 * MS);
        for n in 0..100 {
            timeout.answered(if n % 2 == 0 { 10 * MS } else { 90 * MS });
        }
        assert!(timeout.current() > 90 * MS, "{:?}", timeout.current());
    }

    #[test]
    fn silence_doubles_it_up_to_the_ceiling_and_an_answer_ends_that() {
        let mut timeout = LearnedTimeout::new(50 * MS, 180 * MS);
        timeout.answered(5 * MS);
        assert_eq!(timeout.current(), 50 * MS);
        timeout.missed();
        assert_eq!(timeout.current(), 100 * MS);
        for _ in 0..100 {
            timeout.missed();
        }
        assert_eq!(timeout.current(), 180 * MS);
        timeout.answered(5 * MS);
        assert_eq!(timeout.current(), 50 * MS);
    }
}
