//! What the machine has done and what comes back.

use std::time::Duration;

use drive_core::{
    Direction, Error, ErrorKind, Faults, Identity, Measurements, Reaction, Recognised, Result, SelfRestart,
    Setpoint, Status, StopMode, Stopped, Watchdog, Withdrawn,
};
use tokio::time::Instant;

use super::{
    expiry::Lifetime,
    questions::{Question, Told},
};

/// What to do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// Talk to the drive.
    Do {
        job: Job,
        /// Whether it is done on the drive's turn.
        on_turn: bool,
        /// How long its calls may wait until they are sent.
        lifetime: Lifetime,
        /// When to drop it, because something else must not wait for it.
        until: Option<Instant>,
    },
    /// Wait for an order or this time.
    Wait(Instant),
    /// The exit is done.
    Finished,
}

/// Whether a drive has its turn at what the drives of a line do one after the other: what takes many exchanges of the
/// lowest class. If all did it at once none would be done in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Turn {
    /// It wants none.
    Unwanted,
    /// It waits for it.
    Wanted,
    /// It has it.
    Granted,
}

/// One call of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Job {
    Stop(StopMode),
    Withdraw,
    Start(Direction),
    /// With the direction of the start to which it belongs: where that start would be refused, it is not given.
    SetSetpoint(Setpoint, Option<Direction>),
    ResetFaults,
    Release,
    Persist,
    ArmWatchdog(Duration, Reaction),
    RestoreWatchdog(Watchdog),
    KeepAlive,
    Status {
        /// Whether what was read once is to be forgotten first.
        anew: bool,
    },
    Identify,
    Watchdog,
    SelfRestarts,
    Faults,
    Measurements,
    /// What somebody asks.
    Ask(Question),
}

impl Job {
    /// The number of a long reading that goes on where it was cut.
    pub(crate) const fn keeps(self) -> Option<u8> {
        match self {
            Self::Measurements => Some(1),
            Self::Faults | Self::Ask(Question::Faults) => Some(2),
            Self::SelfRestarts => Some(3),
            Self::Identify => Some(4),
            _ => None,
        }
    }

    /// Whether it only reads, and gives way to an order.
    pub(crate) const fn is_poll(self) -> bool {
        matches!(
            self,
            Self::KeepAlive
                | Self::Status { .. }
                | Self::Identify
                | Self::Watchdog
                | Self::SelfRestarts
                | Self::Faults
                | Self::Measurements
                | Self::Ask(Question::Faults | Question::Read(_))
        )
    }
}

/// What a call of the drive gave.
#[derive(Debug)]
pub(crate) enum Reply {
    Stopped(Result<Stopped>),
    Withdrawn(Result<Withdrawn>),
    /// Of a start, a reset or a release.
    Ordered(Result<Status>),
    Setpoint(Result<()>),
    Saved(Result<u32>),
    KeptAlive(Result<()>),
    Status(Result<Status>),
    Identity(Result<(Identity, Recognised)>),
    Watchdog(Result<Watchdog>),
    SelfRestarts(Result<Vec<SelfRestart>>),
    Faults(Result<Faults>),
    Measurements(Result<Measurements>),
    Told(Result<Told>),
}

impl Reply {
    /// What a job gives that has failed by this.
    pub(crate) fn failed(job: Job, error: Error) -> Self {
        match job {
            Job::Stop(_) => Self::Stopped(Err(error)),
            Job::Withdraw => Self::Withdrawn(Err(error)),
            Job::Start(_) | Job::ResetFaults | Job::Release => Self::Ordered(Err(error)),
            Job::SetSetpoint(..) => Self::Setpoint(Err(error)),
            Job::Persist => Self::Saved(Err(error)),
            Job::ArmWatchdog(..) | Job::RestoreWatchdog(_) | Job::Watchdog => Self::Watchdog(Err(error)),
            Job::KeepAlive => Self::KeptAlive(Err(error)),
            Job::Status { .. } => Self::Status(Err(error)),
            Job::Identify => Self::Identity(Err(error)),
            Job::SelfRestarts => Self::SelfRestarts(Err(error)),
            Job::Faults => Self::Faults(Err(error)),
            Job::Measurements => Self::Measurements(Err(error)),
            Job::Ask(_) => Self::Told(Err(error)),
        }
    }

    /// The error, if it is one that tells of the line, the drive or its driver, and not of what the family has.
    pub(crate) fn error(&self) -> Option<&Error> {
        let error = match self {
            Self::Stopped(result) => result.as_ref().err(),
            Self::Withdrawn(result) => result.as_ref().err(),
            Self::Ordered(result) | Self::Status(result) => result.as_ref().err(),
            Self::Setpoint(result) | Self::KeptAlive(result) => result.as_ref().err(),
            Self::Saved(result) => result.as_ref().err(),
            Self::Identity(result) => result.as_ref().err(),
            Self::Watchdog(result) => result.as_ref().err(),
            Self::SelfRestarts(result) => result.as_ref().err(),
            Self::Faults(result) => result.as_ref().err(),
            Self::Measurements(result) => result.as_ref().err(),
            Self::Told(told) => told.as_ref().err(),
        };
        error.filter(|error| {
            matches!(
                error,
                Error::Port { .. }
                    | Error::Exception { .. }
                    | Error::Answer { .. }
                    | Error::DriverPanicked(_)
            )
        })
    }

    /// Whether what may wear an EEPROM was written, or may have been.
    pub(crate) fn may_have_written(&self) -> bool {
        let error = match self {
            Self::Told(Ok(Told::Written(written))) => return written.changed,
            Self::Saved(result) => result.as_ref().err(),
            Self::Watchdog(result) => result.as_ref().err(),
            Self::Told(told) => told.as_ref().err(),
            _ => return false,
        };
        error.is_none_or(|error| matches!(error.kind(), ErrorKind::OutcomeUnknown | ErrorKind::NotConfirmed))
    }
}
