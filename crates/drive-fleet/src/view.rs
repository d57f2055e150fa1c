//! What a fleet knows, as programs write it **and read it back**: the objects of [`Snapshot`], [`Event`], [`Outcome`] and
//! [`Trip`]. Each is what the type of its name is written as. A sentence stands beside the fields that it is made of, never
//! instead of them.
//!
//! ```
//! use drive_fleet::{Cause, Event, EventKind, view::{EventView, Happened}};
//! use drive_core::State;
//!
//! let kind = EventKind::StateChanged { from: State::Ready, to: State::Running };
//! let told = serde_json::to_string(&Event::now("pump 1", kind, Cause::Drive))?;
//! let read: EventView = serde_json::from_str(&told)?;
//! assert_eq!(read.what, Happened::StateChanged { from: State::Ready, to: State::Running });
//! # Ok::<_, serde_json::Error>(())
//! ```

mod finding;

use std::{
    sync::Arc,
    time::{Duration, SystemTime},
};

use drive_core::{
    Command, Control, Error, ErrorKind, Fault, Ground, Identity, Lease, Measurements, Motion, Refusal,
    SelfRestart, Setpoint, State, Status, StopMode, Watchdog,
};
use serde::{Deserialize, Serialize, Serializer};
use tokio::time::Instant;

use crate::{
    cause::{Cause, ChangedWord},
    concern::{Concern, ConcernKind, Severity},
    eeprom::{EepromLedger, EepromUse},
    event::{Event, EventKind, ExitAction},
    exceeded::Limit,
    outcome::{Became, LastSeen, Outcome, Refused, Started, StopModes, Unconfirmed},
    shows::Shows,
    snapshot::{Counters, Freshness, IdentityCheck, Link, PendingStop, Snapshot, Trip, WatchdogCheck},
    watchdog::WatchdogBefore,
};

pub use self::finding::FindingFigures;

/// What is known of a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SnapshotView {
    /// Its name.
    pub name: Arc<str>,
    /// What it does, in the one word with which its row begins.
    #[serde(default)]
    pub shows: Shows,
    /// Whether it answers.
    pub link: Link,
    /// What went wrong last since its last status.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The fast set.
    pub status: Judged<Status>,
    /// The slow set.
    pub measurements: Judged<Measurements>,
    /// The setpoint that it was given last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setpoint: Option<Setpoint>,
    /// Whether its output has reached it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<bool>,
    /// The trip that it shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<TripView>,
    /// A stop that is not confirmed yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<PendingStop>,
    /// Whether this fleet started the motor.
    pub started_here: bool,
    /// Why a start would be refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_refused: Option<String>,
    /// The settings by which it starts its motor again by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts_by_itself: Option<Vec<String>>,
    /// Which drive it is.
    pub identity: IdentityCheck,
    /// Its communication watchdog.
    pub watchdog: WatchdogCheck,
    /// All that troubles it, the worst first.
    #[serde(default)]
    pub concerns: Vec<ConcernView>,
    /// Counters.
    pub counters: Counters,
}

impl SnapshotView {
    /// The worst that troubles it.
    #[must_use]
    pub fn concern(&self) -> Option<&ConcernView> {
        self.concerns.first()
    }

    /// Its place among all by what troubles it: 0 is the worst, and who troubles nobody comes last.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.concern().map_or(usize::MAX, |concern| concern.rank)
    }

    /// What is known of it at `now`.
    #[must_use]
    pub fn of(snapshot: &Snapshot, now: Instant) -> Self {
        let restarts = snapshot.self_restarts.as_ref();
        Self {
            name: Arc::clone(&snapshot.name),
            shows: snapshot.shows(),
            link: snapshot.link,
            error: snapshot.error.as_ref().map(ToString::to_string),
            status: Judged {
                quality: snapshot.freshness(now),
                value: snapshot.status.as_ref().map(|status| Status::clone(&status.value)),
            },
            measurements: Judged {
                quality: snapshot.measurements_freshness(now),
                value: snapshot.measurements.as_ref().map(|measured| Measurements::clone(&measured.value)),
            },
            setpoint: snapshot.setpoint,
            reached: snapshot.has_reached_setpoint(now),
            fault: snapshot.present_trip().map(TripView::from),
            stop: snapshot.stop,
            started_here: snapshot.started_here(),
            start_refused: snapshot.start_refused(now).map(ToString::to_string),
            starts_by_itself: restarts.map(|all| all.iter().map(|one| one.code.to_owned()).collect()),
            identity: snapshot.identity.clone(),
            watchdog: snapshot.watchdog.clone(),
            concerns: snapshot.concerns(now).iter().map(|concern| ConcernView::of(concern, now)).collect(),
            counters: snapshot.counters,
        }
    }
}

