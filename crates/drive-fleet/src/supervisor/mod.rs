//! The supervisor of one drive: a pure machine. Time is an argument, it does no input or output.
//!
//! In: [`handle_order`](Supervisor::handle_order), [`handle_stop`](Supervisor::handle_stop),
//! [`handle_exit`](Supervisor::handle_exit), [`handle_reply`](Supervisor::handle_reply). Out:
//! [`next`](Supervisor::next) says what to do now, [`poll_output`](Supervisor::poll_output) what to tell whom,
//! [`snapshot`](Supervisor::snapshot) what is known.

mod adoption;
pub(crate) mod checks;
mod exit;
mod expiry;
mod job;
mod line_lost;
mod observe;
mod off_setpoint;
mod orders;
mod pace;
mod permission;
mod questions;
mod retraction;
mod shown;
mod stopping;
#[cfg(test)]
mod tests;
mod verdict;
mod withdraw;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use drive_core::{
    Control, Error, Ground, Lack, Lease, Measurements, PortError, Refusal, Status, WatchdogCapability,
};
use tokio::time::Instant;

use self::{
    adoption::Adoption,
    checks::Checks,
    exit::{Exit, Leaving},
    orders::{Active, Queued},
    pace::Pace,
    questions::Questions,
    retraction::Retraction,
    stopping::Stopping,
    withdraw::Withdrawal,
};
pub(crate) use self::{
    expiry::{Expiry, Lifetime},
    job::{Job, Reply, Step, Turn},
    permission::Leave,
    questions::{Question, Told},
};
use crate::{
    cause::{Act, Cause, ChangedWord, Policy},
    concern::{self, ConcernKind},
    eeprom::{EepromUse, Ledger},
    event::{EventKind, Happened},
    exceeded::Limit,
    limits::Given,
    outcome::{Outcome, Refused, Unknown},
    settings::DriveSettings,
    snapshot::{Counters, Link, Snapshot, Timed, Trip},
};

/// How many panics of a driver are told that say something else, until its drive is found anew.
const PANICS: usize = 8;

/// What was written last that changes the motor, and why.
#[derive(Debug)]
struct Acted {
    job: Job,
    cause: Cause,
    /// No status has come since.
    is_new: bool,
}

/// Names a caller that waits for an outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct CallId(pub(crate) u64);

/// Who asked for something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Asker {
    /// Somebody who waits for the outcome.
    Caller { id: CallId, act: Arc<Act> },
    /// A policy of the settings.
    Policy(Policy),
}

impl Asker {
    /// The caller that waits.
    const fn id(&self) -> Option<CallId> {
        match self {
            Self::Caller { id, .. } => Some(*id),
            Self::Policy(_) => None,
        }
    }

    fn name(&self) -> Arc<str> {
        match self {
            Self::Caller { act, .. } => Arc::clone(&act.commander),
            Self::Policy(policy) => Arc::from(policy.to_string()),
        }
    }

    fn cause(&self) -> Cause {
        match self {
            Self::Caller { act, .. } => Cause::Command(Act::clone(act)),
            Self::Policy(policy) => Cause::policy(*policy),
        }
    }

    /// Whether the drive ends, with the fleet or without it.
    const fn is_exit(&self) -> bool {
        matches!(self, Self::Policy(Policy::Exit | Policy::Removal))
    }
}

/// What the machine wants told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Output {
    /// To everybody.
    Event(Happened),
    /// To one caller: the drive shows that it is in force what he has asked for.
    InForce(CallId, Outcome),
    /// To one caller.
    Answer(CallId, Outcome),
    /// To one who asked a question.
    Told(CallId, Result<Told, Refused>),
}

