//! Whether the computer was asleep.

use std::time::Duration;

/// By how much its two clocks must have parted: more than reading them takes on a busy machine, less than any sleep.
const LEAST: Duration = Duration::from_millis(100);

/// Tells when the computer was asleep: the time since it was switched on has gone on then, and the time by which everybody
/// waits has not. A value that was read before looks as young as if it had not slept, and nothing has timed out.
#[derive(Debug, Clone, Copy)]
pub struct Sleeps {
    clocks: Clocks,
    /// By how much the one was ahead of the other at the most.
    ahead: Option<Duration>,
}

/// Reads the time by which everybody waits, that since the computer was switched on, and the first once more. `None`: the system
/// has no such clocks.
pub type Clocks = fn() -> Option<[Duration; 3]>;

impl Default for Sleeps {
    fn default() -> Self {
        Self::new()
    }
}

impl Sleeps {
    /// From now on.
    #[must_use]
    pub fn new() -> Self {
        Self::by(clocks)
    }

    /// From now on, by other clocks than the computer's: to see what becomes of a program whose computer sleeps.
    #[must_use]
    pub fn by(clocks: Clocks) -> Self {
        let mut sleeps = Self { clocks, ahead: None };
        sleeps.slept();
        sleeps
    }

    /// For how long it was asleep since this was last called; `None`: it was not, or the system does not say.
    pub fn slept(&mut self) -> Option<Duration> {
        let [before, since_boot, after] = (self.clocks)()?;
        self.told(before, since_boot, after)
    }

    /// The same, when the time since the start was read between two readings of the time by which everybody waits.
    fn told(&mut self, before: Duration, since_boot: Duration, after: Duration) -> Option<Duration> {
        // The process itself may have stood still between the readings.
        let least = since_boot.saturating_sub(after);
        let most = since_boot.saturating_sub(before);
        let known = self.ahead.get_or_insert(most);
        let slept = least.saturating_sub(*known);
        *known = (*known).max(least);
        (slept >= LEAST).then_some(slept)
    }
}

#[cfg(target_os = "linux")]
fn clocks() -> Option<[Duration; 3]> {
    use rustix::time::{ClockId, clock_gettime};

    let clocks = [ClockId::Monotonic, ClockId::Boottime, ClockId::Monotonic];
    let [before, since_boot, after] = clocks.map(|clock| Duration::try_from(clock_gettime(clock)).ok());
    Some([before?, since_boot?, after?])
}

#[cfg(not(target_os = "linux"))]
const fn clocks() -> Option<[Duration; 3]> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_computer_that_was_asleep_is_told_once_and_for_how_long() {
        let mut sleeps = Sleeps::by(|| None);
        assert_eq!(sleeps.told(10 * SECOND, 15 * SECOND, 10 * SECOND), None);
        assert_eq!(sleeps.told(11 * SECOND, 16 * SECOND, 11 * SECOND), None);
        assert_eq!(sleeps.told(12 * SECOND, 3_617 * SECOND, 12 * SECOND), Some(3_600 * SECOND));
        assert_eq!(sleeps.told(13 * SECOND, 3_618 * SECOND, 13 * SECOND), None);
    }

    #[test]
    fn a_process_that_stood_still_was_not_asleep() {
        let mut sleeps = Sleeps::by(|| None);
        assert_eq!(sleeps.told(10 * SECOND, 10 * SECOND, 10 * SECOND), None);
        // Between the first reading and the second, then between the second and the third.
        assert_eq!(sleeps.told(11 * SECOND, 15 * SECOND, 15 * SECOND), None);
        assert_eq!(sleeps.told(16 * SECOND, 16 * SECOND, 20 * SECOND), None);
        assert_eq!(sleeps.told(21 * SECOND, 21 * SECOND, 21 * SECOND), None);
    }

    #[test]
    fn this_computer_is_awake() {
        assert_eq!(Sleeps::new().slept(), None);
    }
}
