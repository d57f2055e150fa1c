//! What a line counts, always: per slave, per class, for the line as a whole.

#[cfg(feature = "serde")]
mod json;

use std::{collections::BTreeMap, time::Duration};

use drive_core::Class;

#[cfg(feature = "unitelway")]
use drive_unitelway::LinkCounters;

/// Buckets of an octave.
const SUB: usize = 8;

/// Octaves, from 1 µs on: up to 67 s.
const OCTAVES: usize = 26;

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
    buckets: Box<[u32]>,
    count: u64,
    /// Nanoseconds, as the two below.
    sum: u64,
    min: u64,
    max: u64,
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

    fn count_in(&mut self, bucket: usize, times: u32) {
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
fn count_at(counts: &mut Box<[u32]>, at: usize, times: u32) {
    if at >= counts.len() {
        let room = std::iter::repeat_n(0, at + 1 - counts.len());
        *counts = counts.iter().copied().chain(room).collect();
    }
    if let Some(count) = counts.get_mut(at) {
        *count = count.saturating_add(times);
    }
}

fn nanos(duration: Duration) -> u64 {
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

fn end_of(bucket: usize) -> Duration {
    let (octave, within) = (bucket / SUB, bucket % SUB);
    Duration::from_nanos((((SUB + within + 1) as u64 * 1_000) << octave) / SUB as u64)
}

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
    counts: Box<[u32]>,
    /// Nanoseconds.
    sum: u64,
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

/// How the calls ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct Outcomes {
    /// With an answer.
    pub answered: u64,
    /// With the slave's exception.
    pub exceptions: u64,
    /// Without an answer in time.
    pub timeouts: u64,
    /// With a damaged answer.
    pub damaged: u64,
    /// With an answer that did not fit the request.
    pub mismatches: u64,
    /// Refused by the slave for as long as its line repeats it (UNI-TELWAY's NAK).
    pub busy: u64,
    /// Expired in the queue.
    pub expired: u64,
    /// Replaced in the queue by a later request.
    pub superseded: u64,
    /// Withdrawn by a caller that did not wait.
    pub withdrawn: u64,
    /// Refused at once: slave off-line, queue full, line down or closed.
    pub refused: u64,
}

/// What the line knows of one slave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct SlaveStats {
    /// Requests sent, retries and probes included.
    pub sent: u64,
    /// How exchanges and waiting requests ended; one call with a retry counts each of its exchanges.
    pub outcomes: Outcomes,
    /// Requests sent again.
    pub retries: u64,
    /// Probes while it was off-line.
    pub probes: u64,
    /// Answers that came after their time was over.
    pub late: u64,
    /// Answers that came sooner than a line can carry request and answer: those that come twice, mostly.
    pub early: u64,
    /// Values after which another answer to the same question came, so that they may have been those of an earlier one.
    pub retracted: u64,
    /// Intact frames with another function than was asked for.
    pub wrong_function: u64,
    /// Intact frames with the function that was asked for, and another count, address or value.
    pub wrong_count: u64,
    /// How often it went off-line.
    pub went_offline: u64,
    /// Whether it is off-line now.
    pub offline: bool,
    /// How long it takes until it is asked whether it is back, as far as is known; `None` unless it is off-line.
    #[cfg_attr(feature = "serde", serde(rename = "next_probe_ns", with = "drive_core::serialize::maybe_ns"))]
    pub next_probe: Option<Duration>,
    /// The response timeout that holds now.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "response_timeout_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub response_timeout: Duration,
    /// What its own link had counted when it was last read, by
    /// [`link_counters`](crate::unite::UniTe::link_counters) on a UNI-TELWAY line. Feature `unitelway`.
    #[cfg(feature = "unitelway")]
    #[cfg_attr(feature = "serde", serde(with = "json::link"))]
    pub link: Option<LinkCounters>,
    /// From the end of a request to the first character of its answer, as computed from the answer's end and length.
    pub response: Histogram,
    /// Each exchange, from the first character of its request to the end of its answer, or of the wait for one.
    pub exchanges: Spread,
}

