//! Units as types: integers at the wire's own resolution, so that nothing is rounded on the way.

use std::{fmt, str::FromStr};

/// A text that is no value with its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected {0}")]
pub struct UnitError(pub(crate) &'static str);

/// Declares a unit that is an integer with a fixed number of decimals.
macro_rules! decimal_unit {
    ($(#[$meta:meta])* $name:ident($inner:ty), $from:ident, $to:ident, $decimals:literal, $symbol:literal) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        pub struct $name($inner);

        impl $name {
            #[doc = concat!("From the integer that counts its smallest step; prints with ", $decimals, " decimals in ", $symbol, ".")]
            #[must_use]
            pub const fn $from(value: $inner) -> Self {
                Self(value)
            }

            /// As the integer that counts its smallest step.
            #[must_use]
            pub const fn $to(self) -> $inner {
                self.0
            }

            #[doc = "The sum; `None` where this unit cannot hold it."]
            #[must_use]
            pub const fn checked_add(self, other: Self) -> Option<Self> {
                match self.0.checked_add(other.0) {
                    Some(sum) => Some(Self(sum)),
                    None => None,
                }
            }

            #[doc = "The difference; `None` where this unit cannot hold it, as one below zero of what has no sign."]
            #[must_use]
            pub const fn checked_sub(self, other: Self) -> Option<Self> {
                match self.0.checked_sub(other.0) {
                    Some(difference) => Some(Self(difference)),
                    None => None,
                }
            }

            #[doc = "The sum, or the most that this unit holds."]
            #[must_use]
            pub const fn saturating_add(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }

            #[doc = "The difference, or the least that this unit holds."]
            #[must_use]
            pub const fn saturating_sub(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write_decimal(f, i64::from(self.0), $decimals)?;
                f.write_str(concat!(" ", $symbol))
            }
        }

        #[doc = concat!("Reads a number with at most ", $decimals, " decimals and its unit, `", $symbol, "`.")]
        impl FromStr for $name {
            type Err = UnitError;

            fn from_str(text: &str) -> Result<Self, UnitError> {
                let counts = without_unit(text, $symbol).and_then(|number| read_decimal(number, $decimals));
                let value = counts.and_then(|counts| <$inner>::try_from(counts).ok()).map(Self);
                value.ok_or(UnitError(concat!("a number with at most ", $decimals, " decimals and its unit, ", $symbol)))
            }
        }

        #[cfg(feature = "serde")]
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                crate::serialize::decimal(i64::from(self.0), $decimals, serializer)
            }
        }

        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let counts = crate::serialize::read_decimal(deserializer, $decimals, $symbol)?;
                let (least, most) = (Self(<$inner>::MIN), Self(<$inner>::MAX));
                <$inner>::try_from(counts).map(Self).map_err(|_| {
                    let mut number = String::new();
                    let _ = write_decimal(&mut number, counts, $decimals);
                    serde::de::Error::custom(format_args!("{number} {} is outside {least} to {most}", $symbol))
                })
            }
        }

        #[cfg(feature = "schemars")]
        impl schemars::JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "type": "number" })
            }
        }
    };
}

decimal_unit! {
    /// A frequency in hundredths of a hertz, without a sign: the direction is said apart.
    ///
    /// ```
    /// use drive_core::Frequency;
    ///
    /// assert_eq!(Frequency::from_hertz(50), Frequency::from_centihertz(5_000));
    /// assert_eq!(Frequency::from_centihertz(4_750).to_string(), "47.50 Hz");
    /// ```
    Frequency(u32), from_centihertz, centihertz, 2, "Hz"
}
decimal_unit! {
    /// A speed in revolutions per minute, without a sign.
    ///
    /// ```
    /// use drive_core::Speed;
    ///
    /// assert_eq!("1450 rpm".parse(), Ok(Speed::from_rpm(1_450)));
    /// ```
    Speed(u32), from_rpm, rpm, 0, "rpm"
}
decimal_unit! {
    /// A current in tenths of an ampere.
    ///
    /// ```
    /// use drive_core::Current;
    ///
    /// let (measured, limit) = (Current::from_deciamperes(93), Current::from_deciamperes(85));
    /// assert!(measured > limit);
    /// assert_eq!(measured.saturating_sub(limit).to_string(), "0.8 A");
    /// ```
    Current(u32), from_deciamperes, deciamperes, 1, "A"
}
decimal_unit! {
    /// A voltage in tenths of a volt.
    ///
    /// ```
    /// use drive_core::Voltage;
    ///
    /// assert_eq!(Voltage::from_decivolts(5_402).to_string(), "540.2 V");
    /// ```
    Voltage(u32), from_decivolts, decivolts, 1, "V"
}
decimal_unit! {
    /// A share in hundredths of a percent, signed (torque has a direction).
    ///
    /// ```
    /// use drive_core::Percent;
    ///
    /// let torque = Percent::from_percent(-35);
    /// assert_eq!(torque.to_string(), "-35.00 %");
    /// assert_eq!(torque.checked_add(Percent::from_hundredths(50)), Some(Percent::from_hundredths(-3_450)));
    /// ```
    Percent(i32), from_hundredths, hundredths, 2, "%"
}
decimal_unit! {
    /// A power in tens of watts (0.01 kW).
    ///
    /// ```
    /// use drive_core::Power;
    ///
    /// assert_eq!("0.75 kW".parse(), Ok(Power::from_decawatts(75)));
    /// assert!("750 W".parse::<Power>().is_err(), "a unit is not guessed");
    /// ```
    Power(i32), from_decawatts, decawatts, 2, "kW"
}

