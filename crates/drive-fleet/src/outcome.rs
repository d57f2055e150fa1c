//! What is asked of a drive of a fleet, and what became of it.

mod order;
mod refused;
mod shown;
mod unconfirmed;

use std::fmt;

use drive_core::Setpoint;

pub(crate) use self::shown::Tenths;
pub use self::{
    order::{Order, Until},
    refused::Refused,
    shown::{LastSeen, Started, StopModes},
    unconfirmed::{Unconfirmed, Unknown},
};

/// What an outcome comes to, for whoever does not ask why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Became {
    /// The drive's own words show it.
    Confirmed,
    /// It was sent, and they do not show it.
    NotConfirmed,
    /// It was sent, or may have been, and the drive could not be asked.
    Unknown,
    /// Nothing moved because of it.
    Refused,
    /// It was not sent in time.
    Expired,
    /// A later command, or a stop, took its place.
    Superseded,
    /// There was nothing to be done: a withdrawal found no run command of this side.
    Nothing,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use = "only a confirmed command is known to be in force"]
pub enum Outcome {
    /// The drive's own words show it.
    Confirmed,
    /// Of a withdrawal: no run command of this side stood any more, and nothing was written.
    NothingStood,
    /// The drive's own words show it of a start: which way, and the setpoint that it uses.
    Started(Started),
    /// The drive's own words show it of a stop: how it was asked for, and how the drive has stopped.
    Stopped(StopModes),
    /// It was sent, or a part of it, and the drive's own words do not show it. A run command may still take effect later, so that a
    /// start is taken back by a ramp stop, which is repeated until it is confirmed; not one whose run word was not sent
    /// ([`Unconfirmed::NotStarted`]), and not one that [was in force](crate::Ticket::in_force), of which no more was waited for than that it
    /// comes to its setpoint.
    NotConfirmed(Unconfirmed),
    /// Its lifetime ran out before it was sent. It never will be.
    Expired,
    /// It was sent, or may have been, and the drive could not be asked in time what became of it. A start is taken back
    /// as above, unless whoever would do that has ended ([`Unknown::abandoned`]).
    OutcomeUnknown(Unknown),
    /// It was refused; nothing moved because of it.
    Refused(Refused),
}

impl Outcome {
    /// Whether the drive's own words show it.
    #[must_use]
    pub const fn is_confirmed(&self) -> bool {
        matches!(self, Self::Confirmed | Self::Started(_) | Self::Stopped(_))
    }

    /// Of a start whose setpoint is in the drive and whose run word was not sent: why, where it was not its time that was over.
    pub(crate) const fn not_started(
        setpoint: Setpoint,
        why: Option<Refused>,
        last: Option<LastSeen>,
    ) -> Self {
        Self::NotConfirmed(Unconfirmed::NotStarted { setpoint, why, last })
    }

    /// Whether a start may follow: it is confirmed, or a setpoint that only a start shows.
    pub(crate) const fn lets_a_start_follow(&self) -> bool {
        match self {
            Self::NotConfirmed(Unconfirmed::Denied(error)) => error.only_a_start_shows(),
            _ => self.is_confirmed(),
        }
    }

    /// Whether a run command of a start with this outcome is in the drive, or may be.
    pub(crate) const fn may_have_started(&self) -> bool {
        !matches!(self, Self::Refused(_) | Self::Expired | Self::NotConfirmed(Unconfirmed::NotStarted { .. }))
    }

    /// Of a start that is in force: which way, and the setpoint that it uses.
    #[must_use]
    pub const fn started(&self) -> Option<Started> {
        match self {
            Self::Started(started) => Some(*started),
            _ => None,
        }
    }

    /// Of a stop that was sent: how it was asked for, and how the drive stops.
    #[must_use]
    pub const fn stop(&self) -> Option<StopModes> {
        match self {
            Self::Stopped(stop) => Some(*stop),
            Self::NotConfirmed(Unconfirmed::TimeOver { stop, .. }) => *stop,
            Self::NotConfirmed(Unconfirmed::StopDenied { stop, .. }) => Some(*stop),
            Self::OutcomeUnknown(Unknown { stop, .. }) => *stop,
            _ => None,
        }
    }

    /// What it comes to.
    #[must_use]
    pub const fn became(&self) -> Became {
        match self {
            Self::NotConfirmed(Unconfirmed::Superseded | Unconfirmed::Stopped)
            | Self::Refused(Refused::Superseded | Refused::Stopped) => Became::Superseded,
            Self::Confirmed | Self::Started(_) | Self::Stopped(_) => Became::Confirmed,
            Self::NothingStood => Became::Nothing,
            Self::NotConfirmed(_) => Became::NotConfirmed,
            Self::Expired => Became::Expired,
            Self::OutcomeUnknown(_) => Became::Unknown,
            Self::Refused(_) => Became::Refused,
        }
    }

    /// Its word for programs: `confirmed`, `not_confirmed`, `unknown`, `refused`, `expired`, `superseded` where a later
    /// command or a stop took its place, or `nothing` where there was nothing to be done.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self.became() {
            Became::Confirmed => "confirmed",
            Became::NotConfirmed => "not_confirmed",
            Became::Unknown => "unknown",
            Became::Refused => "refused",
            Became::Expired => "expired",
            Became::Superseded => "superseded",
            Became::Nothing => "nothing",
        }
    }

    /// The reason in one word for programs, where there is one.
    #[must_use]
    pub const fn reason(&self) -> Option<&'static str> {
        match self {
            Self::Confirmed
            | Self::NothingStood
            | Self::Started(_)
            | Self::Stopped(_)
            | Self::Expired
            | Self::OutcomeUnknown(_) => None,
            Self::NotConfirmed(why) => Some(why.word()),
            Self::Refused(why) => Some(why.word()),
        }
    }

    /// What there is to be told of it in a sentence, for persons; `None` where its word says it all.
    #[must_use]
    pub fn text(&self) -> Option<String> {
        match self {
            Self::Started(started) => Some(started.to_string()),
            Self::Stopped(stop) => stop.is_told().then(|| stop.to_string()),
            Self::Confirmed => None,
            Self::NothingStood => Some("no run command of this side stood any more".to_owned()),
            Self::Expired => Some("its time was over before it was sent: it never will be".to_owned()),
            Self::NotConfirmed(why) => Some(why.to_string()),
            Self::OutcomeUnknown(unknown) => Some(unknown.to_string()),
            Self::Refused(why) => Some(why.to_string()),
        }
    }

    /// The same in words, for logs and the audit log.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self.became() {
            Became::Confirmed => "confirmed",
            Became::NotConfirmed => "not confirmed",
            Became::Unknown => "outcome unknown",
            Became::Refused => "refused",
            Became::Expired => "expired",
            Became::Superseded => "superseded",
            Became::Nothing => "nothing to be done",
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind())?;
        self.text().map_or(Ok(()), |text| write!(f, ": {text}"))
    }
}
