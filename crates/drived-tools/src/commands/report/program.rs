//! What the program was told of the drives, and the alarms that it has raised.

use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::{
    gather::{DriveTold, Told},
    words::{cell, facts, milliseconds, moment, own, table, unread},
};
use drived_plant::plant::{
    recent::RecentView,
    views::{HappenedView, SettingsView},
};

/// What `control` means: beside the state it is who commands the drive.
const MAY_COMMAND: &str = "may be commanded";

/// The newest alarms stand in a report, and how many there are besides.
const ALARMS: usize = 60;

/// The settings, those of drives that are told the same together.
pub(super) fn settings(drives: &[DriveTold]) -> Markup {
    let mut alike: Vec<(String, Vec<&str>)> = Vec::new();
    for drive in drives {
        let rows = match &drive.settings {
            Ok(told) => rows(told),
            Err(why) => vec![("settings".to_owned(), unread(why))],
        };
        let shown = facts(rows).into_string();
        match alike.iter_mut().find(|(other, _)| *other == shown) {
            Some((_, names)) => names.push(drive.name()),
            None => alike.push((shown, vec![drive.name()])),
        }
    }
    html! {
        @for (shown, names) in alike {
            div.block { h4.names { (names.join(", ")) } (PreEscaped(shown)) }
        }
    }
}

fn rows(told: &SettingsView) -> Vec<(String, Markup)> {
    let mut rows = Vec::new();
    let settings = json!(told.settings);
    for (key, value) in settings.as_object().into_iter().flatten().filter(|(key, _)| *key != "name") {
        let label = if key == "control" { MAY_COMMAND.to_owned() } else { spoken(key) };
        flatten(&label, value, &mut rows);
    }
    for (age, label) in [
        (told.running_age_ms, "by the plan, a status is never older, running"),
        (told.rest_age_ms, "the same at rest"),
        (told.measurements_age_ms, "the same of measured values"),
    ] {
        let age = age.map_or_else(|| "no limit, or none are read".to_owned(), milliseconds);
        rows.push((label.to_owned(), own(&age)));
    }
    rows
}

/// A key, or a word of the API, as a person reads it.
fn spoken(text: &str) -> String {
    text.replace('_', " ")
}

/// Each value of an object in a row of its own, under the names that lead to it.
fn flatten(label: &str, value: &Value, rows: &mut Vec<(String, Markup)>) {
    match value {
        Value::Object(members) if members.is_empty() => rows.push((label.to_owned(), own("none"))),
        Value::Object(members) => {
            for (key, value) in members {
                flatten(&format!("{label}: {}", spoken(key)), value, rows);
            }
        }
        Value::Array(all) if all.is_empty() => rows.push((label.to_owned(), own("none"))),
        Value::Array(all) => {
            rows.push((label.to_owned(), own(&all.iter().map(plain).collect::<Vec<_>>().join(", "))));
        }
        Value::Number(_) => {
            let (name, shown) = match label.rsplit_once(' ') {
                Some((name, "ms")) => (name, milliseconds(value.as_f64())),
                Some((name, "hz")) => (name, format!("{value} Hz")),
                Some((name, "a")) => (name, format!("{value} A")),
                Some((name, "percent")) => (name, format!("{value} %")),
                _ => (label, value.to_string()),
            };
            rows.push((name.to_owned(), cell(shown)));
        }
        _ => rows.push((label.to_owned(), own(&plain(value)))),
    }
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_owned(),
        Value::String(text) => spoken(text),
        Value::Array(all) => all.iter().map(plain).collect::<Vec<_>>().join(" to "),
        other => other.to_string(),
    }
}

/// The alarms of the last events that the program remembers.
pub(super) fn alarms(events: &Told<Vec<RecentView>>, names: &[&str]) -> Markup {
    let events = match events {
        Ok(events) => events,
        Err(why) => return html! { p { (unread(why)) } },
    };
    let concerns = |event: &HappenedView| event.drive.as_deref().is_none_or(|drive| names.contains(&drive));
    let all: Vec<HappenedView> = events
        .iter()
        .filter_map(|recent| recent.what.event())
        .filter(|event| event.alarm && concerns(event))
        .collect();
    let shown = all.iter().rev().take(ALARMS);
    let row = |event: &HappenedView| {
        let drive = event.drive.as_deref().map_or_else(|| own("the program"), cell);
        vec![cell(moment(event.time_unix_ms)), drive, own(&event.text)]
    };
    html! {
        @if all.is_empty() { p { (own("None among the last events that the program remembers: ")) (events.len()) "." } }
        @else {
            (table("list", &["time", "drive", "alarm"], 9, shown.map(row).collect()))
            @if all.len() > ALARMS { p.note { (own("Older ones that are left out: ")) (all.len() - ALARMS) "." } }
        }
    }
}
