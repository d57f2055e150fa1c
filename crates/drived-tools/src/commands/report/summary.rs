//! What a reader wants to know first: what needs somebody, and every drive in one line.

use drive_fleet::Severity;
use maud::{Markup, html};
use tokio::time::Instant;

use super::{
    drive::UNWATCHED,
    gather::{DriveTold, Gathered, LEFT_OUT, Told},
    words::{cell, own, share, table, unread},
};
use drived_plant::plant::views::{DriveView, LineDetailView, LineLink};
use drived_screen::row::{Column, Row};
use drived_words::values;

/// Exchanges that go wrong more often than this deserve a word: one in a hundred.
const OFTEN: u64 = 100;

/// Every drive in one line.
pub(super) fn overview(gathered: &Gathered) -> Markup {
    let rows = gathered.drives.iter().map(|drive| {
        let view = &drive.view;
        let (answered, polls) = drive.statuses();
        let worked = view.snapshot.measurements.value.as_ref().map(values::worked);
        let [running_time, ..] = worked.unwrap_or_default();
        let differs = match &drive.parameters {
            Ok(compared) => cell(compared.factory.differences.len()),
            Err(why) if why == LEFT_OUT => own("left out"),
            Err(_) => html! { span.unread { (own("not read")) } },
        };
        let row = Row::of(view, Instant::now());
        vec![
            html! { a href={ "#" (drive.anchor()) } { (drive.name()) } },
            cell(drive.family_name()),
            html! { (view.line) ", " (view.slave) },
            html! { span.trouble[row.is_in_trouble()] { (own(row.cell(Column::State))) } },
            cell(share(answered, polls)),
            cell(running_time.1.unwrap_or_else(|| "–".to_owned())),
            differs,
        ]
    });
    let heads = ["drive", "family", "line, address", "state", "answered", "run time", "differ from factory"];
    table("list overview", &heads, 4, rows.collect())
}

/// What needs somebody, the worst first; what is the same of several drives stands once.
pub(super) fn attention(gathered: &Gathered) -> Markup {
    let mut all: Vec<(Finding, Vec<&DriveTold>)> = Vec::new();
    for drive in &gathered.drives {
        for finding in of_drive(drive) {
            match all.iter_mut().find(|(known, _)| *known == finding) {
                Some((_, drives)) => drives.push(drive),
                None => all.push((finding, vec![drive])),
            }
        }
    }
    all.sort_by_key(|(finding, _)| (finding.grade, finding.rank));
    let lines: Vec<Markup> = gathered.lines.iter().flat_map(of_line).collect();
    html! {
        @if all.is_empty() && lines.is_empty() {
            p { (own("Nothing: every drive answers, none has a fault, and every line is as it was planned.")) }
        } @else {
            ul {
                @for (finding, drives) in &all { li {
                    @if finding.grade == Grade::Severe { strong { (own(&finding.what)) } } @else { (own(&finding.what)) }
                    @if !finding.more.is_empty() { ": " (own(&finding.more)) }
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
struct Finding {
    grade: Grade,
    /// That of what troubles the drive by itself; what only a report finds comes behind.
    rank: usize,
    what: String,
    more: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Grade {
    Severe,
    Worth,
    Unread,
}

/// What troubles a drive by itself, the worst first.
fn concerns(view: &DriveView) -> Vec<Finding> {
    let concerns = view.snapshot.concerns.iter().map(|concern| Finding {
        grade: match concern.severity {
            Severity::Alarm => Grade::Severe,
            Severity::Warning | Severity::Note => Grade::Worth,
        },
        rank: concern.rank,
        what: concern.kind.to_string(),
        more: concern.detail.clone().unwrap_or_default(),
    });
    concerns.collect()
}

fn of_drive(drive: &DriveTold) -> Vec<Finding> {
    let mut told = concerns(&drive.view);
    let mut say = |grade, what: &str, more: String| {
        told.push(Finding { grade, rank: usize::MAX, what: what.to_owned(), more });
    };
    let settings = drive.settings.as_ref();
    if settings.is_ok_and(|told| told.feed.is_some_and(|feed| !feed.in_time)) {
        say(Grade::Worth, "the communication watchdog may run out between two frames", String::new());
    } else if settings.is_ok_and(|told| told.watchdog_armed == Some(false)) {
        say(Grade::Worth, "the communication watchdog is off", UNWATCHED.to_owned());
    }
    for warning in drive.faults.iter().flat_map(|faults| &faults.warnings) {
        say(Grade::Worth, "alarm", warning.to_string());
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

fn of_line(detail: &Told<LineDetailView>) -> Vec<Markup> {
    let LineDetailView { line, planned, .. } = match detail {
        Ok(detail) => detail,
        Err(why) => return vec![html! { (own("a line: ")) (unread(why)) }],
    };
    let mut told = Vec::new();
    let mut say = |what: Markup| told.push(html! { (own("line ")) (line.name) ": " (what) });
    if line.link == LineLink::Away {
        say(html! { strong { (own("its port is away")) } ": " (own(line.error.as_deref().unwrap_or("–"))) });
    }
    for (_, name, number) in line.errors.of_exchanges() {
        if number * OFTEN > line.exchanges {
            say(html! { (share(number, line.exchanges)) (own(" of the exchanges: ")) (own(name)) });
        }
    }
    if line.errors.foreign.is_some_and(|count| count > 0) {
        say(own("frames of somebody else were heard: a second master may be on it"));
    }
    if planned.utilisation_percent > 100.0 {
        let percent = format!("{:.0} %", planned.utilisation_percent);
        say(html! { (own("the settings ask for more than the line has: ")) (percent) });
    }
    told
}

/// The first that a report says of what troubles a drive.
#[cfg(any(test, feature = "testing"))]
pub fn worst_of(view: &DriveView) -> String {
    let all = concerns(view);
    assert!(all.is_sorted_by_key(|finding| (finding.grade, finding.rank)), "{all:?}");
    let Finding { what, more, .. } = &all[0];
    if more.is_empty() { what.clone() } else { format!("{what}: {more}") }
}
