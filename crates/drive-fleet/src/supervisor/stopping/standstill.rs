//! What the drive shows of a stop: that no run command is in force any more, that the motor comes down, and that it stands, which
//! confirms it.

use drive_core::{Command, INJECTION_AT_MOST, Motion, StopMode};
use tokio::time::Instant;

use super::Waiter;
use crate::{
    event::EventKind,
    outcome::Outcome,
    snapshot::Link,
    supervisor::{Job, Output, Supervisor},
};

impl Supervisor {
    /// What a new status says of a stop under way. Nothing is confirmed before the drive has taken it: a motor that stands for
    /// another reason may hold a run command.
    pub(in crate::supervisor) fn judge_stop(&mut self, now: Instant) {
        let (Some(status), Some(stopping)) = (&self.status, &mut self.stopping) else { return };
        let (at, motion, output) = (status.at, status.value.motion, status.value.output_frequency);
        let times = &self.settings.times;
        let standstill = times.standstill;
        let (is_known, is_another) = (self.checks.stranger().is_none(), self.checks.is_another());
        if stopping.attempts == 0 {
            return;
        }
        stopping.see_again(now, &status.value, standstill);
        if stopping.taken && status.value.is_undriven() {
            // Who has asked again while it came down needs no word any more.
            stopping.next_try = None;
        }
        let injects = stopping.used == StopMode::DcInjection;
        let injected_for = stopping.injects_since.map(|since| now.saturating_duration_since(since));
        match motion {
            // Some drives inject for as long as they are told to, and heat a motor that stands: their ramp ends it.
            Motion::Held | Motion::AtRest | Motion::Coasting if injects => stopping.go_on_by_ramp(now),
            _ if injects && injected_for.is_some_and(|time| time >= INJECTION_AT_MOST) => {
                stopping.go_on_by_ramp(now);
            }
            _ if crate::mutant!("untaken-stop-confirmed", !stopping.taken, false) => {
                if motion == Motion::Driven {
                    stopping.sinks(now, output, times);
                }
            }
            Motion::Driven if crate::mutant!("run-behind-a-stop-left", true, false) => {
                stopping.is_undone(now, &status.value, standstill);
            }
            _ => {
                // What direct current holds has no output that could come down; its own time ends it.
                if motion == Motion::Braking && !injects {
                    stopping.comes_down(now, output, standstill);
                }
                // Another drive that stands there says nothing of the motor that was to be stopped.
                if !(is_known || is_another && stopping.of_another) {
                    return;
                }
                if stopping.next_try.is_none() {
                    self.tell_taken(at);
                }
                // Without an output no more is to be had: the shaft may coast.
                let ends = matches!(motion, Motion::Held | Motion::AtRest | Motion::Coasting);
                if crate::mutant!("braking-told-as-standstill", ends, true) {
                    self.stop_confirmed(now, at, motion);
                }
            }
        }
    }

    /// The question which drive it is, where only that is wanted to confirm a stop that it has taken, or to give it one of before.
    pub(in crate::supervisor) fn stopped_identity_job(&self, now: Instant) -> Option<Job> {
        let waits =
            self.stopping.as_ref().is_some_and(|stopping| stopping.taken) || self.owes_stop_of_before();
        self.checks.identity_job(now).filter(|_| waits && self.link == Link::Connected && !self.unseen)
    }

    /// A status that was read then shows that no run command is in force.
    fn tell_taken(&mut self, at: Instant) {
        let Some(stopping) = &mut self.stopping else { return };
        for waiter in stopping.waiters.iter_mut().filter(|waiter| !waiter.is_told && waiter.asked_at <= at) {
            waiter.is_told = true;
            let in_force = |id| Output::InForce(id, Outcome::Confirmed);
            self.outputs.extend(waiter.asker.id().map(in_force));
        }
    }

    /// A status that was read then confirms what was asked for before.
    fn stop_confirmed(&mut self, now: Instant, at: Instant, motion: Motion) {
        let Some(mut stopping) = self.stopping.take() else { return };
        self.retraction.confirmed(at, stopping.mode);
        self.given = None;
        let is_answered =
            |waiter: &Waiter| crate::mutant!("older-status-confirms-a-stop", waiter.asked_at <= at, true);
        let (confirmed, later): (Vec<_>, Vec<_>) = stopping.waiters.drain(..).partition(is_answered);
        let is_over = stopping.asked_at <= at;
        let modes = |asked| stopping.modes(asked);
        let confirmed: Vec<_> =
            confirmed.into_iter().map(|waiter| (waiter.asker, modes(waiter.asked))).collect();
        if is_over {
            let event = EventKind::StopConfirmed { mode: stopping.used, motion };
            for (asker, modes) in confirmed {
                self.conclude(asker, Command::Stop(modes.asked), None, Outcome::Stopped(modes));
            }
            self.emit_shown(event, stopping.asker.cause());
            return;
        }
        // Somebody has asked for it again since.
        stopping.waiters = later;
        stopping.since = stopping.asked_at;
        stopping.patient_until = stopping.since + self.settings.times.stop_alarm;
        stopping.alarm_at = Some(stopping.since + self.settings.times.standstill);
        (stopping.undone, stopping.runs_by, stopping.lowest) = (0, None, None);
        self.stopping = Some(stopping);
        self.pace.hurry(now);
        for (asker, modes) in confirmed {
            self.conclude(asker, Command::Stop(modes.asked), None, Outcome::Stopped(modes));
        }
    }
}
