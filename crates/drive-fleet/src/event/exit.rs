//! What was done to a drive when the fleet shut down, or when it was taken out.

use std::fmt;

use crate::outcome::Outcome;

/// What was done to a drive when the fleet shut down.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use = "only a confirmed stop is known to have been carried out"]
pub enum ExitAction {
    /// It was left as it was: it stands, or its policy says so, or nothing may be written to it.
    Left,
    /// **Alarm**: its motor turns, or turned when it was last seen, by this fleet or by an earlier run whose record it has. This fleet had not
    /// started it, and left it.
    LeftTurning,
    /// It was stopped, with this outcome.
    Stopped(Outcome),
    /// Control was given back, with this outcome.
    Released(Outcome),
    /// **Alarm**: the time for shutting down was over first. Its motor may turn.
    TimeOver,
}

impl ExitAction {
    /// Whether somebody should look at the drive now.
    #[must_use]
    pub const fn is_alarm(&self) -> bool {
        match self {
            Self::Left => false,
            Self::LeftTurning | Self::TimeOver => true,
            Self::Stopped(outcome) | Self::Released(outcome) => !outcome.is_confirmed(),
        }
    }
}

impl fmt::Display for ExitAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Left => f.write_str("left as it is"),
            Self::LeftTurning => f.write_str("left turning, it was not started here"),
            Self::Stopped(outcome) => write!(f, "stop {outcome}"),
            Self::Released(outcome) => write!(f, "release {outcome}"),
            Self::TimeOver => f.write_str("given up, its stop is not confirmed"),
        }
    }
}
