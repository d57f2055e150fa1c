//! The chapter of one line: the plan beside what was measured, how it was used, how its slaves answered, what went wrong.

use maud::{Markup, html};
use serde_json::Value;

use super::{
    own::LINE,
    plot::{self, Axis, Step},
    words::{cell, count, list, milliseconds, percent, share, span, table, text},
};

/// What goes wrong with an exchange, by the key of the API, and what it is called.
pub(super) const KINDS: [(&str, &str); 5] = [
    ("no_answer", "no answer"),
    ("damaged", "damaged"),
    ("late", "late"),
    ("mismatched", "does not fit"),
    ("exception", "refused"),
];

pub(super) fn chapter(line: &Value, drives: &[Value]) -> Markup {
    let measured = &line["measured"];
    let away = line["link"] != "connected";
    html! {
        section.line {
            h3 { @if line["name"] == LINE { "The line" } @else { "Line " (text(&line["name"])) } }
            p.where { (text(&line["port"])) ", " (text(&line["protocol"])) }
            @if away { p.alarm { "The port is away: " (line["error"].as_str().unwrap_or("no reason is known")) } }
            p { "Measured since the line was opened, " (span(&measured["elapsed_ms"])) " before this report; "
                (count(&line["exchanges"])) " requests were sent." }
            h4 { "Plan against measured" }
            (plan(line))
            h4 { "How long answers took" }
            (answers(line))
            h4 { "Errors by kind" }
            (errors(line))
            h4 { "Availability" }
            (availability(line, drives))
        }
    }
}

/// One row a figure: what was planned, what was measured, and what to think of it.
fn plan(line: &Value) -> Markup {
    let (planned, measured) = (&line["planned"], &line["measured"]);
    let both = |key: &str| (milliseconds(&planned[key]), milliseconds(&measured[key]));
    let verdict = |planned: &Value, measured: &Value| match (planned.as_f64(), measured.as_f64()) {
        (Some(planned), Some(measured)) if measured <= planned => "within the plan",
        (Some(_), Some(_)) => "MORE THAN PLANNED",
        _ => "not measured",
    };
    let row = |figure: &str, planned: String, measured: String, verdict: &str| {
        vec![cell(figure), cell(planned), cell(measured), cell(verdict)]
    };
    let (cycle, cycle_was) = both("cycle_ms");
    let (stop, stop_was) = both("stop_ms");
    let used = &measured["utilisation_percent"];
    let waited = &measured["stop_wait_ms"];
    let stops = match count(&waited["count"]) {
        0 => "no stop was sent".to_owned(),
        stops => format!("{} at the most, of {stops}", milliseconds(&waited["max"])),
    };
    let statuses = &measured["status_wait_ms"];
    let silence = &measured["silence_ms"];
    let kept = match (measured["needed_silence_ms"].as_f64(), silence["min"].as_f64()) {
        (Some(needed), Some(kept)) if kept + 0.005 < needed => "TOO SHORT",
        (Some(_), Some(_)) => "kept",
        _ => "none is needed",
    };
    let rows = vec![
        row(
            "one status of every drive",
            cycle,
            cycle_was,
            verdict(&planned["cycle_ms"], &measured["cycle_ms"]),
        ),
        row(
            "polls and watchdogs use, all drives running",
            percent(&planned["utilisation_percent"]),
            format!("{} ({} lately)", percent(used), percent(&line["utilisation_percent"])),
            match verdict(&planned["utilisation_percent"], used) {
                "MORE THAN PLANNED" => "more: questions and commands come on top",
                verdict => verdict,
            },
        ),
        row(
            "a stop is on the wire within",
            stop,
            format!("{stop_was} as the line has been"),
            verdict(&planned["stop_ms"], &measured["stop_ms"]),
        ),
        row(
            "  stops that were sent waited",
            milliseconds(&planned["stop_ms"]),
            stops,
            match count(&waited["count"]) {
                0 => "not measured",
                _ => verdict(&planned["stop_ms"], &waited["max"]),
            },
        ),
        row(
            "all have confirmed a stop within",
            milliseconds(&planned["all_stopped_ms"]),
            "–".to_owned(),
            "not measured",
        ),
        row(
            "a status waits for its turn",
            "–".to_owned(),
            format!(
                "{} half of them, {} at the most",
                milliseconds(&statuses["p50"]),
                milliseconds(&statuses["max"])
            ),
            "",
        ),
        row(
            "silence before a request",
            format!("{} are needed", milliseconds(&measured["needed_silence_ms"])),
            format!("{} at the least", milliseconds(&silence["min"])),
            kept,
        ),
        row(
            "this computer writes later than it may by",
            "–".to_owned(),
            format!(
                "{} of 99 in 100, {} at the most",
                milliseconds(&measured["lag_ms"]["p99"]),
                milliseconds(&measured["lag_ms"]["max"])
            ),
            "",
        ),
    ];
    let strange = [
        ("requests sent again", count(&measured["retries"])),
        ("frames of somebody else", count(&line["errors"]["foreign"])),
        ("bytes that make no frame", count(&measured["noise_bytes"])),
        ("port lost", count(&measured["lost"])),
    ];
    html! {
        (table("list", &["figure", "planned", "measured", "verdict"], 9, rows))
        p.note { @for (index, (what, number)) in strange.iter().enumerate() { @if index > 0 { "; " } (what) ": " (number) } "." }
    }
}