impl Frequency {
    /// Standstill.
    pub const ZERO: Self = Self(0);

    /// From tenths of a hertz, the resolution of most Altivar registers.
    #[must_use]
    pub const fn from_decihertz(decihertz: u16) -> Self {
        Self(decihertz as u32 * 10)
    }

    /// From whole hertz.
    #[must_use]
    pub const fn from_hertz(hertz: u16) -> Self {
        Self(hertz as u32 * 100)
    }

    /// In tenths of a hertz, if it is a whole number of them and fits a signed word; a setpoint that the register
    /// cannot hold is not rounded.
    #[must_use]
    pub const fn exact_decihertz(self) -> Option<u16> {
        if self.0.is_multiple_of(10) && self.0 / 10 <= i16::MAX as u32 {
            Some((self.0 / 10) as u16)
        } else {
            None
        }
    }
}

impl Percent {
    /// From whole percents.
    #[must_use]
    pub const fn from_percent(percent: i16) -> Self {
        Self(percent as i32 * 100)
    }
}

/// Writes `value` × 10^-`decimals` without passing through a float.
pub(crate) fn write_decimal(f: &mut impl fmt::Write, value: i64, decimals: u8) -> fmt::Result {
    let scale = 10_u64.pow(u32::from(decimals));
    let magnitude = value.unsigned_abs();
    if value < 0 {
        f.write_char('-')?;
    }
    if decimals == 0 {
        return write!(f, "{magnitude}");
    }
    write!(f, "{}.{:0width$}", magnitude / scale, magnitude % scale, width = usize::from(decimals))
}

/// The number before a unit, whatever the unit's case.
fn without_unit<'a>(text: &'a str, symbol: &str) -> Option<&'a str> {
    let text = text.trim();
    let (number, unit) = text.split_at_checked(text.len().checked_sub(symbol.len())?)?;
    unit.eq_ignore_ascii_case(symbol).then_some(number.trim_end())
}

/// Reads a decimal number as an integer of `decimals` places; `None` when it is none or has more places.
pub(crate) fn read_decimal(text: &str, decimals: u8) -> Option<i64> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let decimals = usize::from(decimals);
    let only_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || fraction.len() > decimals || !only_digits(whole) || !only_digits(fraction) {
        return None;
    }
    let value: i64 = format!("{whole}{fraction:0<decimals$}").parse().ok()?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_prints_with_its_decimals_and_its_sign() {
        assert_eq!(Current::from_deciamperes(23).to_string(), "2.3 A");
        assert_eq!(Percent::from_hundredths(-5).to_string(), "-0.05 %");
        assert_eq!(Percent::from_percent(-118).to_string(), "-118.00 %");
        assert_eq!(Power::from_decawatts(75).to_string(), "0.75 kW");
    }

    #[test]
    fn a_frequency_that_tenths_cannot_hold_is_not_rounded() {
        assert_eq!(Frequency::from_centihertz(1_234).exact_decihertz(), None);
        assert_eq!(Frequency::from_centihertz(1_230).exact_decihertz(), Some(123));
        assert_eq!(Frequency::from_centihertz(u32::MAX / 10 * 10).exact_decihertz(), None);
    }

    #[test]
    fn sums_and_differences_never_wrap() {
        let (three, two) = (Frequency::from_hertz(3), Frequency::from_hertz(2));
        assert_eq!(three.checked_sub(two), Some(Frequency::from_hertz(1)));
        assert_eq!((two.checked_sub(three), two.saturating_sub(three)), (None, Frequency::ZERO));
        let most = Frequency::from_centihertz(u32::MAX);
        assert_eq!((most.checked_add(two), most.saturating_add(two)), (None, most));
        assert_eq!(
            Percent::from_percent(5).checked_sub(Percent::from_percent(8)),
            Some(Percent::from_percent(-3))
        );
    }

    #[test]
    fn a_value_reads_back_as_it_is_printed_and_is_nothing_without_its_unit() {
        for centihertz in [0, 1, 3_050, u32::MAX] {
            let frequency = Frequency::from_centihertz(centihertz);
            assert_eq!(frequency.to_string().parse(), Ok(frequency));
        }
        assert_eq!("-118.00 %".parse(), Ok(Percent::from_percent(-118)));
        assert_eq!(" 0.75KW".parse(), Ok(Power::from_decawatts(75)));
        assert_eq!("900rpm".parse(), Ok(Speed::from_rpm(900)));
        for text in
            ["", "30", "Hz", "30.005 Hz", "-5 Hz", "30 rpm", "42949672.96 Hz", "30 H\u{7a}\u{301}", "é"]
        {
            assert!(text.parse::<Frequency>().is_err(), "{text}");
        }
        assert_eq!(
            "".parse::<Speed>().unwrap_err().to_string(),
            "expected a number with at most 0 decimals and its unit, rpm"
        );
    }

    #[test]
    fn a_decimal_reads_back_and_rejects_what_it_cannot_hold() {
        assert_eq!(read_decimal("50", 1), Some(500));
        assert_eq!(read_decimal("-50.5", 1), Some(-505));
        assert_eq!(read_decimal("50.55", 1), None);
        for text in ["", "-", ".5", "5,0", "+5", "1e3", "99999999999999999999"] {
            assert_eq!(read_decimal(text, 1), None, "{text}");
        }
    }
}
