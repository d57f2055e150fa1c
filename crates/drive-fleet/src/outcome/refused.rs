//! Why a command is refused: nothing moved because of it.

use std::{borrow::Cow, fmt, sync::Arc};

use drive_core::{Error, Identity, Refusal};

use crate::limits::LimitProblem;

/// Why a command is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refused {
    /// The drive is configured to be only read.
    ReadOnly,
    /// The commander is not among those who may command this drive.
    Commander(String),
    /// The drive has not been seen yet, or is lost.
    NotConnected,
    /// Its last status is too old, and no fresh one came in time.
    Stale,
    /// The drive as it is does not allow it, as seen here or by its driver.
    Because(Refusal),
    /// It says that it is another drive than before; accept that first.
    IdentityChanged,
    /// It is none of those that were to be accepted: what it says that it is; `None`: nothing.
    NotTheShown(Option<Arc<Identity>>),
    /// It says that it is of another family than it is configured as: what it is, and which family fits.
    OtherFamily(Cow<'static, str>),
    /// What it is could not be checked in time since it was connected.
    IdentityUnchecked,
    /// Its communication watchdog is not as the contract says.
    WatchdogUnverified,
    /// A stop of it is not confirmed yet.
    StopPending,
    /// A stop came before it was sent.
    Stopped,
    /// A later command took its place before it was sent.
    Superseded,
    /// Its ticket was dropped before it was sent.
    Withdrawn,
    /// The limits of this fleet forbid the setpoint.
    Limit(LimitProblem),
    /// The drive refused it, or its driver for another reason than the drive's state.
    Drive(Error),
    /// Too many commands for this drive wait.
    QueueFull,
    /// The drive was removed from the fleet, or is about to be, and the fleet goes on.
    Removed,
    /// The fleet has shut down.
    ShutDown,
}

impl Refused {
    /// Its word for programs.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::ReadOnly => "read_only",
            Self::Commander(_) => "no_right",
            Self::NotConnected => "offline",
            Self::Stale => "stale",
            Self::Because(reason) => reason.word(),
            Self::IdentityChanged | Self::IdentityUnchecked | Self::OtherFamily(_) => "identity",
            Self::NotTheShown(_) => "not_as_shown",
            Self::WatchdogUnverified => "watchdog",
            Self::StopPending => "stop_pending",
            Self::Stopped => "stop",
            Self::Superseded => "later_command",
            Self::Withdrawn => "withdrawn",
            Self::Limit(LimitProblem::Forbidden { .. }) => "forbidden_band",
            Self::Limit(_) | Self::Drive(Error::Setpoint { .. }) => "limit",
            Self::Drive(Error::Unsupported { .. }) => "unsupported",
            // The drive has said nothing: that is no refusal of what was asked.
            Self::Drive(Error::Port { .. }) => "no_answer",
            Self::Drive(_) => "drive",
            Self::QueueFull => "queue_full",
            Self::Removed => "removed",
            Self::ShutDown => "shut_down",
        }
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        match error {
            Error::Refused { reason, .. } => Self::Because(reason),
            error => Self::Drive(error),
        }
    }
}

impl std::error::Error for Refused {}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadOnly => f.write_str("the drive is only read: its settings say control = false"),
            Self::Commander(name) => write!(f, "{name:?} may not command this drive"),
            Self::NotConnected => f.write_str("the drive does not answer"),
            Self::Stale => f.write_str("its status is too old"),
            Self::Because(reason) => reason.fmt(f),
            Self::IdentityChanged => {
                f.write_str("it is another drive than before: accept its identity first")
            }
            Self::NotTheShown(Some(now)) => write!(f, "it is not the drive that was shown: it is {now} now"),
            Self::NotTheShown(None) => {
                f.write_str("it does not say which drive it is: there is nothing to accept")
            }
            Self::OtherFamily(it_is) => write!(f, "it is none of the family that it is set up as: {it_is}"),
            Self::IdentityUnchecked => f.write_str("it has not been possible to check which drive it is"),
            Self::WatchdogUnverified => f.write_str("its communication watchdog is not verified"),
            Self::StopPending => f.write_str("a stop of it is not confirmed yet"),
            Self::Stopped => f.write_str("a stop came before it was sent"),
            Self::Superseded => f.write_str("a later command took its place before it was sent"),
            Self::Withdrawn => f.write_str("it was withdrawn before it was sent"),
            Self::Limit(problem) => problem.fmt(f),
            Self::Drive(error) => error.fmt(f),
            Self::QueueFull => f.write_str("too many commands for this drive wait"),
            Self::Removed => f.write_str("the drive was removed from the fleet"),
            Self::ShutDown => f.write_str("the fleet has shut down"),
        }
    }
}
