//! One line: how much of it is used, what went wrong, how long answers take, and what was on it last.

use std::time::Duration;

use ratatui::{
    Frame,
    layout::Rect,
    style::{Style, Stylize as _},
    text::{Line, Span},
};

use super::{
    super::{model::Model, words},
    document::Document,
};
use drived_plant::plant::views::{
    AnswerTimes, AnswersView, ExchangeView, LineLink, LineView, ResultWord, TimesView,
};
use drived_screen::row::{alarm, old};
use drived_words::{logging::escaped, output};

/// The longest bar of the histogram, and where its bars end, in milliseconds.
const BAR: usize = 40;
const ENDS: [f64; 15] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 300.0, 1_000.0];

pub(super) fn draw(model: &mut Model, name: &str, frame: &mut Frame<'_>, area: Rect) {
    let mut document = Document::new(usize::from(area.width));
    let known = model.line.as_ref().filter(|known| known.line.name == name);
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
                if let Some(late) = &detail.measured.lag_ms {
                    lateness(&mut document, late);
                }
                histogram(&mut document, &detail.measured.answers);
            }
            slaves(&mut document, line);
            last(&mut document, detail.map_or(&[], |detail| &detail.last));
        }
        (_, None) => document.say("the daemon has no such line any more. Esc: back", Style::new()),
    }
    document.draw(model, frame, area);
}

fn summary(document: &mut Document, line: &LineView) {
    let time = |milliseconds| output::age(Duration::from_millis(milliseconds));
    if line.link == LineLink::Away {
        let why = line.error.as_deref().map_or_else(|| "its port is not there".to_owned(), escaped);
        document.say(&format!("AWAY: {why}"), alarm());
    }
    document.pair("port", Some(format!("{}, {}", escaped(&line.port), escaped(&line.protocol))));
    let (now, all) = (line.utilisation_percent, line.utilisation_since_opening_percent);
    let used = match line.link {
        LineLink::Away => "none: its port is away".to_owned(),
        LineLink::Connected => format!("{now:.0} % lately, {all:.0} % since it was opened"),
    };
    document.pair("utilisation", Some(used));
    let stop = time(line.worst_case_stop_ms);
    document.pair("a stop waits", Some(format!("{stop} at most, whatever happens")));
    let cycle = time(line.cycle_ms);
    document.pair("cycle", Some(format!("{cycle} for one status of every drive, by the plan")));
    document.pair("exchanges", Some(line.exchanges.to_string()));
    document.pair("errors", Some(line.errors.in_words()));
}

/// How much later than the line allowed requests were sent: what this host costs.
fn lateness(document: &mut Document, late: &TimesView) {
    let TimesView { p50, p99, max, .. } = late;
    let told = format!("usually {p50:.2} ms, 1 % above {p99:.2} ms, {max:.2} ms at most");
    document.pair("sent too late by", Some(told));
}

/// How long the drives of the line took to answer, all of them together.
fn histogram(document: &mut Document, answers: &[AnswersView]) {
    let mut counts = [0_u64; ENDS.len() + 1];
    for step in answers.iter().flat_map(|slave| &slave.times) {
        if let Some(sum) = counts.get_mut(ENDS.partition_point(|bound| *bound < step.up_to_ms)) {
            *sum += u64::from(step.count);
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

fn slaves(document: &mut Document, line: &LineView) {
    document.heading("drives");
    for slave in &line.slaves {
        let name = slave.drive.as_deref().map_or_else(|| "no drive".to_owned(), escaped);
        let next = slave.next_probe_ms.map(|next| output::age(Duration::from_millis(next)));
        let state = match slave.off_line {
            true => {
                format!("OFF-LINE, only probed, next in {}", next.unwrap_or_else(|| "a while".to_owned()))
            }
            false => "answers".to_owned(),
        };
        let times = slave.answer_ms.map(|AnswerTimes { p50, p99, max }| {
            format!("usually {p50:.1} ms, 1 % above {p99:.1} ms, longest {max:.1} ms")
        });
        let parts = [
            Some(format!("{} {name}: {state}", slave.slave)),
            times,
            Some(format!("{} exchanges", slave.exchanges)),
            Some(format!("errors: {}", slave.errors.in_words())),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        document.say(&parts.join("; "), if slave.off_line { alarm() } else { Style::new() });
    }
}

/// The last exchanges, the newest first.
fn last(document: &mut Document, last: &[ExchangeView]) {
    document.heading("last exchanges, the newest first");
    for exchange in last.iter().rev() {
        let ExchangeView { time_unix_ms, slave, request, answer, result, took_ms } = exchange;
        let answer = if answer.is_empty() { String::new() } else { format!(" → {}", escaped(answer)) };
        let (at, request) = (words::clock(*time_unix_ms), escaped(request));
        let told = format!("{at} slave {slave}: {result} {took_ms:.1} ms: {request}{answer}");
        document.say(&told, if *result == ResultWord::Ok { Style::new() } else { alarm() });
    }
}
