//! Whether the motor turns: [`Motion`], a claim with its evidence (rule 12), and [`Shaft`], which follows it from status to
//! status.

mod descent;
mod shaft;

use std::time::Duration;

use crate::units::Frequency;

pub use self::shaft::Shaft;

/// What is known of the shaft. No output is not standstill: a motor whose output was cut coasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Motion {
    /// The drive turns it: a run command acts.
    Driven,
    /// The drive brings it down, along a ramp, a quick stop or by injection.
    Braking,
    /// It stands, and the drive holds it there by direct current.
    Held,
    /// The output was cut while it turned, or was not there at the first look or the first one behind a lost line, and nothing tells
    /// when it has come to rest.
    Coasting,
    /// The drive brought it down to no output, or watches the shaft itself and says that it stands, or its coast time is over. What it
    /// did between two looks nobody saw: a motor that was at rest, and that others have run and let coast meanwhile, is told to be at
    /// rest still. Behind a lost line it is not: nobody knows for how long it was not looked at.
    AtRest,
    /// The words do not tell.
    #[default]
    NotKnown,
}

crate::named! { Motion {
    Driven => "driven",
    Braking => "braking",
    Held => "held by injection",
    Coasting => "output off, the shaft may coast",
    AtRest => "at rest",
    NotKnown => "not known",
} }

impl Motion {
    /// Whether nothing is known of it.
    #[must_use]
    pub const fn is_not_known(&self) -> bool {
        matches!(self, Self::NotKnown)
    }

    /// Whether the drive gives the motor no torque and none is to be expected: at rest, or coasting.
    #[must_use]
    pub const fn is_undriven(self) -> bool {
        matches!(self, Self::AtRest | Self::Coasting)
    }
}

/// What one status shows of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Output {
    /// A run command acts.
    Driven,
    /// The motor is brought down, at this output.
    Braking(Frequency),
    /// Direct current is injected. Until the motor stands this brakes it.
    Injection,
    /// There is no output, and the drive has not cut it by itself: a ramp has ended.
    None,
    /// There is no output, and the drive says that the stop which it was making has come to its end.
    Ended,
    /// There is no output any more, of a motor that a stop brought down in whose place another may stand by now: only that it had
    /// the time to come down as fast as it was seen to tells a ramp that has ended from a cut.
    Gone,
    /// The output is cut: freewheel, a blocked output, no mains.
    Cut,
    /// The output is cut by a trip.
    Tripped,
    /// Something that watches the shaft itself says that it stands.
    Stands,
    /// The words do not tell.
    NotKnown,
}

/// How long direct current is given to bring a motor to rest where nothing else is known: as long as an Altivar 312 keeps it at
/// its full height (`IdC`, BBV51701 p. 40). No manual says when the shaft stands.
pub const INJECTION_TIME: Duration = Duration::from_secs(5);

/// How long direct current is held at the most: longer heats a motor that stands. An Altivar 312 takes no longer time for it
/// either (`tdC`, BBV51701 p. 41).
pub const INJECTION_AT_MOST: Duration = Duration::from_secs(30);

#[cfg(test)]
mod tests;
