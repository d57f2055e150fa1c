//! One drive: its state, its curves, and everything that is known of it.

use std::time::Duration;

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Modifier, Style, Stylize as _},
    text::Line,
    widgets::Paragraph,
};
use serde_json::Value;
use tokio::time::Instant;

use super::{
    super::{
        drive::{Drive, read},
        happening::Kind,
        model::Model,
        words,
    },
    document::{Document, alarm},
    plot,
    text::{fitted, height_of},
};
use crate::{client, explain::word_in_words, logging::escaped, output};

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
    let family = drive.told["family"].as_str().unwrap_or_default();
    let place = format!("{}  {family}@{} on {}", drive.name, drive.told["slave"], drive.line);
    let shows =
        client::status_in_words(&drive.told["status"]).unwrap_or_else(|| "nothing is known".to_owned());
    let age = drive.age(now).map(words::time).unwrap_or_default();
    let state = match (live, drive.stop_is_pending()) {
        (true, false) => format!("live: {shows}"),
        (true, true) => format!("STOP PENDING: {shows}"),
        (false, _) => format!("{}, NOT LIVE, {age} ago: ({shows})", drive.state().to_uppercase()),
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
    let (mut document, told) = (Document::new(width), &drive.told);
    let connected = model.plant.is_connected();
    let live = drive.is_live(now, connected);
    let text = |value: &Value| value.as_str().map(escaped);
    fault(&mut document, &told["fault"]);
    let remark = drive.remark();
    if !told["fault"].is_object() && !remark.is_empty() {
        document.say(&remark, if drive.is_in_trouble() { alarm() } else { Style::new() });
    }
    for (place, concern) in drive.concerns().iter().enumerate() {
        if place > 0 {
            document.say(&escaped(&concern.text), Style::new());
        }
        document.pair("what to do", Some(escaped(&concern.remedy)));
    }
    if let Some(why) = text(&told["start_refused"]).filter(|_| told["control"] == true) {
        document.pair("a start now", Some(format!("would be refused: {why}")));
    }
    document.heading("last commands");
    let of_drive = model.plant.happenings.iter().rev().filter(|one| one.drive == drive.name);
    let commands: Vec<_> = of_drive.filter(|one| one.is(Kind::Commands)).take(COMMANDS).collect();
    if commands.is_empty() {
        document.say("none since the daemon began", Style::new().dim());
    }
    for one in commands {
        let style = if one.is_alarm { alarm() } else { Style::new() };
        document.say(&format!("{} {}", words::clock(one.unix_ms), one.text), style);
    }
    let is_good = told["measurements"]["quality"] == "good";
    measured(&mut document, told, live && is_good, drive.heard_ago(now));
    document.heading("limits, identity, watchdog");
    document.pair("limits", limits(&told["limits"]));
    let identity = &told["identity"];
    let model_of = ["vendor", "model", "power"].map(|key| text(&identity[key]));
    document.pair("model", Some(model_of.into_iter().flatten().collect::<Vec<_>>().join(" ")));
    document.pair("firmware", text(&identity["firmware"]));
    document.pair("identity", text(&identity["check"]).map(|check| words::spoken(&check)));
    document.pair("watchdog", watchdog(&told["watchdog"]));
    let codes = told["starts_by_itself"].as_array().into_iter().flatten().filter_map(text);
    document.pair("starts by itself", Some(codes.collect::<Vec<_>>().join(", ")));
    document.pair("counted", Some(counters(&told["counters"])));
    document.heading("words as the drive sent them");
    let family = told["family"].as_str().and_then(|family| family.parse().ok());
    for word in told["status"]["raw"].as_array().into_iter().flatten() {
        let (Some(address), Some(value)) = (read(&word["address"]), read(&word["value"])) else { continue };
        let raw = format!("{value:04X}h");
        let told = word_in_words(family, address, value);
        let shown = if told.contains(&raw) { told } else { format!("{told} = {raw}") };
        document.dated_pair(&format!("register {address}"), Some(shown), live);
    }
    document
}