/// The supervisor of one drive.
#[derive(Debug)]
pub(crate) struct Supervisor {
    name: Arc<str>,
    settings: DriveSettings,
    /// The code by which the drive says that its watchdog has tripped it.
    communication_fault: Option<u16>,
    /// Whether setting its watchdog wears its EEPROM.
    watchdog_wears: bool,
    link: Link,
    status: Option<Timed<Status>>,
    measurements: Option<Timed<Measurements>>,
    /// What was withdrawn of them.
    retraction: Retraction,
    /// The setpoint that the drive confirmed last.
    given: Option<Given>,
    checks: Checks,
    pace: Pace,
    active: Option<Active>,
    queue: VecDeque<Queued>,
    questions: Questions,
    stopping: Option<Stopping>,
    /// How many stops were asked of it.
    stops: u64,
    /// When the setpoint was asked for that counts, by a start or by itself.
    setpoint_asked_at: Option<Instant>,
    withdrawal: Option<Withdrawal>,
    exit: Exit,
    /// Why it ends.
    exits_by: Policy,
    leaving: Leaving,
    /// Nobody holds it any more.
    is_unheld: bool,
    /// Who asked for the last start that was sent.
    started_by: Option<CallId>,
    /// The run command of this side that stands in the drive, or may, as the family keeps it.
    lease: Option<Lease>,
    /// What was written to its EEPROM.
    ledger: Ledger,
    /// What becomes of a run command of before.
    adoption: Adoption,
    /// What the last status said of it that was told.
    suspended: Option<(Lack, Refusal)>,
    /// Somebody else has command, and the settings leave the run command as it is until it is in force again.
    reported: bool,
    exceeded: BTreeMap<&'static str, Limit>,
    /// What the family found to be set up otherwise.
    unmet: Option<Refusal>,
    /// The same as it was told last.
    unmet_told: Option<Refusal>,
    /// A stop of this side has taken the command from somebody else, which is told, and no status has shown it yet.
    stop_took_command: bool,
    /// Whether its motor comes to its setpoint.
    off_setpoint: off_setpoint::Watch,
    /// Who has taken control, until it is back.
    control_taken: Option<Control>,
    /// The last job that was sent to change what the motor does, and why.
    acted: Option<Acted>,
    /// The words that changed with the status that is looked at.
    words: Arc<[ChangedWord]>,
    /// Since when something troubles the drive.
    since: Vec<(ConcernKind, Instant)>,
    trips: Arc<VecDeque<Trip>>,
    /// How often the last trip's explanation may still be asked for.
    explanations: u8,
    counters: Counters,
    /// Since when there has been no valid status.
    silent_since: Instant,
    /// The last error since the last status.
    last_error: Option<Error>,
    /// What was told of panics of its driver since it was found.
    panics: Vec<String>,
    /// A status has failed since the last that came: the drive may have been switched off and on.
    doubtful: bool,
    /// Its line has lost its port, and no status was read anew since: another drive may answer.
    unseen: bool,
    in_flight: Option<Job>,
    /// What the job in flight writes to the EEPROM, if it does, and why.
    wearing: Option<(EepromUse, Cause)>,
    turn: Turn,
    /// Until when what is done on its turn may go on.
    turn_ends: Option<Instant>,
    /// A poll has given way to an order since the last status.
    yielded: bool,
    outputs: VecDeque<Output>,
    changed: bool,
}

impl Supervisor {
    pub(crate) fn new(
        now: Instant,
        settings: DriveSettings,
        watchdog: Option<WatchdogCapability>,
        communication_fault: Option<u16>,
    ) -> Self {
        Self {
            communication_fault,
            watchdog_wears: watchdog.is_some_and(|watchdog| watchdog.wears),
            name: Arc::from(settings.name.as_str()),
            link: Link::Connecting,
            status: None,
            measurements: None,
            retraction: Retraction::new(now),
            given: None,
            checks: Checks::new(&settings, watchdog),
            pace: Pace::new(now, settings.periods),
            active: None,
            queue: VecDeque::new(),
            questions: Questions::new(),
            stopping: None,
            stops: 0,
            setpoint_asked_at: None,
            withdrawal: None,
            exit: Exit::No,
            exits_by: Policy::Exit,
            leaving: Leaving::No,
            is_unheld: false,
            started_by: None,
            lease: None,
            ledger: Ledger::new(now, settings.eeprom_before.clone()),
            adoption: Adoption::of(&settings),
            suspended: None,
            reported: false,
            exceeded: BTreeMap::new(),
            unmet: None,
            unmet_told: None,
            stop_took_command: false,
            off_setpoint: off_setpoint::Watch::default(),
            control_taken: None,
            acted: None,
            words: Arc::default(),
            since: Vec::new(),
            trips: Arc::default(),
            explanations: 0,
            counters: Counters::default(),
            silent_since: now,
            last_error: None,
            panics: Vec::new(),
            doubtful: false,
            unseen: false,
            in_flight: None,
            wearing: None,
            turn: Turn::Unwanted,
            turn_ends: None,
            yielded: false,
            outputs: VecDeque::new(),
            changed: true,
            settings,
        }
    }

