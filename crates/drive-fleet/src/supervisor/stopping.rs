//! Stops: sent at once, repeated until the drive shows standstill, an alarm when they cannot be confirmed.

use std::time::Duration;

use drive_core::{
    Command, Error, ErrorKind, Followed, Frequency, INJECTION_AT_MOST, Motion, Refusal, Result, Setpoint,
    Status, StopMode, Stopped,
};
use tokio::time::Instant;

use super::{Asker, CallId, Job, Output, Supervisor, shown::who_runs, verdict::status_of};
use crate::{
    cause::Cause,
    event::EventKind,
    outcome::{Outcome, Refused, StopModes, Unconfirmed, Unknown},
    settings::Times,
    snapshot::{Link, PendingStop},
    stop_order::{StopOrder, strength},
};

/// The shortest and the longest pause between two attempts of a stop.
pub(super) const REPEAT: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

/// By how much the output has to come down to count as coming down, and how long it may not before it hangs: the slowest ramp of all
/// families, 3200 s from 50 Hz, takes it in 6.4 s.
const PROGRESS: Frequency = Frequency::from_centihertz(10);
const HANGS: Duration = Duration::from_secs(10);

/// Longer than any exit: its own limit ends it.
const EXIT: Duration = Duration::from_secs(86_400);

/// Whether its driver does not send it at all.
const fn is_refused(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Refused | ErrorKind::Unsupported)
}

/// A stop under way.
#[derive(Debug)]
pub(super) struct Stopping {
    /// The hardest mode that was asked for.
    asked: StopMode,
    /// The mode that is sent.
    mode: StopMode,
    /// The mode by which the drive says that it stops; that which is sent until it has said so.
    used: StopMode,
    /// By which the drive has said that it stops, and why by another than was asked for.
    shown: Option<(StopMode, Option<&'static str>)>,
    /// For how long direct current is to be held, where somebody has said so.
    injection: Option<Duration>,
    /// For how long the drive's driver has said that it is.
    injects_for: Option<Duration>,
    since: Instant,
    /// When it was asked for last: a status that was read before says nothing of that.
    asked_at: Instant,
    /// Attempts that have ended.
    attempts: u32,
    /// Attempts that have begun.
    begun: u32,
    /// Whose act it is, the last.
    asker: Asker,
    /// Somebody has asked for it who knew that another drive stands there: it is that one which is to stop.
    of_another: bool,
    /// The drive has shown that no run command is in force.
    taken: bool,
    /// It had, before it was not heard or its line was lost: what it shows first decides.
    was_taken: bool,
    /// Since when the drive injects for it.
    injects_since: Option<Instant>,
    /// The lowest output since it was given, and anew since it was taken.
    lowest: Option<Frequency>,
    /// When it is sent next; `None` while the drive has taken it.
    next_try: Option<Instant>,
    pause: Duration,
    error: Option<Error>,
    /// How often the motor ran again behind it.
    undone: u32,
    /// By whose run command it did, as far as the drive told.
    runs_by: Option<Refusal>,
    /// Until when the drive may be without it before that is an alarm.
    patient_until: Instant,
    /// When its lack of confirmation becomes an alarm; `None` when it has.
    alarm_at: Option<Instant>,
    waiters: Vec<Waiter>,
}

#[derive(Debug)]
struct Waiter {
    asker: Asker,
    asked: StopOrder,
    /// When.
    asked_at: Instant,
    until: Instant,
    /// It has heard that no run command is in force any more.
    is_told: bool,
}

impl Stopping {
    /// How a stop was asked for, and how the drive stops.
    fn modes(&self, order: StopOrder) -> StopModes {
        let asked = order.mode;
        let used = self.shown.map(|(used, _)| used);
        let why = self.shown.and_then(|(_, why)| why).filter(|_| used != Some(asked));
        let (injection_asked, injection_used) = (order.injects_for(), self.injects_for);
        StopModes { asked, used, why, injection_asked, injection_used }
    }

