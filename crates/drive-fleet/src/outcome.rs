//! What is asked of a drive of a fleet, and what became of it.

use std::{borrow::Cow, fmt, sync::Arc, time::Duration};

use drive_core::{
    Command, Direction, Error, Frequency, Identity, Motion, Refusal, Setpoint, Status, StopMode,
};

use crate::{limits::LimitProblem, shown_identity::ShownIdentity, stop_order::StopOrder};

/// When a start or a setpoint counts as done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Until {
    /// The drive's words show that it is in force.
    #[default]
    InForce,
    /// The drive's words show that the output has reached the setpoint.
    AtReference,
}

/// What is asked of a drive, besides a stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Start in a direction, at a setpoint that is given first: this one, or the one that was given last, or else at the one that the drive
    /// holds.
    Start {
        /// The direction.
        direction: Direction,
        /// The setpoint; `None`: the one that was given last.
        setpoint: Option<Setpoint>,
        /// When it counts as done.
        until: Until,
    },
    /// Change the setpoint.
    Setpoint {
        /// The setpoint.
        setpoint: Setpoint,
        /// When it counts as done.
        until: Until,
    },
    /// Reset the present fault.
    ResetFaults,
    /// Give control back to the panel or the terminals.
    Release,
    /// Take what the drive says it is for right from now on, if that is still what was shown. Nothing is sent.
    AcceptIdentity(ShownIdentity),
    /// Save the drive's parameters to EEPROM.
    Persist,
}

impl Order {
    /// Whether it can move a motor.
    pub(crate) const fn is_motion(&self) -> bool {
        matches!(self, Self::Start { .. } | Self::Setpoint { .. })
    }

    /// The setpoint that it gives.
    pub(crate) const fn setpoint(&self) -> Option<Setpoint> {
        match *self {
            Self::Setpoint { setpoint, .. } => Some(setpoint),
            _ => self.start_setpoint(),
        }
    }

    /// The setpoint that a start is given with.
    pub(crate) const fn start_setpoint(&self) -> Option<Setpoint> {
        match *self {
            Self::Start { setpoint, .. } => setpoint,
            _ => None,
        }
    }

    /// How it ends when this status has shown that it is in force.
    pub(crate) fn done(&self, status: Option<&Status>) -> Outcome {
        match *self {
            Self::Start { direction, .. } => Outcome::Started(Started::shown(direction, status)),
            _ => Outcome::Confirmed,
        }
    }

    /// How events and logs name it.
    #[must_use]
    pub const fn command(&self) -> Command {
        match *self {
            Self::Start { direction, .. } => Command::Start(direction),
            Self::Setpoint { setpoint, .. } => Command::Setpoint(setpoint),
            Self::ResetFaults => Command::ResetFaults,
            Self::Release => Command::Release,
            Self::AcceptIdentity(_) => Command::Configure("accepting the identity"),
            Self::Persist => Command::Persist,
        }
    }
}

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

/// How a drive was started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Started {
    /// Which way.
    pub direction: Direction,
    /// The setpoint that it uses, as the drive told it with the start, and within the limits up to which that turns its motor; `None` where
    /// its words do not hold it.
    #[cfg_attr(feature = "serde", serde(rename = "reference_hz", skip_serializing_if = "Option::is_none"))]
    pub reference: Option<Frequency>,
    /// Its motor still turned the other way then, and comes down first.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "std::ops::Not::not"))]
    pub turns_round: bool,
}

impl Started {
    /// As the status shows it that has confirmed the start.
    pub(crate) fn shown(direction: Direction, status: Option<&Status>) -> Self {
        let turns =
            status.filter(|status| status.motion == Motion::Driven).and_then(|status| status.direction);
        Self {
            direction,
            reference: status.and_then(|status| status.reference),
            turns_round: turns.is_some_and(|turns| turns != direction),
        }
    }
}

impl fmt::Display for Started {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "started {}", self.direction)?;
        if let Some(reference) = self.reference {
            write!(f, " at {reference}")?;
        }
        if self.turns_round {
            f.write_str(": its motor still turns the other way, and comes down first")?;
        }
        match self.reference {
            Some(Frequency::ZERO) => f.write_str(": its setpoint is zero"),
            _ => Ok(()),
        }
    }
}

/// How a stop was asked for, and how the drive stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct StopModes {
    /// The mode that was asked for.
    pub asked: StopMode,
    /// The mode by which the drive stops; `None` while it has shown none.
    pub used: Option<StopMode>,
    /// Why it is another, where the drive or its driver tells.
    pub why: Option<&'static str>,
    /// For how long direct current was to be held, where it was asked for and somebody has said so.
    pub injection_asked: Option<Duration>,
    /// For how long it is held, where it is injected.
    pub injection_used: Option<Duration>,
}

impl StopModes {
    /// Whether the drive stops by another mode than was asked for.
    #[must_use]
    pub fn is_replaced(&self) -> bool {
        self.used.is_some_and(|used| used != self.asked)
    }

    /// Whether there is more to be told of it than that the drive stops as it was asked for.
    #[must_use]
    pub fn is_told(&self) -> bool {
        self.is_replaced() || self.injection_used.is_some()
    }

    /// How it was asked for.
    const fn order(&self) -> StopOrder {
        StopOrder { mode: self.asked, injection: self.injection_asked }
    }
}

impl fmt::Display for StopModes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { asked, used, why, injection_asked, injection_used } = self;
        let order = self.order();
        match used {
            None => write!(f, "asked for a {order}, and the drive has shown none"),
            Some(used) if used == asked => match (injection_asked, injection_used) {
                (Some(asked), Some(used)) if asked != used => {
                    write!(f, "asked for a {order}, it is held for {used:?}")
                }
                (_, Some(used)) => write!(f, "{asked} stop held for {used:?}"),
                _ => write!(f, "{asked} stop"),
            },
            Some(used) => {
                write!(f, "asked for a {order}, the drive did a {used} stop")?;
                why.map_or(Ok(()), |why| write!(f, " because {why}"))
            }
        }
    }
}

/// A status that may be old.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct LastSeen {
    /// The status.
    pub status: Arc<Status>,
    /// How long ago it was read.
    pub age: Duration,
}

impl fmt::Display for LastSeen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} ago", self.status, Tenths(self.age))
    }
}

/// A time as a person reads it.
pub(crate) struct Tenths(pub(crate) Duration);

impl fmt::Display for Tenths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = self.0.as_millis() / 100;
        write!(f, "{}.{} s", tenths / 10, tenths % 10)
    }
}

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