    /// Other settings hold from now on. The motor, the orders and the stops under way go on.
    pub(crate) fn handle_settings(&mut self, now: Instant, settings: &DriveSettings) {
        if *self.name != *settings.name {
            let old = std::mem::replace(&mut self.name, Arc::from(settings.name.as_str()));
            self.emit_by(EventKind::Renamed(old), Cause::policy(Policy::Settings));
        }
        let changed = self.settings.differ(settings);
        if !changed.is_empty() {
            self.emit_by(EventKind::Reconfigured(changed), Cause::policy(Policy::Settings));
        }
        self.checks.reconfigure(now, settings);
        self.pace.reconfigure(now, settings.periods);
        self.settings = settings.clone();
        self.check_limits();
        self.changed = true;
    }

    /// The drive's name.
    pub(crate) fn name(&self) -> Arc<str> {
        Arc::clone(&self.name)
    }

    /// What to do now. A job that it gives is in flight until its reply or [`handle_dropped`](Self::handle_dropped).
    pub(crate) fn next(&mut self, now: Instant) -> Step {
        // What the time has ended ends before anything is chosen: nothing that has expired is sent.
        self.handle_time(now);
        if self.is_gone() {
            return Step::Finished;
        }
        self.turn_ends = None;
        let urgent = self.choose(now);
        let Some((job, until)) = urgent.or_else(|| self.choose_background(now)) else {
            return Step::Wait(self.wake_at(now));
        };
        let on_turn = urgent.is_none();
        let lifetime = self.lifetime(now, job);
        if let Job::Start(_) = job {
            // A new run command takes the place of the one that was to be withdrawn.
            self.withdrawal = None;
        }
        self.note_act(job);
        self.wearing = self.wears(job);
        self.in_flight = Some(job);
        self.changed = true;
        Step::Do { job, on_turn, lifetime, until }
    }

    /// What is most urgent, and how long it may hold up the rest.
    fn choose(&mut self, now: Instant) -> Option<(Job, Option<Instant>)> {
        if let Some(job) = self.stop_job(now) {
            return Some((job, None));
        }
        // A run command that is not in force may act at any moment (rule 5): before every order.
        if let Some(job) = self.withdraw_job(now).or_else(|| self.restore_job()) {
            return Some((job, None));
        }
        if let Some(job) = self.stopped_identity_job(now) {
            return Some((job, None));
        }
        let feed_at = self.checks.feed_at().filter(|_| self.link == Link::Connected);
        let hungry = feed_at.is_some_and(|at| at <= now);
        let anew = self.doubtful || self.unseen || self.link != Link::Connected;
        let status = (Job::Status { anew }, feed_at);
        // A stream of orders must not blind the fleet for the drive that it commands.
        if !hungry && self.pace.status_due() + self.settings.periods.rest <= now {
            return Some(status);
        }
        if let Some(order) = self.order_job(now) {
            return Some(order);
        }
        // Behind the orders, whose own frames feed the drive as well.
        if hungry {
            return Some((Job::KeepAlive, None));
        }
        (self.pace.status_due() <= now).then_some(status)
    }

