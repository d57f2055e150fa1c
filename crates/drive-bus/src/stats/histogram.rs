//! Durations by buckets that grow with them.

use std::time::Duration;

/// Buckets of an octave.
pub(super) const SUB: usize = 8;

/// Octaves, from 1 µs on: up to 67 s.
pub(super) const OCTAVES: usize = 26;

/// A histogram of durations with a resolution of 9 to 12 %, from 1 µs to 67 s. It keeps the buckets from the shortest to
/// the longest that was counted: a drive that answers steadily needs few, and there are thirty thousand drives on a
/// thousand lines.
///
/// ```
/// use drive_bus::stats::Histogram;
/// use std::time::Duration;
///
/// let mut waits = Histogram::new();
/// for millis in 1..=100 {
///     waits.record(Duration::from_millis(millis));
/// }
/// // The longest exactly, a quantile an eighth too long at the most.
/// assert_eq!((waits.count(), waits.max()), (100, Duration::from_millis(100)));
/// assert!(waits.quantile(500) >= Duration::from_millis(50) && waits.quantile(500) < Duration::from_millis(57));
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Histogram {
    first: usize,
    /// As many as there are: a line has a thousand neighbours.
    pub(super) buckets: Box<[u32]>,
    pub(super) count: u64,
    /// Nanoseconds, as the two below.
    pub(super) sum: u64,
    pub(super) min: u64,
    pub(super) max: u64,
}

impl Histogram {
    /// An empty histogram.
    #[must_use]
    pub fn new() -> Self {
        Self { first: 0, buckets: Box::default(), count: 0, sum: 0, min: u64::MAX, max: 0 }
    }

    /// Counts one duration.
    pub fn record(&mut self, duration: Duration) {
        self.count_in(bucket_of(duration), 1);
        let nanos = nanos(duration);
        self.count += 1;
        self.sum = self.sum.saturating_add(nanos);
        self.min = self.min.min(nanos);
        self.max = self.max.max(nanos);
    }

    /// How many were counted.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// The shortest, exactly; zero when nothing was counted.
    #[must_use]
    pub const fn min(&self) -> Duration {
        if self.count == 0 { Duration::ZERO } else { Duration::from_nanos(self.min) }
    }

    /// The longest, exactly.
    #[must_use]
    pub const fn max(&self) -> Duration {
        Duration::from_nanos(self.max)
    }

    /// The mean; zero when nothing was counted.
    #[must_use]
    pub fn mean(&self) -> Duration {
        Duration::from_nanos(self.sum.checked_div(self.count).unwrap_or_default())
    }

    /// The duration that `per_mille` of 1000 do not exceed: 500 is the median, 990 is p99, 999 is p99.9. Rounded up to
    /// the end of its bucket, and never above the longest. Zero when nothing was counted.
    #[must_use]
    pub fn quantile(&self, per_mille: u32) -> Duration {
        let rank = (self.count.saturating_mul(u64::from(per_mille.min(1_000)))).div_ceil(1_000).max(1);
        let mut seen = 0;
        for (index, &bucket) in self.buckets.iter().enumerate() {
            seen += u64::from(bucket);
            if seen >= rank {
                return end_of(self.first + index).min(self.max());
            }
        }
        self.max()
    }

    /// The buckets from the shortest to the longest that was counted: where each ends, and how many are in it. A bucket begins
    /// where the one before it ends, an eighth of an octave below.
    pub fn buckets(&self) -> impl Iterator<Item = (Duration, u32)> + '_ {
        self.buckets.iter().enumerate().map(|(index, &count)| (end_of(self.first + index), count))
    }

    /// Adds what another one counted.
    pub fn add(&mut self, other: &Self) {
        for (index, &theirs) in other.buckets.iter().enumerate() {
            self.count_in(other.first + index, theirs);
        }
        self.count += other.count;
        self.sum = self.sum.saturating_add(other.sum);
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    pub(super) fn count_in(&mut self, bucket: usize, times: u32) {
        if self.buckets.is_empty() {
            self.first = bucket;
        }
        let missing = self.first.saturating_sub(bucket);
        if missing > 0 {
            self.buckets = std::iter::repeat_n(0, missing).chain(self.buckets.iter().copied()).collect();
            self.first = bucket;
        }
        count_at(&mut self.buckets, bucket - self.first, times);
    }
}

