//! What each drive did, day by day.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which days are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DaysAsked {
    /// All, where none is named.
    pub drives: Vec<String>,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
}

/// A day of a drive, from midnight to midnight in this machine's zone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DayView {
    pub drive: String,
    /// `2026-11-21`.
    pub day: String,
    pub start_unix_ms: i64,
    /// The share of the day for which its state is known, from 0 to 1: what is told below is told of that.
    pub known: f64,
    /// For how long its motor ran.
    pub running_ms: i64,
    /// How often it was seen to begin to run.
    pub starts: u64,
    /// By what it tripped, and how often.
    pub trips: std::collections::BTreeMap<String, u64>,
    /// For how long a value was above a limit of this program's configuration.
    pub above_limits_ms: i64,
    /// For how long it told a warning of its own.
    pub warning_ms: i64,
    /// The electrical energy; absent where nothing is known of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyView>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub greatest_current_a: Option<f64>,
    /// The greatest thermal state of the motor and of the drive, in per cent, and what was left to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_margin_percent: Option<f64>,
}

/// Energy, and where it is from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnergyView {
    /// In kWh where it was summed up here, and in the drive's own counts where it has a counter.
    pub amount: f64,
    pub from: EnergyFrom,
}

/// Where an energy is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnergyFrom {
    /// The drive's own counter: its counts.
    Counter,
    /// Summed up here from its power over the time in which that is known: kWh, and what was used otherwise is not in it.
    Summed,
}
