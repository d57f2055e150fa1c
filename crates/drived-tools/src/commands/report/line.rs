//! The chapter of one line: the plan beside what was measured, how it was used, how its slaves answered, what went wrong.

use maud::{Markup, html};

use super::{
    gather::DriveTold,
    own::LINE,
    plot::{self, Axis, Step},
    words::{cell, milliseconds, own, percent, share, span, table},
};
use drived_plant::plant::views::{AnswersView, LineDetailView, LineErrors, LineLink, SlaveView, StepView};

/// What is to be thought of a figure that was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    NotMeasured,
    Within,
    More,
}

impl Verdict {
    fn of(planned: f64, measured: Option<f64>) -> Self {
        match measured {
            None => Self::NotMeasured,
            Some(measured) if measured <= planned => Self::Within,
            Some(_) => Self::More,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::NotMeasured => "not measured",
            Self::Within => "within the plan",
            Self::More => "MORE THAN PLANNED",
        }
    }
}

/// From what a finding cannot be told.
pub(super) fn cannot_be_told_from(what: &str) -> String {
    format!("it cannot be told from {what}")
}

pub(super) fn chapter(detail: &LineDetailView, drives: &[DriveTold]) -> Markup {
    let LineDetailView { line, measured, .. } = detail;
    html! {
        section.line {
            h3 { @if line.name == LINE { (own("The line")) } @else { (own("Line ")) (line.name) } }
            p.where { (line.port) ", " (line.protocol) }
            @if line.link == LineLink::Away {
                p.alarm { (own("The port is away: ")) (own(line.error.as_deref().unwrap_or("–"))) }
            }
            p { (own("Measured since the line was opened: ")) (own(&span(measured.elapsed_ms))) (own(", requests sent: "))
                (line.exchanges) "." }
            @if !line.findings.is_empty() {
                h4 { "What is wrong with it" }
                ul { @for finding in &line.findings {
                    li {
                        @if let Some(slave) = finding.slave {
                            @match &finding.drive { Some(drive) => (drive), None => (own(&format!("address {slave}"))) } ": "
                        }
                        (own(&finding.text))
                        @if let Some(what) = &finding.cannot_be_told_from { " (" (own(&cannot_be_told_from(what))) ")" }
                        @for next in &finding.next { "; " (own(next)) }
                    }
                } }
            }
            h4 { "Plan against measured" }
            (plan(detail))
            h4 { "How long answers took" }
            (answers(detail))
            h4 { "Errors by kind" }
            (errors(detail))
            h4 { "Availability" }
            (availability(detail, drives))
        }
    }
}

