//! What happens to a drive: each kind of event with what belongs to it, its name, and whether it is an alarm.

use std::{borrow::Cow, sync::Arc, time::Duration};

use drive_bus::evidence::Finding;
use drive_core::{
    Command, Control, Error, Ground, Identity, Lease, Motion, Refusal, SelfRestart, Setpoint, State, Status,
    StopMode, Watchdog,
};

use super::ExitAction;
use crate::{
    eeprom::{EepromLedger, EepromUse},
    exceeded::Limit,
    outcome::Outcome,
    snapshot::Trip,
    watchdog::WatchdogBefore,
};

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum EventKind {
    /// It answers, for the first time or again; its state is adopted.
    Connected(Arc<Status>),
    /// It does not answer any more.
    Lost {
        /// How long ago its last valid status is.
        silent_for: Duration,
        /// The last error; `None` when its statuses only came too late.
        error: Option<Error>,
    },
    /// Its state changed.
    StateChanged {
        /// Before.
        from: State,
        /// Now.
        to: State,
    },
    /// It tripped.
    Tripped(Box<Trip>),
    /// What the drive says about its last trip was read.
    TripExplained(Box<Trip>),
    /// While it is tripped it names another fault than before: the one of this, by which it cannot go on either.
    FaultChanged(Box<Trip>),
    /// It shows no fault any more.
    FaultCleared,
    /// An alarm that does not trip came or went.
    Warning {
        /// Whether it is present.
        present: bool,
    },
    /// A measured value went above its limit or came back.
    Limit {
        /// The value and its limit.
        limit: Limit,
        /// Whether it is above.
        exceeded: bool,
    },
    /// Panel, terminals or another bus have control now.
    ControlTaken(Control),
    /// Somebody else has control, who has not taken it: it was found so when the drive was seen again, or it was given back.
    ControlElsewhere(Control),
    /// This bus has control again.
    ControlReturned,
    /// Somebody else had control until a start of this side took it, which is how some drives are commanded.
    StartTookCommand(Control),
    /// **Alarm**: somebody else has control, and the run command of this side still stands in the drive. When control is
    /// given back it may start the motor.
    RunCommandStands(Error),
    /// Settings of the drive start its motor again by themselves.
    RestartsItself {
        /// Which.
        by: Arc<[SelfRestart]>,
        /// Whether the settings of this fleet accept all of them.
        accepted: bool,
    },
    /// It said what it is for the first time, or again what is remembered.
    Identified(Arc<Identity>),
    /// It says that it is another drive than before. Motion is refused.
    IdentityChanged {
        /// What is remembered.
        remembered: Arc<Identity>,
        /// What it says now.
        found: Arc<Identity>,
    },
    /// **Alarm**: it says that it is none of the family that it is configured as. It is read, and stopped when that is asked for;
    /// nothing else is written to it.
    OtherFamily {
        /// What it is, and which family fits.
        it_is: Cow<'static, str>,
        /// What it says.
        found: Arc<Identity>,
    },
    /// **Alarm** while it is so: a setting on which its words rest is not as it has to be, or is so again.
    SetUpOtherwise {
        /// What, as a start is refused for it.
        because: Refusal,
        /// Whether it is so; `false`: not any more.
        present: bool,
    },
    /// Its communication watchdog is as the contract says; whether it had to be written for that.
    WatchdogVerified {
        /// As it is.
        watchdog: Watchdog,
        /// Whether it was written.
        written: bool,
        /// What the exit would put back; `None`: nothing, or the drive does not say which it is.
        before: Option<Arc<WatchdogBefore>>,
    },
    /// Its communication watchdog is not as the contract says.
    WatchdogBroken(String),
    /// **Alarm**: its motor turns, and its communication watchdog is not as the contract says. It is set up at standstill.
    WatchdogNotInForce(String),
    /// At the shut-down its communication watchdog was put back to what was found.
    WatchdogRestored(Watchdog),
    /// At the shut-down its communication watchdog stays armed: it acts as soon as nobody speaks to the drive.
    WatchdogStays {
        /// After how long.
        timeout: Duration,
        /// Why it was not put back.
        why: &'static str,
    },
    /// Its EEPROM was written, or may have been: **an alarm** where that is more often than it lasts
    /// ([`EEPROM_WRITES_A_DAY`](crate::EEPROM_WRITES_A_DAY)).
    EepromWritten {
        /// By what.
        by: EepromUse,
        /// What is known of its writes now.
        ledger: EepromLedger,
    },
    /// A command ended.
    Command {
        /// Which.
        command: Command,
        /// The setpoint that a start was given with.
        setpoint: Option<Setpoint>,
        /// By whom.
        commander: Arc<str>,
        /// How.
        outcome: Outcome,
    },
    /// It cannot stop by the mode that was asked for and is stopped by another.
    StopModeReplaced {
        /// What was asked for.
        asked: StopMode,
        /// What is done.
        used: StopMode,
        /// Why, where the drive or its driver tells.
        why: Option<&'static str>,
    },
    /// The drive was commanded by somebody else until a stop took the command from him. It is kept until it is released.
    StopTookCommand(Control),
    /// **Alarm**: a stop cannot be confirmed. It is repeated.
    StopUnconfirmed {
        /// Since when, as a duration.
        since: Duration,
        /// In how many attempts it was sent, or may have been: see [`PendingStop`](crate::PendingStop).
        attempts: u32,
        /// What is known of it.
        outcome: Outcome,
    },
    /// A stop is confirmed: the drive shows standstill.
    StopConfirmed {
        /// The mode by which it was stopped.
        mode: StopMode,
        /// What is known of the shaft: at rest, held there, or without an output and perhaps coasting.
        motion: Motion,
    },
    /// **Alarm**: the output is cut, braked or held though a run command of this side stands in the drive. It may start the motor
    /// when what cuts it goes away, so that it is withdrawn unless the settings accept that.
    OutputBlocked(Refusal),
    /// **Alarm**: the motor follows another reference than that of the bus though a run command of this side stands. It is
    /// withdrawn unless the settings accept that.
    ReferenceTaken(Refusal),
    /// **Alarm**: another command took the place of the run command of this side, or decides instead of it.
    CommandOverridden(Refusal),
    /// What a contract with the drive rests on has changed without this side: it is looked at anew.
    ContractChanged(Ground),
    /// **Alarm**: its driver has panicked in a call, which is a fault of the program: what it said of that. That call has failed; the drive is asked
    /// and stopped as ever. Told once of each that says something else, until the drive is found anew.
    DriverPanicked(String),
    /// A second, different answer came to the question that its last status has answered: what that showed counts for nothing.
    ValueWithdrawn,
    /// The line has found something wrong by what it has heard, or does not find it any more. What concerns no single slave is told
    /// of the first drive of the line.
    LineFinding {
        /// What, with its share of the traffic and what to do next.
        finding: Finding,
        /// Whether it is found; `false`: not any more.
        present: bool,
    },
    /// The run command of an earlier run of this program stands in the drive: it is ours again.
    RunAdopted(Lease),
    /// There is a record of a run command, or of a stop, of an earlier run of this program, and it does not stand or is not of this
    /// drive: why.
    RunNotAdopted(String),
    /// Other settings hold from now on: these.
    Reconfigured(Vec<&'static str>),
    /// It is called otherwise from now on, and is the same drive: what it was called.
    Renamed(Arc<str>),
    /// What was done to it when the fleet shut down.
    Exit(ExitAction),
    /// What was done to it when it was taken out of the fleet, such as by a reload. What has the same name afterwards is
    /// another drive, or the same under other settings.
    Removed(ExitAction),
}

impl EventKind {
    /// Its name, as logs and JSON lines have it.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Connected(_) => "connected",
            Self::Lost { .. } => "lost",
            Self::StateChanged { .. } => "state changed",
            Self::Tripped(_) => "tripped",
            Self::TripExplained(_) => "trip explained",
            Self::FaultChanged(_) => "fault changed",
            Self::FaultCleared => "fault cleared",
            Self::Warning { .. } => "warning",
            Self::Limit { .. } => "limit",
            Self::ControlTaken(_) => "control taken",
            Self::ControlElsewhere(_) => "control elsewhere",
            Self::ControlReturned => "control returned",
            Self::StartTookCommand(_) => "start took command",
            Self::RunCommandStands(_) => "run command stands",
            Self::RestartsItself { .. } => "restarts itself",
            Self::Identified(_) => "identified",
            Self::IdentityChanged { .. } => "identity changed",
            Self::OtherFamily { .. } => "other family",
            Self::SetUpOtherwise { .. } => "set up otherwise",
            Self::WatchdogVerified { .. } => "watchdog verified",
            Self::WatchdogBroken(_) => "watchdog broken",
            Self::WatchdogNotInForce(_) => "watchdog not in force",
            Self::WatchdogRestored(_) => "watchdog put back",
            Self::WatchdogStays { .. } => "watchdog stays armed",
            Self::EepromWritten { .. } => "eeprom written",
            Self::Command { .. } => "command",
            Self::StopModeReplaced { .. } => "stop mode replaced",
            Self::StopTookCommand(_) => "stop took command",
            Self::StopUnconfirmed { .. } => "stop unconfirmed",
            Self::StopConfirmed { .. } => "stop confirmed",
            Self::OutputBlocked(_) => "output blocked",
            Self::ReferenceTaken(_) => "reference taken",
            Self::CommandOverridden(_) => "command overridden",
            Self::ContractChanged(_) => "contract changed",
            Self::DriverPanicked(_) => "driver panicked",
            Self::ValueWithdrawn => "value withdrawn",
            Self::LineFinding { .. } => "line finding",
            Self::RunAdopted(_) => "run adopted",
            Self::RunNotAdopted(_) => "run not adopted",
            Self::Reconfigured(_) => "reconfigured",
            Self::Renamed(_) => "renamed",
            Self::Exit(_) => "exit",
            Self::Removed(_) => "removed",
        }
    }

    /// Whether somebody should look at it now.
    #[must_use]
    pub const fn is_alarm(&self) -> bool {
        match self {
            Self::Exit(action) | Self::Removed(action) => action.is_alarm(),
            Self::EepromWritten { ledger, .. } => ledger.is_worn(),
            other => other.is_always_alarm(),
        }
    }

    const fn is_always_alarm(&self) -> bool {
        matches!(
            self,
            Self::Lost { .. }
                | Self::Tripped(_)
                | Self::IdentityChanged { .. }
                | Self::OtherFamily { .. }
                | Self::SetUpOtherwise { present: true, .. }
                | Self::WatchdogBroken(_)
                | Self::WatchdogNotInForce(_)
                | Self::StopUnconfirmed { .. }
                | Self::RunCommandStands(_)
                | Self::DriverPanicked(_)
                | Self::OutputBlocked(_)
                | Self::ReferenceTaken(_)
                | Self::CommandOverridden(_)
                | Self::RestartsItself { accepted: false, .. }
                | Self::Limit { exceeded: true, .. }
                | Self::Warning { present: true }
        )
    }
}
