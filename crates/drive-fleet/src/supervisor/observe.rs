//! What a status tells: events, trips with their freeze-frame, loss and return.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, SystemTime},
};

use drive_core::{Control, Error, ExceptionMeaning, Faults, Measurements, Motion, PortError, Result, Status};
use tokio::time::Instant;

use super::{Acted, Asker, Job, Supervisor};
use crate::{
    cause::{Cause, ChangedWord, Policy},
    event::EventKind,
    exceeded::Limit,
    outcome::Refused,
    settings::{OnFault, OnLoss},
    snapshot::{Link, Timed, Trip},
};

/// How many trips are kept for each drive.
const TRIPS: usize = 16;
/// A silence in which a drive can have been switched off and on, or exchanged: what is checked at a connect is checked
/// again.
const SWITCHED_OFF: Duration = Duration::from_secs(1);
/// How often the explanation of a trip is asked for.
const EXPLANATIONS: u8 = 3;

/// Who has control of a drive, where that is somebody else. Some drives tell it only then.
fn somebody_else(status: &Status) -> Option<Control> {
    status.control.filter(|control| *control != Control::Bus)
}

/// Whether an exception may be that of a drive of another family: it has not what was asked for. A busy drive says something else.
const fn is_of_another(error: &Error) -> bool {
    use ExceptionMeaning::{NoSuchFunction, NoSuchRegister, Refused, ValueRefused};
    matches!(
        error,
        Error::Exception { meaning: NoSuchFunction | NoSuchRegister | Refused | ValueRefused, .. }
    )
}

/// The words that a status shows otherwise than the one before.
fn changed_words(before: Option<&Status>, status: &Status) -> Arc<[ChangedWord]> {
    let Some(earlier) = before else { return Arc::default() };
    let changed = status.raw.iter().filter_map(|word| {
        let before = earlier.raw(word.address);
        (before != Some(word.value)).then_some(ChangedWord { word: *word, before })
    });
    changed.collect()
}

impl Supervisor {
    pub(super) fn handle_status(&mut self, now: Instant, result: Result<Status>) {
        let in_time = self.pace.status_ended(now, self.is_busy());
        self.yielded = false;
        self.counters.polls += 1;
        match result {
            Ok(status) => {
                self.counters.answered += 1;
                self.counters.missed += u64::from(!in_time);
                self.accept_status(now, status);
            }
            Err(error) => {
                self.counters.missed += 1;
                if self.link != Link::Connected && is_of_another(&error) {
                    self.checks.refused(now);
                }
                // What this side had no time to ask says nothing of the drive.
                self.doubtful |= !matches!(error, Error::Port { problem: PortError::Expired, .. });
            }
        }
    }

    /// Takes what the drive says now for true, whatever was thought of it before.
    pub(super) fn accept_status(&mut self, now: Instant, status: Status) {
        let was = self.link;
        let before = self.status.take();
        let status = Timed::<Status>::new(status, now);
        let silent_for = status.at.saturating_duration_since(self.silent_since);
        // After a silence what it shows was not seen happening.
        let may_be_another = self.unseen || self.doubtful && silent_for >= SWITCHED_OFF;
        let found = was != Link::Connected || may_be_another;
        self.words = changed_words(before.as_ref().map(|before| &*before.value), &status.value);
        self.silent_since = self.silent_since.max(status.at);
        self.status = Some(status.clone());
        self.last_error = None;
        if let Some(active) = &mut self.active {
            active.is_seen();
        }
        self.retraction.status(now);
        self.changed = true;
        if was != Link::Connected {
            self.link = Link::Connected;
            self.panics.clear();
            self.given = None;
            self.checks.connected(now);
            self.pace.reconnected(now);
            self.emit_shown(EventKind::Connected(Arc::clone(&status.value)), Cause::Found);
        } else if may_be_another {
            self.checks.connected(now);
        }
        if found || self.doubtful {
            self.doubt_stop();
        }
        self.doubtful = false;
        self.compare(before.as_ref().map(|before| &*before.value), &status.value, found);
        if status.value.is_fault() && before.as_ref().is_some_and(|before| before.value.is_fault()) {
            self.see_another_fault(&status.value);
        } else if status.value.is_fault() {
            let armed_for = self.checks.armed_for().filter(|_| before.is_some());
            let unheard = armed_for.filter(|timeout| silent_for >= *timeout).map(|_| silent_for);
            // Where no code is shown yet, its explanation will tell; where the manual names none for it, as that of an Altivar 58, how
            // long it was not spoken to is all there is, and anything may have tripped it meanwhile.
            let is_it =
                self.communication_fault.zip(status.value.fault_code).map(|(code, shown)| code == shown);
            let by_watchdog = is_it == Some(true);
            let watchdog_after = unheard.filter(|_| is_it != Some(false));
            let status = status.clone();
            self.record_trip(
                now,
                Trip {
                    at: now,
                    wall: SystemTime::now(),
                    found,
                    before,
                    status,
                    faults: None,
                    by_watchdog,
                    watchdog_after,
                },
            );
        }
        self.check_limits();
        self.judge_setpoint(now);
        // Its line may have called it off-line sooner.
        if was == Link::Lost
            && silent_for >= self.settings.periods.max_age
            && self.settings.control
            && let OnLoss::Stop(mode) = self.settings.on_loss
        {
            self.stop_by_policy(now, Asker::Policy(Policy::OnLoss), mode);
        }
        self.tell_watchdog();
        self.judge_run(now);
        self.judge_stop(now);
        self.judge_order(now);
        if self.is_busy() {
            self.pace.quicken(now);
        }
    }

