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

/// A time in nanoseconds, whole, that is also read back as the very same, for `#[serde(with = "…")]`: for what is counted or
/// planned, of which a millisecond is much. Longer ones than a `u64` holds, 584 years, are written as that.
pub mod duration_ns {
    use super::{Deserialize, Deserializer, Duration, Serialize, Serializer, whole_ns};

    /// Writes it.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
        whole_ns(*time).serialize(serializer)
    }

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
        u64::deserialize(deserializer).map(Duration::from_nanos)
    }
}

/// The same, or none.
pub mod maybe_ns {
    use super::{Deserialize, Deserializer, Duration, Serialize, Serializer, whole_ns};

    /// Writes it.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(time: &Option<Duration>, serializer: S) -> Result<S::Ok, S::Error> {
        time.map(whole_ns).serialize(serializer)
    }

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
        Ok(Option::<u64>::deserialize(deserializer)?.map(Duration::from_nanos))
    }
}

/// A value of which the text says everything, as that text, for `#[serde(with = "…")]`: what its `Display` writes, and its
/// `FromStr` reads.
///
/// ```
/// use drive_core::SerialSettings;
///
/// #[derive(serde::Serialize, serde::Deserialize)]
/// struct Wiring {
///     #[serde(with = "drive_core::serialize::as_text")]
///     address: std::net::SocketAddr,
///     // This one is written so by itself.
///     serial: SerialSettings,
/// }
///
/// let text = r#"{"address":"10.0.0.5:502","serial":"19200 8E1"}"#;
/// let wiring: Wiring = serde_json::from_str(text)?;
/// assert_eq!(serde_json::to_string(&wiring)?, text);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub mod as_text {
    use std::{fmt::Display, str::FromStr};

    use super::{Deserialize, Deserializer, Serializer, de};

    /// Writes it.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(value: &impl Display, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(value)
    }

    /// Reads it.
    ///
    /// # Errors
    /// Those of the deserializer, and what the text is not.
    pub fn deserialize<'de, T, D>(deserializer: D) -> Result<T, D::Error>
    where
        T: FromStr<Err: Display>,
        D: Deserializer<'de>,
    {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

/// Has a type written and read as its text, by [`as_text`].
#[doc(hidden)]
#[macro_export]
macro_rules! written_as_text {
    ($($type:ty),+ $(,)?) => {$(
        impl ::serde::Serialize for $type {
            fn serialize<S: ::serde::Serializer>(
                &self,
                serializer: S,
            ) -> ::std::result::Result<S::Ok, S::Error> {
                $crate::serialize::as_text::serialize(self, serializer)
            }
        }

        impl<'de> ::serde::Deserialize<'de> for $type {
            fn deserialize<D: ::serde::Deserializer<'de>>(
                deserializer: D,
            ) -> ::std::result::Result<Self, D::Error> {
                $crate::serialize::as_text::deserialize(deserializer)
            }
        }
    )+};
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
    bytes: usize,
}

static WORDS: Mutex<Words> = Mutex::new(Words { texts: BTreeSet::new(), bytes: 0 });

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
}

/// The same text, kept; `?` where there is no room.
pub(crate) fn text(text: &str) -> &'static str {
    WORDS.lock().unwrap_or_else(PoisonError::into_inner).text(text)
}

/// Whether what is read may take so many bytes more; they are counted then.
pub(crate) fn there_is_room_for(bytes: usize) -> bool {
    WORDS.lock().unwrap_or_else(PoisonError::into_inner).takes(bytes)
}

/// A word of a manual, such as a mnemonic, for `#[serde(deserialize_with = "…")]`: the types of a drive have it from the
/// family's tables, for as long as the program lives. What is read is kept as long, once each and 1 MiB of all of them at the
/// most, whatever is sent; a word that has no room is `?`.
///
/// # Errors
/// Those of the deserializer.
pub fn kept<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static str, D::Error> {
    Ok(text(&String::deserialize(deserializer)?))
}

fn whole_ns(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
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

#[cfg(test)]
mod tests;
