//! What a drive says of itself: [`Status`], the fast set that control and safety need, and [`Measurements`], the slow
//! set.

use std::{fmt, time::Duration};

use tokio::time::Instant;

use crate::{
    lease::Verdict,
    motion::Motion,
    named::Word,
    refusal::Refusal,
    setpoint::{Direction, Setpoint},
    state::{Control, State},
    units::{Current, Frequency, Percent, Power, Speed, Voltage},
};

/// One word as the drive sent it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct RawWord {
    /// Its address.
    pub address: u16,
    /// The manual's mnemonic.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::serialize::kept"))]
    pub code: Word,
    /// The word.
    pub value: u16,
}

/// The fast set: what control and safety need, in the fewest exchanges that the family's limits allow.
///
/// A field is `None` when the family has no such value or it cannot be known in these exchanges. Nothing is guessed.
///
/// ```
/// use drive_core::{Frequency, Motion, RawWord, State, Status};
///
/// // As a family makes it of the words that it has read.
/// let status = Status {
///     state: State::Running,
///     output_frequency: Some(Frequency::from_hertz(30)),
///     motion: Motion::Driven,
///     raw: vec![RawWord { address: 3201, code: "ETA", value: 0x0227 }],
///     ..Status::default()
/// };
/// assert!(!status.is_fault() && !status.is_undriven());
/// assert_eq!(status.raw(3201), Some(0x0227));
/// assert_eq!(status.current, None, "what was not told is not 0");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Status {
    /// The state.
    pub state: State,
    /// The direction of the output, or of the run command where the drive only tells that.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub direction: Option<Direction>,
    /// The output frequency.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "output_frequency_hz", skip_serializing_if = "Option::is_none")
    )]
    pub output_frequency: Option<Frequency>,
    /// The motor current.
    #[cfg_attr(feature = "serde", serde(rename = "current_a", skip_serializing_if = "Option::is_none"))]
    pub current: Option<Current>,
    /// The motor current as a share of the drive's own base, where that is what the drive gives.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "current_percent", skip_serializing_if = "Option::is_none")
    )]
    pub current_share: Option<Percent>,
    /// The reference that the drive follows, or will with a start, where the fast set holds it: how fast, whoever gives it.
    #[cfg_attr(feature = "serde", serde(rename = "reference_hz", skip_serializing_if = "Option::is_none"))]
    pub reference: Option<Frequency>,
    /// Whether the output has reached the reference.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub at_reference: Option<bool>,
    /// Whether an alarm that does not trip is present.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub warning: Option<bool>,
    /// The vendor's code of the present fault, where the fast set holds it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub fault_code: Option<u16>,
    /// Who commands the drive.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub control: Option<Control>,
    /// What these words say of the run command that this side has given; `None`: none of this side's stands, as far as is
    /// known. See [`Lease`](crate::Lease).
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "run_command",
            default,
            skip_serializing_if = "Option::is_none",
            with = "crate::lease::object"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<crate::lease::VerdictObject>"))]
    pub verdict: Option<Verdict>,
    /// Whether the motor turns, as a claim with its evidence.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Motion::is_not_known"))]
    pub motion: Motion,
    /// Every word that was read for this status.
    pub raw: Vec<RawWord>,
    /// When the oldest of these words ended on the line; `None` on a port that keeps no time.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "age_ms",
            skip_serializing_if = "Option::is_none",
            default,
            with = "crate::serialize::maybe_age"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
    pub at: Option<Instant>,
}

impl Status {
    /// The word read at `address`.
    #[must_use]
    pub fn raw(&self, address: u16) -> Option<u16> {
        self.raw.iter().find(|word| word.address == address).map(|word| word.value)
    }

    /// Whether it has tripped or is about to.
    #[must_use]
    pub const fn is_fault(&self) -> bool {
        self.state.is_fault()
    }

    /// Whether the words that it sent are some that its manual explains.
    #[must_use]
    pub const fn is_explained(&self) -> bool {
        !matches!(self.state, State::Unknown)
    }

