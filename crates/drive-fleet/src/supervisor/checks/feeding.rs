//! When the communication watchdog of a drive wants a frame of its own, because no poll has fed it.

use tokio::time::Instant;

use super::Checks;
use crate::snapshot::WatchdogCheck;

/// The part of a watchdog's time after which it is fed by a frame of its own, if no poll has fed it: a half. The
/// plan counts on the same part.
pub const FEED_PART: u32 = 2;

impl Checks {
    /// The drive received a frame at this time, and answered it.
    pub(crate) fn heard(&mut self, at: Instant) {
        if self.heard.is_none_or(|before| before < at) {
            self.heard = Some(at);
            self.feed_again = None;
        }
    }

    /// When the watchdog wants a frame of its own.
    pub(crate) fn feed_at(&self) -> Option<Instant> {
        let set = match self.watchdog {
            // Another run of the program, or a write whose outcome nobody has heard, may have set it up.
            WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => {
                self.shown.into_iter().chain(self.contract.map(|contract| contract.timeout)).min()
            }
            _ => self.shown,
        };
        let at = self.heard? + set.or(self.fixed)? / FEED_PART;
        Some(self.feed_again.map_or(at, |again| at.max(again)))
    }

    pub(crate) fn handle_kept_alive(&mut self, now: Instant, answered: bool) {
        if let (false, Some(heard), Some(at)) = (answered, self.heard, self.feed_at()) {
            // Half of the half that is left.
            self.feed_again = Some(now + at.saturating_duration_since(heard) / FEED_PART);
        }
    }
}
