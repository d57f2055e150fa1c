//! How long a command may take to show, and how often the drive is read meanwhile: [`Confirming`], the same for every
//! family.

use std::time::Duration;

use tokio::time::{self, Instant};

/// From the write until a command counts as not confirmed. A drive follows its command word within its own cycle, which
/// no manual puts above 0.1 s; the rest is for a line that thirty other drives use too.
pub const CONFIRMED_WITHIN: Duration = Duration::from_secs(2);

/// How long a drive may take to show a word that it holds in its other words, before what they show counts.
pub const SETTLED_WITHIN: Duration = Duration::from_millis(250);

/// The pauses between two readings that do not show a command: the first and the longest.
const PAUSE: (Duration, Duration) = (Duration::from_millis(10), Duration::from_millis(100));

/// The time in which a command has to show. It is a time and not a number of readings: twenty readings are half a second
/// on a slow line and a few milliseconds on TCP.
///
/// ```
/// use drive_core::Confirming;
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() {
/// # let mut readings = 0;
/// # let mut reads_so = || { readings += 1; readings == 4 };
/// let mut confirming = Confirming::begin();
/// let confirmed = loop {
///     if reads_so() {
///         break true;
///     }
///     if !confirming.again().await {
///         break false; // two seconds are over
///     }
/// };
/// assert!(confirmed);
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Confirming {
    until: Instant,
    pause: Duration,
}

/// A moment so much later: where that is longer than any clock goes, in thirty years.
#[must_use]
pub fn later(at: Instant, time: Duration) -> Instant {
    const NEVER: Duration = Duration::from_secs(30 * 365 * 24 * 3_600);
    at.checked_add(time.min(NEVER)).unwrap_or(at)
}

impl Confirming {
    /// The usual time, from now on.
    #[must_use]
    pub fn begin() -> Self {
        Self::within(CONFIRMED_WITHIN)
    }

    /// A time of its own, from now on: for what the drive is known to take longer for.
    #[must_use]
    pub fn within(time: Duration) -> Self {
        Self { until: later(Instant::now(), time), pause: PAUSE.0 }
    }

    /// Waits until the drive is worth another reading. False: the time is over. At least one reading is always worth it
    /// before this is asked.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn again(&mut self) -> bool {
        let next = Instant::now() + self.pause;
        if next > self.until {
            return false;
        }
        time::sleep_until(next).await;
        self.pause = (self.pause * 2).min(PAUSE.1);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_reading_follows_a_reading_for_the_time_and_not_beyond() {
        let begun = Instant::now();
        let mut confirming = Confirming::begin();
        let mut readings = 1;
        while confirming.again().await {
            readings += 1;
        }
        assert!(begun.elapsed() <= CONFIRMED_WITHIN, "{:?}", begun.elapsed());
        assert!((15..=30).contains(&readings), "{readings}");
    }
}
