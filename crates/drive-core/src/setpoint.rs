//! What is asked of a drive: direction, setpoint, stop mode.

#[cfg(feature = "serde")]
mod json;

use std::{fmt, str::FromStr};

use crate::units::{Frequency, Percent, Speed, UnitError};

/// Direction of rotation, as the drive names it.
///
/// ```
/// use drive_core::Direction;
///
/// assert_eq!("Reverse".parse(), Ok(Direction::Reverse));
/// assert_eq!("left".parse::<Direction>().unwrap_err().to_string(), "expected one of forward, reverse");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Direction {
    /// Forward.
    Forward,
    /// Reverse.
    Reverse,
}

crate::named! { Direction {
    Forward => "forward",
    Reverse => "reverse",
} }

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
    /// A share of the drive's own full scale, for drives that count so.
    #[cfg_attr(feature = "serde", serde(rename = "share_percent"))]
    Share(Percent),
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

impl From<Percent> for Setpoint {
    fn from(share: Percent) -> Self {
        Self::Share(share)
    }
}

impl fmt::Display for Setpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency(frequency) => frequency.fmt(f),
            Self::Speed(speed) => speed.fmt(f),
            Self::Share(share) => share.fmt(f),
        }
    }
}

/// Reads a frequency with at most two decimals, such as `30 Hz` or `30.5Hz`, a whole speed, such as `900 rpm`, or a share with
/// at most two decimals, such as `50%`. A number without a unit is none.
///
/// ```
/// use drive_core::{Frequency, Setpoint};
///
/// assert_eq!("30.5Hz".parse(), Ok(Setpoint::from(Frequency::from_centihertz(3_050))));
/// assert!("30".parse::<Setpoint>().is_err());
/// ```
impl FromStr for Setpoint {
    type Err = UnitError;

    fn from_str(text: &str) -> Result<Self, UnitError> {
        let frequency = text.parse().map(Self::Frequency);
        let share = || text.parse().ok().filter(|share: &Percent| share.hundredths() >= 0).map(Self::Share);
        let setpoint = frequency.or_else(|_: UnitError| text.parse().map(Self::Speed));
        setpoint.or_else(|_: UnitError| {
            share().ok_or(UnitError(
                "a frequency with at most two decimals such as 47.5 Hz, or a speed such as 1450 rpm, or a share such as 50 %",
            ))
        })
    }
}

/// How to stop.
///
/// ```
/// use drive_core::StopMode;
///
/// assert_eq!("DC injection".parse(), Ok(StopMode::DcInjection));
/// assert_eq!(StopMode::ALL.map(|mode| mode.to_string()).join(", "), "ramp, fast, freewheel, DC injection");
/// ```
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

crate::named! { StopMode {
    Ramp => "ramp",
    Fast => "fast",
    Freewheel => "freewheel",
    DcInjection => "DC injection",
} }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setpoint_is_a_number_and_its_unit() {
        let hertz = |centihertz| Ok(Frequency::from_centihertz(centihertz).into());
        for (text, setpoint) in [
            ("30 Hz", hertz(3_000)),
            ("30.5Hz", hertz(3_050)),
            ("0.01 hz", hertz(1)),
            ("900 rpm", Ok(Speed::from_rpm(900).into())),
            ("1450RPM", Ok(Speed::from_rpm(1_450).into())),
            ("50%", Ok(Percent::from_percent(50).into())),
            ("12.25 %", Ok(Percent::from_hundredths(1_225).into())),
        ] {
            assert_eq!(text.parse::<Setpoint>(), setpoint, "{text}");
        }
        for text in [
            "",
            "30",
            "fast",
            "-5 Hz",
            "1.234 Hz",
            "1,5 Hz",
            "99999999999 Hz",
            "rpm",
            "14.5 rpm",
            "-5 %",
            "%",
        ] {
            let error = text.parse::<Setpoint>().expect_err(text);
            assert!(error.to_string().contains("such as 47.5 Hz, or a speed such as 1450 rpm"));
        }
    }

    #[test]
    fn a_stop_mode_and_a_direction_read_back_as_they_are_printed_and_as_programs_write_them() {
        for mode in StopMode::ALL {
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        for text in ["DC injection", "dc_injection", "dc-injection", "DC-Injection"] {
            assert_eq!(text.parse(), Ok(StopMode::DcInjection));
        }
        assert_eq!("Reverse".parse(), Ok(Direction::Reverse));
        let error = "left".parse::<Direction>().unwrap_err();
        assert_eq!(error.to_string(), "expected one of forward, reverse");
    }
}
