//! What is asked of a drive: direction, setpoint, stop mode.

use std::fmt;

use crate::units::{Frequency, Speed};

/// Direction of rotation, as the drive names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Direction {
    /// Forward.
    Forward,
    /// Reverse.
    Reverse,
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Forward => "forward",
            Self::Reverse => "reverse",
        })
    }
}

/// The setpoint: how fast, never which way. The direction is part of [`Drive::start`](crate::Drive::start).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Setpoint {
    /// Output frequency.
    #[cfg_attr(feature = "serde", serde(rename = "frequency_hz"))]
    Frequency(Frequency),
    /// Motor speed, for drives that take one.
    #[cfg_attr(feature = "serde", serde(rename = "speed_rpm"))]
    Speed(Speed),
}

impl From<Frequency> for Setpoint {
    fn from(frequency: Frequency) -> Self {
        Self::Frequency(frequency)
    }
}

impl From<Speed> for Setpoint {
    fn from(speed: Speed) -> Self {
        Self::Speed(speed)
    }
}

impl fmt::Display for Setpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency(frequency) => frequency.fmt(f),
            Self::Speed(speed) => speed.fmt(f),
        }
    }
}

/// How to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum StopMode {
    /// Along the deceleration ramp.
    Ramp,
    /// Along the drive's short ramp.
    Fast,
    /// By cutting the output: the motor coasts.
    Freewheel,
    /// By injecting direct current.
    DcInjection,
}

impl StopMode {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Ramp, Self::Fast, Self::Freewheel, Self::DcInjection];
}

impl fmt::Display for StopMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Ramp => "ramp",
            Self::Fast => "fast",
            Self::Freewheel => "freewheel",
            Self::DcInjection => "DC injection",
        })
    }
}

/// A command, as errors and logs name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    /// Start in a direction.
    Start(Direction),
    /// Stop.
    Stop(StopMode),
    /// End the run command that this side has given, and nothing else.
    Withdraw,
    /// Change the setpoint.
    Setpoint(Setpoint),
    /// Reset the present fault.
    ResetFaults,
    /// Give control back to the panel or the terminals.
    Release,
    /// Set up the drive's communication watchdog.
    ArmWatchdog,
    /// Write a parameter.
    WriteParameter(u16),
    /// Save the parameters to EEPROM.
    Persist,
    /// Set up something of the family's own, named here.
    Configure(&'static str),
}

impl Command {
    /// Its word for programs: what is asked, without its direction, value or register.
    #[must_use]
    pub const fn action(&self) -> &'static str {
        match self {
            Self::Start(_) => "start",
            Self::Stop(_) => "stop",
            Self::Withdraw => "withdraw",
            Self::Setpoint(_) => "setpoint",
            Self::ResetFaults => "reset",
            Self::Release => "release",
            Self::ArmWatchdog => "watchdog",
            Self::WriteParameter(_) => "parameter",
            Self::Persist => "save",
            Self::Configure(_) => "configure",
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(direction) => write!(f, "start {direction}"),
            Self::Stop(mode) => write!(f, "stop by {mode}"),
            Self::Withdraw => f.write_str("withdrawal of the run command"),
            Self::Setpoint(setpoint) => write!(f, "setpoint {setpoint}"),
            Self::ResetFaults => f.write_str("fault reset"),
            Self::Release => f.write_str("release"),
            Self::ArmWatchdog => f.write_str("watchdog set-up"),
            Self::WriteParameter(address) => write!(f, "parameter {address}"),
            Self::Persist => f.write_str("save to EEPROM"),
            Self::Configure(what) => f.write_str(what),
        }
    }
}
