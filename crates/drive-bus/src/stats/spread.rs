//! Durations by fixed bounds.

use std::time::Duration;

use super::histogram::{count_at, nanos};

/// The bounds of [`Spread`]: what requests and answers take on a wire, from a short one at high speed to the longest time-out
/// that is usual.
pub const BOUNDS: [Duration; 14] = {
    const MILLISECONDS: [u64; 14] = [5, 8, 12, 16, 20, 25, 30, 40, 50, 75, 100, 250, 500, 1_000];
    let mut bounds = [Duration::ZERO; 14];
    let mut at = 0;
    while at < bounds.len() {
        bounds[at] = Duration::from_millis(MILLISECONDS[at]);
        at += 1;
    }
    bounds
};

/// Durations counted by the fixed [`BOUNDS`], so that those of many slaves, lines and hosts can be added up.
///
/// ```
/// use drive_bus::stats::{BOUNDS, Spread};
/// use std::time::Duration;
///
/// let mut exchanges = Spread::default();
/// exchanges.record(Duration::from_millis(21));
/// exchanges.record(Duration::from_secs(3));
/// let within: Vec<_> = BOUNDS.iter().zip(exchanges.up_to()).filter(|(_, count)| *count > 0).collect();
/// assert_eq!(*within[0].0, Duration::from_millis(25));
/// assert_eq!(exchanges.up_to().last(), Some(2));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Spread {
    /// One for each bound and one for what is longer, up to the last that is not zero: most drives need few.
    pub(super) counts: Box<[u32]>,
    /// Nanoseconds.
    pub(super) sum: u64,
}

impl Spread {
    /// Counts one duration.
    pub fn record(&mut self, duration: Duration) {
        count_at(&mut self.counts, BOUNDS.partition_point(|bound| *bound < duration), 1);
        self.sum = self.sum.saturating_add(nanos(duration));
    }

    /// How many were not longer than each of the [`BOUNDS`], and at last how many there were.
    pub fn up_to(&self) -> impl Iterator<Item = u64> + '_ {
        let mut sum = 0;
        (0..=BOUNDS.len()).map(move |at| {
            sum += self.counts.get(at).copied().map_or(0, u64::from);
            sum
        })
    }

    /// All of them together.
    #[must_use]
    pub const fn sum(&self) -> Duration {
        Duration::from_nanos(self.sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_counts_a_duration_at_its_bound_as_not_longer() {
        let mut spread = Spread::default();
        assert_eq!(spread.up_to().max(), Some(0));
        let micros = [0, 5_000, 5_001, 16_000, 999_999, 1_000_000, 1_000_001, 60_000_000];
        micros.map(Duration::from_micros).into_iter().for_each(|duration| spread.record(duration));
        let counted: Vec<u64> = spread.up_to().collect();
        assert_eq!(counted, [2, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 6, 8]);
        assert_eq!(spread.sum(), Duration::from_micros(micros.iter().sum()));
    }
}
