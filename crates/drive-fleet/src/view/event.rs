//! What happened to a drive, as programs read it: each kind of event under its own name, with its fields.

use std::sync::Arc;

use drive_core::{Control, Ground, Identity, Lease, Motion, SelfRestart, State, Status, StopMode, Watchdog};
use serde::{Deserialize, Serialize};

use super::{
    CommandedView, ErrorView, ExitView, FindingFigures, OutcomeView, RefusalView, TripView, unix_ms, whole_ms,
};
use crate::{
    cause::{Cause, ChangedWord},
    eeprom::{EepromLedger, EepromUse},
    event::{Event, EventKind},
    exceeded::Limit,
    snapshot::Trip,
    watchdog::WatchdogBefore,
};

/// Something that happened to a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct EventView {
    /// Its place among all events of the fleet.
    pub order: u64,
    /// When, as the wall's clock stood then.
    pub time_unix_ms: u64,
    /// The drive.
    pub drive: Arc<str>,
    /// What.
    #[serde(flatten)]
    pub what: Happened,
    /// Whether somebody should look at it now.
    pub alarm: bool,
    /// The same in a sentence.
    pub text: String,
    /// Why.
    pub cause: Cause,
    /// The words of the drive that changed with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<ChangedWord>,
}

impl From<&Event> for EventView {
    fn from(event: &Event) -> Self {
        Self {
            order: event.order,
            time_unix_ms: unix_ms(event.wall),
            drive: Arc::clone(&event.drive),
            what: Happened::from(&event.kind),
            alarm: event.kind.is_alarm(),
            text: event.kind.to_string(),
            cause: event.cause.clone(),
            words: event.words.to_vec(),
        }
    }
}

/// What happened, by the name of its kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
#[expect(missing_docs, reason = "the fields are those of EventKind")]
pub enum Happened {
    Connected {
        status: Box<Status>,
    },
    Lost {
        silent_for_ms: u64,
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<ErrorView>,
    },
    StateChanged {
        from: State,
        to: State,
    },
    Tripped {
        fault: Box<TripView>,
    },
    TripExplained {
        fault: Box<TripView>,
    },
    FaultChanged {
        fault: Box<TripView>,
    },
    FaultCleared,
    Warning {
        present: bool,
    },
    Limit {
        #[serde(flatten)]
        limit: Limit,
        exceeded: bool,
    },
    ControlTaken {
        control: Control,
    },
    ControlElsewhere {
        control: Control,
    },
    ControlReturned,
    StartTookCommand {
        control: Control,
    },
    RunCommandStands {
        error: ErrorView,
    },
    RestartsItself {
        by: Vec<SelfRestart>,
        accepted: bool,
    },
    Identified {
        identity: Identity,
    },
    IdentityChanged {
        remembered: Identity,
        found: Identity,
    },
    OtherFamily {
        it_is: String,
        found: Identity,
    },
    /// A setting on which its words rest is not as it has to be, or is so again.
    SetUpOtherwise {
        /// What.
        because: RefusalView,
        /// Whether it is so.
        present: bool,
    },
    WatchdogVerified {
        watchdog: Watchdog,
        written: bool,
        #[serde(skip_serializing_if = "Option::is_none")]
        before: Option<WatchdogBefore>,
    },
    WatchdogBroken {
        why: String,
    },
    WatchdogNotInForce {
        why: String,
    },
    WatchdogPutBack {
        watchdog: Watchdog,
    },
    WatchdogStaysArmed {
        timeout_ms: u64,
        why: String,
    },
    EepromWritten {
        by: EepromUse,
        ledger: EepromLedger,
    },
    Command {
        command: CommandedView,
    },
    StopModeReplaced {
        asked: StopMode,
        used: StopMode,
        #[serde(skip_serializing_if = "Option::is_none")]
        why: Option<String>,
    },
    StopTookCommand {
        control: Control,
    },
    StopUnconfirmed {
        since_ms: u64,
        attempts: u32,
        known: OutcomeView,
    },
    StopConfirmed {
        /// The mode by which it was stopped.
        mode: StopMode,
        /// What is known of the shaft.
        motion: Motion,
    },
    /// The output is cut though a run command of this side stands.
    OutputBlocked {
        /// What decides instead.
        because: RefusalView,
    },
    /// Another reference is followed though a run command of this side stands.
    ReferenceTaken {
        /// What decides instead.
        because: RefusalView,
    },
    /// Another command decides instead of the run command of this side.
    CommandOverridden {
        /// What decides instead.
        because: RefusalView,
    },
    /// What a contract with the drive rests on has changed.
    ContractChanged {
        /// What.
        ground: Ground,
    },
    /// Its driver has panicked in a call.
    DriverPanicked {
        /// What it said of that.
        said: String,
    },
    /// Another answer came to the question that the last status has answered.
    ValueWithdrawn,
    /// The line has found something wrong, or does not find it any more.
    LineFinding {
        /// What, by its name.
        defect: String,
        #[serde(flatten)]
        figures: FindingFigures,
        /// Whether it concerns the whole line.
        of_line: bool,
        present: bool,
        /// What to do next, the likeliest first.
        next: Vec<String>,
    },
    /// A run command of an earlier run of the program stands, and is ours again.
    RunAdopted {
        /// The run command.
        lease: Lease,
    },
    /// It is not ours.
    RunNotAdopted {
        /// Why.
        why: String,
    },
    Reconfigured {
        settings: Vec<String>,
    },
    Renamed {
        /// What it was called.
        was: Arc<str>,
    },
    Exit {
        exit: ExitView,
    },
    Removed {
        exit: ExitView,
    },
}

