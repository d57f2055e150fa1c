//! The drive's own communication watchdog.

use std::time::Duration;

/// Counts the time since the last frame. It starts with the first [`feed`](Self::feed), as drives do: a line that
/// was never used trips nobody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Watchdog {
    timeout: Option<Duration>,
    idle: Option<Duration>,
}

impl Watchdog {
    /// A watchdog with a time, or none.
    #[must_use]
    pub const fn new(timeout: Option<Duration>) -> Self {
        Self { timeout, idle: None }
    }

    /// Changes its time; what has passed since the last frame still counts.
    pub const fn set_timeout(&mut self, timeout: Option<Duration>) {
        self.timeout = timeout;
    }

    /// A frame came.
    pub const fn feed(&mut self) {
        self.idle = Some(Duration::ZERO);
    }

    /// Waits for the first frame again, as after power-up or a trip.
    pub const fn rest(&mut self) {
        self.idle = None;
    }

    /// The time until it expires, if it is counting. A model advances no further than this in one piece, so that a
    /// trip happens at its own moment and not at the end of a long step.
    #[must_use]
    pub fn remaining(&self) -> Option<Duration> {
        Some(self.timeout?.saturating_sub(self.idle?))
    }

    /// Lets time pass; `true` when the time has run out. It then rests until the next frame.
    #[must_use]
    pub fn advance(&mut self, elapsed: Duration) -> bool {
        if let Some(idle) = &mut self.idle {
            *idle = idle.saturating_add(elapsed);
        }
        let expired = self.remaining() == Some(Duration::ZERO);
        if expired {
            self.rest();
        }
        expired
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_secs(3);

    #[test]
    fn it_expires_after_its_time_and_not_before() {
        let mut watchdog = Watchdog::new(Some(TIMEOUT));
        watchdog.feed();
        assert!(!watchdog.advance(TIMEOUT - Duration::from_nanos(1)));
        assert_eq!(watchdog.remaining(), Some(Duration::from_nanos(1)));
        assert!(watchdog.advance(Duration::from_nanos(1)));
    }

    #[test]
    fn a_frame_begins_the_time_anew() {
        let mut watchdog = Watchdog::new(Some(TIMEOUT));
        watchdog.feed();
        assert!(!watchdog.advance(Duration::from_secs(2)));
        watchdog.feed();
        assert!(!watchdog.advance(Duration::from_secs(2)));
    }

    #[test]
    fn nothing_expires_before_the_first_frame_or_without_a_time() {
        assert!(!Watchdog::new(Some(TIMEOUT)).advance(Duration::from_secs(3_600)));
        let mut off = Watchdog::new(None);
        off.feed();
        assert!(!off.advance(Duration::from_secs(3_600)));
    }
}