/// The present fault, what to do, and what the drive showed before it and at it.
fn fault(document: &mut Document, fault: &Value) {
    if !fault.is_object() {
        return;
    }
    let text = |key: &str| fault[key].as_str().map(escaped);
    let code = fault["code"].as_u64().map(|code| code.to_string());
    let parts = [Some("Tripped".to_owned()), code, text("mnemonic")].into_iter().flatten();
    let known = parts.collect::<Vec<_>>().join(" ");
    document.say(
        &format!("{known}: {}", text("meaning").unwrap_or_else(|| "no meaning told yet".to_owned())),
        alarm(),
    );
    document.pair("what to do", text("remedy"));
    if fault["by_watchdog"] == true {
        document.say("Its communication watchdog has tripped it: nobody spoke to it in time.", Style::new());
    }
    document.pair("tripped at", fault["time_unix_ms"].as_u64().map(words::clock));
    for (label, key) in [("before the trip", "before"), ("at the trip", "at_trip")] {
        document.pair(label, client::status_in_words(&fault[key]));
    }
}

/// `since`: how long ago that was told.
fn measured(document: &mut Document, told: &Value, live: bool, since: Duration) {
    document.heading("measurements");
    let measured = &told["measurements"];
    let Some(age) = measured["age_ms"].as_u64().map(Duration::from_millis) else {
        document.say("none yet", Style::new().dim());
        return;
    };
    let of_trip = if measured["before_trip"] == true { ", from before the trip" } else { "" };
    let old = if live { "" } else { ", OLD" };
    document.pair("read", Some(format!("{} ago{old}{of_trip}", words::time(age + since))));
    let said = |key: &&String| !["age_ms", "before_trip"].contains(&key.as_str());
    for (key, value) in measured.as_object().into_iter().flatten().filter(|(key, _)| said(key)) {
        if let (label, Some(value)) = client::measurement(key, value) {
            document.dated_pair(&label, Some(value), live);
        }
    }
}

fn limits(limits: &Value) -> Option<String> {
    let hertz = |value: &Value| value.as_f64().map(|value| format!("{value:.1} Hz"));
    let ends = [("low_hz", "from"), ("high_hz", "to")];
    let ends = ends.into_iter().filter_map(|(key, word)| Some(format!("{word} {}", hertz(&limits[key])?)));
    let bands = limits["forbidden_hz"].as_array().into_iter().flatten();
    let bands = bands.filter_map(|band| Some(format!("not {} to {}", hertz(&band[0])?, hertz(&band[1])?)));
    Some(ends.chain(bands).collect::<Vec<_>>().join(", "))
}

fn watchdog(watchdog: &Value) -> Option<String> {
    let check = words::spoken(watchdog["check"].as_str()?);
    let time = watchdog["time_ms"].as_u64().map(Duration::from_millis).map(words::time);
    let reaction = match &watchdog["reaction"] {
        Value::String(reaction) => Some(words::spoken(reaction)),
        Value::Number(code) => Some(format!("reaction {code}")),
        _ => None,
    };
    let why = watchdog["why"].as_str().map(escaped);
    Some([Some(check), time, reaction, why].into_iter().flatten().collect::<Vec<_>>().join(", "))
}

fn counters(counters: &Value) -> String {
    let told = ["polls", "answered", "missed", "failures", "lost", "trips", "saves"].map(|key| {
        let count = counters[key].as_u64().unwrap_or_default();
        format!("{key} {count}")
    });
    told.join(", ")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn limits_are_told_with_their_forbidden_bands_and_units() {
        let told = json!({"low_hz": 10.0, "high_hz": 50.0, "forbidden_hz": [[30.0, 32.5]]});
        assert_eq!(limits(&told).as_deref(), Some("from 10.0 Hz, to 50.0 Hz, not 30.0 Hz to 32.5 Hz"));
        assert_eq!(limits(&Value::Null).as_deref(), Some(""));
    }
}
