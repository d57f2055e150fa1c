//! A measured value above its limit.

use std::fmt;

use drive_core::{Current, Frequency, Percent};

/// The compensation of slip turns a motor faster than its setpoint says.
const SLIP: u32 = 20;

/// A measured value that has a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "of", rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Limit {
    /// The output frequency, of which the limit of its setpoints is the limit: whoever gives it, and whatever it counts as.
    Frequency {
        /// Measured.
        #[cfg_attr(feature = "serde", serde(rename = "measured_hz"))]
        measured: Frequency,
        /// Its limit.
        #[cfg_attr(feature = "serde", serde(rename = "limit_hz"))]
        limit: Frequency,
    },
    /// The motor current.
    Current {
        /// Measured.
        #[cfg_attr(feature = "serde", serde(rename = "measured_a"))]
        measured: Current,
        /// Its limit.
        #[cfg_attr(feature = "serde", serde(rename = "limit_a"))]
        limit: Current,
    },
    /// The thermal state of the drive.
    DriveThermal {
        /// Measured.
        #[cfg_attr(feature = "serde", serde(rename = "measured_percent"))]
        measured: Percent,
        /// Its limit.
        #[cfg_attr(feature = "serde", serde(rename = "limit_percent"))]
        limit: Percent,
    },
    /// The thermal state of the motor.
    MotorThermal {
        /// Measured.
        #[cfg_attr(feature = "serde", serde(rename = "measured_percent"))]
        measured: Percent,
        /// Its limit.
        #[cfg_attr(feature = "serde", serde(rename = "limit_percent"))]
        limit: Percent,
    },
}

impl Limit {
    /// The output frequency and whether it is above the limit by more than the compensation of slip makes of a setpoint, 5 %.
    pub(crate) fn of_frequency(measured: Frequency, limit: Frequency) -> (Self, bool) {
        let slip = limit.centihertz() / SLIP;
        (Self::Frequency { measured, limit }, measured.centihertz() > limit.centihertz().saturating_add(slip))
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency { measured, limit } => write!(f, "output {measured} of {limit}"),
            Self::Current { measured, limit } => write!(f, "current {measured} of {limit}"),
            Self::DriveThermal { measured, limit } => {
                write!(f, "thermal state of the drive {measured} of {limit}")
            }
            Self::MotorThermal { measured, limit } => {
                write!(f, "thermal state of the motor {measured} of {limit}")
            }
        }
    }
}
