//! One drive: its state, its curves, and everything that is known of it.

use drive_fleet::{ConcernKind, view::TripView};
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Modifier, Style, Stylize as _},
    text::Line,
    widgets::Paragraph,
};
use tokio::time::Instant;

use super::{
    super::{drive::Drive, happening::Kind, model::Model, words},
    document::Document,
    plot,
};
use drived_plant::plant::views::DriveView;
use drived_screen::row::{self, alarm, fitted, height_of};
use drived_words::explain::word_in_words;
use drived_words::{logging::escaped, output, values};

/// From this width on the curves stand beside the words.
const SIDE_BY_SIDE: u16 = 110;
/// Curves are not made lower than this.
const LOWEST: u16 = 9;
/// How many of the last commands are shown.
const COMMANDS: usize = 8;

pub(super) fn draw(model: &mut Model, name: &str, now: Instant, frame: &mut Frame<'_>, area: Rect) {
    let Some(drive) = model.plant.drive(name) else {
        let text = format!("{name}: the daemon has no such drive any more. Esc: back");
        frame.render_widget(Paragraph::new(text), area);
        return;
    };
    let head = head(drive, model, now, usize::from(area.width));
    let [above, below] =
        Layout::vertical([Constraint::Length(height_of(head.len())), Constraint::Fill(1)]).areas(area);
    frame.render_widget(Paragraph::new(head), above);
    let [curves, rest] = match area.width >= SIDE_BY_SIDE {
        true => Layout::horizontal([Constraint::Percentage(55), Constraint::Fill(1)]).spacing(2).areas(below),
        false => {
            let height = (below.height / 2).max(LOWEST).min(below.height);
            Layout::vertical([Constraint::Length(height), Constraint::Fill(1)]).areas(below)
        }
    };
    plot::draw(&model.curves, frame, if model.curves_alone { below } else { curves });
    if model.curves_alone {
        return;
    }
    let document = known(drive, model, now, usize::from(rest.width));
    document.draw(model, frame, rest);
}

/// What it is and what it does, in two lines.
fn head(drive: &Drive, model: &Model, now: Instant, width: usize) -> Vec<Line<'static>> {
    let live = drive.is_live(now, model.plant.is_connected());
    let DriveView { line, slave, family, snapshot, .. } = &drive.told;
    let place = format!("{}  {family}@{slave} on {line}", drive.name());
    let age = snapshot.status.value.as_ref().and_then(|status| status.at);
    let age = age.map(|at| output::age(now.saturating_duration_since(at)));
    let said = escaped(&row::sentence(snapshot, live));
    let state = match (live, age) {
        (true, _) => format!("live: {said}"),
        (false, Some(age)) => format!("{said}, {age} ago"),
        (false, None) => said,
    };
    let style = match drive.is_alarming() {
        true => alarm(),
        false if live => Style::new().add_modifier(Modifier::BOLD),
        false => Style::new().add_modifier(Modifier::DIM),
    };
    let mut lines = vec![Line::from(fitted(&place, width)).bold()];
    lines.extend(output::hanging(&state, width.max(1)).into_iter().map(|line| Line::styled(line, style)));
    lines
}

/// Everything else, the most urgent first.
fn known(drive: &Drive, model: &Model, now: Instant, width: usize) -> Document {
    let mut document = Document::new(width);
    let DriveView { snapshot: told, .. } = &drive.told;
    let live = drive.is_live(now, model.plant.is_connected());
    for concern in &told.concerns {
        let style = if concern.severity.is_trouble() { alarm() } else { Style::new() };
        match (concern.kind, &told.fault) {
            (ConcernKind::Tripped, Some(trip)) => fault(&mut document, trip),
            _ => document.say(&escaped(&concern.text), style),
        }
        document.pair("what to do", Some(escaped(&concern.remedy)));
    }
    if !drive.told.control {
        document.say("only read", Style::new());
    }
    if let Some(why) = told.start_refused.as_ref().filter(|_| drive.told.control) {
        document.pair("a start now", Some(format!("would be refused: {}", escaped(why))));
    }
    document.heading("last commands");
    let of_drive = model.plant.happenings.iter().rev().filter(|one| *one.drive == *drive.name());
    let commands: Vec<_> = of_drive.filter(|one| one.is(Kind::Commands)).take(COMMANDS).collect();
    if commands.is_empty() {
        document.say("none since the daemon began", Style::new().dim());
    }
    for one in commands {
        let style = if one.is_alarm { alarm() } else { Style::new() };
        document.say(&format!("{} {}", words::clock(one.unix_ms), one.text), style);
    }
    measured(&mut document, &drive.told, live && told.measurements.is_good(), now);
    document.heading("limits, identity, watchdog");
    document.pair("limits", drive.told.limits.as_ref().map(values::limits));
    if let Some(identity) = values::identity(&told.identity) {
        let model_of = [&identity.vendor, &identity.model].into_iter().flatten();
        let model_of = model_of.map(|part| escaped(part)).collect::<Vec<_>>().join(" ");
        document.pair("model", Some(model_of));
        document.pair("firmware", identity.version.as_deref().map(escaped));
    }
    document.pair("identity", Some(values::identity_check(&told.identity).to_owned()));
    document.pair("watchdog", Some(escaped(&values::watchdog(&told.watchdog))));
    document.pair("starts by itself", told.starts_by_itself.as_ref().map(|codes| escaped(&codes.join(", "))));
    document.pair("counted", Some(values::counters(told.counters)));
    document.heading("words as the drive sent them");
    let family = drive.told.family.parse().ok();
    for word in told.status.value.iter().flat_map(|status| &status.raw) {
        let raw = format!("{:04X}h", word.value);
        let told = word_in_words(family, word.address, word.value);
        let shown = if told.contains(&raw) { told } else { format!("{told} = {raw}") };
        document.dated_pair(&format!("register {}", word.address), Some(shown), live);
    }
    document
}

/// The present fault, what to do, and what the drive showed before it and at it.
fn fault(document: &mut Document, trip: &TripView) {
    document.say(&format!("Tripped: {}", escaped(&values::tripped(trip.fault.as_ref()))), alarm());
    document.pair("what to do", trip.fault.and_then(|fault| fault.remedy()).map(escaped));
    if trip.by_watchdog {
        document.say("Its communication watchdog has tripped it: nobody spoke to it in time.", Style::new());
    }
    document.pair("tripped at", Some(words::clock(trip.time_unix_ms)));
    document.pair("before the trip", trip.before.as_ref().map(ToString::to_string));
    document.pair("at the trip", Some(trip.at_trip.to_string()));
}

fn measured(document: &mut Document, told: &DriveView, live: bool, now: Instant) {
    document.heading("measurements");
    let Some((measured, at)) = told.snapshot.measurements.value.as_ref().and_then(|all| Some((all, all.at?)))
    else {
        document.say("none yet", Style::new().dim());
        return;
    };
    let age = output::age(now.saturating_duration_since(at));
    document.pair("read", Some(format!("{age} ago{}", if live { "" } else { ", OLD" })));
    for (label, value) in values::measurements(measured) {
        document.dated_pair(label, Some(value), live);
    }
}
