//! The supervisor of one drive: a pure machine. Time is an argument, it does no input or output.
//!
//! In: [`handle_order`](Supervisor::handle_order), [`handle_stop`](Supervisor::handle_stop),
//! [`handle_exit`](Supervisor::handle_exit), [`handle_reply`](Supervisor::handle_reply). Out:
//! [`next`](Supervisor::next) says what to do now, [`poll_output`](Supervisor::poll_output) what to tell whom,
//! [`snapshot`](Supervisor::snapshot) what is known.

mod acted;
mod adoption;
mod asker;
pub(crate) mod checks;
mod due;
mod eeprom;
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
mod ran;
mod replies;
mod retraction;
mod shown;
mod stopping;
mod telling;
mod verdict;
mod withdraw;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use drive_core::{Control, Error, Lack, Lease, Measurements, Refusal, Status, WatchdogCapability};
use tokio::time::Instant;

use self::{
    acted::Acted,
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
use crate::{
    cause::{Cause, ChangedWord, Policy},
    concern::ConcernKind,
    eeprom::{EepromUse, Ledger},
    event::EventKind,
    exceeded::Limit,
    limits::Given,
    outcome::{Order, Outcome, Unknown},
    settings::DriveSettings,
    snapshot::{Counters, Link, Timed, Trip},
};

pub(crate) use self::{
    asker::{Asker, CallId},
    expiry::{Expiry, Lifetime},
    job::{Job, Reply, Step, Turn},
    permission::Leave,
    questions::{Question, Told},
    telling::Output,
};

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
    /// When the last start was asked for.
    start_asked_at: Option<Instant>,
    /// The setpoint before the one that is sent was dropped for it.
    setpoint_dropped: bool,
    /// That setpoint, until something later is sent, or is not: only then it is known what to tell of it.
    dropped_for_later: Option<(Asker, Order)>,
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
            start_asked_at: None,
            setpoint_dropped: false,
            dropped_for_later: None,
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

    /// Other settings hold from now on. The motor, the orders and the stops under way go on, but a start that they refuse, as long as its motor
    /// is at rest. Gives whether the job in flight has to be dropped.
    pub(crate) fn handle_settings(&mut self, now: Instant, settings: &DriveSettings) -> bool {
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
        if self.link == Link::Connected {
            self.adopt_run(now);
        }
        self.check_limits();
        self.changed = true;
        self.end_forbidden_start(now)
    }

    /// The drive's name.
    pub(crate) fn name(&self) -> Arc<str> {
        Arc::clone(&self.name)
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

#[cfg(test)]
mod tests;
