//! What is asked of a drive besides a stop, and when that counts as done.

use drive_core::{Command, Direction, Setpoint, Status};

use super::{Outcome, Started};
use crate::shown_identity::ShownIdentity;

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
