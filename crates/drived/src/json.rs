//! What objects for programs have in common: one JSON object a line, numbers as integers with their unit in their name.

use std::time::{Duration, SystemTime};

use drive_core::{Current, Frequency, Status};
use serde::Serialize;
use tokio::time::Instant;

/// What a status tells of the motor, beside what each kind of object adds.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Motor {
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    output_frequency_centihertz: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    current_deciamperes: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault_code: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<String>,
}

impl From<&Status> for Motor {
    fn from(status: &Status) -> Self {
        Self {
            state: Some(status.state.to_string()),
            direction: status.direction.map(|direction| direction.to_string()),
            output_frequency_centihertz: status.output_frequency.map(Frequency::centihertz),
            current_deciamperes: status.current.map(Current::deciamperes),
            fault_code: status.fault_code,
            control: status.control.map(|control| control.to_string()),
        }
    }
}

/// An object as a line.
pub(crate) fn line(object: &impl Serialize) -> String {
    // Strings, integers and lists always have a JSON form.
    serde_json::to_string(object).unwrap_or_default()
}

/// A moment of the runtime's clock on the wall's, in milliseconds since 1970.
pub(crate) fn unix(at: Instant) -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    milliseconds(now.saturating_sub(Instant::now().saturating_duration_since(at)))
}

pub(crate) fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

pub(crate) fn microseconds(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}