    /// What is done on the drive's turn, when it has it.
    fn choose_background(&mut self, now: Instant) -> Option<(Job, Option<Instant>)> {
        let wanted = match self.link {
            Link::Connected => self.background_job(now),
            // What answers and refuses is asked what it is, and nothing else.
            _ => self
                .checks
                .identity_job(now)
                .filter(|_| matches!(self.last_error, Some(Error::Exception { .. }))),
        };
        let Some(job) = wanted else {
            self.turn = Turn::Unwanted;
            return None;
        };
        if self.turn != Turn::Granted {
            self.turn = Turn::Wanted;
            return None;
        }
        self.turn = Turn::Unwanted;
        // A write is not left half done for a poll, and its frames feed the drive as well.
        if let Job::ArmWatchdog(..) | Job::Ask(Question::Write(..)) = job {
            return Some((job, None));
        }
        let ends = self.pace.status_due().max(now + self.settings.periods.max_age / 3);
        self.turn_ends = Some(ends);
        // Nobody feeds the watchdog of a drive that is lost.
        let feed_at = self.checks.feed_at().filter(|_| self.link == Link::Connected);
        Some((job, Some(feed_at.map_or(ends, |at| at.min(ends)))))
    }

    /// Whether the drive wants its turn.
    pub(crate) const fn turn(&self) -> Turn {
        self.turn
    }

    /// The drive has its turn.
    pub(crate) const fn grant_turn(&mut self) {
        self.turn = Turn::Granted;
    }

    fn background_job(&self, now: Instant) -> Option<Job> {
        // What is known of the drive is read anew first, or it would be asked by what another one has said.
        if self.unseen || self.exit_action().is_some() {
            return None;
        }
        if self.explanations > 0 {
            return Some(Job::Faults);
        }
        if let Some(job) = self.checks.job(now, self.settings.control, self.stands()) {
            return Some(job);
        }
        self.question_job().or_else(|| (self.pace.slow_due() <= now).then_some(Job::Measurements))
    }

    fn lifetime(&self, now: Instant, job: Job) -> Lifetime {
        match job {
            // Which drive it is decides whether a stop of before is its own: it is looked for as the stop itself would be given.
            Job::Status { .. } if self.owes_stop_of_before() && self.link != Link::Connected => {
                Lifetime::FOR_A_STOP
            }
            Job::Identify if self.owes_stop_of_before() => Lifetime::FOR_A_STOP,
            Job::Status { .. } => {
                Lifetime { call: Some(self.pace.until_next(now, self.is_busy())), ..Lifetime::default() }
            }
            Job::SetSetpoint(..) | Job::Start(_) | Job::ResetFaults | Job::Release | Job::Persist => {
                self.order_lifetime(now)
            }
            _ => Lifetime::default(),
        }
    }

    /// When something is to be done at the latest.
    fn wake_at(&self, now: Instant) -> Instant {
        let mut at = self.pace.status_due();
        if self.link == Link::Connected {
            at = at.min(self.lost_at());
            at = self.checks.feed_at().into_iter().fold(at, Instant::min);
            if self.turn == Turn::Unwanted && !self.unseen && self.exit_action().is_none() {
                at = at.min(self.pace.slow_due());
                at = self.checks.wake_at().into_iter().fold(at, Instant::min);
            }
        }
        let stop = self.stopping.as_ref().and_then(Stopping::wake_at);
        let order = self.active.as_ref().and_then(Active::wake_at);
        let withdrawal = self.withdrawal.as_ref().and_then(Withdrawal::wake_at).filter(|_| !self.is_unseen());
        stop.into_iter().chain(order).chain(withdrawal).fold(at, Instant::min).max(now)
    }

    fn handle_time(&mut self, now: Instant) {
        if self.link != Link::Lost && now >= self.lost_at() {
            self.lose(now);
        }
        self.checks.hold_back(self.watchdog_wears && self.ledger.is_worn(now).is_some());
        self.check_stop_times(now);
        self.check_order_times(now);
        self.advance_exit(now);
    }

    fn lost_at(&self) -> Instant {
        self.silent_since + self.settings.periods.max_age
    }