/// The slaves of a line, each with its name and how it answered.
fn slaves(line: &Value) -> impl Iterator<Item = (String, &Value, &Value)> {
    list(&line["slaves"]).iter().map(|slave| {
        let answers =
            list(&line["measured"]["answers"]).iter().find(|answers| answers["slave"] == slave["slave"]);
        let name =
            slave["drive"].as_str().map_or_else(|| "no drive of the program".to_owned(), str::to_owned);
        (format!("{}\u{a0}·\u{a0}{name}", slave["slave"]), slave, answers.unwrap_or(&Value::Null))
    })
}

/// The steps of one slave, each beginning where the one before it ends.
fn steps(answers: &Value) -> Vec<Step> {
    let ends: Vec<(f64, f64)> = list(&answers["times"])
        .iter()
        .filter_map(|step| Some((step["up_to_ms"].as_f64()?, step["count"].as_f64()?)))
        .collect();
    let begins = ends.iter().scan(None, |before, (end, _)| {
        // The first step is as wide as one is.
        Some(before.replace(*end).unwrap_or(*end * 8.0 / 9.0))
    });
    begins.zip(&ends).map(|(from, &(to, count))| Step { from, to, count }).collect()
}

fn answers(line: &Value) -> Markup {
    let all: Vec<(String, &Value, Vec<Step>)> =
        slaves(line).map(|(name, slave, answers)| (name, slave, steps(answers))).collect();
    let Some(axis) = Axis::of(all.iter().map(|(_, _, steps)| &steps[..])) else {
        return html! { p.unread { "No slave of this line has answered." } };
    };
    let rows = all.iter().map(|(name, slave, steps)| {
        let times = &slave["answer_ms"];
        let picture = if times.is_object() {
            let about = format!(
                "{name}: half of the answers within {}, the longest {}",
                milliseconds(&times["p50"]),
                milliseconds(&times["max"])
            );
            plot::answer_times(axis, steps, &about)
        } else {
            html! { span.unread { "has not answered" } }
        };
        vec![
            cell(name),
            picture,
            cell(milliseconds(&times["p50"])),
            cell(milliseconds(&times["p99"])),
            cell(milliseconds(&times["max"])),
            cell(milliseconds(&slave["timeout_ms"])),
        ]
    });
    html! {
        (table("list", &["slave", "milliseconds, each on the same axis", "half within", "99 of 100", "longest", "given up after"], 2, rows.collect()))
        p.note { "From the end of a request to the first character of its answer. A bar is as high as its share of the highest of its \
            slave; answers that were far shorter than the others stand at the left end." }
    }
}

