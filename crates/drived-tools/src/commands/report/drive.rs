//! The chapter of one drive.

use drive_core::{Fault, Identity, registers};
use drive_fleet::{Freshness, IdentityCheck, WatchdogCheck, view::Judged};
use maud::{Markup, html};
use tokio::time::Instant;

use super::{
    gather::DriveTold,
    parameters, past,
    words::{cell, facts, milliseconds, moment, own, share, table, unread, untold},
};
use crate::commands::param::file::Backup;
use drived_screen::row::{Column, Row};
use drived_words::{output, values};

/// What it means that no communication watchdog runs.
pub(super) const UNWATCHED: &str = "a motor keeps turning when the line is lost";

pub(super) fn chapter(drive: &DriveTold, before: Option<&[Backup]>) -> Markup {
    html! {
        section.drive id=(drive.anchor()) {
            h3 { (drive.name()) }
            p.where {
                (drive.family_name()) (own(", address ")) (drive.view.slave) (own(" on line ")) (drive.view.line)
                @if drive.view.control { (own(", may be commanded")) } @else { (own(", only read")) }
            }
            div.columns {
                div.block { h4 { "What it is" } (identity(drive)) }
                div.block { h4 { "State now" } (state(drive)) }
                div.block { h4 { "Hours, energy, measured values" } (measured(drive)) }
                div.block { h4 { "Communication watchdog" } (watchdog(drive)) }
            }
            @if !drive.view.not_known.is_empty() {
                h4 { "What nobody can know of it" }
                ul { @for said in &drive.view.not_known { li { (own(said)) } } }
            }
            @if let Some(told) = &drive.past { h4 { "The last thirty days" } (past::part(told)) }
            h4 { "Faults" }
            (faults(drive))
            @if let Some(before) = before { h4 { "Changed since the backup" } (parameters::since(drive, before)) }
            h4 { "Parameters that differ from the factory setting" }
            (parameters::part(drive))
        }
    }
}

fn identity(drive: &DriveTold) -> Markup {
    let check = &drive.view.snapshot.identity;
    let found = values::identity(check);
    let told = |part: fn(&Identity) -> &Option<String>| match found.map(part) {
        Some(Some(said)) => cell(said.trim()),
        None if *check == IdentityCheck::Unchecked => {
            unread("the drive was not asked yet, or did not answer")
        }
        _ => untold(),
    };
    let mut rows = vec![
        ("family".to_owned(), cell(drive.family_name())),
        ("vendor".to_owned(), told(|identity| &identity.vendor)),
        ("model".to_owned(), told(|identity| &identity.model)),
        ("firmware".to_owned(), told(|identity| &identity.version)),
        ("serial number".to_owned(), untold()),
    ];
    let registers = drive.family.as_ref().map_or(&[][..], |family| family.capabilities().rows);
    let codes = found.map_or(&[][..], |identity| &identity.codes);
    for word in codes {
        if let Some(row) = registers.iter().find(|row| row.code == word.code) {
            rows.push((row.name.to_owned(), cell(row.show(word.value))));
        }
    }
    for (row, held) in ratings(drive) {
        match held {
            // What was told above is not told twice.
            Ok(_) if codes.iter().any(|word| word.code == row.code) => {}
            Ok(shown) => rows.push((row.name.to_owned(), cell(shown))),
            Err(why) => rows.push((row.name.to_owned(), unread(why))),
        }
    }
    rows.push(("compared with earlier".to_owned(), own(values::identity_check(check))));
    facts(rows)
}