/// One row a figure: what was planned, what was measured, and what to think of it.
fn plan(detail: &LineDetailView) -> Markup {
    let LineDetailView { line, planned, measured, .. } = detail;
    let row = |figure: &str, planned: String, measured: String, verdict: &str| {
        let verdict = if verdict.is_empty() { cell("") } else { own(verdict) };
        vec![own(figure), own(&planned), own(&measured), verdict]
    };
    let used = measured.utilisation_percent;
    let longest = measured.stop_wait_ms.map(|waited| waited.max);
    let stops = measured.stop_wait_ms.map_or_else(
        || "no stop was sent".to_owned(),
        |waited| format!("{} at the most, of {}", milliseconds(waited.max), waited.count),
    );
    let statuses = measured.status_wait_ms;
    let kept = match (measured.needed_silence_ms, measured.silence_ms) {
        (Some(needed), Some(kept)) if kept.min + 0.005 < needed => "TOO SHORT",
        (Some(_), Some(_)) => "kept",
        _ => "none is needed",
    };
    let rows = vec![
        row(
            "one status of every drive",
            milliseconds(planned.cycle_ms),
            milliseconds(measured.cycle_ms),
            Verdict::of(planned.cycle_ms, measured.cycle_ms).words(),
        ),
        row(
            "polls and watchdogs use, all drives running",
            percent(planned.utilisation_percent),
            format!("{} ({} lately)", percent(used), percent(line.utilisation_percent)),
            match Verdict::of(planned.utilisation_percent, Some(used)) {
                Verdict::More => "more: questions and commands come on top",
                verdict => verdict.words(),
            },
        ),
        row(
            "a stop is on the wire within",
            milliseconds(planned.stop_ms),
            format!("{} as the line has been", milliseconds(measured.stop_ms)),
            Verdict::of(planned.stop_ms, Some(measured.stop_ms)).words(),
        ),
        row(
            "  stops that were sent waited",
            milliseconds(planned.stop_ms),
            stops,
            Verdict::of(planned.stop_ms, longest).words(),
        ),
        row(
            "all have confirmed a stop within",
            milliseconds(planned.all_stopped_ms),
            "–".to_owned(),
            Verdict::NotMeasured.words(),
        ),
        row(
            "a status waits for its turn",
            "–".to_owned(),
            format!(
                "{} half of them, {} at the most",
                milliseconds(statuses.map(|waited| waited.p50)),
                milliseconds(statuses.map(|waited| waited.max))
            ),
            "",
        ),
        row(
            "silence before a request",
            format!("{} are needed", milliseconds(measured.needed_silence_ms)),
            format!("{} at the least", milliseconds(measured.silence_ms.map(|silence| silence.min))),
            kept,
        ),
        row(
            "this computer writes later than it may by",
            "–".to_owned(),
            format!(
                "{} of 99 in 100, {} at the most",
                milliseconds(measured.lag_ms.map(|late| late.p99)),
                milliseconds(measured.lag_ms.map(|late| late.max))
            ),
            "",
        ),
    ];
    let strange = [
        ("requests sent again", measured.retries),
        ("frames of somebody else", line.errors.foreign.unwrap_or_default()),
        ("bytes that make no frame", measured.noise_bytes),
        ("port lost", measured.lost),
    ];
    html! {
        (table("list", &["figure", "planned", "measured", "verdict"], 9, rows))
        p.note { @for (index, (what, number)) in strange.iter().enumerate() { @if index > 0 { "; " } (own(what)) ": " (number) } "." }
    }
}

/// The slaves of a line, each with its name and how it answered.
fn slaves(detail: &LineDetailView) -> impl Iterator<Item = (String, &SlaveView, Option<&AnswersView>)> {
    detail.line.slaves.iter().map(|slave| {
        let answers = detail.measured.answers.iter().find(|answers| answers.slave == slave.slave);
        let name = slave.drive.as_deref().unwrap_or("no drive of the program");
        (format!("{}\u{a0}·\u{a0}{name}", slave.slave), slave, answers)
    })
}

/// The name of a slave; what the program says where it has none is its own.
fn called(name: &str, slave: &SlaveView) -> Markup {
    if slave.drive.is_some() { cell(name) } else { own(name) }
}

/// The steps of one slave, each beginning where the one before it ends.
fn steps(answers: Option<&AnswersView>) -> Vec<Step> {
    let ends = answers.map_or(&[][..], |answers| &answers.times);
    let begins = ends.iter().scan(None, |before, step| {
        // The first step is as wide as one is.
        Some(before.replace(step.up_to_ms).unwrap_or(step.up_to_ms * 8.0 / 9.0))
    });
    let step = |(from, step): (f64, &StepView)| Step { from, to: step.up_to_ms, count: step.count.into() };
    begins.zip(ends).map(step).collect()
}

fn answers(detail: &LineDetailView) -> Markup {
    let all: Vec<(String, &SlaveView, Vec<Step>)> =
        slaves(detail).map(|(name, slave, answers)| (name, slave, steps(answers))).collect();
    let Some(axis) = Axis::of(all.iter().map(|(_, _, steps)| &steps[..])) else {
        return html! { p.unread { (own("No slave of this line has answered.")) } };
    };
    let rows = all.iter().map(|(name, slave, steps)| {
        let times = slave.answer_ms;
        let picture = match times {
            Some(times) => {
                let (half, longest) = (milliseconds(times.p50), milliseconds(times.max));
                let about = format!("{name}: half of the answers within {half}, the longest {longest}");
                plot::answer_times(axis, steps, &about)
            }
            None => html! { span.unread { (own("has not answered")) } },
        };
        vec![
            called(name, slave),
            picture,
            cell(milliseconds(times.map(|times| times.p50))),
            cell(milliseconds(times.map(|times| times.p99))),
            cell(milliseconds(times.map(|times| times.max))),
            cell(milliseconds(slave.timeout_ms as f64)),
        ]
    });
    html! {
        (table("list", &["slave", "milliseconds, each on the same axis", "half within", "99 of 100", "longest", "given up after"], 2, rows.collect()))
        p.note { (own("From the end of a request to the first character of its answer. A bar is as high as its share of the highest of its slave; answers that were far shorter than the others stand at the left end.")) }
    }
}

