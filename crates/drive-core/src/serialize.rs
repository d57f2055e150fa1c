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
    collections::BTreeSet,
    fmt,
    sync::{Mutex, PoisonError},
    time::{Duration, SystemTime},
};

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, Visitor},
};
use tokio::time::Instant;

use crate::{
    error::Refusal,
    faults::{Fault, FaultEntry},
    lease::{Lack, Verdict},
    setpoint::{Command, Direction, Setpoint, StopMode},
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
pub mod maybe_ms {
    use super::{Deserialize, Deserializer, Duration};

    pub use super::milliseconds as serialize;

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
        Ok(Option::<u64>::deserialize(deserializer)?.map(Duration::from_millis))
    }
}

/// A moment as its age in milliseconds that is also read back, for `#[serde(with = "…")]`: as long before it is read as it
/// was before it was written.
pub mod age_ms {
    use super::{Deserialize, Deserializer, Instant, moment};

    pub use super::age as serialize;

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Instant, D::Error> {
        u64::deserialize(deserializer).map(moment)
    }
}

/// The same, or none.
pub mod maybe_age {
    use super::{Deserialize, Deserializer, Instant, moment};

    pub use super::age as serialize;

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Instant>, D::Error> {
        Ok(Option::<u64>::deserialize(deserializer)?.map(moment))
    }
}

/// So long ago, or when this machine was started.
fn moment(age_ms: u64) -> Instant {
    let now = Instant::now();
    now.checked_sub(Duration::from_millis(age_ms)).unwrap_or(now)
}

/// A time in hours.
pub(crate) mod hours {
    use super::{Deserialize, Deserializer, Duration, Serialize, Serializer, de};

    pub(crate) fn serialize<S: Serializer>(
        time: &Option<Duration>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        time.map(|time| time.as_secs_f64() / 3_600.0).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Duration>, D::Error> {
        let hours = Option::<f64>::deserialize(deserializer)?;
        let time = hours.map(|hours| Duration::try_from_secs_f64(hours * 3_600.0));
        time.transpose().map_err(de::Error::custom)
    }
}

/// What the words that were read may take together, in bytes; one more is `?`.
const KEPT: usize = 1 << 20;

/// Words of a manual that were read, each kept once for the life of the program.
struct Words {
    texts: BTreeSet<&'static str>,
    entries: Vec<&'static FaultEntry>,
    bytes: usize,
}

static WORDS: Mutex<Words> = Mutex::new(Words { texts: BTreeSet::new(), entries: Vec::new(), bytes: 0 });

impl Words {
    /// Whether there is room for so many bytes more; they are counted then.
    fn takes(&mut self, bytes: usize) -> bool {
        let fits = self.bytes + bytes <= KEPT;
        self.bytes += if fits { bytes } else { 0 };
        fits
    }

    fn text(&mut self, text: &str) -> &'static str {
        if let Some(known) = self.texts.get(text) {
            return known;
        }
        if !self.takes(text.len() + size_of::<&str>()) {
            return "?";
        }
        let kept: &'static str = Box::leak(text.into());
        self.texts.insert(kept);
        kept
    }

    fn entry(&mut self, entry: FaultEntry) -> Option<&'static FaultEntry> {
        let known = self.entries.iter().copied().find(|known| **known == entry);
        known.or_else(|| {
            let kept: &'static FaultEntry =
                self.takes(size_of::<FaultEntry>()).then(|| &*Box::leak(Box::new(entry)))?;
            self.entries.push(kept);
            Some(kept)
        })
    }
}

