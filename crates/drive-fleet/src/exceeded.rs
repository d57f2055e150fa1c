//! A measured value above its limit.

use std::fmt;

use drive_core::{Current, Percent};

/// A measured value that has a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "of", rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Limit {
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

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
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
