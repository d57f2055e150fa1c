//! Why a command that was sent is not confirmed, and what is known of one whose outcome is not.

use std::{fmt, time::Duration};

use drive_core::{Error, Refusal, Setpoint};

use super::{LastSeen, Refused, StopModes, Tenths};

/// What is known of a command whose outcome is not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Unknown {
    /// The last error; `None` while its driver still looks for a sign of it.
    pub error: Option<Error>,
    /// What the drive said last, which is older than the command.
    pub last: Option<LastSeen>,
    /// Of a stop: how it was asked for, and how the drive stops.
    pub stop: Option<StopModes>,
    /// Whoever carried it out has ended first: the runtime of the fleet, or the fleet with its last handle. **Nobody takes a start back
    /// or repeats a stop then.**
    pub abandoned: bool,
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.abandoned {
            return f.write_str("the fleet has ended meanwhile: it was sent, or may have been, and nobody looks after it any more");
        }
        match &self.error {
            Some(error) => error.fmt(f)?,
            // It may have answered all the while that its driver looks for a sign of it.
            None => f.write_str("nothing has confirmed it yet")?,
        }
        match &self.last {
            Some(last) => write!(f, "; the drive was last seen {last}"),
            None => f.write_str("; the drive has never been seen"),
        }?;
        replaced(f, self.stop)
    }
}

/// The part of a sentence that tells of another mode than was asked for.
fn replaced(f: &mut fmt::Formatter<'_>, stop: Option<StopModes>) -> fmt::Result {
    match stop.filter(StopModes::is_told) {
        Some(stop) => write!(f, "; {stop}"),
        None => Ok(()),
    }
}

/// Why a command that was sent is not confirmed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unconfirmed {
    /// The time for it is over and the drive says something else, or nothing.
    TimeOver {
        /// The time it had.
        after: Duration,
        /// What the drive said since, if anything.
        last: Option<LastSeen>,
        /// What keeps the command from being in force, where the drive tells it.
        because: Option<Refusal>,
        /// Of a stop: how it was asked for, and how the drive stops.
        stop: Option<StopModes>,
    },
    /// The drive's words deny it.
    Denied(Error),
    /// The drive refuses each attempt of a stop by an exception.
    StopDenied {
        /// The last.
        error: Error,
        /// How it was asked for, and how the drive stops.
        stop: StopModes,
    },
    /// Of a start: its setpoint is in the drive, and a motor that runs already goes to it; its run word was not sent, and never will be.
    NotStarted {
        /// The setpoint.
        setpoint: Setpoint,
        /// Why its run word was not sent; `None`: its lifetime was over.
        why: Option<Refused>,
        /// What the drive said last, which may be older than the setpoint.
        last: Option<LastSeen>,
    },
    /// A later command took its place.
    Superseded,
    /// A stop came.
    Stopped,
    /// Its ticket was dropped.
    Withdrawn,
    /// The drive tripped.
    Tripped,
    /// The drive was lost.
    Lost,
}

impl Unconfirmed {
    /// Its word for programs.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::TimeOver { because: Some(because), .. }
            | Self::Denied(Error::NotConfirmed { because: Some(because), .. }) => because.word(),
            Self::TimeOver { .. } => "time_over",
            Self::Denied(_) | Self::StopDenied { .. } => "denied",
            Self::NotStarted { .. } => "not_started",
            Self::Superseded => "later_command",
            Self::Stopped => "stop",
            Self::Withdrawn => "withdrawn",
            Self::Tripped => "fault",
            Self::Lost => "offline",
        }
    }
}

impl fmt::Display for Unconfirmed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeOver { after, last, because, stop } => {
                let after = Tenths(*after);
                match last {
                    Some(last) => write!(f, "after {after} the drive says {last}")?,
                    None => write!(f, "the drive has said nothing for {after}")?,
                }
                because.map_or(Ok(()), |because| write!(f, "; {because}"))?;
                replaced(f, *stop)
            }
            Self::Denied(Error::NotConfirmed { status, because, .. }) => {
                write!(f, "the drive says {status}")?;
                because.map_or(Ok(()), |because| write!(f, "; {because}"))
            }
            Self::Denied(error) => error.fmt(f),
            Self::StopDenied { error, stop } => {
                error.fmt(f)?;
                replaced(f, Some(*stop))
            }
            Self::NotStarted { setpoint, why, last } => {
                write!(f, "its setpoint of {setpoint} is in the drive, and its run word was not sent: ")?;
                match why {
                    Some(why) => why.fmt(f)?,
                    None => f.write_str("its time was over")?,
                }
                last.as_ref().map_or(Ok(()), |last| write!(f, "; the drive was last seen {last}"))
            }
            Self::Superseded => f.write_str("a later command took its place"),
            Self::Stopped => f.write_str("a stop came while it was carried out"),
            Self::Withdrawn => f.write_str("it was withdrawn"),
            Self::Tripped => f.write_str("the drive tripped"),
            Self::Lost => f.write_str("the drive was lost"),
        }
    }
}