    /// The reply to the job in flight.
    pub(crate) fn handle_reply(&mut self, now: Instant, reply: Reply) {
        let job = self.in_flight.take();
        let worn = self.wearing.take().filter(|_| reply.may_have_written());
        self.changed = true;
        if let Some(error) = reply.error() {
            self.last_error = Some(error.clone());
            self.counters.failures += 1;
            // The line has asked it often enough: nobody waits until its status is too old.
            if is_gone(error) && self.link == Link::Connected {
                self.lose(now);
            }
        }
        match reply {
            Reply::Status(result) => {
                let is_seen = result.is_ok() && matches!(job, Some(Job::Status { anew: true }));
                self.handle_status(now, result);
                self.unseen &= !is_seen;
            }
            Reply::Measurements(result) => self.handle_measurements(now, result),
            Reply::Faults(result) => self.handle_faults(now, result),
            Reply::Identity(result) => {
                if let Some(event) = self.checks.handle_identity(now, result) {
                    self.emit_by(event, Cause::Found);
                }
                if self.checks.is_another() {
                    // Whatever turns its motor is not ours.
                    self.withdrawal = None;
                    self.end_writes();
                }
                if self.link == Link::Connected {
                    self.adopt_run(now);
                    // The status that it showed before it was asked.
                    self.judge_stop(now);
                }
            }
            Reply::Watchdog(result) if matches!(job, Some(Job::RestoreWatchdog(_))) => {
                self.handle_restored(result);
            }
            Reply::Watchdog(result) => {
                let armed = matches!(job, Some(Job::ArmWatchdog(..)));
                let control = self.settings.control;
                if let Some(event) = self.checks.handle_watchdog(now, armed, control, result) {
                    let cause = if armed { Cause::policy(Policy::Watchdog) } else { Cause::Found };
                    self.emit_by(event, cause);
                }
                self.tell_watchdog();
            }
            Reply::SelfRestarts(result) => {
                if let Some(event) = self.checks.handle_restarts(now, result) {
                    self.emit_by(event, Cause::Found);
                }
            }
            Reply::Told(told) => self.handle_told(told),
            Reply::Withdrawn(result) => self.handle_withdrawn(now, result),
            Reply::KeptAlive(result) => self.checks.handle_kept_alive(now, result.is_ok()),
            Reply::Stopped(result) => self.handle_stopped(now, result),
            Reply::Setpoint(result) => self.handle_setpoint_reply(now, result),
            Reply::Ordered(result) => self.handle_order_reply(now, result.map(Some)),
            Reply::Saved(result) => {
                if let Ok(saves) = result {
                    self.counters.saves = u64::from(saves);
                }
                self.handle_order_reply(now, result.map(|_| None));
            }
        }
        self.note_eeprom(now, worn);
    }

    /// Its task has panicked: the job in flight has failed by it. Gives whether there is one.
    pub(crate) fn handle_panicked(&mut self, now: Instant, said: String) -> bool {
        self.note_panic(said.clone());
        let Some(job) = self.in_flight else { return false };
        self.handle_reply(now, Reply::failed(job, Error::DriverPanicked(said)));
        true
    }

    /// Its driver has panicked, and goes on being asked.
    pub(crate) fn note_panic(&mut self, said: String) {
        // What it has half read counts for nothing.
        self.doubtful = true;
        if self.panics.len() < PANICS && !self.panics.contains(&said) {
            self.panics.push(said.clone());
            self.emit_by(EventKind::DriverPanicked(said), Cause::Found);
        }
    }

    /// The drive has heard a frame, and answered it. No reply of a job tells that: some take no exchange at all.
    pub(crate) fn handle_heard(&mut self, at: Instant) {
        self.checks.heard(at);
    }

    /// Until when the job in flight goes on although its time is over: the frames of a status, or of what the drive does on its
    /// turn, feed it as well, so it is not cut for a keep-alive while they are answered.
    pub(crate) fn goes_on(&self, now: Instant) -> Option<Instant> {
        let fed_until = self.checks.feed_at()?;
        let until = match self.in_flight? {
            Job::Status { .. } => fed_until,
            _ => fed_until.min(self.turn_ends?),
        };
        (until > now).then_some(until)
    }