/// A word of a manual, such as a mnemonic, for `#[serde(deserialize_with = "…")]`: the types of a drive have it from the
/// family's tables, for as long as the program lives. What is read is kept as long, once each and 1 MiB of all of them at the
/// most, whatever is sent; a word that has no room is `?`.
///
/// # Errors
/// Those of the deserializer.
pub fn kept<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static str, D::Error> {
    let text = String::deserialize(deserializer)?;
    Ok(WORDS.lock().unwrap_or_else(PoisonError::into_inner).text(&text))
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

impl<'de> Deserialize<'de> for Fault {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        struct Listed {
            code: u16,
            mnemonic: Option<String>,
            meaning: Option<String>,
            remedy: Option<String>,
        }
        let Listed { code, mnemonic, meaning, remedy } = Listed::deserialize(deserializer)?;
        let mut words = WORDS.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = mnemonic.zip(meaning).zip(remedy).and_then(|((mnemonic, meaning), remedy)| {
            let (mnemonic, meaning) = (words.text(&mnemonic), words.text(&meaning));
            let remedy = words.text(&remedy);
            words.entry(FaultEntry { code, mnemonic, meaning, remedy })
        });
        Ok(Self { code, entry })
    }
}

/// Its word, its text and what it was given: `{"action": "start", "command": "start forward", "direction": "forward"}`.
impl Serialize for Command {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut told = Told {
            action: self.action().into(),
            command: self.to_string(),
            direction: None,
            mode: None,
            setpoint: None,
            register: None,
        };
        match *self {
            Self::Start(direction) => told.direction = Some(direction),
            Self::Stop(mode) => told.mode = Some(mode),
            Self::Setpoint(setpoint) => told.setpoint = Some(setpoint),
            Self::WriteParameter(register) => told.register = Some(register),
            _ => {}
        }
        told.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Command {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Told { action, command, direction, mode, setpoint, register } = Told::deserialize(deserializer)?;
        let missing = |field| de::Error::missing_field(field);
        Ok(match &*action {
            "start" => Self::Start(direction.ok_or_else(|| missing("direction"))?),
            "stop" => Self::Stop(mode.ok_or_else(|| missing("mode"))?),
            "withdraw" => Self::Withdraw,
            "setpoint" => Self::Setpoint(setpoint.ok_or_else(|| missing("setpoint"))?),
            "reset" => Self::ResetFaults,
            "release" => Self::Release,
            "watchdog" => Self::ArmWatchdog,
            "parameter" => Self::WriteParameter(register.ok_or_else(|| missing("register"))?),
            "save" => Self::Persist,
            "configure" => {
                Self::Configure(WORDS.lock().unwrap_or_else(PoisonError::into_inner).text(&command))
            }
            other => return Err(de::Error::custom(format_args!("no command is called {other:?}"))),
        })
    }
}

#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct Told {
    action: String,
    command: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<Direction>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mode: Option<StopMode>,
    #[serde(skip_serializing_if = "Option::is_none")]
    setpoint: Option<Setpoint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    register: Option<u16>,
}

/// A verdict as an object: its word, what is lacking, and the sentence.
pub(crate) mod verdict {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Verdict, VerdictObject};

    pub(crate) fn serialize<S: Serializer>(
        verdict: &Option<Verdict>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        verdict.as_ref().map(VerdictObject::from).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Verdict>, D::Error> {
        Ok(Option::<VerdictObject>::deserialize(deserializer)?.map(Verdict::from))
    }
}

#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct VerdictObject {
    verdict: String,
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
        let because = verdict.because().map(|because| because.to_string());
        Self { verdict: verdict.word().to_owned(), lacks, because }
    }
}

impl From<VerdictObject> for Verdict {
    fn from(object: VerdictObject) -> Self {
        let VerdictObject { verdict, lacks, because } = object;
        match (&*verdict, lacks) {
            ("in_force", _) => Self::InForce,
            ("not_in_force", Some(lacks)) => {
                let because = because.unwrap_or_default();
                let because = WORDS.lock().unwrap_or_else(PoisonError::into_inner).text(&because);
                // The sentence is what is told of a reason.
                Self::lacks(lacks, Refusal::Settings(because))
            }
            _ => Self::NotKnown,
        }
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