fn errors(line: &Value) -> Markup {
    let mut all: Vec<(String, &Value, u64)> =
        slaves(line).map(|(name, slave, _)| (name, &slave["errors"], count(&slave["exchanges"]))).collect();
    all.push(("all".to_owned(), &line["errors"], count(&line["exchanges"])));
    let parts = |errors: &Value| KINDS.map(|(key, _)| (key, count(&errors[key])));
    let bad = |errors: &Value| parts(errors).iter().map(|(_, number)| number).sum::<u64>();
    // The bars of all slaves have one scale.
    let worst = all.iter().max_by(|(_, one, of), (_, other, of_other)| {
        (bad(one) * of_other.max(&1)).cmp(&(bad(other) * of.max(&1)))
    });
    let (worst, of) = worst.map_or((0, 1), |(_, errors, of)| (bad(errors), *of));
    let rows = all.iter().map(|(name, errors, exchanges)| {
        let about = format!("{name}: {} of {exchanges} exchanges went wrong", bad(errors));
        let share_of = |number: u64| number as f64 / (*exchanges).max(1) as f64;
        let drawn = parts(errors).map(|(key, number)| (key, share_of(number)));
        let mut cells = vec![
            cell(name),
            plot::shares(&drawn, worst.max(1) as f64 / of.max(1) as f64, &about),
            cell(exchanges),
        ];
        cells.extend(parts(errors).map(|(_, number)| cell(number)));
        cells.push(cell(share(count(&errors["damaged"]), *exchanges)));
        cells
    });
    let mut heads = vec!["slave", "what went wrong", "sent"];
    heads.extend(KINDS.map(|(_, name)| name));
    heads.push("damaged share");
    html! {
        (table("list errors", &heads, 2, rows.collect()))
        p.note.legend {
            @if worst > 0 { "A full bar is " (share(worst, of)) " of the exchanges; from left to right: " } @else { "From left to right: " }
            @for (key, name) in KINDS { span { span.swatch.(key) {} " " (name) } }
        }
    }
}

fn availability(line: &Value, drives: &[Value]) -> Markup {
    let rows = slaves(line).map(|(name, slave, answers)| {
        let drive = drives.iter().find(|drive| drive["name"] == slave["drive"]);
        let counters = drive.map_or(&Value::Null, |drive| &drive["counters"]);
        let (polls, answered) = (count(&counters["polls"]), count(&counters["answered"]));
        let answered = answered.min(polls);
        let now = match (slave["off_line"] == true, slave["next_probe_ms"].as_u64()) {
            (false, _) => "asked".to_owned(),
            (true, Some(next)) => format!("OFF-LINE, asked again in {}", milliseconds(&next.into())),
            (true, None) => "OFF-LINE".to_owned(),
        };
        let about = format!("{name}: {answered} of {polls} statuses came");
        vec![
            cell(name),
            plot::shares(&[("good", answered as f64)], polls.max(1) as f64, &about),
            cell(share(answered, polls)),
            cell(polls),
            cell(count(&counters["missed"])),
            cell(count(&counters["lost"])),
            cell(count(&answers["went_offline"])),
            cell(now),
        ]
    });
    table(
        "list",
        &["slave", "statuses that came", "share", "due", "not before the next", "lost", "off-line", "now"],
        2,
        rows.collect(),
    )
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_step_begins_where_the_one_before_it_ends() {
        let answers = json!({"times": [{"up_to_ms": 9.0, "count": 5}, {"up_to_ms": 10.0, "count": 0}, {"up_to_ms": 11.0, "count": 2}]});
        let steps: Vec<_> = steps(&answers).iter().map(|step| (step.from, step.to, step.count)).collect();
        assert_eq!(steps, [(8.0, 9.0, 5.0), (9.0, 10.0, 0.0), (10.0, 11.0, 2.0)]);
    }
}
