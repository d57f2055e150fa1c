//! What a reader wants to know first: what needs somebody, and every drive in one line.

use maud::{Markup, html};
use serde_json::Value;

use super::{
    drive::{UNWATCHED, tripped},
    gather::{DriveTold, Gathered, LEFT_OUT},
    line::KINDS,
    words::{cell, count, list, share, table, text, unread},
};
use crate::client;

/// Exchanges that go wrong more often than this deserve a word: one in a hundred.
const OFTEN: u64 = 100;

/// Every drive in one line.
pub(super) fn overview(gathered: &Gathered) -> Markup {
    let rows = gathered.drives.iter().map(|drive| {
        let view = &drive.view;
        let counters = &view["counters"];
        let (polls, answered) = (count(&counters["polls"]), count(&counters["answered"]));
        let hours = client::measured("running_time_h", &view["measurements"]["running_time_h"]);
        let differs = match &drive.parameters {
            Ok(compared) => cell(compared.factory.differences.len()),
            Err(why) if why == LEFT_OUT => cell("left out"),
            Err(_) => html! { span.unread { "not read" } },
        };
        vec![
            html! { a href={ "#" (drive.anchor()) } { (drive.name()) } },
            cell(drive.family_name()),
            html! { (text(&view["line"])) ", " (view["slave"]) },
            html! { span.trouble[trouble(drive)] { (client::state_in_words(view)) } },
            cell(share(answered.min(polls), polls)),
            cell(hours.unwrap_or_else(|| "–".to_owned())),
            differs,
        ]
    });
    let heads = ["drive", "family", "line, address", "state", "answered", "run time", "differ from factory"];
    table("list overview", &heads, 4, rows.collect())
}

fn trouble(drive: &DriveTold) -> bool {
    !drive.is_there() || !drive.trips().is_empty() || drive.view["stop"].is_object()
}

/// What needs somebody, the worst first; what is the same of several drives stands once.
pub(super) fn attention(gathered: &Gathered) -> Markup {
    let mut all: Vec<(Concern, Vec<&DriveTold>)> = Vec::new();
    for drive in &gathered.drives {
        for concern in of_drive(drive) {
            match all.iter_mut().find(|(known, _)| *known == concern) {
                Some((_, drives)) => drives.push(drive),
                None => all.push((concern, vec![drive])),
            }
        }
    }
    all.sort_by_key(|(concern, _)| concern.grade);
    let lines: Vec<Markup> = gathered.lines.iter().flat_map(of_line).collect();
    html! {
        @if all.is_empty() && lines.is_empty() {
            p { "Nothing: every drive answers, none has a fault, and every line is as it was planned." }
        } @else {
            ul {
                @for (concern, drives) in &all { li {
                    @if concern.grade == Grade::Severe { strong { (concern.what) } } @else { (concern.what) }
                    @if !concern.more.is_empty() { ": " (concern.more) }
                    " – "
                    @for (index, drive) in drives.iter().enumerate() {
                        @if index > 0 { ", " } a href={ "#" (drive.anchor()) } { (drive.name()) }
                    }
                } }
                @for line in &lines { li { (line) } }
            }
        }
    }
}

/// Something of a drive that needs somebody.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Concern {
    grade: Grade,
    what: String,
    more: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Grade {
    Severe,
    Worth,
    Unread,
}

fn of_drive(drive: &DriveTold) -> Vec<Concern> {
    let view = &drive.view;
    let mut told = Vec::new();
    let mut say = |grade, what: &str, more: String| told.push(Concern { grade, what: what.to_owned(), more });
    if !drive.is_there() {
        let why = view["error"].as_str().unwrap_or("nothing is known of it");
        say(Grade::Severe, "does not answer", why.to_owned());
    }
    for fault in drive.trips() {
        say(Grade::Severe, "tripped", tripped(fault));
    }
    if view["stop"].is_object() {
        say(Grade::Severe, "a stop is not confirmed, the motor may turn", String::new());
    }
    if view["identity"]["check"] == "changed" {
        say(Grade::Severe, "it is another drive than the one that the program knows", String::new());
    }
    let settings = drive.settings.as_ref();
    if view["watchdog"]["check"] == "broken" {
        let why = text(&view["watchdog"]["why"]).to_owned();
        say(Grade::Worth, "the communication watchdog is not as the settings say", why);
    } else if settings.is_ok_and(|told| told["feed"]["in_time"] == false) {
        say(Grade::Worth, "the communication watchdog may run out between two frames", String::new());
    } else if settings.is_ok_and(|told| told["watchdog_armed"] == false) {
        say(Grade::Worth, "the communication watchdog is off", UNWATCHED.to_owned());
    }
    for warning in drive.faults.iter().flat_map(|faults| list(&faults["warnings"])) {
        say(Grade::Worth, "alarm", client::fault_in_words(warning));
    }
    let restarts: Vec<&str> = list(&view["starts_by_itself"]).iter().filter_map(Value::as_str).collect();
    if !restarts.is_empty() {
        say(Grade::Worth, "its own settings start the motor again by themselves", restarts.join(", "));
    }
    if drive.is_there() {
        let all = [settings.err(), drive.faults.as_ref().err(), drive.parameters.as_ref().err()];
        for why in all.into_iter().flatten().filter(|why| *why != LEFT_OUT) {
            say(Grade::Unread, "not read", why.clone());
        }
        let unread = drive.parameters.as_ref().map_or(0, |compared| compared.held.unread());
        if unread > 0 {
            say(Grade::Unread, "parameters that could not be read", unread.to_string());
        }
    }
    told
}

fn of_line(line: &Result<Value, String>) -> Vec<Markup> {
    let line = match line {
        Ok(line) => line,
        Err(why) => return vec![html! { "a line: " (unread(why)) }],
    };
    let mut told = Vec::new();
    let mut say = |what: Markup| told.push(html! { "line " (text(&line["name"])) ": " (what) });
    if line["link"] != "connected" {
        say(
            html! { strong { "its port is away" } ": " (line["error"].as_str().unwrap_or("no reason is known")) },
        );
    }
    let exchanges = count(&line["exchanges"]);
    for (key, name) in KINDS {
        let number = count(&line["errors"][key]);
        if number * OFTEN > exchanges {
            say(html! { (share(number, exchanges)) " of the exchanges: " (name) });
        }
    }
    if count(&line["errors"]["foreign"]) > 0 {
        say(html! { "frames of somebody else were heard: a second master may be on it" });
    }
    let planned = line["planned"]["utilisation_percent"].as_f64().unwrap_or_default();
    if planned > 100.0 {
        say(html! { "the settings ask for more than the line has: " (cell(format!("{planned:.0} %"))) });
    }
    told
}