    pub(super) const fn pending(&self) -> PendingStop {
        PendingStop {
            mode: self.used,
            since: self.since,
            attempts: self.begun,
            taken: self.taken,
            alarm: self.alarm_at.is_none(),
            undone: self.undone,
        }
    }

    /// The motor stands, or nearly: what still acts is ended along the ramp.
    fn go_on_by_ramp(&mut self, now: Instant) {
        (self.mode, self.used) = (StopMode::Ramp, StopMode::Ramp);
        self.taken = false;
        self.next_try = Some(now);
    }

    /// The drive shows that no run command is in force: from here the motor comes down by itself and needs its time, which counts
    /// from when the stop was given, however often it is taken.
    fn takes(&mut self, now: Instant, standstill: Duration) {
        self.taken = true;
        self.lowest = None;
        self.alarm_at = self.alarm_at.map(|at| at.max(self.since + standstill));
        for waiter in &mut self.waiters {
            waiter.until = match waiter.asker.is_exit() {
                true => waiter.until.min(now + standstill),
                false => waiter.until.max(waiter.asked_at + standstill),
            };
        }
    }

    /// Nobody has seen whether it acts still.
    pub(super) const fn doubt(&mut self) {
        self.was_taken |= std::mem::replace(&mut self.taken, false);
    }

    /// What the drive shows first behind a time in which nobody saw it. A motor that is driven may be on its ramp still, where its words do not
    /// tell a stop from a run: the stop is given anew, and nobody is blamed.
    const fn see_again(&mut self, now: Instant, motion: Motion) {
        if !std::mem::replace(&mut self.was_taken, false) || self.taken {
            return;
        }
        match motion {
            Motion::Driven => self.next_try = Some(now),
            _ => self.taken = true,
        }
    }

    /// A run command has come behind it, kept back on its way or from somebody else: it is written again at once, and has no more time
    /// than from when it was given, whatever its ramp had gained.
    fn is_undone(&mut self, now: Instant, status: &Status, standstill: Duration) {
        self.taken = false;
        (self.undone, self.runs_by) = (self.undone.saturating_add(1), who_runs(status));
        self.next_try = Some(now);
        self.alarm_at = self.alarm_at.map(|at| at.min(self.patient_until));
        for waiter in self.waiters.iter_mut().filter(|waiter| !waiter.asker.is_exit()) {
            waiter.until = waiter.until.min(waiter.asked_at + standstill);
        }
    }

    /// The motor comes down by itself. As long as it does, its time begins anew: a long ramp is no alarm, a ramp that hangs is. Not
    /// behind a stop that was undone: what sinks between two run commands would have all the time that there is.
    fn comes_down(&mut self, now: Instant, output: Option<Frequency>, standstill: Duration) {
        let Some(output) = output.filter(|_| self.undone == 0) else { return };
        let Some(lowest) = self.lowest else {
            self.lowest = Some(output);
            self.alarm_at = self.alarm_at.map(|at| at.min(now + HANGS));
            return;
        };
        if output.centihertz() + PROGRESS.centihertz() <= lowest.centihertz() {
            self.lowest = Some(output);
            self.alarm_at = self.alarm_at.map(|_| now + standstill.min(HANGS));
            for waiter in &mut self.waiters {
                waiter.until = waiter.until.max(now + standstill);
            }
        }
    }

    /// The output sinks, and nothing tells whether by this stop or by a lower setpoint that was given before: it is waited for as long as
    /// it does, for that ends at the setpoint, and below it the motor obeys. Not where something is known to keep the stop from the motor,
    /// and for no longer than a stop has that was taken.
    fn sinks(&mut self, now: Instant, output: Option<Frequency>, times: &Times) {
        let is_denied = match &self.error {
            None | Some(Error::NotConfirmed { because: None, .. }) => false,
            Some(_) => true,
        };
        let Some(output) = output.filter(|_| !is_denied && self.undone == 0) else { return };
        let Some(lowest) = self.lowest else {
            self.lowest = Some(output);
            return;
        };
        if output.centihertz() + PROGRESS.centihertz() <= lowest.centihertz() {
            self.lowest = Some(output);
            let until = (now + times.stop_alarm).min(self.since + times.standstill);
            self.alarm_at = self.alarm_at.map(|at| at.max(until));
            for waiter in &mut self.waiters {
                waiter.until = waiter.until.max(until);
            }
        }
    }

