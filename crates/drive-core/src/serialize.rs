//! How times and numbers are written for programs, for types of your own beside those of this crate: wall time as
//! `time_unix_ms`, ages as `age_ms`, numbers in the unit that their key ends with. With the feature `serde`.
//!
//! ```
//! #[derive(serde::Serialize)]
//! struct Reading {
//!     #[serde(rename = "time_unix_ms", serialize_with = "drive_core::serialize::unix_ms")]
//!     at: tokio::time::Instant,
//!     #[serde(rename = "output_frequency_hz")]
//!     output_frequency: drive_core::Frequency,
//! }
//! ```

use std::{
    fmt,
    time::{Duration, SystemTime},
};

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, Visitor},
};
use tokio::time::Instant;

use crate::{
    faults::{Fault, FaultEntry},
    lease::{Lack, Verdict},
    setpoint::Command,
};

/// A moment, or none, as its age in milliseconds when it is written.
///
/// # Errors
/// Those of the serializer.
pub fn age<S: Serializer>(
    at: &(impl Copy + Into<Option<Instant>>),
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let at: Option<Instant> = (*at).into();
    at.map(|at| whole_ms(at.elapsed())).serialize(serializer)
}

/// A moment of the runtime's clock as milliseconds since 1970 on the wall's, as that stands when it is written.
///
/// # Errors
/// Those of the serializer.
pub fn unix_ms<S: Serializer>(at: &Instant, serializer: S) -> Result<S::Ok, S::Error> {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    whole_ms(now.saturating_sub(at.elapsed())).serialize(serializer)
}

/// A time, or none, in milliseconds.
///
/// # Errors
/// Those of the serializer.
pub fn milliseconds<S: Serializer>(
    time: &(impl Copy + Into<Option<Duration>>),
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let time: Option<Duration> = (*time).into();
    time.map(whole_ms).serialize(serializer)
}

/// A time in milliseconds that is also read back, for `#[serde(with = "…")]`.
pub mod duration_ms {
    use super::{Deserialize, Deserializer, Duration};

    pub use super::milliseconds as serialize;

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
        u64::deserialize(deserializer).map(Duration::from_millis)
    }
}

/// A time in milliseconds, or none.
pub(crate) mod maybe_ms {
    use super::{Deserialize, Deserializer, Duration};

    pub(crate) use super::milliseconds as serialize;

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Duration>, D::Error> {
        Ok(Option::<u64>::deserialize(deserializer)?.map(Duration::from_millis))
    }
}

/// A time in hours.
pub(crate) fn hours<S: Serializer>(time: &Option<Duration>, serializer: S) -> Result<S::Ok, S::Error> {
    time.map(|time| time.as_secs_f64() / 3_600.0).serialize(serializer)
}

fn whole_ms(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// `counts` × 10^-`decimals` as a number.
pub(crate) fn decimal<S: Serializer>(counts: i64, decimals: u8, serializer: S) -> Result<S::Ok, S::Error> {
    match decimals {
        0 => serializer.serialize_i64(counts),
        _ => serializer.serialize_f64(counts as f64 / scale(decimals)),
    }
}

/// Reads a number as an integer of `decimals` places; one that has more places is an error and not rounded.
pub(crate) fn read_decimal<'de, D: Deserializer<'de>>(
    deserializer: D,
    decimals: u8,
    symbol: &'static str,
) -> Result<i64, D::Error> {
    deserializer.deserialize_f64(Number { decimals, symbol })
}

/// What an `f64` holds exactly.
const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;

fn scale(decimals: u8) -> f64 {
    10_f64.powi(i32::from(decimals))
}

struct Number {
    decimals: u8,
    symbol: &'static str,
}

impl Visitor<'_> for Number {
    type Value = i64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number in {} with {} decimals at the most", self.symbol, self.decimals)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<i64, E> {
        let scale = scale(self.decimals);
        let counts = (value * scale).round();
        // The nearest double of a decimal divides back to itself.
        if counts.abs() < EXACT && counts / scale == value {
            Ok(counts as i64)
        } else {
            Err(E::invalid_value(de::Unexpected::Float(value), &self))
        }
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<i64, E> {
        let counts = value.checked_mul(10_i64.pow(u32::from(self.decimals)));
        counts.ok_or_else(|| E::invalid_value(de::Unexpected::Signed(value), &self))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<i64, E> {
        let signed = i64::try_from(value);
        self.visit_i64(signed.map_err(|_| E::custom("the number is too large"))?)
    }
}

/// What the manual does not list has a code alone.
impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Unlisted {
            code: u16,
        }
        match self.entry {
            Some(entry) => FaultEntry { code: self.code, ..*entry }.serialize(serializer),
            None => Unlisted { code: self.code }.serialize(serializer),
        }
    }
}

/// Its word and its text: `{"action": "start", "command": "start forward"}`.
impl Serialize for Command {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Told { action: self.action(), command: self.to_string() }.serialize(serializer)
    }
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct Told {
    action: &'static str,
    command: String,
}

/// A verdict as an object: its word, what is lacking, and the sentence.
pub(crate) fn verdict<S: Serializer>(verdict: &Option<Verdict>, serializer: S) -> Result<S::Ok, S::Error> {
    verdict.as_ref().map(VerdictObject::from).serialize(serializer)
}

#[derive(Serialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct VerdictObject {
    verdict: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    lacks: Option<Lack>,
    #[serde(skip_serializing_if = "Option::is_none")]
    because: Option<String>,
}

impl From<&Verdict> for VerdictObject {
    fn from(verdict: &Verdict) -> Self {
        let lacks = match verdict {
            Verdict::NotInForce { lacks, .. } => Some(*lacks),
            Verdict::InForce | Verdict::NotKnown => None,
        };
        Self { verdict: verdict.word(), lacks, because: verdict.because().map(|because| because.to_string()) }
    }
}

#[cfg(feature = "schemars")]
mod schemas {
    use std::borrow::Cow;

    use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

    use super::{Command, Fault, Told};

    impl JsonSchema for Command {
        fn schema_name() -> Cow<'static, str> {
            "Command".into()
        }

        fn json_schema(generator: &mut SchemaGenerator) -> Schema {
            Told::json_schema(generator)
        }
    }

    impl JsonSchema for Fault {
        fn schema_name() -> Cow<'static, str> {
            "Fault".into()
        }

        fn json_schema(_: &mut SchemaGenerator) -> Schema {
            json_schema!({
                "type": "object",
                "properties": {
                    "code": {"type": "integer"},
                    "mnemonic": {"type": "string"},
                    "meaning": {"type": "string"},
                    "remedy": {"type": "string"}
                },
                "required": ["code"]
            })
        }
    }
}

#[cfg(test)]
mod tests;