impl SlaveStats {
    /// Whether anything came instead of its answers.
    pub(crate) const fn has_heard_else(&self) -> bool {
        let outcomes = &self.outcomes;
        outcomes.damaged
            + outcomes.mismatches
            + self.late
            + self.early
            + self.wrong_function
            + self.wrong_count
            > 0
    }
}

/// What the line knows of one class.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct ClassStats {
    /// Requests sent for the first time.
    pub sent: u64,
    /// From the call to the first bit on the line.
    pub wait: Histogram,
    /// The same by fixed bounds.
    pub waits: Spread,
}

/// What is known of the gateway between a connection and its drives, see [`Gateway`](crate::Gateway).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FarEndStats {
    /// Questions in vain that it may still be at.
    pub owed: usize,
    /// How many requests it serves at once, as far as was seen.
    pub at_once: usize,
    /// It was seen, or is set, that it serves no more.
    pub no_more: bool,
    /// How long it waits for a drive that does not answer.
    #[cfg_attr(feature = "serde", serde(rename = "wait_ns", with = "drive_core::serialize::duration_ns"))]
    pub wait: Duration,
    /// Where that is from.
    pub wait_is: WaitIs,
    /// Questions that were asked in vain.
    pub in_vain: u64,
    /// Whether it serves a second connection, over which a stop goes past what the first waits for.
    pub second: SecondConnection,
    /// How many stops were answered over that.
    pub stops_over_second: u64,
}

/// Whether a far end serves a second connection of this line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum SecondConnection {
    /// None was needed yet, or none is to be opened.
    Unused,
    /// It was answered over it.
    Granted,
    /// It is not granted, for this reason, and was given up.
    GivenUp(#[cfg_attr(feature = "serde", serde(deserialize_with = "drive_core::serialize::kept"))] Word),
}

/// A reason of this crate's. Derived code that reads it must not take its lifetime for that of what is read, which it does where
/// it sees the reference.
type Word = &'static str;

/// How it is known how long a gateway waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum WaitIs {
    /// Nobody knows: [`Gateway::ASSUMED_WAIT`](crate::Gateway::ASSUMED_WAIT).
    Assumed,
    /// As configured.
    Set,
    /// As it was seen to wait last.
    Seen,
}

/// What a line has counted since it was opened.
///
/// ```
/// use drive_bus::{Line, LineConfig};
/// use drive_core::{Class, SerialSettings};
/// # use tokio_modbus::client::{Context, Reader};
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let stream = plant.in_memory();
/// let line = Line::over(stream, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
/// # let mut drive: Context = line.slave(1).into();
/// # drive.read_holding_registers(3201, 1).await??;
/// let stats = line.stats();
/// for (slave, told) in &stats.slaves {
///     println!("{slave}: {} answers, {:?} p99", told.outcomes.answered, told.response.quantile(990));
/// }
/// assert_eq!(stats.class(Class::Status).sent, 1);
/// assert_eq!((stats.foreign, stats.noise_bytes), (0, 0), "nobody else is on this line");
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct Stats {
    /// Since when, as a duration.
    #[cfg_attr(feature = "serde", serde(rename = "elapsed_ns", with = "drive_core::serialize::duration_ns"))]
    pub elapsed: Duration,
    /// Time in which the line was needed: the characters of requests and answers, the silences that the protocol and
    /// the slaves want, and the slaves' own time to answer. What is missing to `elapsed` was idle or lost to the host.
    #[cfg_attr(feature = "serde", serde(rename = "busy_ns", with = "drive_core::serialize::duration_ns"))]
    pub busy: Duration,
    /// Per slave, those that were asked.
    pub slaves: BTreeMap<u8, SlaveStats>,
    /// Per class, the most urgent first, as [`Class::ALL`].
    #[cfg_attr(feature = "serde", serde(with = "json::classes"))]
    pub classes: [ClassStats; 5],
    /// The silence kept before each request, from the end of the last activity to the write.
    pub silence: Histogram,
    /// How much later than allowed each request was written while one was waiting: what the host costs.
    pub lag: Histogram,
    /// Intact frames of somebody else, or of a slave that nobody had asked.
    pub foreign: u64,
    /// Bytes that made no frame.
    pub noise_bytes: u64,
    /// Requests that the adapter gave back.
    pub echoes: u64,
    /// Whether the adapter echoes, as far as is known.
    pub echoing: bool,
    /// Calls that ended because the line was never quiet.
    pub never_quiet: u64,
    /// Broadcasts sent.
    pub broadcasts: u64,
    /// How often the port was opened, and lost.
    pub opened: u64,
    /// How often the port was lost.
    pub lost: u64,
    /// The gateway, where there may be one.
    pub far_end: Option<FarEndStats>,
    /// Why the port was lost or cannot be opened; `None` while it is open, and before that is known.
    pub away: Option<String>,
    /// Requests that wait now.
    pub queued: usize,
    /// The longest wait of a Stop until its first bit, while the line goes on as it has: with the response times that it
    /// has learned, the longest exchange that was asked, and foreign frames and damage only where there were any. Beside
    /// it stands [`LineConfig::worst_case_stop`](crate::LineConfig::worst_case_stop), which holds whatever happens.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "worst_case_stop_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub worst_case_stop: Duration,
}

