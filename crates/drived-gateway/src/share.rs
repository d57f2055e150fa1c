//! How much of a line a gateway has used: pure, time is an argument.

use std::time::Duration;

use tokio::time::Instant;

/// What may be used ahead of time: a client that asks seldom is answered at once.
const AHEAD: Duration = Duration::from_secs(1);

/// The share of one line. Every use is paid back in time: one of 10 ms at a share of 30 % in 33 ms. What is owed may reach
/// so far [`AHEAD`], so that of any time T no more than the share of T and a second is used, and one use more.
#[derive(Debug)]
pub(super) struct Share {
    /// When everything that was used is paid.
    paid_at: Instant,
}

impl Share {
    pub(super) const fn new(now: Instant) -> Self {
        Self { paid_at: now }
    }

    /// When the line may be used again.
    pub(super) fn free_at(&self, now: Instant) -> Instant {
        self.paid_at.checked_sub(AHEAD).unwrap_or(now).max(now)
    }

    /// Whether more is owed than reads within the share owe: exchanges in vain, which take a line from everybody.
    pub(super) fn is_owed_more_than(&self, takes: Duration, percent: u32, now: Instant) -> bool {
        self.paid_at > now + AHEAD + due(takes, percent)
    }

    /// The line is used for so long, at a share of so many percent.
    pub(super) fn charge(&mut self, now: Instant, used: Duration, percent: u32) {
        self.paid_at = self.paid_at.max(now).checked_add(due(used, percent)).unwrap_or(self.paid_at);
    }
}

/// In which time such a use is paid back.
fn due(used: Duration, percent: u32) -> Duration {
    used.saturating_mul(100) / percent.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const USE: Duration = Duration::from_millis(20);

    #[test]
    fn of_a_minute_no_more_than_the_share_of_61_seconds_is_used_and_no_less_where_it_is_wanted() {
        for percent in [1, 10, 30, 80] {
            let start = Instant::now();
            let (mut share, mut now, mut used) = (Share::new(start), start, Duration::ZERO);
            while now < start + Duration::from_secs(60) {
                share.charge(now, USE, percent);
                used += USE;
                now = share.free_at(now);
            }
            let (least, most) =
                (Duration::from_secs(60) * percent / 100, Duration::from_secs(61) * percent / 100);
            assert!((least..=most + USE).contains(&used), "{percent} %: {used:?}");
        }
    }

    #[test]
    fn who_has_not_asked_for_long_has_saved_up_no_more_than_a_second() {
        let start = Instant::now();
        let mut share = Share::new(start);
        let later = start + Duration::from_secs(3_600);
        let mut used = Duration::ZERO;
        while share.free_at(later) == later {
            share.charge(later, USE, 30);
            used += USE;
        }
        assert!(used <= Duration::from_millis(300) + USE, "{used:?}");
    }
}
