//! A stop whose time is over: an alarm, and an answer to who waits for it. It goes on being repeated.

use drive_core::{Command, Error, ErrorKind, Refusal};
use tokio::time::Instant;

use super::is_refused;
use crate::{
    event::EventKind,
    outcome::{Outcome, Unconfirmed, Unknown},
    snapshot::Link,
    stop_order::StopOrder,
    supervisor::Supervisor,
};

impl Supervisor {
    pub(in crate::supervisor) fn check_stop_times(&mut self, now: Instant) {
        let Some(stopping) = &mut self.stopping else { return };
        let alarm = crate::mutant!(
            "unconfirmed-stop-untold",
            stopping.alarm_at.take_if(|at| *at <= now).is_some(),
            false
        );
        let (over, waiting): (Vec<_>, Vec<_>) =
            stopping.waiters.drain(..).partition(|waiter| waiter.until <= now);
        stopping.waiters = waiting;
        if !alarm && over.is_empty() {
            return;
        }
        let (since, attempts) = (now.saturating_duration_since(stopping.since), stopping.begun);
        let cause = stopping.asker.cause();
        let asked = StopOrder { mode: stopping.asked, injection: stopping.injection };
        let over: Vec<_> = over.into_iter().map(|waiter| (waiter.asker, waiter.asked)).collect();
        if alarm {
            let outcome = self.unconfirmed_stop(now, asked);
            self.emit_by(EventKind::StopUnconfirmed { since, attempts, outcome }, cause);
        }
        for (asker, asked) in over {
            let outcome = self.unconfirmed_stop(now, asked);
            self.conclude(asker, Command::Stop(asked.mode), None, outcome);
        }
    }

    /// What is known of a stop that is not confirmed: only a status that is fresh, and younger than it, says anything of it.
    fn unconfirmed_stop(&self, now: Instant, asked: StopOrder) -> Outcome {
        let Some(stopping) = &self.stopping else { return Outcome::Confirmed };
        let stop = Some(stopping.modes(asked));
        let error = stopping.error.clone().or_else(|| self.last_error.clone());
        let max_age = self.settings.periods.max_age;
        let said = self.status.as_ref().filter(|status| {
            self.link == Link::Connected && status.at >= stopping.since && status.age(now) <= max_age
        });
        match (said, &error) {
            (Some(status), None | Some(Error::NotConfirmed { .. })) if stopping.attempts > 0 => {
                let after = now.saturating_duration_since(stopping.since);
                let last = Some(status.seen(now));
                let denied = match &error {
                    Some(Error::NotConfirmed { because, .. }) => *because,
                    _ => self.checks.is_another().then_some(Refusal::Exchanged),
                };
                let because = denied.or(stopping.runs_by);
                Outcome::NotConfirmed(Unconfirmed::TimeOver { after, last, because, stop })
            }
            // It never left: by what its driver knows, it is no stop of this drive.
            (_, Some(refused)) if stopping.attempts == 0 && is_refused(refused) => {
                Outcome::NotConfirmed(Unconfirmed::Denied(refused.clone()))
            }
            // An exception is an answer: it was not carried out.
            (_, Some(denied)) if denied.kind() == ErrorKind::Exception => {
                let (error, stop) = (denied.clone(), stopping.modes(asked));
                Outcome::NotConfirmed(Unconfirmed::StopDenied { error, stop })
            }
            _ => {
                let last = self.status.as_ref().map(|status| status.seen(now));
                Outcome::OutcomeUnknown(Unknown { error, last, stop, abandoned: false })
            }
        }
    }
}