impl From<&EventKind> for Happened {
    fn from(kind: &EventKind) -> Self {
        let trip = |trip: &Trip| Box::new(TripView::from(trip));
        match kind {
            EventKind::Connected(status) => Self::Connected { status: Box::new(Status::clone(status)) },
            EventKind::Lost { silent_for, error } => Self::Lost {
                silent_for_ms: whole_ms(*silent_for),
                error: error.as_ref().map(ErrorView::from),
            },
            EventKind::StateChanged { from, to } => Self::StateChanged { from: *from, to: *to },
            EventKind::Tripped(told) => Self::Tripped { fault: trip(told) },
            EventKind::TripExplained(told) => Self::TripExplained { fault: trip(told) },
            EventKind::FaultChanged(told) => Self::FaultChanged { fault: trip(told) },
            EventKind::FaultCleared => Self::FaultCleared,
            EventKind::Warning { present } => Self::Warning { present: *present },
            EventKind::Limit { limit, exceeded } => Self::Limit { limit: *limit, exceeded: *exceeded },
            EventKind::ControlTaken(control) => Self::ControlTaken { control: *control },
            EventKind::ControlElsewhere(control) => Self::ControlElsewhere { control: *control },
            EventKind::ControlReturned => Self::ControlReturned,
            EventKind::StartTookCommand(control) => Self::StartTookCommand { control: *control },
            EventKind::RunCommandStands(error) => Self::RunCommandStands { error: error.into() },
            EventKind::RestartsItself { by, accepted } => {
                Self::RestartsItself { by: by.to_vec(), accepted: *accepted }
            }
            EventKind::Identified(identity) => Self::Identified { identity: Identity::clone(identity) },
            EventKind::IdentityChanged { remembered, found } => Self::IdentityChanged {
                remembered: Identity::clone(remembered),
                found: Identity::clone(found),
            },
            EventKind::OtherFamily { it_is, found } => {
                Self::OtherFamily { it_is: it_is.to_string(), found: Identity::clone(found) }
            }
            EventKind::SetUpOtherwise { because, present } => {
                Self::SetUpOtherwise { because: because.into(), present: *present }
            }
            EventKind::WatchdogVerified { watchdog, written, before } => Self::WatchdogVerified {
                watchdog: *watchdog,
                written: *written,
                before: before.as_deref().cloned(),
            },
            EventKind::WatchdogBroken(why) => Self::WatchdogBroken { why: why.clone() },
            EventKind::WatchdogNotInForce(why) => Self::WatchdogNotInForce { why: why.clone() },
            EventKind::WatchdogRestored(watchdog) => Self::WatchdogPutBack { watchdog: *watchdog },
            EventKind::WatchdogStays { timeout, why } => {
                Self::WatchdogStaysArmed { timeout_ms: whole_ms(*timeout), why: (*why).to_owned() }
            }
            EventKind::Command { command, setpoint, commander, outcome } => Self::Command {
                command: CommandedView {
                    command: *command,
                    given: *setpoint,
                    commander: Arc::clone(commander),
                    outcome: outcome.into(),
                },
            },
            EventKind::StopModeReplaced { asked, used, why } => {
                Self::StopModeReplaced { asked: *asked, used: *used, why: why.map(str::to_owned) }
            }
            EventKind::StopTookCommand(control) => Self::StopTookCommand { control: *control },
            EventKind::StopUnconfirmed { since, attempts, outcome } => Self::StopUnconfirmed {
                since_ms: whole_ms(*since),
                attempts: *attempts,
                known: outcome.into(),
            },
            EventKind::StopConfirmed { mode, motion } => Self::StopConfirmed { mode: *mode, motion: *motion },
            EventKind::OutputBlocked(because) => Self::OutputBlocked { because: because.into() },
            EventKind::ReferenceTaken(because) => Self::ReferenceTaken { because: because.into() },
            EventKind::CommandOverridden(because) => Self::CommandOverridden { because: because.into() },
            EventKind::ContractChanged(ground) => Self::ContractChanged { ground: *ground },
            EventKind::EepromWritten { by, ledger } => {
                Self::EepromWritten { by: *by, ledger: EepromLedger::clone(ledger) }
            }
            EventKind::DriverPanicked(said) => Self::DriverPanicked { said: said.clone() },
            EventKind::ValueWithdrawn => Self::ValueWithdrawn,
            EventKind::LineFinding { finding, present } => Self::LineFinding {
                defect: finding.defect.name().to_owned(),
                figures: finding.into(),
                of_line: finding.slave.is_none(),
                present: *present,
                next: finding.next().iter().map(|next| (*next).to_owned()).collect(),
            },
            EventKind::RunAdopted(lease) => Self::RunAdopted { lease: *lease },
            EventKind::RunNotAdopted(why) => Self::RunNotAdopted { why: why.clone() },
            EventKind::Reconfigured(settings) => {
                Self::Reconfigured { settings: settings.iter().map(|name| (*name).to_owned()).collect() }
            }
            EventKind::Renamed(old) => Self::Renamed { was: Arc::clone(old) },
            EventKind::Exit(action) => Self::Exit { exit: action.into() },
            EventKind::Removed(action) => Self::Removed { exit: action.into() },
        }
    }
}