/// What the drive is by its registers, as far as its parameters were read.
fn ratings(drive: &DriveTold) -> Vec<(&'static registers::Row, Result<String, &str>)> {
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

fn state(drive: &DriveTold) -> Markup {
    let known = &drive.view.snapshot;
    let shown = Row::of(&drive.view, Instant::now()).cell(Column::State).to_owned();
    let status = known.status.value.as_ref();
    let mut rows = vec![
        ("state".to_owned(), own(&shown)),
        ("read".to_owned(), read(known.status.quality, status.and_then(|status| status.at))),
    ];
    let mut row = |label: &str, value: Option<String>| {
        rows.extend(value.map(|value| (label.to_owned(), own(&value))));
    };
    row("why", known.error.clone());
    for (label, value) in status.into_iter().flat_map(values::status) {
        row(label, Some(value));
    }
    let at_reference = status.and_then(|status| status.at_reference);
    row("at reference", at_reference.map(|yes| if yes { "yes" } else { "no" }.to_owned()));
    row("setpoint given", known.setpoint.map(|setpoint| setpoint.to_string()));
    row("starts by itself", restarts(known.starts_by_itself.as_deref()));
    row("start", known.start_refused.as_ref().map(|why| format!("would be refused now: {why}")));
    let (answered, polls) = drive.statuses();
    row("statuses answered", Some(format!("{} ({answered} of {polls})", share(answered, polls))));
    row("lost", Some(times(known.counters.lost)));
    row("trips seen by the program", Some(known.counters.trips.to_string()));
    facts(rows)
}

/// How old a value is, or that there is none.
fn read(quality: Freshness, at: Option<Instant>) -> Markup {
    let age = at.map(|at| output::age(at.elapsed()));
    match (quality, age) {
        (Freshness::Fresh, Some(age)) => html! { (age) (own(" before this report")) },
        (Freshness::Stale, Some(age)) => {
            html! { strong { (own("NOT LIVE: ")) } (age) (own(" before this report")) }
        }
        (_, _) => unread("the drive has not told it since the program started"),
    }
}

fn restarts(codes: Option<&[String]>) -> Option<String> {
    let Some(codes) = codes else { return Some("not known yet".to_owned()) };
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
    let Judged { quality, value } = &drive.view.snapshot.measurements;
    let at = value.as_ref().and_then(|values| values.at);
    let mut rows = vec![("read".to_owned(), read(*quality, at))];
    let Some(values) = value else { return facts(rows) };
    for (label, value) in values::worked(values) {
        // What it costs to leave out is a family that has no such counter.
        rows.push((label.to_owned(), value.map_or_else(untold, cell)));
    }
    rows.extend(values::measured(values).into_iter().map(|(label, value)| (label.to_owned(), own(&value))));
    facts(rows)
}

fn watchdog(drive: &DriveTold) -> Markup {
    let check = &drive.view.snapshot.watchdog;
    let mut rows = vec![("the program".to_owned(), own(&watched(check)))];
    let found = values::found_watchdog(check);
    let time = found.and_then(|found| found.timeout).map(|time| time.as_secs_f64() * 1_000.0);
    let settings = drive.settings.as_ref();
    let feed = settings.ok().and_then(|settings| settings.feed);
    let has_one = drive.family.as_ref().is_ok_and(|family| family.capabilities().watchdog.is_some());
    let armed = match settings.map(|settings| settings.watchdog_armed) {
        Ok(Some(true)) => own("yes"),
        Ok(Some(false)) => html! { strong { (own("no")) } ": " (own(UNWATCHED)) },
        Ok(None) if !has_one => {
            html! { span.untold { (own("this family has none that can be read")) } ": " (own(UNWATCHED)) (own(", unless it is set at the drive")) }
        }
        Ok(None) => unread("the drive has not told it since the program started"),
        Err(why) => unread(why),
    };
    rows.push(("armed".to_owned(), armed));
    if let Some(time) = feed.map(|feed| feed.time_ms).or(time) {
        rows.push(("timeout".to_owned(), cell(milliseconds(time))));
        let reaction = found.and_then(|found| found.reaction);
        rows.push((
            "reaction".to_owned(),
            reaction.map_or_else(untold, |reaction| own(&reaction.to_string())),
        ));
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
                        html! { strong { (own("none: too late by ")) (milliseconds(-margin)) } }
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
    pub(super) fn trips(&self) -> Vec<Option<Fault>> {
        let told = self.faults.as_ref().map_or(&[][..], |faults| &faults.present);
        let seen = self.view.snapshot.fault.iter().filter(|_| told.is_empty()).map(|trip| trip.fault);
        told.iter().copied().map(Some).chain(seen).collect()
    }
}

/// What the program does about the watchdog.
fn watched(check: &WatchdogCheck) -> String {
    match check {
        WatchdogCheck::Verified(_) => "set up by the settings, and verified".to_owned(),
        WatchdogCheck::WaitsForStandstill(_) => {
            "is set otherwise than the settings say, until the motor stands".to_owned()
        }
        WatchdogCheck::Broken(why) => format!("could NOT be brought to what the settings say: {why}"),
        WatchdogCheck::NoContract { .. } => {
            "the settings leave it as it is; as it was found it is fed".to_owned()
        }
        WatchdogCheck::Unchecked => "not read yet".to_owned(),
    }
}

fn faults(drive: &DriveTold) -> Markup {
    let trip = drive.view.snapshot.fault.as_ref();
    let by_watchdog = trip.is_some_and(|trip| trip.by_watchdog);
    let trips = drive.trips();
    let faults = match &drive.faults {
        Ok(faults) => faults,
        Err(why) => {
            return html! {
                @for fault in trips { (present(fault, by_watchdog)) }
                p { (own("Alarms and history: ")) (unread(why)) }
            };
        }
    };
    let kept = drive.family.as_ref().map_or(0, |family| family.capabilities().fault_history);
    html! {
        @for fault in &trips { (present(*fault, by_watchdog)) }
        @if trips.is_empty() && faults.tripped { p { (own("It has tripped, and names no fault.")) } }
        @if trips.is_empty() && !faults.tripped { p { (own("No fault is present.")) } }
        @if let Some(trip) = trip { p { (own("The program saw it at ")) (moment(trip.time_unix_ms)) "." } }
        @match faults.reset_allowed {
            Some(true) if faults.tripped => p { (own("The drive would accept a reset.")) },
            Some(false) => p { (own("The drive would not accept a reset: its cause is still there.")) },
            _ => {},
        }
        @for warning in &faults.warnings { p.alarm { (own("Alarm without a trip: ")) (own(&warning.to_string())) } }
        @if kept == 0 { p.untold { (own("This family keeps no history of faults.")) } }
        @else if faults.history.is_empty() { p { (own("The history of the drive is empty.")) } }
        @else {
            (table("list", &["history", "code", "mnemonic", "meaning", "what to do"], 9, faults.history.iter().enumerate().map(entry).collect()))
        }
    }
}

fn present(fault: Option<Fault>, by_watchdog: bool) -> Markup {
    let remedy = fault.and_then(|fault| fault.remedy());
    html! {
        div.trip {
            p { strong { (own("Tripped: ")) (own(&values::tripped(fault.as_ref()))) } @if by_watchdog { (own(", by the communication watchdog")) } }
            p { (own("What to do: ")) @match remedy { Some(remedy) => (own(remedy)), None => (own("see the manual of the drive")) } }
        }
    }
}

/// A fault of the history, in the order in which the drive keeps it.
fn entry((index, fault): (usize, &Fault)) -> Vec<Markup> {
    let known = fault.entry;
    let told = |word: Option<&str>| word.map_or_else(|| cell("–"), own);
    vec![
        cell(index + 1),
        cell(fault.code),
        cell(known.map_or("–", |known| known.mnemonic)),
        told(known.map(|known| known.meaning)),
        told(known.map(|known| known.remedy)),
    ]
}