    fn compare(&mut self, before: Option<&Status>, status: &Status, found: bool) {
        let mut changed_by = None;
        if let Some(before) = before {
            let (from, to) = (before.state, status.state);
            if from != to {
                let cause = if found { Cause::Found } else { self.cause_of(before, status) };
                self.emit_shown(EventKind::StateChanged { from, to }, cause.clone());
                if before.is_fault() && !status.is_fault() {
                    self.emit_shown(EventKind::FaultCleared, cause.clone());
                }
                changed_by = Some(cause);
            }
        }
        self.compare_besides(before, status, found);
        self.note_seen(changed_by.as_ref(), status);
    }

    /// What else a status shows otherwise than the one before: its warning, and who has control.
    fn compare_besides(&mut self, before: Option<&Status>, status: &Status, found: bool) {
        let cause = if found { Cause::Found } else { Cause::Drive };
        let warned = before.and_then(|before| before.warning).unwrap_or(false);
        if let Some(present) = status.warning
            && present != warned
        {
            self.emit_shown(EventKind::Warning { present }, cause.clone());
        }
        let Some(before) = before else { return };
        match (somebody_else(before), somebody_else(status)) {
            (was, is) if was == is => {}
            (Some(was), None) => {
                let by_stop = std::mem::take(&mut self.stop_took_command);
                let start = self.acted.as_ref().filter(|acted| matches!(acted.job, Job::Start(_)));
                match start.map(|acted| acted.cause.clone()).filter(|_| self.control_taken.is_none()) {
                    // It was not taken from this bus: so some drives stand until they are started.
                    Some(start) => self.emit_shown(EventKind::StartTookCommand(was), start),
                    // A stop took it: that is told, and nobody has given it back.
                    None if by_stop => {}
                    None => self.emit_shown(EventKind::ControlReturned, cause),
                }
                self.control_taken = None;
            }
            (None, None) => {}
            (_, Some(is)) => {
                // Whoever has control now may give another reference.
                (self.given, self.stop_took_command) = (None, false);
                // The reset of an Altivar 21 zeroes its command word (Modbus §6.4): so it gives command back, too.
                let given =
                    self.acted.as_ref().filter(|acted| matches!(acted.job, Job::Release | Job::ResetFaults));
                match given.map(|acted| acted.cause.clone()) {
                    _ if found => self.emit_shown(EventKind::ControlElsewhere(is), Cause::Found),
                    // It was given, not taken.
                    Some(act) => {
                        self.acted = None;
                        self.emit_shown(EventKind::ControlElsewhere(is), act);
                    }
                    None => {
                        self.control_taken = Some(is);
                        self.emit_shown(EventKind::ControlTaken(is), cause);
                    }
                }
            }
        }
    }

