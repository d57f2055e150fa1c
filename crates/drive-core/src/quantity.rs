//! The values that a drive can show besides its state: [`Quantity`].

/// A value of [`Status`](crate::Status) or [`Measurements`](crate::Measurements), by the name that both give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Quantity {
    /// [`Status::output_frequency`](crate::Status::output_frequency).
    OutputFrequency,
    /// [`Status::current`](crate::Status::current).
    Current,
    /// [`Status::current_share`](crate::Status::current_share).
    CurrentShare,
    /// [`Measurements::speed`](crate::Measurements::speed).
    Speed,
    /// [`Measurements::output_voltage`](crate::Measurements::output_voltage).
    OutputVoltage,
    /// [`Measurements::line_voltage`](crate::Measurements::line_voltage).
    LineVoltage,
    /// [`Measurements::dc_bus_voltage`](crate::Measurements::dc_bus_voltage).
    DcBusVoltage,
    /// [`Measurements::torque`](crate::Measurements::torque).
    Torque,
    /// [`Measurements::input_power`](crate::Measurements::input_power).
    InputPower,
    /// [`Measurements::output_power`](crate::Measurements::output_power).
    OutputPower,
    /// [`Measurements::drive_thermal`](crate::Measurements::drive_thermal).
    DriveThermal,
    /// [`Measurements::motor_thermal`](crate::Measurements::motor_thermal).
    MotorThermal,
    /// [`Measurements::running_time`](crate::Measurements::running_time).
    RunningTime,
    /// [`Measurements::powered_time`](crate::Measurements::powered_time).
    PoweredTime,
}

impl Quantity {
    /// All of them.
    pub const ALL: &'static [Self] = &[
        Self::OutputFrequency,
        Self::Current,
        Self::CurrentShare,
        Self::Speed,
        Self::OutputVoltage,
        Self::LineVoltage,
        Self::DcBusVoltage,
        Self::Torque,
        Self::InputPower,
        Self::OutputPower,
        Self::DriveThermal,
        Self::MotorThermal,
        Self::RunningTime,
        Self::PoweredTime,
    ];

    /// Whether it is of the slow set, [`Measurements`](crate::Measurements).
    #[must_use]
    pub const fn is_measured(self) -> bool {
        !matches!(self, Self::OutputFrequency | Self::Current | Self::CurrentShare)
    }

    /// Its key, as `Status` and `Measurements` are written: its unit stands in it.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::OutputFrequency => "output_frequency_hz",
            Self::Current => "current_a",
            Self::CurrentShare => "current_percent",
            Self::Speed => "speed_rpm",
            Self::OutputVoltage => "output_voltage_v",
            Self::LineVoltage => "line_voltage_v",
            Self::DcBusVoltage => "dc_bus_voltage_v",
            Self::Torque => "torque_percent",
            Self::InputPower => "input_power_kw",
            Self::OutputPower => "output_power_kw",
            Self::DriveThermal => "drive_thermal_percent",
            Self::MotorThermal => "motor_thermal_percent",
            Self::RunningTime => "running_time_h",
            Self::PoweredTime => "powered_time_h",
        }
    }
}

#[cfg(all(test, feature = "serde"))]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::{Current, Frequency, Measurements, Percent, Power, Speed, Status, Voltage};

    #[test]
    fn each_stands_under_its_key_in_the_set_that_it_is_of() {
        let percent = Some(Percent::from_percent(1));
        let status = Status {
            output_frequency: Some(Frequency::ZERO),
            current: Some(Current::from_deciamperes(1)),
            current_share: percent,
            ..Status::default()
        };
        let (volts, power) = (Some(Voltage::from_decivolts(1)), Some(Power::from_decawatts(1)));
        let measured = Measurements {
            speed: Some(Speed::from_rpm(1)),
            output_voltage: volts,
            line_voltage: volts,
            dc_bus_voltage: volts,
            torque: percent,
            input_power: power,
            output_power: power,
            drive_thermal: percent,
            motor_thermal: percent,
            running_time: Some(Duration::ZERO),
            powered_time: Some(Duration::ZERO),
            ..Measurements::default()
        };
        let (status, measured) =
            (serde_json::to_value(status).unwrap(), serde_json::to_value(measured).unwrap());
        for quantity in Quantity::ALL {
            let set = if quantity.is_measured() { &measured } else { &status };
            assert!(set[quantity.key()].is_number(), "{quantity:?}: {set}");
        }
    }
}
