//! A stop is asked for, by a caller or by a policy: it begins, or is taken into the one that is under way.

use std::time::Duration;

use drive_core::Command;
use tokio::time::Instant;

use super::{REPEAT, Stopping, Waiter};
use crate::{
    outcome::{Outcome, Refused},
    stop_order::{StopOrder, strength},
    supervisor::{Asker, CallId, Job, Supervisor},
};

/// Longer than any exit: its own limit ends it.
const EXIT: Duration = Duration::from_secs(86_400);

impl Supervisor {
    /// Somebody wants the drive stopped. A stop under way that is as hard takes it in. Gives whether the job in flight has to be
    /// dropped for it.
    pub(crate) fn handle_stop(
        &mut self,
        now: Instant,
        asker: Asker,
        order: StopOrder,
        patience: Option<Duration>,
    ) -> bool {
        if !self.settings.control {
            self.conclude(asker, Command::Stop(order.mode), None, Outcome::Refused(Refused::ReadOnly));
            return false;
        }
        self.begin_stop(now, asker, order, patience.unwrap_or(self.settings.times.stop_alarm));
        self.drops_for_stop()
    }

    /// Whether the job in flight has to be dropped for the stop that is under way. What the drive has taken waits for nothing but
    /// the statuses that confirm it.
    pub(in crate::supervisor) fn drops_for_stop(&self) -> bool {
        match (self.in_flight, &self.stopping) {
            (Some(Job::Stop(mode)), Some(stopping)) => stopping.mode != mode,
            (Some(Job::Status { .. }), Some(stopping)) => !stopping.taken,
            (Some(_), Some(stopping)) => !stopping.taken || stopping.next_try.is_some(),
            _ => false,
        }
    }

    /// Stops for a policy.
    pub(in crate::supervisor) fn stop_by_policy(
        &mut self,
        now: Instant,
        asker: Asker,
        stop: impl Into<StopOrder>,
    ) {
        self.begin_stop(now, asker, stop.into(), self.settings.times.stop_alarm);
    }

    /// How the stop that is given and not confirmed yet is to stop it from now on: direct current that has brought it to rest is only to
    /// be ended.
    pub(crate) fn stop_under_way(&self) -> Option<StopOrder> {
        let order = |stopping: &Stopping| StopOrder { mode: stopping.mode, injection: stopping.injection };
        self.stopping.as_ref().map(order)
    }

    /// Nobody sees the drive for now.
    pub(in crate::supervisor) const fn doubt_stop(&mut self) {
        if let Some(stopping) = &mut self.stopping {
            stopping.doubt();
        }
    }

    /// For how long direct current is to be held now.
    pub(crate) fn injection(&self) -> Option<Duration> {
        self.stopping.as_ref().and_then(|stopping| stopping.injection).or(self.settings.injection)
    }

    pub(in crate::supervisor) fn begin_stop(
        &mut self,
        now: Instant,
        asker: Asker,
        order: StopOrder,
        patience: Duration,
    ) {
        let (mode, injection) = (order.mode, order.injects_for());
        // What waits would move the motor behind its stop.
        if crate::mutant!("orders-outlive-a-stop", true, false) {
            self.end_orders_by_stop();
        }
        self.stops += 1;
        // Who gave the start has nothing to take back any more.
        self.started_by = None;
        self.changed = true;
        // A stop takes the run command back as well.
        self.withdrawal = None;
        // The exit has its own limit; until then the stop is repeated.
        let until = if asker.is_exit() { now + EXIT } else { now + patience };
        let mut waiter = Waiter { asker: asker.clone(), asked: order, asked_at: now, until, is_told: false };
        let of_another = self.checks.is_another() && asker.id().is_some();
        let output = self.status.as_ref().and_then(|status| status.value.output_frequency);
        match &mut self.stopping {
            Some(stopping) => {
                stopping.of_another |= of_another;
                if crate::mutant!("stop-softened", strength(mode) > strength(stopping.asked), true) {
                    (stopping.asked, stopping.mode, stopping.used) = (mode, mode, mode);
                    stopping.taken = false;
                }
                stopping.asked_at = now;
                // The longer brings the motor to rest.
                stopping.injection = stopping.injection.max(injection);
                if stopping.taken {
                    // It comes down already, or was seen to: somebody else may have run it since, which shows late or not at all.
                    waiter.until = waiter.until.max(now + self.settings.times.standstill);
                    stopping.next_try = Some(now);
                    self.pace.hurry(now);
                } else {
                    stopping.next_try = Some(now);
                    stopping.pause = REPEAT.0;
                }
                stopping.waiters.push(waiter);
                stopping.asker = asker;
            }
            None => {
                self.stopping = Some(Stopping {
                    asked: mode,
                    mode,
                    used: mode,
                    shown: None,
                    injection,
                    injects_for: None,
                    since: now,
                    asked_at: now,
                    attempts: 0,
                    begun: 0,
                    asker,
                    of_another,
                    taken: false,
                    was_taken: false,
                    injects_since: None,
                    lowest: output,
                    next_try: Some(now),
                    pause: REPEAT.0,
                    error: None,
                    undone: 0,
                    runs_by: None,
                    patient_until: now + patience,
                    alarm_at: Some(now + patience),
                    waiters: vec![waiter],
                });
            }
        }
    }

    /// A caller does not wait any more.
    pub(crate) fn forget_callers(&mut self, gone: impl Fn(CallId) -> bool) {
        if let Some(stopping) = &mut self.stopping {
            let is_gone = |asker: &Asker| matches!(asker, Asker::Caller { id, .. } if gone(*id));
            stopping.waiters.retain(|waiter| !is_gone(&waiter.asker));
        }
    }
}