impl From<&Snapshot> for SnapshotView {
    fn from(snapshot: &Snapshot) -> Self {
        Self::of(snapshot, Instant::now())
    }
}

/// Why something is not so, as programs read it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RefusalView {
    /// In one word.
    pub reason: String,
    /// In a sentence.
    pub text: String,
}

impl From<&Refusal> for RefusalView {
    fn from(refusal: &Refusal) -> Self {
        Self { reason: refusal.word().to_owned(), text: refusal.to_string() }
    }
}

/// A value beside the verdict on its age.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Judged<T> {
    /// The verdict.
    pub quality: Freshness,
    /// The value.
    #[serde(flatten)]
    pub value: Option<T>,
}

impl<T> Judged<T> {
    /// Whether the value is so now.
    #[must_use]
    pub const fn is_good(&self) -> bool {
        matches!(self.quality, Freshness::Fresh)
    }
}

/// Something that troubles a drive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ConcernView {
    /// What.
    pub kind: ConcernKind,
    /// Its place among all kinds: 0 is the worst.
    pub rank: usize,
    /// How badly.
    pub severity: Severity,
    /// Whether somebody is woken for it.
    pub wakes: bool,
    /// For how long, by the clock of whoever told it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since_ms: Option<u64>,
    /// It in a sentence.
    pub text: String,
    /// The part of the sentence that is of this drive, behind the words of the kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
    /// What to do first.
    pub remedy: String,
}

impl ConcernView {
    /// What troubles a drive at `now`.
    #[must_use]
    pub fn of(concern: &Concern, now: Instant) -> Self {
        let kind = concern.kind;
        Self {
            kind,
            rank: kind.rank(),
            severity: kind.severity(),
            wakes: kind.wakes(),
            since_ms: concern.lasts(now).map(whole_ms),
            text: concern.to_string(),
            detail: concern.detail.clone(),
            remedy: kind.remedy().to_owned(),
        }
    }
}

/// A trip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct TripView {
    /// What it tripped by; absent while the drive has not said.
    #[serde(flatten)]
    pub fault: Option<Fault>,
    /// Whether by its communication watchdog, as its own code says.
    pub by_watchdog: bool,
    /// How long it had not been heard then, where that is longer than its watchdog waits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watchdog_after_ms: Option<u64>,
    /// Whether it was found so: it tripped at some time before.
    #[serde(default)]
    pub found: bool,
    /// When it was seen, by the wall's clock.
    pub time_unix_ms: u64,
    /// The last status before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<Status>,
    /// The first that shows it.
    pub at_trip: Status,
}

impl From<&Trip> for TripView {
    fn from(trip: &Trip) -> Self {
        Self {
            fault: trip.fault(),
            by_watchdog: trip.by_watchdog,
            watchdog_after_ms: trip.watchdog_after.map(whole_ms),
            found: trip.found,
            time_unix_ms: unix_ms(trip.wall),
            before: trip.before.as_ref().map(|before| Status::clone(&before.value)),
            at_trip: Status::clone(&trip.status.value),
        }
    }
}

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

/// A command that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct CommandedView {
    /// Which.
    #[serde(flatten)]
    pub command: Command,
    /// The setpoint that a start was given with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub given: Option<Setpoint>,
    /// By whom.
    pub commander: Arc<str>,
    /// How.
    #[serde(flatten)]
    pub outcome: OutcomeView,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OutcomeView {
    /// In one word.
    pub outcome: Became,
    /// Why, in one word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Why, in a sentence; of a start that is in force, at what.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// What went wrong, where something did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorView>,
    /// Of a start that is in force: which way, and the setpoint that it uses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started: Option<Started>,
    /// Of a stop: how it was asked for, and how the drive stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<StopModesView>,
    /// What the drive said last, where that matters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<Box<SeenView>>,
}

