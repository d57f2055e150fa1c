//! The timer of a serial line, and how long the line stays awake for an answer.
//!
//! A silence of 3.5 characters is 1.75 to 4 ms. tokio's own timer has a wheel of 1 ms and is late by up to 1.4 ms, which
//! on a line of short frames costs one transaction in ten. [`Timer::precise`] is late by microseconds;
//! [`Timer::tokio`] is for a paused clock, where tokio's timer is exact, and for tests.
//!
//! Both are **late, never early**: a silence that is kept too long costs throughput, one that is too short is a broken
//! frame.
//!
//! A processor that has nothing to do falls asleep and needs 30 to 100 µs to wake up. Where it is known when something
//! happens, somebody can be awake: [`Timer`] is aimed before its deadline and spins for what is left, and [`Watch`] says
//! when an answer is worth being awake for. In a process with more than eight precise timers neither happens.
//!
//! ```
//! use drive_clock::Timer;
//! use std::time::Duration;
//! use tokio::time::Instant;
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() {
//! // The silence of 3.5 characters at 19200 bit/s: 11 bits each.
//! let silence = Duration::from_micros(2_006);
//! let mut timer = Timer::precise();
//! let over = Instant::now() + silence;
//! timer.until(over).await;
//! assert!(Instant::now() >= over, "late it may be, early never");
//! # }
//! ```

#![forbid(unsafe_code)]

#[cfg(target_os = "linux")]
#[path = "descriptor.rs"]
mod alarm;
#[cfg(not(target_os = "linux"))]
#[path = "elsewhere.rs"]
mod alarm;
mod company;
mod sleep;
mod watch;

use std::{
    fmt,
    future::poll_fn,
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use tokio::time::{Instant, Sleep};

use crate::{alarm::Alarm, company::Member};

pub use crate::{
    sleep::{Clocks, Sleeps},
    watch::Watch,
};

/// How much before the deadline the timer is aimed at the most, and with it how long a wait spins at the most.
const LONGEST_LEAD: Duration = Duration::from_micros(120);

/// What the lead is more than the usual lateness, so that most waits end on their deadline.
const MARGIN: Duration = Duration::from_micros(8);

/// One timer, reused for every wait of its owner.
pub struct Timer(Source);

enum Source {
    Precise(Precise),
    Tokio { sleep: Pin<Box<Sleep>>, armed_for: Option<Instant> },
}

struct Precise {
    alarm: Alarm,
    armed: Option<Armed>,
    lead: Lead,
    _member: Member,
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

    fn current(self) -> Duration {
        if company::is_small() { self.0 } else { Duration::ZERO }
    }

    /// The timer was this late behind the time at which it was aimed.
    fn learn(&mut self, late: Duration) {
        self.0 = (self.0 * 7 / 8 + (late + MARGIN) / 8).min(LONGEST_LEAD);
    }
}

impl Timer {
    /// A timer that is late by microseconds, for a line on a real descriptor. Works inside a tokio runtime whose clock is
    /// not paused. In a process that has no descriptor left it is [`Timer::tokio`].
    ///
    /// # Panics
    /// Outside a tokio runtime with time and I/O enabled, as tokio's own timers and sockets do.
    #[must_use]
    pub fn precise() -> Self {
        let precise = |alarm| Precise { alarm, armed: None, lead: Lead::new(), _member: Member::new() };
        Alarm::new().map_or_else(|_| Self::tokio(), |alarm| Self(Source::Precise(precise(alarm))))
    }

    /// tokio's own timer: exact under a paused clock, otherwise late by up to 1.4 ms.
    ///
    /// # Panics
    /// Outside a tokio runtime with time enabled, as every tokio timer does.
    #[must_use]
    pub fn tokio() -> Self {
        Self(Source::Tokio { sleep: Box::pin(tokio::time::sleep(Duration::ZERO)), armed_for: None })
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
        ready!(self.poll_shortly_before(context, deadline));
        while Instant::now() < deadline {
            std::hint::spin_loop();
        }
        Poll::Ready(())
    }

    /// [`until`](Self::until), except that it returns up to 120 µs **before** the deadline instead of spinning: for
    /// somebody who has better to do in that time.
    pub fn poll_shortly_before(&mut self, context: &mut Context<'_>, deadline: Instant) -> Poll<()> {
        match &mut self.0 {
            Source::Precise(precise) => precise.poll(context, deadline),
            Source::Tokio { sleep, armed_for } => {
                if *armed_for != Some(deadline) {
                    sleep.as_mut().reset(deadline);
                    *armed_for = Some(deadline);
                }
                sleep.as_mut().poll(context)
            }
        }
    }
}

impl fmt::Debug for Timer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Source::Precise(_) => "Timer::precise",
            Source::Tokio { .. } => "Timer::tokio",
        })
    }
}

impl Precise {
    /// Ready within the lead of the deadline.
    fn poll(&mut self, context: &mut Context<'_>, deadline: Instant) -> Poll<()> {
        let now = Instant::now();
        let armed = match self.armed.filter(|armed| armed.deadline == deadline) {
            Some(armed) => armed,
            None => {
                let aimed_at = deadline.checked_sub(self.lead.current()).unwrap_or(deadline);
                if now >= aimed_at {
                    return Poll::Ready(());
                }
                self.alarm.set(now, aimed_at);
                *self.armed.insert(Armed { deadline, aimed_at })
            }
        };
        ready!(self.alarm.poll(context));
        self.armed = None;
        self.lead.learn(Instant::now().saturating_duration_since(armed.aimed_at));
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
        for dropped in [Duration::from_secs(3_600), Duration::from_micros(300)] {
            let dropped = Instant::now() + dropped;
            poll_fn(|context| {
                let _ = timer.poll_until(context, dropped);
                Poll::Ready(())
            })
            .await;
            let near = Instant::now() + Duration::from_millis(2);
            timer.until(near).await;
            assert!(Instant::now() >= near);
        }
    }

    #[tokio::test]
    async fn a_deadline_too_far_for_any_clock_is_a_wait_without_end() {
        let mut timer = Timer::precise();
        let far = Instant::now() + Duration::from_secs(u32::MAX.into());
        tokio::select! {
            () = timer.until(far) => panic!("that is a lifetime"),
            () = tokio::time::sleep(Duration::from_millis(5)) => {}
        }
    }
}
