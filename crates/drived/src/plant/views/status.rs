//! Status and measurements of a drive, with their quality.

use std::time::Duration;

use drive_core::{
    Current, Frequency, Measurements, Percent, Power, RawWord, Setpoint, Speed, Status, Voltage,
};
use drive_fleet::{Freshness, Snapshot, Timed};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use super::word;
use crate::json::milliseconds;

/// Whether a value is what the drive shows now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Quality {
    /// It is: the drive answers, and the value is young enough.
    Good,
    /// It is the last that is known, and old.
    Stale,
    /// Nothing is known yet.
    #[default]
    Missing,
}

impl From<Freshness> for Quality {
    fn from(freshness: Freshness) -> Self {
        match freshness {
            Freshness::Fresh => Self::Good,
            Freshness::Stale => Self::Stale,
            Freshness::Never => Self::Missing,
        }
    }
}

/// One word as the drive sent it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct RawView {
    pub(crate) address: u16,
    /// The manual's mnemonic.
    pub(crate) code: &'static str,
    pub(crate) value: u16,
}

impl From<&RawWord> for RawView {
    fn from(raw: &RawWord) -> Self {
        Self { address: raw.address, code: raw.code, value: raw.value }
    }
}

/// The fast set: what control and safety need.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(crate) struct StatusView {
    pub(crate) quality: Quality,
    /// How long ago the drive sent it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) age_ms: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) state: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) direction: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output_frequency_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) current_a: Option<f64>,
    /// The current as a share of the drive's own base, where the drive tells that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) current_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at_reference: Option<bool>,
    /// Whether an alarm that does not trip is present.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) warning: Option<bool>,
    /// The vendor's code of the present fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fault_code: Option<u16>,
    /// Who commands the drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) control: Option<String>,
    /// Every word that it was read from.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) raw: Vec<RawView>,
}

impl StatusView {
    /// The status of a snapshot as it is at `now`.
    pub(crate) fn of(snapshot: &Snapshot, now: Instant) -> Self {
        let quality = snapshot.freshness(now).into();
        snapshot.status.as_ref().map(|status| Self::at(status, quality, now)).unwrap_or_default()
    }

    /// A status of the past, which is never shown as live.
    pub(crate) fn past(status: &Timed<Status>, now: Instant) -> Self {
        Self::at(status, Quality::Stale, now)
    }

    fn at(timed: &Timed<Status>, quality: Quality, now: Instant) -> Self {
        let status = &*timed.value;
        Self {
            quality,
            age_ms: Some(milliseconds(timed.age(now))),
            state: Some(word(status.state)),
            direction: status.direction.map(word),
            output_frequency_hz: status.output_frequency.map(hertz),
            current_a: status.current.map(amperes),
            current_percent: status.current_share.map(percent),
            at_reference: status.at_reference,
            warning: status.warning,
            fault_code: status.fault_code,
            control: status.control.map(word),
            raw: status.raw.iter().map(RawView::from).collect(),
        }
    }
}

/// The slow set: what a person or a trend wants to see.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(crate) struct MeasurementsView {
    pub(crate) quality: Quality,
    /// How long ago the drive sent it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) age_ms: Option<u64>,
    /// The drive has tripped, and what it holds still since then is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) before_trip: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reference: Option<SetpointView>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) speed_rpm: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output_voltage_v: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output_voltage_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) line_voltage_v: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) dc_bus_voltage_v: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) dc_bus_voltage_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) torque_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) power_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) input_power_kw: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output_power_kw: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drive_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) motor_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drive_load_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) motor_load_percent: Option<f64>,
    /// In the drive's own counts: its manual names no unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) input_energy_counts: Option<u32>,
    /// In the drive's own counts: its manual names no unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output_energy_counts: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) running_time_h: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) powered_time_h: Option<f64>,
    /// The logic inputs, bit by bit as the family's manual lists them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) inputs: Option<u16>,
    /// The logic outputs, bit by bit as the family's manual lists them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) outputs: Option<u16>,
    /// Every word that it was read from.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) raw: Vec<RawView>,
}

impl MeasurementsView {
    /// The measurements of a snapshot as they are at `now`. They are good while the drive answers and they have not
    /// failed to come twice; `slow` is the period at which they are asked for.
    pub(crate) fn of(snapshot: &Snapshot, slow: Duration, now: Instant) -> Self {
        let Some(timed) = &snapshot.measurements else { return Self::default() };
        let is_young = timed.age(now) <= slow * 2 + snapshot.max_age;
        let is_good = is_young && snapshot.freshness(now) == Freshness::Fresh;
        let quality = if is_good { Quality::Good } else { Quality::Stale };
        let measured: &Measurements = &timed.value;
        Self {
            quality,
            age_ms: Some(milliseconds(timed.age(now))),
            before_trip: measured.before_trip.then_some(true),
            reference: measured.reference.map(SetpointView::from),
            speed_rpm: measured.speed.map(Speed::rpm),
            output_voltage_v: measured.output_voltage.map(volts),
            output_voltage_percent: measured.output_voltage_share.map(percent),
            line_voltage_v: measured.line_voltage.map(volts),
            dc_bus_voltage_v: measured.dc_bus_voltage.map(volts),
            dc_bus_voltage_percent: measured.dc_bus_voltage_share.map(percent),
            torque_percent: measured.torque.map(percent),
            power_percent: measured.power_share.map(percent),
            input_power_kw: measured.input_power.map(kilowatts),
            output_power_kw: measured.output_power.map(kilowatts),
            drive_thermal_percent: measured.drive_thermal.map(percent),
            motor_thermal_percent: measured.motor_thermal.map(percent),
            drive_load_percent: measured.drive_load.map(percent),
            motor_load_percent: measured.motor_load.map(percent),
            input_energy_counts: measured.input_energy,
            output_energy_counts: measured.output_energy,
            running_time_h: measured.running_time.map(hours),
            powered_time_h: measured.powered_time.map(hours),
            inputs: measured.inputs,
            outputs: measured.outputs,
            raw: measured.raw.iter().map(RawView::from).collect(),
        }
    }
}

/// A setpoint: one of the two.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum SetpointView {
    /// The output frequency.
    Frequency(FrequencyView),
    /// The motor speed.
    Speed(SpeedView),
}

/// A setpoint in hertz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrequencyView {
    /// In hertz, with at most two decimals.
    pub(crate) frequency_hz: f64,
}

/// A setpoint in revolutions per minute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpeedView {
    pub(crate) speed_rpm: u32,
}

impl From<Setpoint> for SetpointView {
    fn from(setpoint: Setpoint) -> Self {
        match setpoint {
            Setpoint::Frequency(frequency) => {
                Self::Frequency(FrequencyView { frequency_hz: hertz(frequency) })
            }
            Setpoint::Speed(speed) => Self::Speed(SpeedView { speed_rpm: speed.rpm() }),
        }
    }
}

pub(super) fn hertz(frequency: Frequency) -> f64 {
    f64::from(frequency.centihertz()) / 100.0
}

fn amperes(current: Current) -> f64 {
    f64::from(current.deciamperes()) / 10.0
}

fn percent(percent: Percent) -> f64 {
    f64::from(percent.hundredths()) / 100.0
}

fn kilowatts(power: Power) -> f64 {
    f64::from(power.decawatts()) / 100.0
}

fn volts(voltage: Voltage) -> f64 {
    f64::from(voltage.decivolts()) / 10.0
}

fn hours(time: Duration) -> f64 {
    // A tenth of an hour is what the finest counter tells.
    (time.as_secs_f64() / 360.0).round() / 10.0
}