    /// Why a state became another: by what was last written, if that does it; else the drive did it by itself.
    fn cause_of(&self, from: &Status, to: &Status) -> Cause {
        let Some(Acted { job, cause, is_new }) = &self.acted else { return Cause::Drive };
        let does_it = match job {
            Job::Start(_) => !from.is_fault() && !to.is_fault() && from.motion != Motion::Driven,
            // They end a run, and clear no fault. A motor that stands already is released by somebody else, unless it is seen at once.
            Job::Stop(_) | Job::Withdraw => {
                (!from.is_undriven() || *is_new)
                    && !from.is_fault()
                    && !to.is_fault()
                    && to.motion != Motion::Driven
            }
            Job::ResetFaults => from.is_fault() && !to.is_fault(),
            _ => false,
        };
        if does_it { cause.clone() } else { Cause::Drive }
    }

    /// A status was looked at. What was written is over when the drive has done something else since: what follows from that is
    /// not told as its doing.
    fn note_seen(&mut self, changed_by: Option<&Cause>, status: &Status) {
        let goes_on = self.active.is_some() || self.stopping.is_some() || self.withdrawal.is_some();
        let is_over = |acted: &Acted| match acted.job {
            Job::Start(_) | Job::Stop(_) | Job::Withdraw => {
                changed_by.is_some_and(|cause| *cause != acted.cause)
            }
            // It did not clear the fault.
            Job::ResetFaults => status.is_fault() && !acted.is_new,
            _ => false,
        };
        self.acted = self.acted.take().filter(|acted| goes_on || !is_over(acted));
        if let Some(acted) = &mut self.acted {
            acted.is_new = false;
        }
    }

    /// A motor that turns without the watchdog of its contract is an alarm.
    pub(super) fn tell_watchdog(&mut self) {
        let moving = self.status.as_ref().is_some_and(|status| !status.value.is_undriven());
        if let Some(why) = self.checks.not_in_force(moving && self.link == Link::Connected) {
            self.emit_shown(EventKind::WatchdogNotInForce(why), Cause::Found);
        }
    }

    fn record_trip(&mut self, now: Instant, trip: Trip) {
        // One that stood when the program began was counted by the one before, if it ran then.
        self.counters.trips += u64::from(trip.before.is_some());
        self.explanations = EXPLANATIONS;
        let cause = if trip.found { Cause::Found } else { Cause::Drive };
        self.emit_shown(EventKind::Tripped(Box::new(trip.clone())), cause);
        self.acted = None;
        let by_watchdog = trip.by_watchdog;
        let trips: &mut VecDeque<Trip> = Arc::make_mut(&mut self.trips);
        if trips.len() == TRIPS {
            trips.pop_front();
        }
        trips.push_back(trip);
        self.end_order_by_trip();
        if by_watchdog {
            self.reset_watchdog_trip(now);
        }
    }

    /// Another fault may stand where the one of the trip stood: where the status names another, the drive is asked anew.
    fn see_another_fault(&mut self, status: &Status) {
        let told = self.trips.back().and_then(Trip::fault).map(|fault| fault.code);
        if told.zip(status.fault_code).is_some_and(|(told, shown)| told != shown) {
            self.explanations = EXPLANATIONS;
        }
    }

    fn reset_watchdog_trip(&mut self, now: Instant) {
        if self.settings.control && self.settings.on_fault == OnFault::ResetWatchdogTrip {
            self.enqueue_reset(now);
        }
    }

    pub(super) fn handle_faults(&mut self, now: Instant, result: Result<Faults>) {
        let Ok(faults) = result else {
            self.explanations = self.explanations.saturating_sub(1);
            return;
        };
        self.explanations = 0;
        let trips = Arc::make_mut(&mut self.trips);
        let Some(trip) = trips.back_mut() else { return };
        if let Some(before) = &trip.faults {
            // One that is gone was reset meanwhile.
            if before.present != faults.present && !faults.present.is_empty() {
                // Another may have come on top of the first, so that no policy resets it, whatever it is.
                (trip.by_watchdog, trip.watchdog_after) = (false, None);
                trip.faults = Some(Arc::new(faults));
                // As it was found is said of the trip.
                let changed = Box::new(Trip { found: false, ..trip.clone() });
                self.queue.retain(|queued| !matches!(queued.asker, Asker::Policy(Policy::OnFault)));
                self.emit_by(EventKind::FaultChanged(changed), Cause::Drive);
            }
            return;
        }
        let code = self.communication_fault.filter(|_| trip.status.value.fault_code.is_none());
        let by_watchdog = code.is_some_and(|code| faults.present.iter().any(|fault| fault.code == code));
        trip.by_watchdog |= by_watchdog;
        trip.faults = Some(Arc::new(faults));
        if self.communication_fault.is_some() && !trip.by_watchdog {
            trip.watchdog_after = None;
        }
        let explained = trip.clone();
        let present = self.status.as_ref().is_some_and(|status| status.value.is_fault());
        let cause = if explained.found { Cause::Found } else { Cause::Drive };
        self.emit_by(EventKind::TripExplained(Box::new(explained)), cause);
        if by_watchdog && present {
            self.reset_watchdog_trip(now);
        }
    }

