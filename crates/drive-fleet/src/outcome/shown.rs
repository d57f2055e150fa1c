//! What the words of a drive have shown of a command: how it was started, how it stops, and what it said last.

use std::{fmt, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, Motion, Status, StopMode};

use crate::stop_order::StopOrder;

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
