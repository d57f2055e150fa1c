//! Values of the file as a person writes them: `"500ms"`, `47.5`, `"ramp"`.

use std::{fmt, str::FromStr};

use drive_core::{Current, Frequency, Lack, Percent, Reaction, StopMode};
use drive_fleet::{
    Alarms, Band, FrequencyLimits, OnControlTaken, OnExit, OnExitAdopted, OnExitWatchdog, OnFault, OnLoss,
};
use serde::{Deserialize, Deserializer, de};

use drived_words::duration::Time;

/// A value that is written as a text and read by its own rules, whose error says what was expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parsed<T>(pub T);

impl<'de, T> Deserialize<'de> for Parsed<T>
where
    T: FromStr<Err: fmt::Display>,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a text in quotes, such as \"500ms\" or \"ramp\"")]
        enum Text {
            Text(String),
        }
        let Text::Text(text) = Text::deserialize(deserializer)?;
        text.parse().map(Self).map_err(|error| de::Error::custom(format_args!("{text:?}: {error}")))
    }
}

/// A text that is none of a few words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected one of {}", .0.join(", "))]
pub struct NotAmong(pub &'static [&'static str]);

/// Declares a value that is one of a few words.
#[macro_export]
macro_rules! words {
    ($(#[$meta:meta])* $name:ident($inner:ty): $($word:literal => $value:expr),+) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name(pub $inner);

        impl std::str::FromStr for $name {
            type Err = $crate::config::NotAmong;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($word => Ok(Self($value)),)+
                    _ => Err($crate::config::NotAmong(&[$($word),+])),
                }
            }
        }
    };
}

pub use words;

words! {
    /// What a watchdog does.
    ReactionValue(Reaction):
    "ramp" => Reaction::Ramp,
    "fast" => Reaction::Fast,
    "freewheel" => Reaction::Freewheel,
    "dc-injection" => Reaction::DcInjection,
    "trip" => Reaction::Trip
}

words! {
    /// What happens at the exit; how it stops is said apart.
    ExitPolicy(OnExit):
    "stop" => OnExit::Stop(StopMode::Ramp),
    "release" => OnExit::Release(StopMode::Ramp),
    "leave" => OnExit::Leave
}

words! {
    /// What happens at the exit to a motor that turns and that was not started here.
    AdoptedPolicy(OnExitAdopted):
    "report" => OnExitAdopted::Report,
    "stop" => OnExitAdopted::Stop(StopMode::Ramp),
    "leave" => OnExitAdopted::Leave
}

words! {
    /// What happens at the exit to the watchdog of a drive that stands.
    WatchdogPolicy(OnExitWatchdog):
    "restore-in-ram" => OnExitWatchdog::RestoreInRam,
    "restore" => OnExitWatchdog::Restore,
    "leave" => OnExitWatchdog::Leave
}

words! {
    /// Whether a drive that was lost is stopped when it returns.
    LossPolicy(OnLoss):
    "report" => OnLoss::Report,
    "stop" => OnLoss::Stop(StopMode::Ramp)
}

words! {
    /// Whether the trip of a watchdog is reset.
    FaultPolicy(OnFault):
    "report" => OnFault::Report,
    "reset-watchdog-trip" => OnFault::ResetWatchdogTrip
}

words! {
    /// What happens when somebody else takes control.
    TakenPolicy(OnControlTaken):
    "withdraw" => OnControlTaken::Withdraw,
    "report" => OnControlTaken::Report
}

words! {
    /// What a run command may lack for a while and then act again by itself.
    LackValue(Lack):
    "command" => Lack::Command,
    "reference" => Lack::Reference,
    "output" => Lack::Output
}

/// The value of a drive's option: a text or a whole number, read by the option itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OptionValue(pub(super) String);

impl<'de> Deserialize<'de> for OptionValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a text or a whole number")]
        enum Value {
            Text(String),
            Number(i64),
        }
        Ok(Self(match Value::deserialize(deserializer)? {
            Value::Text(text) => text,
            Value::Number(number) => number.to_string(),
        }))
    }
}

/// A number with at most so many decimals, as an integer of them.
fn decimal<'de, D: Deserializer<'de>>(deserializer: D, decimals: u8) -> Result<u32, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a number")]
    enum Number {
        Whole(i64),
        Fraction(f64),
    }
    let scale = 10_i64.pow(u32::from(decimals));
    let scaled = match Number::deserialize(deserializer)? {
        Number::Whole(whole) => whole.checked_mul(scale).and_then(|scaled| u32::try_from(scaled).ok()),
        Number::Fraction(fraction) => {
            // A person wrote it: it has to be the number that its decimals say.
            let scaled = (fraction * scale as f64).round();
            let exact = (scaled / scale as f64 - fraction).abs() < f64::EPSILON * fraction.abs().max(1.0);
            (exact && (0.0..=f64::from(u32::MAX)).contains(&scaled)).then_some(scaled as u32)
        }
    };
    scaled.ok_or_else(|| {
        de::Error::custom(format_args!("expected a number from 0 on with at most {decimals} decimals"))
    })
}

/// A frequency in hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FrequencyValue(pub(super) Frequency);

impl<'de> Deserialize<'de> for FrequencyValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        decimal(deserializer, 2).map(|value| Self(Frequency::from_centihertz(value)))
    }
}

/// A current in amperes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CurrentValue(pub(super) Current);

impl<'de> Deserialize<'de> for CurrentValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        decimal(deserializer, 1).map(|value| Self(Current::from_deciamperes(value)))
    }
}

/// A share in percent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PercentValue(pub(super) Percent);

impl<'de> Deserialize<'de> for PercentValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = decimal(deserializer, 2)?;
        let value = i32::try_from(value).map_err(|_| de::Error::custom("expected a smaller percentage"))?;
        Ok(Self(Percent::from_hundredths(value)))
    }
}

/// A band of frequencies, `[LOW, HIGH]` in hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BandValue(pub(super) Band);

impl<'de> Deserialize<'de> for BandValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // An array of two would take the first two of more.
        match Vec::<FrequencyValue>::deserialize(deserializer)?.as_slice() {
            [low, high] => Ok(Self(Band { low: low.0, high: high.0 })),
            other => Err(de::Error::custom(format_args!(
                "a band of {} frequencies: expected [LOW, HIGH]",
                other.len()
            ))),
        }
    }
}

/// `watchdog`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WatchdogEntry {
    pub(super) time: Parsed<Time>,
    pub(super) reaction: Parsed<ReactionValue>,
}

/// `frequency`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrequencyEntry {
    low: Option<FrequencyValue>,
    high: Option<FrequencyValue>,
    #[serde(default)]
    forbidden: Vec<BandValue>,
    change_per_second: Option<FrequencyValue>,
}

impl FrequencyEntry {
    pub(super) fn limits(&self) -> FrequencyLimits {
        FrequencyLimits {
            low: self.low.map(|value| value.0),
            high: self.high.map(|value| value.0),
            forbidden: self.forbidden.iter().map(|band| band.0).collect(),
            change_per_second: self.change_per_second.map(|value| value.0),
        }
    }
}

/// `alarms`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlarmsEntry {
    current: Option<CurrentValue>,
    drive_thermal: Option<PercentValue>,
    motor_thermal: Option<PercentValue>,
}

impl AlarmsEntry {
    pub(super) fn alarms(&self) -> Alarms {
        Alarms {
            current: self.current.map(|value| value.0),
            drive_thermal: self.drive_thermal.map(|value| value.0),
            motor_thermal: self.motor_thermal.map(|value| value.0),
        }
    }
}
