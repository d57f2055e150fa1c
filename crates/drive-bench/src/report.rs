//! The table, row by row as it is measured.

use std::time::Duration;

use serde_json::json;

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    /// A part of a whole, 1 being all of it.
    Share,
    /// So many times another measurement.
    Times,
    Millis,
    Micros,
    KiB,
    Count,
}

impl Unit {
    const fn name(self) -> &'static str {
        match self {
            Self::Share => "",
            Self::Times => "x",
            Self::Millis => "ms",
            Self::Micros => "us",
            Self::KiB => "KiB",
            Self::Count => "count",
        }
    }

    fn show(self, value: f64) -> String {
        match self {
            Self::Share => format!("{value:.4}"),
            Self::Times => format!("{value:.3} ×"),
            Self::Millis => format!("{value:.3} ms"),
            Self::Micros => format!("{value:.2} µs"),
            Self::KiB => format!("{value:.0} KiB"),
            Self::Count => format!("{value:.0}"),
        }
    }
}

/// What a number should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Goal {
    /// Nothing is wanted of it: it stands beside one that has a goal.
    None,
    AtLeast(f64),
    AtMost(f64),
}

/// Prints rows as they come.
#[derive(Debug)]
pub(crate) struct Report {
    json: bool,
}

impl Report {
    /// The head of the table, unless the rows are wanted as JSON.
    pub(crate) fn new(json: bool) -> Self {
        if !json {
            println!("| Section | Measured | Value | Goal | Met | Value / goal |");
            println!("|---|---|---|---|---|---|");
        }
        Self { json }
    }

    /// One row.
    pub(crate) fn row(&mut self, section: &str, what: impl AsRef<str>, unit: Unit, value: f64, goal: Goal) {
        let what = what.as_ref();
        let wanted = match goal {
            Goal::None => None,
            Goal::AtLeast(wanted) => Some(("≥", wanted, value >= wanted)),
            Goal::AtMost(wanted) => Some(("≤", wanted, value <= wanted)),
        };
        let ratio =
            wanted.map(|(_, wanted, _)| value / wanted).filter(|ratio| ratio.is_finite() && *ratio > 0.0);
        if self.json {
            let row = json!({
                "section": section,
                "measured": what,
                "unit": unit.name(),
                "value": value,
                "goal": wanted.map(|(relation, wanted, _)| json!({ "relation": relation, "value": wanted })),
                "met": wanted.map(|(_, _, met)| met),
                "ratio": ratio,
            });
            println!("{row}");
            return;
        }
        let shown = wanted.map(|(relation, wanted, _)| match unit {
            _ if wanted == 0.0 => "0".to_owned(),
            Unit::Share => format!("{relation} {wanted:.3}"),
            _ => format!("{relation} {}", unit.show(wanted)),
        });
        let met = wanted.map_or("", |(_, _, met)| if met { "yes" } else { "**no**" });
        println!(
            "| {section} | {what} | {} | {} | {met} | {} |",
            unit.show(value),
            shown.unwrap_or_default(),
            ratio.map(|ratio| format!("{ratio:.3}")).unwrap_or_default(),
        );
    }

    /// A row that has no goal.
    pub(crate) fn note(&mut self, section: &str, what: impl AsRef<str>, unit: Unit, value: f64) {
        self.row(section, what, unit, value, Goal::None);
    }
}

/// Milliseconds of a duration, for a person to read.
pub(crate) fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// Microseconds of a duration, for a person to read.
pub(crate) fn micros(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e6
}

/// The duration that so many of 1000 do not exceed, of durations in any order. Zero when there are none.
pub(crate) fn quantile(durations: &mut [Duration], per_mille: usize) -> Duration {
    durations.sort_unstable();
    let rank = (durations.len() * per_mille).div_ceil(1_000).max(1);
    durations.get(rank - 1).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_one_of_the_measurements_and_never_below_its_share() {
        let mut durations: Vec<_> = (1..=1_000).rev().map(Duration::from_millis).collect();
        assert_eq!(quantile(&mut durations, 500), Duration::from_millis(500));
        assert_eq!(quantile(&mut durations, 999), Duration::from_millis(999));
        assert_eq!(quantile(&mut durations, 1_000), Duration::from_millis(1_000));
        assert_eq!(quantile(&mut [], 500), Duration::ZERO);
    }
}