    pub(super) fn handle_measurements(&mut self, now: Instant, result: Result<Measurements>) {
        self.pace.slow_ended(now);
        let result = self.judge_reference(now, result);
        let Ok(measurements) = result else { return };
        self.retraction.measurements(now);
        self.off_setpoint.measure(&measurements, self.status.as_ref());
        self.measurements = Some(Timed::<Measurements>::new(measurements, now));
        self.check_limits();
        if self.status.as_ref().is_some_and(|status| status.value.is_fault()) {
            // What stands now may be another fault than the one of its trip.
            self.explanations = self.explanations.max(1);
        }
        self.changed = true;
    }

    /// What was measured last against the limits as they are set now.
    pub(super) fn check_limits(&mut self) {
        let (high, alarms) = (self.settings.limits.high, self.settings.alarms);
        let status = self.status.as_ref().map(|status| &*status.value);
        let (current, output) =
            (status.and_then(|status| status.current), status.and_then(|status| status.output_frequency));
        let slow = self.measurements.as_ref().map(|measurements| &*measurements.value);
        let (drive, motor) =
            (slow.and_then(|slow| slow.drive_thermal), slow.and_then(|slow| slow.motor_thermal));
        self.check_limit("current", current, alarms.current, |measured, limit| {
            (Limit::Current { measured, limit }, measured > limit)
        });
        self.check_limit("frequency", output, high, Limit::of_frequency);
        self.check_limit("drive thermal", drive, alarms.drive_thermal, |measured, limit| {
            (Limit::DriveThermal { measured, limit }, measured > limit)
        });
        self.check_limit("motor thermal", motor, alarms.motor_thermal, |measured, limit| {
            (Limit::MotorThermal { measured, limit }, measured > limit)
        });
    }

    /// What has no limit is above none, and what was not measured is as it was.
    fn check_limit<T>(
        &mut self,
        name: &'static str,
        measured: Option<T>,
        limit: Option<T>,
        held: impl FnOnce(T, T) -> (Limit, bool),
    ) {
        let Some(limit) = limit else {
            self.exceeded.remove(name);
            return;
        };
        let Some((limit, exceeded)) = measured.map(|measured| held(measured, limit)) else { return };
        let was = if exceeded { self.exceeded.insert(name, limit) } else { self.exceeded.remove(name) };
        if was.is_some() != exceeded {
            self.emit(EventKind::Limit { limit, exceeded });
        }
    }

    /// Whether the motor is where the drive says that it is: what it counts its setpoint by may be another than it is taken for. A
    /// setpoint that was just given may not be the one yet of which it says so.
    fn judge_setpoint(&mut self, now: Instant) {
        let Some(status) = &self.status else { return self.off_setpoint.forget() };
        let given = self.given.filter(|given| given.at < status.at).map(|given| given.setpoint);
        self.off_setpoint.see(now, given, self.lease.is_some(), &status.value);
    }

    /// There is no valid status any more.
    pub(super) fn lose(&mut self, now: Instant) {
        self.link = Link::Lost;
        self.counters.lost += 1;
        let silent_for = now.saturating_duration_since(self.silent_since);
        self.emit(EventKind::Lost { silent_for, error: self.last_error.clone() });
        self.given = None;
        self.off_setpoint.forget();
        self.acted = None;
        self.explanations = 0;
        self.doubt_stop();
        self.end_orders_by_loss();
        self.end_questions(&Refused::NotConnected);
    }
}
