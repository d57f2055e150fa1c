//! What a drive did in the last thirty days, as the history of the daemon has kept it.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::words::{cell, facts, own, span, unread};
use drived_plant::plant::past::{DayView, EnergyFrom};

pub(super) fn part(told: &Result<Vec<DayView>, String>) -> Markup {
    match told {
        Err(why) => html! { p { (unread(why)) } },
        Ok(days) if days.is_empty() => html! { p { (own("Nothing is kept of it.")) } },
        Ok(days) => facts(rows(days)),
    }
}

fn rows(days: &[DayView]) -> Vec<(String, Markup)> {
    let mut rows = Vec::new();
    let mut row = |label: &str, value: Markup| rows.push((label.to_owned(), value));
    let milliseconds =
        |of: fn(&DayView) -> i64| span(u64::try_from(days.iter().map(of).sum::<i64>()).unwrap_or_default());
    let known = days.iter().map(|day| day.known).sum::<f64>() / days.len() as f64 * 100.0;
    row("days with readings", cell(days.len()));
    row("known of them", cell(format!("{known:.0} %")));
    row("the motor ran", cell(milliseconds(|day| day.running_ms)));
    row("starts seen", cell(days.iter().map(|day| day.starts).sum::<u64>()));
    row("energy", energy(days));
    row("above its limits", cell(milliseconds(|day| day.above_limits_ms)));
    row("with a warning of its own", cell(milliseconds(|day| day.warning_ms)));
    if let Some(most) = days.iter().filter_map(|day| day.greatest_current_a).reduce(f64::max) {
        row("greatest current", cell(format!("{most:.1} A")));
    }
    let mut trips: BTreeMap<&str, u64> = BTreeMap::new();
    for (cause, times) in days.iter().flat_map(|day| &day.trips) {
        *trips.entry(cause).or_default() += times;
    }
    let mut trips: Vec<(&str, u64)> = trips.into_iter().collect();
    trips.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
    row(
        "tripped",
        match trips.is_empty() {
            true => cell("0"),
            false => html! { @for (cause, times) in trips { (times) " × " (self::cause(cause)) br; } },
        },
    );
    rows
}

/// What a drive tripped by, such as `9 OCF: overcurrent`.
fn cause(told: &str) -> Markup {
    match told.split_once(": ") {
        Some((code, meaning)) => html! { (code) ": " (own(meaning)) },
        None => own(told),
    }
}

/// The energy of the days: of one source, for counts and kilowatt-hours are two things.
fn energy(days: &[DayView]) -> Markup {
    let of = |source: EnergyFrom| {
        let amounts = days.iter().filter_map(|day| day.energy.as_ref()).filter(|one| one.from == source);
        amounts.map(|one| one.amount).reduce(|sum, amount| sum + amount)
    };
    match (of(EnergyFrom::Counter), of(EnergyFrom::Summed)) {
        (Some(counts), _) => html! { (format!("{counts:.0}")) (own(" by its own counter")) },
        (None, Some(summed)) => html! { (format!("{summed:.1} kWh")) (own(" summed up from its power")) },
        (None, None) => own("not known: the drive tells neither a counter nor its power"),
    }
}
