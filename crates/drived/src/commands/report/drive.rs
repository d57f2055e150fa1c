//! The chapter of one drive.

use drive_core::Row;
use maud::{Markup, html};
use serde_json::Value;

use super::{
    gather::DriveTold,
    parameters,
    words::{cell, count, facts, list, milliseconds, moment, share, table, text, unread, untold},
};
use crate::client;

/// Measurements that a reader of a service file looks for: where a family does not tell them, that is said.
const EXPECTED: [(&str, &str); 4] = [
    ("running_time_h", "motor run time"),
    ("powered_time_h", "power-on time"),
    ("input_energy_kwh", "input energy"),
    ("output_energy_kwh", "output energy"),
];

/// What it means that no communication watchdog runs.
pub(super) const UNWATCHED: &str = "a motor keeps turning when the line is lost";

pub(super) fn chapter(drive: &DriveTold) -> Markup {
    html! {
        section.drive id=(drive.anchor()) {
            h3 { (drive.name()) }
            p.where {
                (drive.family_name()) ", address " (drive.view["slave"]) " on line " (text(&drive.view["line"]))
                @if drive.view["control"] == true { ", may be commanded" } @else { ", only read" }
            }
            div.columns {
                div.block { h4 { "What it is" } (identity(drive)) }
                div.block { h4 { "State now" } (state(drive)) }
                div.block { h4 { "Hours, energy, measured values" } (measured(drive)) }
                div.block { h4 { "Communication watchdog" } (watchdog(drive)) }
            }
            h4 { "Faults" }
            (faults(drive))
            h4 { "Parameters that differ from the factory setting" }
            (parameters::part(drive))
        }
    }
}

fn identity(drive: &DriveTold) -> Markup {
    let identity = &drive.view["identity"];
    let told = |key: &str| match (identity[key].as_str(), text(&identity["check"])) {
        (Some(said), _) => cell(said.trim()),
        (None, "unchecked") => unread("the drive was not asked yet, or did not answer"),
        (None, _) => untold(),
    };
    let mut rows = vec![
        ("family".to_owned(), cell(drive.family_name())),
        ("vendor".to_owned(), told("vendor")),
        ("model".to_owned(), told("model")),
        ("firmware".to_owned(), told("firmware")),
        ("serial number".to_owned(), untold()),
    ];
    let registers = drive.family.as_ref().map_or(&[][..], |family| family.capabilities().rows);
    for word in list(&identity["codes"]) {
        let (code, value) =
            (text(&word["code"]), word["value"].as_u64().and_then(|word| u16::try_from(word).ok()));
        let row = registers.iter().find(|row| row.code == code);
        if let (Some(row), Some(value)) = (row, value) {
            rows.push((row.name.to_owned(), cell(row.show(value))));
        }
    }
    for (row, held) in ratings(drive) {
        match held {
            // What was told above is not told twice.
            Ok(_) if list(&identity["codes"]).iter().any(|word| word["code"] == row.code) => {}
            Ok(shown) => rows.push((row.name.to_owned(), cell(shown))),
            Err(why) => rows.push((row.name.to_owned(), unread(why))),
        }
    }
    rows.push(("compared with earlier".to_owned(), cell(check(identity))));
    facts(rows)
}

/// What the drive is by its registers, as far as its parameters were read.
fn ratings(drive: &DriveTold) -> Vec<(&'static Row, Result<String, &str>)> {
    let Ok(compared) = &drive.parameters else { return Vec::new() };
    let held = &compared.held;
    let ratings = held.head.family.capabilities().restoring.ratings;
    let of = held.entries.iter().filter(|entry| ratings.contains(&entry.row.address));
    of.map(|entry| match &entry.held {
        Ok(word) => (entry.row, Ok(held.row(entry.row).show(*word))),
        Err(why) => (entry.row, Err(why.as_str())),
    })
    .collect()
}

fn check(identity: &Value) -> &'static str {
    match text(&identity["check"]) {
        "same" => "the drive that the program knows",
        "changed" => "ANOTHER DRIVE than the one that the program knows",
        "cannot_say" => "a drive of this family cannot be told from another of its kind",
        _ => "not checked yet",
    }
}

