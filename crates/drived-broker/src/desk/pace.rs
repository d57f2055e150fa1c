//! How many commands are looked at: a flood of them moves nothing and fills no log.

use std::time::Duration;

use tokio::time::Instant;

/// So many may come at once, and so often comes room for one more.
const AT_ONCE: u32 = 200;
const ONE_MORE: Duration = Duration::from_millis(20);

/// Lets as many through as may come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    room: u32,
    filled: Instant,
}

impl Pace {
    pub(super) const fn new(now: Instant) -> Self {
        Self { room: AT_ONCE, filled: now }
    }

    /// Whether one more may come now.
    pub(super) fn allows(&mut self, now: Instant) -> bool {
        let steps = now.saturating_duration_since(self.filled).as_millis() / ONE_MORE.as_millis();
        let steps = u32::try_from(steps).unwrap_or(AT_ONCE).min(AT_ONCE);
        self.room = (self.room + steps).min(AT_ONCE);
        self.filled = if self.room == AT_ONCE { now } else { self.filled + ONE_MORE * steps };
        let allowed = self.room > 0;
        self.room = self.room.saturating_sub(1);
        allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_flood_is_let_through_no_faster_than_the_pace() {
        let begun = Instant::now();
        let mut pace = Pace::new(begun);
        let allowed =
            (0..10_000).filter(|number| pace.allows(begun + Duration::from_millis(*number))).count();
        assert_eq!(allowed, 200 + 10_000 / 20 - 1);
    }
}