    /// When a stop under way becomes an alarm or is over for those who wait for it, whatever is in flight.
    pub(crate) fn stop_alarm_at(&self) -> Option<Instant> {
        self.stopping.as_ref().and_then(Stopping::alarm_at)
    }

    /// [`stop_alarm_at`](Self::stop_alarm_at) has passed.
    pub(crate) fn handle_stop_alarm(&mut self, now: Instant) {
        self.changed = true;
        self.check_stop_times(now);
    }

    /// The run command of this side that stands, as the family keeps it.
    pub(crate) fn handle_lease(&mut self, lease: Option<Lease>) {
        self.changed |= self.lease != lease;
        self.lease = lease;
    }

    /// What is set up otherwise in the drive than its words are taken for, as the family has read it.
    pub(crate) fn handle_unmet(&mut self, unmet: Option<Refusal>) {
        self.changed |= self.unmet != unmet;
        self.unmet = unmet;
        // Of another drive that is told, and no setting.
        let is_known = !matches!(
            self.checks.identity(),
            crate::snapshot::IdentityCheck::Unchecked | crate::snapshot::IdentityCheck::OtherFamily { .. }
        );
        if is_known && self.unmet_told != unmet {
            let before = std::mem::replace(&mut self.unmet_told, unmet);
            if let Some(because) = unmet.or(before) {
                self.emit_shown(
                    EventKind::SetUpOtherwise { because, present: unmet.is_some() },
                    Cause::Found,
                );
            }
        }
    }

    /// What a contract with the drive rests on has changed without this side.
    pub(crate) fn handle_changed(&mut self, now: Instant, ground: Ground) {
        self.checks.changed(now, ground);
        if ground == Ground::Units {
            // What it was counted in, or may be, is not what it was when it was given.
            self.given = None;
        }
        self.emit_shown(EventKind::ContractChanged(ground), Cause::Drive);
    }

    /// The job in flight was dropped: because the machine asked for it, or because its time was over. What it was to write may
    /// have been written.
    pub(crate) fn handle_dropped(&mut self, now: Instant) {
        let Some(job) = self.in_flight.take() else { return };
        if let Job::ArmWatchdog(..) = job {
            self.changed = true;
            self.checks.arming_dropped(now);
        }
        let worn = self.wearing.take();
        self.note_eeprom(now, worn);
    }

    /// What is to be told, in order.
    pub(crate) fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// The snapshot, if anything changed since this was last asked.
    pub(crate) fn take_snapshot(&mut self, now: Instant) -> Option<Snapshot> {
        if !std::mem::take(&mut self.changed) {
            return None;
        }
        let mut snapshot = self.snapshot(now);
        concern::note(&mut self.since, &snapshot.concerns(now), now);
        snapshot.since.clone_from(&self.since);
        Some(snapshot)
    }

    /// What is known now.
    pub(crate) fn snapshot(&self, now: Instant) -> Snapshot {
        Snapshot {
            name: self.name(),
            link: self.link,
            error: self.last_error.clone(),
            status: self.status.clone(),
            retracted: self.retraction.is_open,
            measurements: self.measurements.clone(),
            setpoint: self.given.map(|given| given.setpoint),
            identity: self.checks.identity().clone(),
            watchdog: self.checks.watchdog().clone(),
            self_restarts: self.checks.restarts().cloned(),
            restarts_accepted: self.checks.restarts_accepted(),
            control_taken: self.control_taken,
            run_command_stands: self.withdrawal.as_ref().and_then(Withdrawal::stands).cloned(),
            eeprom_worn: self.ledger.is_worn(now),
            exceeded: self.exceeded.values().copied().collect(),
            unmet: self.unmet,
            off_setpoint: self.off_setpoint.off(),
            since: self.since.clone(),
            stop: self.stopping.as_ref().map(Stopping::pending),
            lease: self.lease,
            suspended: self.suspended.map(|(_, because)| because),
            start_refused: self.start_refused(now),
            trips: Arc::clone(&self.trips),
            counters: self.counters,
            max_age: self.settings.periods.max_age,
            measurements_max_age: self.settings.periods.slow.saturating_add(self.settings.periods.max_age),
        }
    }

