//! One line: how much of it is used, what went wrong, how long answers take, and what was on it last.

use std::time::Duration;

use ratatui::{
    Frame,
    layout::Rect,
    style::{Style, Stylize as _},
    text::{Line, Span},
};
use serde_json::Value;

use super::{
    super::{model::Model, words},
    document::{Document, alarm, old},
};
use crate::logging::escaped;

/// What an exchange on a line may end by besides an answer.
const ERRORS: [(&str, &str); 7] = [
    ("no_answer", "no answer"),
    ("damaged", "damaged"),
    ("late", "late"),
    ("mismatched", "not fitting"),
    ("exception", "exception"),
    ("foreign", "foreign"),
    ("echo", "own echo"),
];

/// The longest bar of the histogram, and where its bars end, in milliseconds.
const BAR: usize = 40;
const ENDS: [f64; 15] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 300.0, 1_000.0];

pub(super) fn draw(model: &mut Model, name: &str, frame: &mut Frame<'_>, area: Rect) {
    let mut document = Document::new(usize::from(area.width));
    let known = model.line.as_ref().filter(|(known, _)| known == name).map(|(_, line)| line);
    match (known, model.plant.lines.get(name)) {
        (detail, Some(line)) => {
            let lines: Vec<&String> = model.plant.lines.keys().collect();
            let place = lines.iter().position(|known| *known == name).unwrap_or_default() + 1;
            document.heading(&format!("line {name} ({place} of {}; left, right: another)", lines.len()));
            if !model.plant.is_connected() {
                document.say("NOT LIVE: this was so when the daemon was heard last", old());
            }
            summary(&mut document, line);
            if let Some(detail) = detail {
                lateness(&mut document, &detail["measured"]["lag_ms"]);
                histogram(&mut document, &detail["measured"]["answers"]);
            }
            slaves(&mut document, line);
            last(&mut document, detail);
        }
        (_, None) => document.say("the daemon has no such line any more. Esc: back", Style::new()),
    }
    document.draw(model, frame, area);
}

fn summary(document: &mut Document, line: &Value) {
    let text = |key: &str| line[key].as_str().map(escaped);
    let time = |key: &str| line[key].as_u64().map(|time| words::time(Duration::from_millis(time)));
    let percent = |key: &str| line[key].as_f64().map(|share| format!("{share:.0} %"));
    if line["link"] == "away" {
        let why = text("error").unwrap_or_else(|| "its port is not there".to_owned());
        document.say(&format!("AWAY: {why}"), alarm());
    }
    document.pair(
        "port",
        Some([text("port"), text("protocol")].into_iter().flatten().collect::<Vec<_>>().join(", ")),
    );
    let since = percent("utilisation_since_opening_percent");
    let used = percent("utilisation_percent")
        .zip(since)
        .map(|(now, all)| format!("{now} lately, {all} since it was opened"));
    document.pair("utilisation", used);
    document.pair(
        "a stop waits",
        time("worst_case_stop_ms").map(|time| format!("{time} at most, whatever happens")),
    );
    document.pair(
        "cycle",
        time("cycle_ms").map(|time| format!("{time} for one status of every drive, by the plan")),
    );
    document.pair("exchanges", line["exchanges"].as_u64().map(|count| count.to_string()));
    document.pair("errors", Some(errors(&line["errors"])));
}

/// How much later than the line allowed requests were sent: what this host costs.
fn lateness(document: &mut Document, late: &Value) {
    let time = |key: &str| late[key].as_f64().map(|time| format!("{time:.2} ms"));
    let told = time("p50").zip(time("p99")).zip(time("max"));
    let told = told.map(|((usual, rare), most)| format!("usually {usual}, 1 % above {rare}, {most} at most"));
    document.pair("sent too late by", told);
}