    pub(super) fn wake_at(&self) -> Option<Instant> {
        self.alarm_at().into_iter().chain(self.next_try).min()
    }

    pub(super) fn alarm_at(&self) -> Option<Instant> {
        let waiters = self.waiters.iter().map(|waiter| waiter.until);
        waiters.chain(self.alarm_at).min()
    }

    /// Whether its time is not over yet, for whoever waits for it or until its lack of confirmation is an alarm.
    pub(super) fn has_time(&self) -> bool {
        self.alarm_at().is_some()
    }
}

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
    pub(super) fn drops_for_stop(&self) -> bool {
        match (self.in_flight, &self.stopping) {
            (Some(Job::Stop(mode)), Some(stopping)) => stopping.mode != mode,
            (Some(_), Some(stopping)) => !stopping.taken,
            _ => false,
        }
    }

    /// Stops for a policy.
    pub(super) fn stop_by_policy(&mut self, now: Instant, asker: Asker, stop: impl Into<StopOrder>) {
        self.begin_stop(now, asker, stop.into(), self.settings.times.stop_alarm);
    }

    /// How the stop that is given and not confirmed yet is to stop it from now on: direct current that has brought it to rest is only to
    /// be ended.
    pub(crate) fn stop_under_way(&self) -> Option<StopOrder> {
        let order = |stopping: &Stopping| StopOrder { mode: stopping.mode, injection: stopping.injection };
        self.stopping.as_ref().map(order)
    }

    /// Nobody sees the drive for now.
    pub(super) const fn doubt_stop(&mut self) {
        if let Some(stopping) = &mut self.stopping {
            stopping.doubt();
        }
    }

    /// For how long direct current is to be held now.
    pub(crate) fn injection(&self) -> Option<Duration> {
        self.stopping.as_ref().and_then(|stopping| stopping.injection).or(self.settings.injection)
    }

