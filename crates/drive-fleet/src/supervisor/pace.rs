//! When a drive is asked next.

use std::time::Duration;

use tokio::time::Instant;

use crate::settings::Periods;

/// The ticks of one drive's polls.
#[derive(Debug)]
pub(crate) struct Pace {
    periods: Periods,
    status_due: Instant,
    slow_due: Option<Instant>,
}

impl Pace {
    pub(crate) fn new(now: Instant, periods: Periods) -> Self {
        Self { periods, status_due: now, slow_due: (!periods.slow.is_zero()).then_some(now) }
    }

    /// Other periods hold from now on.
    pub(crate) fn reconfigure(&mut self, now: Instant, periods: Periods) {
        if periods != self.periods {
            self.periods = periods;
            self.status_due = self.status_due.min(now + periods.running);
            self.slow_due = (!periods.slow.is_zero()).then_some(now + periods.slow);
        }
    }

    pub(crate) const fn status_due(&self) -> Instant {
        self.status_due
    }

    /// When the slow set is due; a day from the fast set where it never is, so that it wakes nobody.
    pub(crate) fn slow_due(&self) -> Instant {
        self.slow_due.unwrap_or(self.status_due + Duration::from_secs(86_400))
    }

    /// Asks for a status at once.
    pub(crate) fn hurry(&mut self, now: Instant) {
        self.status_due = self.status_due.min(now);
    }

    /// The drive has begun to need the faster period.
    pub(crate) fn quicken(&mut self, now: Instant) {
        self.status_due = self.status_due.min(now + self.periods.running);
    }

    const fn period(&self, busy: bool) -> Duration {
        if busy { self.periods.running } else { self.periods.rest }
    }

    /// From now until the tick after the one that is due, and at least a period: how long a poll that starts now is of use.
    /// On a full line that which is late is as good as the next, and dropping it would only make that late, too.
    pub(crate) fn until_next(&self, now: Instant, busy: bool) -> Duration {
        let period = self.period(busy);
        (self.status_due + period).saturating_duration_since(now).max(period)
    }

    /// The status that was due has ended; whether before the next tick.
    pub(crate) fn status_ended(&mut self, now: Instant, busy: bool) -> bool {
        // A period of nothing would divide by zero.
        let period = self.period(busy).max(Duration::from_millis(1));
        let next = self.status_due + period;
        let in_time = now <= next;
        // Ticks keep their grid; what is missed is not made up for.
        let missed = now.saturating_duration_since(next).as_nanos() / period.as_nanos();
        let missed = u32::try_from(missed).unwrap_or(u32::MAX);
        self.status_due = if in_time { next } else { next + period.saturating_mul(missed.saturating_add(1)) };
        in_time
    }

    /// The slow set was read, or could not be.
    pub(crate) fn slow_ended(&mut self, now: Instant) {
        if self.slow_due.is_some() {
            self.slow_due = Some(now + self.periods.slow);
        }
    }

    /// The drive is there again: its slow set is wanted soon.
    pub(crate) fn reconnected(&mut self, now: Instant) {
        if self.slow_due.is_some() {
            self.slow_due = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn ticks_keep_their_grid_and_missed_ones_are_not_made_up_for() {
        let start = Instant::now();
        let periods = Periods { running: 100 * MS, rest: 1_000 * MS, ..Periods::default() };
        let mut pace = Pace::new(start, periods);
        assert!(pace.status_ended(start + 30 * MS, true));
        assert_eq!(pace.status_due(), start + 100 * MS);
        assert!(!pace.status_ended(start + 450 * MS, true));
        assert_eq!(pace.status_due(), start + 500 * MS);
        assert!(pace.status_ended(start + 520 * MS, false));
        assert_eq!(pace.status_due(), start + 1_500 * MS);
        pace.quicken(start + 530 * MS);
        assert_eq!(pace.status_due(), start + 630 * MS);
    }
}