fn state(drive: &DriveTold) -> Markup {
    let (view, status) = (&drive.view, &drive.view["status"]);
    let mut rows =
        vec![("state".to_owned(), cell(client::state_in_words(view))), ("read".to_owned(), read(status))];
    let mut row = |label: &str, value: Option<String>| {
        rows.extend(value.map(|value| (label.to_owned(), cell(value))));
    };
    row("why", view["error"].as_str().map(str::to_owned));
    for key in [
        "output_frequency_hz",
        "current_a",
        "current_percent",
        "at_reference",
        "control",
        "warning",
        "fault_code",
    ] {
        row(&client::words(without_unit(key)), client::measured(key, &status[key]));
    }
    row("setpoint given", setpoint(&view["setpoint"]));
    row("status words", words_of(status));
    row("starts by itself", restarts(view));
    row("start", view["start_refused"].as_str().map(|why| format!("would be refused now: {why}")));
    let counters = &view["counters"];
    let (polls, answered) = (count(&counters["polls"]), count(&counters["answered"]));
    row("statuses answered", Some(format!("{} ({answered} of {polls})", share(answered.min(polls), polls))));
    row("lost", Some(times(count(&counters["lost"]))));
    row("trips seen by the program", Some(count(&counters["trips"]).to_string()));
    facts(rows)
}

/// How old a value is, or that there is none.
fn read(judged: &Value) -> Markup {
    let age = judged["age_ms"].as_u64().map(client::age);
    match (text(&judged["quality"]), age) {
        ("good", Some(age)) => html! { (age) " before this report" },
        ("stale", Some(age)) => html! { strong { "NOT LIVE: " } (age) " before this report" },
        (_, _) => unread("the drive has not told it since the program started"),
    }
}

fn setpoint(setpoint: &Value) -> Option<String> {
    let (key, value) = setpoint.as_object()?.iter().next()?;
    client::measured(key, value)
}