    /// Why no drive is to be moved that shows this, whatever its family: it has tripped, or it is in a state from which none
    /// starts. Who commands it is for the family to judge.
    #[must_use]
    pub fn bars_motion(&self) -> Option<Refusal> {
        match self.state {
            State::Fault | State::FaultReaction => {
                Some(self.fault_code.filter(|&code| code != 0).map_or(Refusal::Tripped, Refusal::Fault))
            }
            State::Unknown | State::NotReady => Some(Refusal::State(self.state)),
            _ => None,
        }
    }

    /// Whether the motor stands, as far as is known: at rest, or held there by direct current. A reading of
    /// [`motion`](Self::motion), and of nothing else.
    #[must_use]
    pub const fn is_standstill(&self) -> bool {
        matches!(self.motion, Motion::AtRest | Motion::Held)
    }

    /// Whether the drive gives the motor no torque, and none is to be expected: it [stands](Self::is_standstill), or its output was
    /// cut and [the shaft may coast](Motion::Coasting).
    #[must_use]
    pub const fn is_undriven(&self) -> bool {
        matches!(self.motion, Motion::AtRest | Motion::Held | Motion::Coasting)
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.state)?;
        if let Some(direction) = self.direction {
            write!(f, ", {direction}")?;
        }
        if let Some(frequency) = self.output_frequency {
            write!(f, ", {frequency}")?;
        }
        // No output is not standstill.
        if self.motion == Motion::Coasting {
            write!(f, ", {}", self.motion)?;
        }
        if let Some(current) = self.current {
            write!(f, ", {current}")?;
        }
        if let Some(share) = self.current_share {
            write!(f, ", {share} current")?;
        }
        if self.at_reference == Some(true) {
            f.write_str(", at reference")?;
        }
        if self.warning == Some(true) {
            f.write_str(", warning")?;
        }
        if let Some(control) = self.control {
            write!(f, ", control: {control}")?;
        }
        Ok(())
    }
}