    pub(super) fn begin_stop(&mut self, now: Instant, asker: Asker, order: StopOrder, patience: Duration) {
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
                    // It comes down already, and the next status says of this one, too, how far it is.
                    waiter.until = waiter.until.max(now + self.settings.times.standstill);
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

    pub(super) fn stop_job(&self, now: Instant) -> Option<Job> {
        let stopping = self.stopping.as_ref()?;
        (stopping.next_try? <= now).then_some(Job::Stop(stopping.mode))
    }

    /// What the attempt has heard that is under way: the status does not show the stop yet, and the drive may have refused its word.
    pub(crate) fn handle_followed(&mut self, now: Instant, heard: Followed) {
        let Followed { status, denied } = heard;
        if !matches!(self.in_flight, Some(Job::Stop(_))) {
            return;
        }
        if let Some(stopping) = &mut self.stopping {
            // Whoever asks before the attempt ends is told so, and no more once the drive takes the words again.
            if denied.is_some() || matches!(stopping.error, Some(Error::Exception { .. })) {
                stopping.error = denied;
            }
        }
        self.accept_status(now, status);
    }

    pub(super) fn handle_stopped(&mut self, now: Instant, result: Result<Stopped>) {
        let standstill = self.settings.times.standstill;
        let Some(stopping) = &mut self.stopping else { return };
        // What never left for the line was no attempt.
        let error = result.as_ref().err();
        let refused = error.is_some_and(is_refused);
        let sent = !refused && error.is_none_or(|error| error.kind() != ErrorKind::NotSent);
        stopping.attempts = stopping.attempts.saturating_add(u32::from(sent));
        stopping.begun = stopping.begun.saturating_sub(u32::from(!sent));
        let cause = stopping.asker.cause();
        let status = match result {
            Ok(Stopped { status, mode: used, instead: why, taken_from, injects_for }) => {
                let asked = stopping.mode;
                let told = std::mem::replace(&mut stopping.used, used);
                stopping.next_try = None;
                // The ramp that ends an injection is no other mode.
                if stopping.injects_since.is_none() || used != StopMode::Ramp {
                    stopping.shown = Some((used, why));
                }
                if used == StopMode::DcInjection {
                    stopping.injects_since.get_or_insert(now);
                    stopping.injects_for = injects_for;
                }
                stopping.error = None;
                stopping.pause = REPEAT.0;
                if !stopping.taken {
                    stopping.takes(now, standstill);
                }
                if let Some(other) = taken_from {
                    self.stop_took_command = true;
                    self.emit_by(EventKind::StopTookCommand(other), cause.clone());
                }
                if used != asked && used != told {
                    self.emit_by(EventKind::StopModeReplaced { asked, used, why }, cause);
                }
                Some(status)
            }
            Err(error) => {
                stopping.next_try = crate::mutant!("stop-not-repeated", Some(now + stopping.pause), None);
                stopping.pause = (stopping.pause * 2).min(REPEAT.1);
                stopping.taken = false;
                // No time makes it go out: whoever looks after the motor is told now.
                if refused {
                    stopping.alarm_at = stopping.alarm_at.map(|at| at.min(now));
                }
                let status = status_of(&error);
                stopping.error = Some(error);
                status
            }
        };
        if let Some(status) = status {
            self.accept_status(now, status);
        }
    }

    /// What a new status says of a stop under way. Nothing is confirmed before the drive has taken it: a motor that stands for
    /// another reason may hold a run command.
    pub(super) fn judge_stop(&mut self, now: Instant) {
        let (Some(status), Some(stopping)) = (&self.status, &mut self.stopping) else { return };
        let (at, motion, output) = (status.at, status.value.motion, status.value.output_frequency);
        let times = &self.settings.times;
        let standstill = times.standstill;
        let (is_known, is_another) = (self.checks.stranger().is_none(), self.checks.is_another());
        if stopping.attempts == 0 {
            return;
        }
        stopping.see_again(now, motion);
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
                self.tell_taken(at);
                // Without an output no more is to be had: the shaft may coast.
                let ends = matches!(motion, Motion::Held | Motion::AtRest | Motion::Coasting);
                if crate::mutant!("braking-told-as-standstill", ends, true) {
                    self.stop_confirmed(now, at, motion);
                }
            }
        }
    }

    /// The question which drive it is, where only that is wanted to confirm a stop that it has taken, or to give it one of before.
    pub(super) fn stopped_identity_job(&self, now: Instant) -> Option<Job> {
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

    pub(super) fn check_stop_times(&mut self, now: Instant) {
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

    /// Tells everybody how a command ended, and its caller first.
    pub(super) fn conclude(
        &mut self,
        asker: Asker,
        command: Command,
        setpoint: Option<Setpoint>,
        outcome: Outcome,
    ) {
        let (commander, cause) = (asker.name(), asker.cause());
        match asker {
            Asker::Caller { id, .. } => self.outputs.push_back(Output::Answer(id, outcome.clone())),
            Asker::Policy(_) if asker.is_exit() => self.exit_concluded(&outcome),
            Asker::Policy(_) => {}
        }
        self.emit_by(EventKind::Command { command, setpoint, commander, outcome }, cause);
    }

    /// An attempt is on its way; whose.
    pub(super) fn begin_attempt(&mut self) -> Option<Cause> {
        let stopping = self.stopping.as_mut()?;
        stopping.begun = stopping.begun.saturating_add(1);
        Some(stopping.asker.cause())
    }
}