/// The kinds of errors that were counted.
fn errors(counted: &Value) -> String {
    let counts = ERRORS.iter().filter_map(|(key, word)| Some((word, counted[*key].as_u64()?)));
    let some: Vec<String> =
        counts.filter(|(_, count)| *count > 0).map(|(word, count)| format!("{count} {word}")).collect();
    if some.is_empty() { "none".to_owned() } else { some.join(", ") }
}

/// How long the drives of the line took to answer, all of them together.
fn histogram(document: &mut Document, answers: &Value) {
    let mut counts = [0_u64; ENDS.len() + 1];
    let steps =
        answers.as_array().into_iter().flatten().filter_map(|slave| slave["times"].as_array()).flatten();
    for step in steps {
        let end = step["up_to_ms"].as_f64().unwrap_or_default();
        if let Some(sum) = counts.get_mut(ENDS.partition_point(|bound| *bound < end)) {
            *sum += step["count"].as_u64().unwrap_or_default();
        }
    }
    let most = counts.iter().copied().max().unwrap_or_default();
    if most == 0 {
        return;
    }
    document.heading("how long they take to answer");
    let ends = ENDS.iter().map(|end| format!("to {end} ms")).chain(["longer".to_owned()]);
    let counts: Vec<(String, u64)> = ends.zip(counts).collect();
    let first = counts.iter().position(|(_, count)| *count > 0).unwrap_or_default();
    let last = counts.iter().rposition(|(_, count)| *count > 0).unwrap_or_default();
    for (end, count) in counts.get(first..=last).unwrap_or_default() {
        // One that is there at all is seen.
        let length = usize::try_from(count * BAR as u64 / most).unwrap_or(BAR).max(usize::from(*count > 0));
        document.line(Line::from(vec![
            Span::raw(format!("{end:>10} ")).dim(),
            Span::raw("█".repeat(length)).cyan(),
            Span::raw(format!(" {count}")),
        ]));
    }
}

fn slaves(document: &mut Document, line: &Value) {
    document.heading("drives");
    for slave in line["slaves"].as_array().into_iter().flatten() {
        let name = slave["drive"].as_str().map_or_else(|| "no drive".to_owned(), escaped);
        let time = |key: &str| slave["answer_ms"][key].as_f64().map(|time| format!("{time:.1} ms"));
        let away = slave["off_line"] == true;
        let next = slave["next_probe_ms"].as_u64().map(|next| words::time(Duration::from_millis(next)));
        let state = match away {
            true => {
                format!("OFF-LINE, only probed, next in {}", next.unwrap_or_else(|| "a while".to_owned()))
            }
            false => "answers".to_owned(),
        };
        let times = [("usually", "p50"), ("1 % above", "p99"), ("longest", "max")];
        let times = times.iter().filter_map(|(word, key)| Some(format!("{word} {}", time(key)?)));
        let parts = [
            format!("{} {name}: {state}", slave["slave"]),
            times.collect::<Vec<_>>().join(", "),
            format!("{} exchanges", slave["exchanges"]),
            format!("errors: {}", errors(&slave["errors"])),
        ];
        let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        document.say(&parts.join("; "), if away { alarm() } else { Style::new() });
    }
}

/// The last exchanges, the newest first.
fn last(document: &mut Document, line: Option<&Value>) {
    document.heading("last exchanges, the newest first");
    let last = line.and_then(|line| line["last"].as_array()).map_or(&[][..], Vec::as_slice);
    for exchange in last.iter().rev() {
        let text = |key: &str| exchange[key].as_str().map(escaped).unwrap_or_default();
        let at = exchange["time_unix_ms"].as_u64().map(words::clock).unwrap_or_default();
        let result = text("result");
        let answer =
            if text("answer").is_empty() { String::new() } else { format!(" → {}", text("answer")) };
        let took = exchange["took_ms"].as_f64().unwrap_or_default();
        let told = format!(
            "{at} slave {}: {} {took:.1} ms: {}{answer}",
            exchange["slave"],
            words::spoken(&result),
            text("request")
        );
        document.say(&told, if result == "ok" { Style::new() } else { alarm() });
    }
}