impl From<&Outcome> for OutcomeView {
    fn from(outcome: &Outcome) -> Self {
        let (error, last) = match outcome {
            Outcome::NotConfirmed(Unconfirmed::Denied(error) | Unconfirmed::StopDenied { error, .. })
            | Outcome::Refused(Refused::Drive(error)) => (Some(error), None),
            Outcome::NotConfirmed(
                Unconfirmed::TimeOver { last, .. } | Unconfirmed::NotStarted { last, .. },
            ) => (None, last.as_ref()),
            Outcome::OutcomeUnknown(unknown) => (unknown.error.as_ref(), unknown.last.as_ref()),
            _ => (None, None),
        };
        Self {
            outcome: outcome.became(),
            reason: outcome.reason().map(str::to_owned),
            text: outcome.text(),
            error: error.map(ErrorView::from),
            started: outcome.started(),
            stop: outcome.stop().map(StopModesView::from),
            last: last.map(|last| Box::new(SeenView::from(last))),
        }
    }
}

/// How a stop was asked for, and how the drive stops.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StopModesView {
    /// The mode that was asked for.
    pub asked: StopMode,
    /// The mode by which the drive stops; absent while it has shown none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub used: Option<StopMode>,
    /// Why it is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// For how long direct current was to be held, in milliseconds, where somebody has said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub injection_asked_ms: Option<u64>,
    /// For how long it is held, in milliseconds, where it is injected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub injection_used_ms: Option<u64>,
}

impl From<StopModes> for StopModesView {
    fn from(stop: StopModes) -> Self {
        Self {
            asked: stop.asked,
            used: stop.used,
            why: stop.why.map(str::to_owned),
            injection_asked_ms: stop.injection_asked.map(whole_ms),
            injection_used_ms: stop.injection_used.map(whole_ms),
        }
    }
}

/// A status that may be old.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SeenView {
    /// How old it was then.
    pub seen_before_ms: u64,
    /// What it said.
    #[serde(flatten)]
    pub status: Status,
}

impl From<&LastSeen> for SeenView {
    fn from(seen: &LastSeen) -> Self {
        Self {
            seen_before_ms: whole_ms(seen.age),
            status: Status { at: None, ..Status::clone(&seen.status) },
        }
    }
}

/// What went wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ErrorView {
    /// Of which kind.
    pub kind: ErrorKind,
    /// The slave, the register and the reason, in a sentence.
    pub text: String,
}

impl From<&Error> for ErrorView {
    fn from(error: &Error) -> Self {
        Self { kind: error.kind(), text: error.to_string() }
    }
}

/// What was done to a drive when it ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExitView {
    /// In one word.
    pub action: Ended,
    /// How a stop or a release ended.
    #[serde(flatten)]
    pub outcome: Option<OutcomeView>,
}

/// What was done to a drive when it ended, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
#[expect(missing_docs, reason = "they are those of ExitAction")]
pub enum Ended {
    Left,
    LeftTurning,
    Stopped,
    Released,
    TimeOver,
}

impl From<&ExitAction> for ExitView {
    fn from(action: &ExitAction) -> Self {
        let (action, outcome) = match action {
            ExitAction::Left => (Ended::Left, None),
            ExitAction::LeftTurning => (Ended::LeftTurning, None),
            ExitAction::Stopped(outcome) => (Ended::Stopped, Some(outcome)),
            ExitAction::Released(outcome) => (Ended::Released, Some(outcome)),
            ExitAction::TimeOver => (Ended::TimeOver, None),
        };
        Self { action, outcome: outcome.map(OutcomeView::from) }
    }
}

/// What became of a drive of a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OfDrive {
    /// The drive.
    pub drive: Arc<str>,
    /// What became of it.
    #[serde(flatten)]
    pub outcome: OutcomeView,
}

pub(crate) fn by_drive<S: Serializer>(
    outcomes: &[(Arc<str>, Outcome)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let told = |(drive, outcome): &(Arc<str>, Outcome)| OfDrive {
        drive: Arc::clone(drive),
        outcome: outcome.into(),
    };
    serializer.collect_seq(outcomes.iter().map(told))
}

/// Writes a type as its object.
macro_rules! written_as {
    ($($type:ident as $object:ty;)*) => {
        $(
            impl Serialize for $type {
                fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    <$object>::from(self).serialize(serializer)
                }
            }

            #[cfg(feature = "schemars")]
            impl schemars::JsonSchema for $type {
                fn schema_name() -> std::borrow::Cow<'static, str> {
                    stringify!($type).into()
                }

                fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                    <$object>::json_schema(generator)
                }
            }
        )*
    };
}

written_as! {
    Snapshot as SnapshotView;
    Trip as TripView;
    Event as EventView;
    Outcome as OutcomeView;
    ExitAction as ExitView;
}

fn unix_ms(at: SystemTime) -> u64 {
    whole_ms(at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default())
}

fn whole_ms(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
