//! What objects for programs have in common: one JSON object a line.

use std::time::{Duration, SystemTime};

use serde::Serialize;
use tokio::time::Instant;

/// An object as a line.
pub fn line(object: &impl Serialize) -> String {
    // Strings, numbers and lists always have a JSON form.
    serde_json::to_string(object).unwrap_or_default()
}

/// A moment of the runtime's clock on the wall's, in milliseconds since 1970.
pub fn unix(at: Instant) -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    milliseconds(now.saturating_sub(Instant::now().saturating_duration_since(at)))
}

pub fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

pub fn microseconds(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}
