//! The timer of a serial line.
//!
//! A silence of 3.5 characters is 1.75 to 4 ms. tokio's own timer has a wheel of 1 ms and is late by up to 1.4 ms, which
//! on a line of short frames costs one transaction in ten. [`Timer::precise`] is late by tens of microseconds;
//! [`Timer::tokio`] is for a paused clock, where tokio's timer is exact, and for tests.
//!
//! Both are **late, never early**: a silence that is kept too long costs throughput, one that is too short is a broken
//! frame.

#![forbid(unsafe_code)]

use std::{
    fmt,
    future::poll_fn,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use tokio::time::{Instant, Sleep};

/// Waits longer than this begin on tokio's timer, which is cheap to set and to drop again: most long waits are
/// response timeouts, and an answer ends them long before they are due.
const COARSE: Duration = Duration::from_millis(5);

/// How much before a deadline the coarse timer must hand over, so that its own lateness never shows.
const HANDOVER: Duration = Duration::from_millis(3);

/// How much before the deadline the fine timer is aimed at the most, and with it how long a wait spins at the most. A
/// processor that has fallen asleep needs 30 to 100 µs to wake up.
const LONGEST_LEAD: Duration = Duration::from_micros(120);

/// What the lead is more than the usual lateness, so that most waits end on their deadline.
const MARGIN: Duration = Duration::from_micros(8);

/// One timer, reused for every wait of its owner.
pub struct Timer {
    coarse: Pin<Box<Sleep>>,
    coarse_for: Option<Instant>,
    fine: Option<Fine>,
}

struct Fine {
    timer: async_io::Timer,
    armed: Option<Armed>,
    lead: Lead,
}

#[derive(Debug, Clone, Copy)]
struct Armed {
    deadline: Instant,
    aimed_at: Instant,
}

/// How much before a deadline the timer is aimed: as late as it usually is, learned from each of its wake-ups. What is
/// left when it was quicker is spent spinning.
#[derive(Debug, Clone, Copy)]
struct Lead(Duration);

impl Lead {
    const fn new() -> Self {
        Self(Duration::from_micros(40))
    }

    /// The timer was this late behind the time at which it was aimed.
    fn learn(&mut self, late: Duration) {
        self.0 = (self.0 * 7 / 8 + (late + MARGIN) / 8).min(LONGEST_LEAD);
    }
}

impl Timer {
    /// A timer that is late by tens of microseconds, for a line on a real descriptor. Works inside a tokio runtime
    /// whose clock is not paused.
    ///
    /// # Panics
    /// Outside a tokio runtime with time enabled, as every tokio timer does.
    #[must_use]
    pub fn precise() -> Self {
        Self {
            fine: Some(Fine { timer: async_io::Timer::never(), armed: None, lead: Lead::new() }),
            ..Self::tokio()
        }
    }

    /// tokio's own timer: exact under a paused clock, otherwise late by up to 1.4 ms.
    ///
    /// # Panics
    /// Outside a tokio runtime with time enabled, as every tokio timer does.
    #[must_use]
    pub fn tokio() -> Self {
        Self { coarse: Box::pin(tokio::time::sleep(Duration::ZERO)), coarse_for: None, fine: None }
    }

    /// Waits until `deadline`: never returns before it, at once when it has passed.
    ///
    /// # Cancellation
    /// Safe to drop and to call again with the same or another deadline.
    pub async fn until(&mut self, deadline: Instant) {
        poll_fn(|context| self.poll_until(context, deadline)).await;
    }

    /// [`until`](Self::until) for a hand-written future.
    pub fn poll_until(&mut self, context: &mut Context<'_>, deadline: Instant) -> Poll<()> {
        let Some(fine) = &mut self.fine else { return self.poll_coarse(context, deadline) };
        let now = Instant::now();
        if now >= deadline {
            return Poll::Ready(());
        }
        if deadline - now > COARSE {
            fine.disarm();
            if self.poll_coarse(context, deadline - HANDOVER).is_pending() {
                return Poll::Pending;
            }
        }
        match &mut self.fine {
            Some(fine) => fine.poll(context, deadline),
            None => Poll::Ready(()),
        }
    }

    fn poll_coarse(&mut self, context: &mut Context<'_>, deadline: Instant) -> Poll<()> {
        if self.coarse_for != Some(deadline) {
            self.coarse.as_mut().reset(deadline);
            self.coarse_for = Some(deadline);
        }
        self.coarse.as_mut().poll(context)
    }
}

impl fmt::Debug for Timer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.fine.is_some() { "Timer::precise" } else { "Timer::tokio" })
    }
}

impl Fine {
    fn disarm(&mut self) {
        if self.armed.take().is_some() {
            self.timer.clear();
        }
    }

    /// When it will ring for this deadline.
    fn arm(&mut self, deadline: Instant) -> Instant {
        let aimed_at = deadline - self.lead.0;
        self.timer.set_at(aimed_at.into_std());
        self.armed = Some(Armed { deadline, aimed_at });
        aimed_at
    }

    fn poll(&mut self, context: &mut Context<'_>, deadline: Instant) -> Poll<()> {
        let armed = self.armed.filter(|armed| armed.deadline == deadline);
        let near = deadline.saturating_duration_since(Instant::now()) <= self.lead.0;
        if armed.is_some() || !near {
            let aimed_at = armed.map_or_else(|| self.arm(deadline), |armed| armed.aimed_at);
            if Pin::new(&mut self.timer).poll(context).is_pending() {
                return Poll::Pending;
            }
            self.armed = None;
            self.lead.learn(Instant::now().saturating_duration_since(aimed_at));
        }
        while Instant::now() < deadline {
            std::hint::spin_loop();
        }
        Poll::Ready(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lead_becomes_the_usual_lateness_and_never_more_than_its_limit() {
        let mut lead = Lead::new();
        (0..100).for_each(|_| lead.learn(Duration::from_micros(70)));
        assert!((70..=80).contains(&lead.0.as_micros()), "{lead:?}");
        // A machine that stands still now and then.
        (0..100).for_each(|_| lead.learn(Duration::from_millis(20)));
        assert_eq!(lead.0, LONGEST_LEAD);
        (0..100).for_each(|_| lead.learn(Duration::ZERO));
        assert!(lead.0 <= 2 * MARGIN, "{lead:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn under_a_paused_clock_a_wait_is_exact() {
        let mut timer = Timer::tokio();
        for millis in [0, 1, 2, 1_000] {
            let start = Instant::now();
            timer.until(start + Duration::from_millis(millis)).await;
            assert_eq!(start.elapsed(), Duration::from_millis(millis));
        }
    }

    #[tokio::test]
    async fn a_precise_wait_never_ends_early() {
        let mut timer = Timer::precise();
        for micros in [0, 20, 50, 500, 1_750, 2_005, 4_999, 5_001, 7_500] {
            let deadline = Instant::now() + Duration::from_micros(micros);
            timer.until(deadline).await;
            assert!(Instant::now() >= deadline, "{micros} us");
        }
    }

    #[tokio::test]
    async fn a_dropped_wait_leaves_nothing_behind_for_the_next() {
        let mut timer = Timer::precise();
        let far = Instant::now() + Duration::from_secs(3_600);
        tokio::select! {
            biased;
            () = timer.until(far) => panic!("an hour has not passed"),
            () = tokio::task::yield_now() => {}
        }
        let near = Instant::now() + Duration::from_millis(2);
        timer.until(near).await;
        assert!(Instant::now() >= near);
    }
}