fn words_of(status: &Value) -> Option<String> {
    let word = |word: &Value| Some(format!("{} {:04X}h", word["code"].as_str()?, word["value"].as_u64()?));
    let words: Vec<String> = list(&status["raw"]).iter().filter_map(word).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

fn restarts(view: &Value) -> Option<String> {
    let Some(all) = view["starts_by_itself"].as_array() else { return Some("not known yet".to_owned()) };
    let codes: Vec<&str> = all.iter().filter_map(Value::as_str).collect();
    (!codes.is_empty()).then(|| format!("by {}", codes.join(", ")))
}

fn times(number: u64) -> String {
    match number {
        0 => "never".to_owned(),
        1 => "once".to_owned(),
        several => format!("{several} times"),
    }
}

fn measured(drive: &DriveTold) -> Markup {
    let values = &drive.view["measurements"];
    let is_read = text(&values["quality"]) != "missing";
    let mut rows = vec![("read".to_owned(), read(values))];
    for (key, label) in EXPECTED {
        let value = client::measured(key, &values[key]).map(cell);
        // What it costs to leave out is a family that has no such counter.
        let value = value.unwrap_or_else(|| if is_read { untold() } else { unread("see above") });
        rows.push((label.to_owned(), value));
    }
    for (key, value) in values.as_object().into_iter().flatten() {
        let is_named = EXPECTED.iter().any(|(named, _)| named == key);
        if is_named || ["quality", "age_ms", "raw"].contains(&key.as_str()) {
            continue;
        }
        if let Some(value) = client::measured(key, value).or_else(|| setpoint(value)) {
            rows.push((client::words(without_unit(key)), cell(value)));
        }
    }
    facts(rows)
}

/// The name of a value without the unit behind it.
fn without_unit(key: &str) -> &str {
    match key.rsplit_once('_') {
        Some((name, "hz" | "a" | "v" | "percent" | "kw" | "kwh" | "rpm" | "h" | "ms")) => name,
        _ => key,
    }
}

fn watchdog(drive: &DriveTold) -> Markup {
    let found = &drive.view["watchdog"];
    let mut rows = vec![("the program".to_owned(), cell(watched(found)))];
    let time = found["time_ms"].as_u64();
    let settings = drive.settings.as_ref();
    let feed = settings.ok().and_then(|settings| settings.feed);
    let has_one = drive.family.as_ref().is_ok_and(|family| family.capabilities().watchdog.is_some());
    let armed = match settings.map(|settings| settings.watchdog_armed) {
        Ok(Some(true)) => cell("yes"),
        Ok(Some(false)) => html! { strong { "no" } ": " (UNWATCHED) },
        Ok(None) if !has_one => {
            html! { span.untold { "this family has none that can be read" } ": " (UNWATCHED) ", unless it is set at the drive" }
        }
        Ok(None) => unread("the drive has not told it since the program started"),
        Err(why) => unread(why),
    };
    rows.push(("armed".to_owned(), armed));
    if let Some(time) = feed.map(|feed| feed.time_ms).or(time.map(|time| time as f64)) {
        rows.push(("timeout".to_owned(), cell(milliseconds(time))));
        let reaction = found["reaction"].as_str().map(client::words);
        rows.push(("reaction".to_owned(), reaction.map_or_else(untold, cell)));
    }
    match (settings, feed) {
        (Err(why), _) => rows.push(("fed within".to_owned(), unread(why))),
        (Ok(_), Some(feed)) => {
            let margin = feed.time_ms - feed.heard_within_ms;
            rows.push(("fed within, by the plan".to_owned(), cell(milliseconds(feed.heard_within_ms))));
            rows.push((
                "margin".to_owned(),
                match margin >= 0.0 {
                    true => cell(milliseconds(margin)),
                    false => {
                        html! { strong { "none" } ": it may run out " (milliseconds(-margin)) " too early" }
                    }
                },
            ));
        }
        (Ok(_), None) => {}
    }
    facts(rows)
}

impl DriveTold {
    /// The present faults: as the drive told them when it was asked, else as the program saw it trip.
    pub(super) fn trips(&self) -> Vec<&Value> {
        let told = self.faults.as_ref().map_or(&[][..], |faults| list(&faults["present"]));
        let seen = [&self.view["fault"]].into_iter().filter(|fault| fault.is_object() && told.is_empty());
        told.iter().chain(seen).collect()
    }
}

/// What the program does about the watchdog.
fn watched(found: &Value) -> String {
    match text(&found["check"]) {
        "verified" => "set up by the settings, and verified".to_owned(),
        "waits_for_standstill" => "is set otherwise than the settings say, until the motor stands".to_owned(),
        "broken" => format!("could NOT be brought to what the settings say: {}", text(&found["why"])),
        "no_contract" => "the settings leave it as it is; as it was found it is fed".to_owned(),
        _ => "not read yet".to_owned(),
    }
}

fn faults(drive: &DriveTold) -> Markup {
    let known = &drive.view["fault"];
    let faults = match &drive.faults {
        Ok(faults) => faults,
        Err(why) => {
            return html! {
                @for fault in drive.trips() { (present(fault)) }
                p { "Alarms and history: " (unread(why)) }
            };
        }
    };
    let kept = drive.family.as_ref().map_or(0, |family| family.capabilities().fault_history);
    let history = list(&faults["history"]);
    html! {
        @for fault in drive.trips() { (present(fault)) }
        @if drive.trips().is_empty() { p { "No fault is present." } }
        @if known["time_unix_ms"].is_u64() { p { "The program saw it at " (moment(known["time_unix_ms"].as_u64())) "." } }
        @match faults["reset_allowed"].as_bool() {
            Some(true) if !list(&faults["present"]).is_empty() => p { "The drive would accept a reset." },
            Some(false) => p { "The drive would not accept a reset: its cause is still there." },
            _ => {},
        }
        @for warning in list(&faults["warnings"]) { p.alarm { "Alarm without a trip: " (client::fault_in_words(warning)) } }
        @if kept == 0 { p.untold { "This family keeps no history of faults." } }
        @else if history.is_empty() { p { "The history of the drive is empty." } }
        @else {
            (table("list", &["history", "code", "mnemonic", "meaning", "what to do"], 9, history.iter().enumerate().map(past).collect()))
        }
    }
}

fn present(fault: &Value) -> Markup {
    html! {
        div.trip {
            p { strong { "Tripped: " (tripped(fault)) } @if fault["by_watchdog"] == true { ", by the communication watchdog" } }
            p { "What to do: " (fault["remedy"].as_str().unwrap_or("see the manual of the drive")) }
        }
    }
}

/// A present fault in words; its code alone where nothing more was read.
pub(super) fn tripped(fault: &Value) -> String {
    match (client::fault_in_words(fault), fault["meaning"].is_string()) {
        (said, true) => said,
        (code, false) if code.is_empty() => "by which fault is not read yet".to_owned(),
        (code, false) => format!("code {code}, whose meaning is not known here"),
    }
}

/// A fault of the history, in the order in which the drive keeps it.
fn past((index, fault): (usize, &Value)) -> Vec<Markup> {
    let told = |key: &str| cell(fault[key].as_str().unwrap_or("–"));
    vec![cell(index + 1), cell(fault["code"].to_string()), told("mnemonic"), told("meaning"), told("remedy")]
}