/// How it begins why a port is opened anew that is there, and on which nobody answers.
pub(crate) const NOTHING_HEARD: &str = "nothing was heard";

impl Stats {
    /// Why the port is not there; `None`: it is. One that is only opened anew because nobody answers is there: what is seen then is a
    /// silence, and no port that is away.
    #[must_use]
    pub fn port_away(&self) -> Option<&str> {
        let why = self.away.as_deref().unwrap_or("it is opened");
        (self.opened <= self.lost && !why.starts_with(NOTHING_HEARD)).then_some(why)
    }

    /// Whether everything that came as an answer came sooner than the configured speed can carry it, so that nothing was taken
    /// for one: three times at least, and nothing else. The far end is faster then than it is said to be, an adapter without a
    /// UART or a program, and [`far_end_paces`](crate::LineConfig::far_end_paces) is to be `Some(false)`; or the speed is set
    /// too low.
    #[must_use]
    pub fn is_faster_than_configured(&self) -> bool {
        let early: u64 = self.slaves.values().map(|slave| slave.early).sum();
        let in_time: u64 =
            self.slaves.values().map(|slave| slave.outcomes.answered + slave.outcomes.exceptions).sum();
        early >= 3 && in_time == 0
    }

    /// One class.
    #[must_use]
    pub fn class(&self, class: Class) -> &ClassStats {
        let [stop, command, keep_alive, status, background] = &self.classes;
        match class {
            Class::Stop => stop,
            Class::Command => command,
            Class::KeepAlive => keep_alive,
            Class::Status => status,
            Class::Background => background,
        }
    }

    pub(crate) fn class_mut(&mut self, class: Class) -> &mut ClassStats {
        let [stop, command, keep_alive, status, background] = &mut self.classes;
        match class {
            Class::Stop => stop,
            Class::Command => command,
            Class::KeepAlive => keep_alive,
            Class::Status => status,
            Class::Background => background,
        }
    }

    /// `busy` by `elapsed`, in millionths.
    #[must_use]
    pub fn utilisation_ppm(&self) -> u32 {
        let ppm = (self.busy.as_nanos() * 1_000_000).checked_div(self.elapsed.as_nanos()).unwrap_or_default();
        u32::try_from(ppm).unwrap_or(u32::MAX)
    }
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
    fn a_spread_counts_a_duration_at_its_bound_as_not_longer() {
        let mut spread = Spread::default();
        assert_eq!(spread.up_to().max(), Some(0));
        let micros = [0, 5_000, 5_001, 16_000, 999_999, 1_000_000, 1_000_001, 60_000_000];
        micros.map(Duration::from_micros).into_iter().for_each(|duration| spread.record(duration));
        let counted: Vec<u64> = spread.up_to().collect();
        assert_eq!(counted, [2, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 6, 8]);
        assert_eq!(spread.sum(), Duration::from_micros(micros.iter().sum()));
    }

    #[test]
    fn an_empty_histogram_says_zero() {
        assert_eq!(Histogram::new().quantile(500), Duration::ZERO);
        assert_eq!(Histogram::new().mean(), Duration::ZERO);
    }
}