/// Adds to a count, and makes room for it where there is none.
pub(super) fn count_at(counts: &mut Box<[u32]>, at: usize, times: u32) {
    if at >= counts.len() {
        let room = std::iter::repeat_n(0, at + 1 - counts.len());
        *counts = counts.iter().copied().chain(room).collect();
    }
    if let Some(count) = counts.get_mut(at) {
        *count = count.saturating_add(times);
    }
}

pub(super) fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for Histogram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Histogram")
            .field("count", &self.count)
            .field("p50", &self.quantile(500))
            .field("p99", &self.quantile(990))
            .field("max", &self.max)
            .finish()
    }
}

fn bucket_of(duration: Duration) -> usize {
    let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX).max(1);
    let octave = micros.ilog2() as usize;
    let within = ((u128::from(micros) * SUB as u128) >> octave) as usize - SUB;
    (octave * SUB + within).min(SUB * OCTAVES - 1)
}

pub(super) fn end_of(bucket: usize) -> Duration {
    let (octave, within) = (bucket / SUB, bucket % SUB);
    Duration::from_nanos((((SUB + within + 1) as u64 * 1_000) << octave) / SUB as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_at_most_an_eighth_too_long_and_never_too_short() {
        let mut histogram = Histogram::new();
        for micros in 1..=10_000 {
            histogram.record(Duration::from_micros(micros));
        }
        for (per_mille, exact) in [(1, 10), (500, 5_000), (990, 9_900), (999, 9_990), (1_000, 10_000)] {
            let exact = Duration::from_micros(exact);
            let got = histogram.quantile(per_mille);
            assert!(
                got >= exact && got <= exact + exact / 8 + Duration::from_micros(1),
                "{per_mille}: {got:?}"
            );
        }
        assert_eq!(histogram.min(), Duration::from_micros(1));
        assert_eq!(histogram.max(), Duration::from_millis(10));
        assert_eq!(histogram.mean(), Duration::from_nanos(5_000_500));
    }

    #[test]
    fn the_buckets_hold_every_duration_below_their_end_and_above_the_one_before() {
        let mut histogram = Histogram::new();
        assert_eq!(histogram.buckets().count(), 0);
        // One bucket goes from 7680 to 8192 µs.
        for micros in [8_100, 8_150, 12_000] {
            histogram.record(Duration::from_micros(micros));
        }
        let filled: Vec<_> = histogram.buckets().filter(|(_, count)| *count > 0).collect();
        assert_eq!(filled.iter().map(|(_, count)| *count).collect::<Vec<_>>(), [2, 1]);
        for (micros, (end, _)) in [8_150, 12_000].into_iter().zip(filled) {
            let exact = Duration::from_micros(micros);
            assert!(exact < end && end <= exact + exact / 8 + Duration::from_micros(1), "{exact:?} {end:?}");
        }
    }

    #[test]
    fn the_extremes_have_a_bucket() {
        let mut histogram = Histogram::new();
        for duration in [Duration::ZERO, Duration::from_nanos(1), Duration::from_secs(67), Duration::MAX] {
            histogram.record(duration);
        }
        assert_eq!(histogram.count(), 4);
        assert_eq!(histogram.quantile(1_000).min(Duration::from_secs(1)), Duration::from_secs(1));
    }

    #[test]
    fn an_empty_histogram_says_zero() {
        assert_eq!(Histogram::new().quantile(500), Duration::ZERO);
        assert_eq!(Histogram::new().mean(), Duration::ZERO);
    }
}