fn errors(detail: &LineDetailView) -> Markup {
    let mut all: Vec<(String, Markup, LineErrors, u64)> = slaves(detail)
        .map(|(name, slave, _)| (name.clone(), called(&name, slave), slave.errors, slave.exchanges))
        .collect();
    all.push(("all".to_owned(), own("all"), detail.line.errors, detail.line.exchanges));
    let bad = |errors: &LineErrors| errors.of_exchanges().iter().map(|(.., number)| number).sum::<u64>();
    // The bars of all slaves have one scale.
    let worst = all.iter().max_by(|(.., one, of), (.., other, of_other)| {
        (bad(one) * of_other.max(&1)).cmp(&(bad(other) * of.max(&1)))
    });
    let (worst, of) = worst.map_or((0, 1), |(.., errors, of)| (bad(errors), *of));
    let rows = all.iter().map(|(name, shown, errors, exchanges)| {
        let about = format!("{name}: {} of {exchanges} exchanges went wrong", bad(errors));
        let share_of = |number: u64| number as f64 / (*exchanges).max(1) as f64;
        let drawn = errors.of_exchanges().map(|(key, _, number)| (key, share_of(number)));
        let mut cells = vec![
            cell(shown),
            plot::shares(&drawn, worst.max(1) as f64 / of.max(1) as f64, &about),
            cell(exchanges),
        ];
        cells.extend(errors.of_exchanges().map(|(.., number)| cell(number)));
        cells.push(cell(share(errors.damaged, *exchanges)));
        cells
    });
    let kinds = LineErrors::default().of_exchanges();
    let mut heads = vec!["slave", "what went wrong", "sent"];
    heads.extend(kinds.map(|(_, name, _)| name));
    heads.push("damaged share");
    html! {
        (table("list errors", &heads, 2, rows.collect()))
        p.note.legend {
            @if worst > 0 { (own("A full bar, as a share of the exchanges: ")) (share(worst, of)) "; " } (own("from left to right: "))
            @for (key, name, _) in kinds { span { span.swatch.(key) {} " " (own(name)) } }
        }
    }
}

fn availability(detail: &LineDetailView, drives: &[DriveTold]) -> Markup {
    let rows = slaves(detail).map(|(name, slave, answers)| {
        let drive = drives.iter().find(|drive| Some(drive.name()) == slave.drive.as_deref());
        let (answered, polls) = drive.map(DriveTold::statuses).unwrap_or_default();
        let counters = drive.map(|drive| drive.view.snapshot.counters).unwrap_or_default();
        let now = match (slave.off_line, slave.next_probe_ms) {
            (false, _) => own("asked"),
            (true, Some(next)) => html! { (own("OFF-LINE, asked again in ")) (milliseconds(next as f64)) },
            (true, None) => own("OFF-LINE"),
        };
        let about = format!("{name}: {answered} of {polls} statuses came");
        vec![
            called(&name, slave),
            plot::shares(&[("good", answered as f64)], polls.max(1) as f64, &about),
            cell(share(answered, polls)),
            cell(polls),
            cell(counters.missed),
            cell(counters.lost),
            cell(answers.map_or(0, |answers| answers.went_offline)),
            now,
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
    fn a_figure_that_was_not_measured_is_judged_neither_way() {
        let told = [None, Some(1.0), Some(1.01)].map(|measured| Verdict::of(1.0, measured));
        assert_eq!(told, [Verdict::NotMeasured, Verdict::Within, Verdict::More]);
    }

    #[test]
    fn a_step_begins_where_the_one_before_it_ends() {
        let answers = json!({"slave": 1, "answered": 7, "went_offline": 0, "times": [{"up_to_ms": 9.0, "count": 5}, {"up_to_ms": 10.0, "count": 0}, {"up_to_ms": 11.0, "count": 2}]});
        let answers = serde_json::from_value(answers).unwrap();
        let steps: Vec<_> =
            steps(Some(&answers)).iter().map(|step| (step.from, step.to, step.count)).collect();
        assert_eq!(steps, [(8.0, 9.0, 5.0), (9.0, 10.0, 0.0), (10.0, 11.0, 2.0)]);
    }
}