    /// Tells what the drive does by itself, as far as this side knows.
    fn emit(&mut self, kind: EventKind) {
        self.emit_by(kind, Cause::Drive);
    }

    fn emit_by(&mut self, kind: EventKind, cause: Cause) {
        self.changed = true;
        self.outputs.push_back(Output::Event(Happened { kind, cause, words: Arc::default() }));
    }

    /// Tells what a status shows, with the words that changed with it.
    fn emit_shown(&mut self, kind: EventKind, cause: Cause) {
        self.changed = true;
        self.outputs.push_back(Output::Event(Happened { kind, cause, words: Arc::clone(&self.words) }));
    }

    /// A job is sent: what changes the motor is remembered with its cause, until it shows.
    fn note_act(&mut self, job: Job) {
        let cause = match job {
            Job::Stop(_) => self.begin_attempt(),
            Job::Withdraw if self.may_withdrawal_stop() => {
                self.withdrawal.as_ref().map(|withdrawal| withdrawal.asker().cause())
            }
            Job::Withdraw => {
                // What the motor does is somebody else's doing already, or that of a stop of here.
                self.acted.take_if(|acted| !matches!(acted.job, Job::Stop(_) | Job::Withdraw));
                return;
            }
            Job::Start(_) | Job::ResetFaults | Job::Release => self.active.as_ref().map(Active::cause),
            _ => return,
        };
        self.acted = cause.map(|cause| Acted { job, cause, is_new: true });
    }

    /// What a job writes to the EEPROM, and why: known while who asks for it stands, for a stop ends what it drops.
    fn wears(&self, job: Job) -> Option<(EepromUse, Cause)> {
        let watchdog = |by, policy| self.watchdog_wears.then(|| (by, Cause::policy(policy)));
        match job {
            Job::ArmWatchdog(..) => watchdog(EepromUse::Watchdog, Policy::Watchdog),
            Job::RestoreWatchdog(_) => watchdog(EepromUse::Restore, self.exits_by),
            Job::Persist => self.active.as_ref().map(|active| (EepromUse::Save, active.cause())),
            Job::Ask(Question::Write(row, _)) if row.storage.may_wear() => {
                self.questions.front().map(|(.., act)| (EepromUse::Parameter, Cause::Command(act.clone())))
            }
            _ => None,
        }
    }

    /// Its EEPROM was written, or may have been.
    fn note_eeprom(&mut self, now: Instant, worn: Option<(EepromUse, Cause)>) {
        let Some((by, cause)) = worn else { return };
        if by == EepromUse::Watchdog {
            self.ledger.kept.in_vain = self.checks.in_vain();
        }
        self.ledger.write(now);
        let ledger = self.ledger.kept.clone();
        self.emit_by(EventKind::EepromWritten { by, ledger }, cause);
    }

    /// Whether the drive's words show that the motor is not driven.
    fn stands(&self) -> bool {
        self.link == Link::Connected && self.status.as_ref().is_some_and(|status| status.value.is_undriven())
    }

    /// Whether the drive's words show that it drives the motor, or brings it down.
    fn turns(&self) -> bool {
        self.status.as_ref().is_some_and(|status| !status.value.is_undriven())
    }

    /// Whether the drive is asked at the faster period.
    fn is_busy(&self) -> bool {
        let moving = self.status.as_ref().is_some_and(|status| !status.value.is_undriven());
        self.link == Link::Connected && (moving || self.active.is_some() || self.stopping.is_some())
    }

    /// What is known of something whose outcome is not.
    fn unknown(&self, now: Instant, error: Option<Error>) -> Outcome {
        let last = self.status.as_ref().map(|status| status.seen(now));
        Outcome::OutcomeUnknown(Unknown { error, last, ..Unknown::default() })
    }
}

/// Whether an error says that the drive cannot be reached at all now.
const fn is_gone(error: &Error) -> bool {
    matches!(
        error,
        Error::Port { problem: PortError::Offline { .. } | PortError::LineDown(_) | PortError::Closed, .. }
    )
}