/// The slow set: what a person or a trend wants to see.
///
/// `None` where the family has no such value.
///
/// ```
/// use drive_core::{Measurements, Percent};
///
/// let told = Measurements { motor_thermal: Some(Percent::from_percent(82)), ..Measurements::default() };
/// let warm = told.motor_thermal.is_some_and(|thermal| thermal > Percent::from_percent(80));
/// assert!(warm && told.dc_bus_voltage.is_none());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Measurements {
    /// When the oldest of these values ended on the line; `None` on a port that keeps no time.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "age_ms",
            skip_serializing_if = "Option::is_none",
            default,
            with = "crate::serialize::maybe_age"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<u64>"))]
    pub at: Option<Instant>,
    /// The drive has tripped, and what it holds still since then is not the present: such values are `None`, and their
    /// words, from just before the trip, stand in [`raw`](Self::raw) alone.
    pub before_trip: bool,
    /// The reference before the ramp.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub reference: Option<Setpoint>,
    /// The motor speed.
    #[cfg_attr(feature = "serde", serde(rename = "speed_rpm", skip_serializing_if = "Option::is_none"))]
    pub speed: Option<Speed>,
    /// The output voltage.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "output_voltage_v", skip_serializing_if = "Option::is_none")
    )]
    pub output_voltage: Option<Voltage>,
    /// The output voltage as a share of the drive's own base.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "output_voltage_percent", skip_serializing_if = "Option::is_none")
    )]
    pub output_voltage_share: Option<Percent>,
    /// The line voltage.
    #[cfg_attr(feature = "serde", serde(rename = "line_voltage_v", skip_serializing_if = "Option::is_none"))]
    pub line_voltage: Option<Voltage>,
    /// The DC bus voltage.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "dc_bus_voltage_v", skip_serializing_if = "Option::is_none")
    )]
    pub dc_bus_voltage: Option<Voltage>,
    /// The DC bus voltage as a share of the drive's own base.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "dc_bus_voltage_percent", skip_serializing_if = "Option::is_none")
    )]
    pub dc_bus_voltage_share: Option<Percent>,
    /// The torque as a share of the nominal torque.
    #[cfg_attr(feature = "serde", serde(rename = "torque_percent", skip_serializing_if = "Option::is_none"))]
    pub torque: Option<Percent>,
    /// The power as a share of the nominal power.
    #[cfg_attr(feature = "serde", serde(rename = "power_percent", skip_serializing_if = "Option::is_none"))]
    pub power_share: Option<Percent>,
    /// The power taken from the line.
    #[cfg_attr(feature = "serde", serde(rename = "input_power_kw", skip_serializing_if = "Option::is_none"))]
    pub input_power: Option<Power>,
    /// The power given to the motor.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "output_power_kw", skip_serializing_if = "Option::is_none")
    )]
    pub output_power: Option<Power>,
    /// The thermal state of the drive; 100 % is nominal.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "drive_thermal_percent", skip_serializing_if = "Option::is_none")
    )]
    pub drive_thermal: Option<Percent>,
    /// The thermal state of the motor; 100 % is nominal.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "motor_thermal_percent", skip_serializing_if = "Option::is_none")
    )]
    pub motor_thermal: Option<Percent>,
    /// The load of the drive.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "drive_load_percent", skip_serializing_if = "Option::is_none")
    )]
    pub drive_load: Option<Percent>,
    /// The load of the motor.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "motor_load_percent", skip_serializing_if = "Option::is_none")
    )]
    pub motor_load: Option<Percent>,
    /// Energy counted at the input, in the drive's own counts where its manual names no unit.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "input_energy_counts", skip_serializing_if = "Option::is_none")
    )]
    pub input_energy: Option<u32>,
    /// Energy counted at the output, in the drive's own counts where its manual names no unit.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "output_energy_counts", skip_serializing_if = "Option::is_none")
    )]
    pub output_energy: Option<u32>,
    /// Hours with the motor running.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "running_time_h",
            skip_serializing_if = "Option::is_none",
            default,
            with = "crate::serialize::hours"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<f64>"))]
    pub running_time: Option<Duration>,
    /// Hours with the drive powered.
    #[cfg_attr(
        feature = "serde",
        serde(
            rename = "powered_time_h",
            skip_serializing_if = "Option::is_none",
            default,
            with = "crate::serialize::hours"
        )
    )]
    #[cfg_attr(feature = "schemars", schemars(with = "Option<f64>"))]
    pub powered_time: Option<Duration>,
    /// The logic inputs, bit by bit as the family's manual lists them.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub inputs: Option<u16>,
    /// The logic outputs, bit by bit as the family's manual lists them.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub outputs: Option<u16>,
    /// Every word that was read.
    pub raw: Vec<RawWord>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_that_may_coast_or_is_braked_without_an_output_is_not_at_standstill() {
        let of = |state, motion| {
            let output_frequency = Some(Frequency::ZERO);
            Status { state, motion, output_frequency, ..Status::default() }.is_standstill()
        };
        assert!(!of(State::Fault, Motion::Coasting));
        assert!(!of(State::Stopping, Motion::Braking));
        assert!(of(State::Stopping, Motion::Held), "direct current holds it");
        assert!(of(State::Disabled, Motion::AtRest));
    }

    #[test]
    fn no_state_and_no_output_is_taken_for_standstill() {
        for state in
            [State::Ready, State::Fault, State::Disabled, State::NotReady, State::QuickStop, State::Unknown]
        {
            let status = Status { state, output_frequency: Some(Frequency::ZERO), ..Status::default() };
            assert!(!status.is_standstill() && !status.is_undriven(), "{state}");
        }
    }

    #[test]
    fn a_status_reads_as_a_sentence() {
        let status = Status {
            state: State::Running,
            direction: Some(Direction::Reverse),
            output_frequency: Some(Frequency::from_hertz(50)),
            current: Some(Current::from_deciamperes(42)),
            at_reference: Some(true),
            control: Some(Control::Bus),
            ..Status::default()
        };
        assert_eq!(status.to_string(), "running, reverse, 50.00 Hz, 4.2 A, at reference, control: bus");
    }

    #[test]
    fn a_status_says_that_a_shaft_whose_output_was_cut_may_coast() {
        let status = Status {
            state: State::Disabled,
            output_frequency: Some(Frequency::ZERO),
            motion: Motion::Coasting,
            ..Status::default()
        };
        assert_eq!(status.to_string(), "disabled, 0.00 Hz, output off, the shaft may coast");
    }
}
