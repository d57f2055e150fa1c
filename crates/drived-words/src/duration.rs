//! Times as a person writes them: `500ms`, `1s`, `2min`, `0`.

use std::{str::FromStr, time::Duration};

/// A time from the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Time(pub Duration);

impl FromStr for Time {
    type Err = NoTime;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let digits = text.find(|character: char| !character.is_ascii_digit()).unwrap_or(text.len());
        let (number, unit) = text.split_at(digits);
        let number: u32 = number.parse().map_err(|_| NoTime(String::new()))?;
        let number = u64::from(number);
        match unit.trim_start() {
            "ms" => Ok(Self(Duration::from_millis(number))),
            "s" => Ok(Self(Duration::from_secs(number))),
            "min" => Ok(Self(Duration::from_secs(number * 60))),
            "h" => Ok(Self(Duration::from_secs(number * 3_600))),
            "d" => Ok(Self(Duration::from_secs(number * 86_400))),
            "" if number == 0 => Ok(Self(Duration::ZERO)),
            "" => Err(NoTime(format!(": {number} of what? {number}s or {number}min"))),
            _ => Err(NoTime(String::new())),
        }
    }
}

/// A text that is no time.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a whole number and a unit, such as 500ms, 1s or 2min{0}")]
pub struct NoTime(String);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_needs_its_unit_unless_it_is_0() {
        for (text, time) in [
            ("500ms", Duration::from_millis(500)),
            ("1s", Duration::from_secs(1)),
            ("2 min", Duration::from_secs(120)),
            ("3h", Duration::from_secs(10_800)),
            ("90d", Duration::from_secs(7_776_000)),
            ("0", Duration::ZERO),
        ] {
            assert_eq!(text.parse(), Ok(Time(time)), "{text}");
        }
        for text in ["", "5", "s", "-1s", "1.5s", "1h30", "99999999999s"] {
            let refused = text.parse::<Time>().unwrap_err().to_string();
            assert!(refused.starts_with("expected a whole number and a unit"), "{text}: {refused}");
        }
        assert!("5".parse::<Time>().unwrap_err().to_string().ends_with("5 of what? 5s or 5min"));
    }
}
