//! What somebody means who asks for a moment, and what is told beside it.

use drived_plant::plant::past::{Certainty, RecordView, SentenceView as Sentence};

use super::{
    body::{Cause, body},
    cause::{causes, headline},
    facts::{Facts, begins, lasting},
};

/// A moment that is a whole minute means that minute.
const MINUTE_MS: i64 = 60_000;
/// So long after it happened a drive shows something at the latest, as a rule; the clock of whoever asks is not this one.
const SHOWN_MS: i64 = 3_000;
const CLOCK_MS: i64 = 1_000;
/// What is farther away than this is not what is asked for.
const FAR_MS: i64 = 10_000;
/// What is heavier than what is asked for is told beside it within this time.
const BESIDE_MS: i64 = 300_000;
/// Of a moment, what was so shortly before and behind it is told with it,
const ALSO_BEFORE_MS: i64 = 3_000;
const ALSO_AFTER_MS: i64 = 10_000;
/// and so many of it at the most.
const ALSO: usize = 8;
/// What is told of one reading is recorded within this time.
const ONE_READING_MS: i64 = 150;
/// What a story is about, the weightiest first. `run`: a motor began or ceased to run.
const WEIGHT: [&str; 29] = [
    "tripped",
    "stop_unconfirmed",
    "other_family",
    "identity_changed",
    "run_command_stands",
    "output_blocked",
    "reference_taken",
    "command_overridden",
    "run_not_adopted",
    "control_taken",
    "watchdog_not_in_force",
    "lost",
    "fault_changed",
    "fault_cleared",
    "run",
    "output_departed",
    "limit",
    "stop",
    "start",
    "reset",
    "release",
    "setpoint",
    "parameter_written",
    "write_refused",
    "command_refused",
    "maintenance_due",
    "state_changed",
    "warning",
    "control_returned",
];
/// What is heavier than anything that a person does.
const HEAVY: usize = 13;

/// What is asked for: a moment, or the minute that begins with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) from: i64,
    pub(super) to: i64,
}

impl Asked {
    pub(super) const fn of(at: i64) -> Self {
        let lasts = if at.rem_euclid(MINUTE_MS) == 0 { MINUTE_MS - 1 } else { 0 };
        Self { from: at, to: at + lasts }
    }

    /// How far away something is.
    pub(super) fn distance(self, at: i64) -> i64 {
        (self.from - at).max(at - self.to).max(0)
    }

    /// Whether it is what was meant, as exactly as a clock is read and a drive is polled.
    pub(super) fn is_met_by(self, at: i64) -> bool {
        (self.from - CLOCK_MS..=self.to + SHOWN_MS).contains(&at)
    }
}

/// How much something weighs; `None`: no story is about it.
fn weight(facts: &Facts, found: &RecordView) -> Option<usize> {
    let of = |what: &str| WEIGHT.iter().position(|one| *one == what);
    let is_run = || {
        let body = body(found);
        let runs = |state: Option<&str>| state == Some("running");
        let begins = !runs(body.from.as_deref()) && runs(body.to.as_deref());
        let ends = runs(body.from.as_deref()) && !runs(body.to.as_deref());
        // A start that was asked for is told as that.
        ends || begins && !matches!(body.cause, Some(Cause::Command { .. }))
    };
    // That the program ends is what somebody asks for who asks for nothing else.
    let ends = matches!(facts.cause_of(found), Some(Cause::Policy { policy }) if policy == "exit");
    match &*found.what {
        _ if ends => of(&found.what).map(|_| WEIGHT.len()),
        "control_taken" if facts.is_fallen_back(found) => of("control_returned"),
        "state_changed" if is_run() => of("run"),
        what => of(what),
    }
}

/// What there is of the drive that a story can be about, with its weight and its beginning.
fn told_of(facts: &Facts) -> impl Iterator<Item = (usize, i64, &RecordView)> {
    let is_one = |found: &&RecordView| {
        matches!(&*found.kind, "event" | "command") && facts.is_of_drive(found) || facts.is_refused(found)
    };
    facts
        .records
        .iter()
        .filter(is_one)
        .filter_map(|found| Some((weight(facts, found)?, begins(found), found)))
}

/// What somebody means who asks for this moment: the weightiest of what was then; else what is nearest, within seconds; else what was found
/// when the drive was seen again, where nobody saw it then. `None`: nothing happened.
pub(super) fn about(facts: &Facts, asked: Asked) -> Option<&RecordView> {
    let then = told_of(facts)
        .filter(|(_, begins, _)| asked.is_met_by(*begins))
        // What was seen shortly before it is meant where nothing was seen with it: whoever asks has read his clock.
        .min_by_key(|(weight, begins, found)| {
            (*begins < asked.from, *weight, asked.distance(*begins), found.number)
        });
    let near = || {
        told_of(facts)
            .filter(|(_, begins, _)| asked.distance(*begins) <= SHOWN_MS)
            .min_by_key(|(weight, begins, found)| (asked.distance(*begins), *weight, found.number))
    };
    let unseen = || {
        let (start, end) = facts.gap_at(asked.from)?;
        told_of(facts)
            .filter(|(weight, begins, found)| {
                *weight <= HEAVY + 1
                    // What a drive was lost by lasts, and so does that another one answers in its place.
                    && (*begins >= asked.from || matches!(&*found.what, "lost" | "other_family"))
                    && (start - CLOCK_MS..=end + SHOWN_MS).contains(begins)
            })
            .min_by_key(|(weight, _, found)| (*weight, found.number))
    };
    let soon = || {
        told_of(facts)
            .filter(|(weight, begins, _)| {
                *weight <= HEAVY + 1 && (asked.from..=asked.to + FAR_MS).contains(begins)
            })
            .min_by_key(|(weight, begins, found)| (asked.distance(*begins), *weight, found.number))
    };
    then.or_else(near).or_else(unseen).or_else(soon).map(|(_, _, found)| found)
}

/// That nothing is recorded of the moment itself, where what is told came later than a clock and a poll explain. Where nobody saw it then, that
/// is told by itself.
pub(super) fn later(facts: &Facts, about: &RecordView, asked: Asked) -> Option<Sentence> {
    let away = begins(about) - asked.to;
    let is_later = away > SHOWN_MS && facts.gap_at(asked.from).is_none();
    let text = format!(
        "nothing is recorded of it at the moment that was asked for: this is the next, {} later",
        lasting(away)
    );
    is_later.then(|| Sentence::of(Certainty::Seen, text).at(asked.from))
}

/// What else happened then, and is not told of why, in its order: each with what is told first of why.
pub(super) fn also(facts: &Facts, about: &RecordView, asked: Asked, why: &[Sentence]) -> Vec<Sentence> {
    let (from, to) = match asked.from == asked.to {
        true => (asked.from - ALSO_BEFORE_MS, asked.to + ALSO_AFTER_MS),
        false => (asked.from, asked.to),
    };
    let mut told = vec![(weight(facts, about).unwrap_or_default(), begins(about), about)];
    // That a motor that stops then stands is no news.
    let rest = WEIGHT.iter().position(|one| *one == "state_changed");
    let mut others: Vec<_> = told_of(facts)
        .filter(|(weight, begins, _)| Some(*weight) != rest && (from..=to).contains(begins))
        .collect();
    others.sort_by_key(|(weight, begins, found)| (*weight, *begins, found.number));
    for other in others {
        let is_told = |(_, begins, found): &(usize, i64, &RecordView)| {
            (begins - other.1).abs() <= ONE_READING_MS
                || (found.time_unix_ms - other.2.time_unix_ms).abs() <= ONE_READING_MS
        };
        if !told.iter().any(is_told) {
            told.push(other);
        }
    }
    let mut others = told.split_off(1);
    others.retain(|(_, _, found)| {
        let words = facts.in_words(found);
        !why.iter().any(|one| one.time_unix_ms == Some(found.time_unix_ms) && one.text.contains(&words))
    });
    others.sort_by_key(|(_, begins, found)| (*begins, found.number));
    let more = others.len().saturating_sub(ALSO);
    let mut said = Vec::new();
    for (_, begins, found) in others.into_iter().take(ALSO) {
        let away = begins - super::facts::begins(about);
        let side = if away < 0 { "earlier" } else { "later" };
        let (began, head) = (began(found), headline(facts, found));
        let text = format!("{} {side}{began}: {}", lasting(away.abs()), head.text);
        said.push(Sentence::of(head.certainty, text).at(begins));
        let why = causes(facts, found).into_iter().next();
        let is_new = |why: &Sentence| found.kind != "command" && !why.text.contains(&facts.in_words(found));
        said.extend(why.filter(is_new).map(|why| Sentence { text: format!("to that: {}", why.text), ..why }));
    }
    if more > 0 {
        let text = format!("{more} more happened then: they are told below");
        said.push(Sentence::of(Certainty::Seen, text));
    }
    said
}

/// What is heavier than what is asked for, before and after it: and not as its cause. Where nothing happened, what
/// was next.
pub(super) fn beside(
    facts: &Facts,
    about: Option<&RecordView>,
    moment: i64,
    told: &[Sentence],
) -> Vec<Sentence> {
    let known = about.and_then(|about| weight(facts, about));
    let is_told = |weight: usize, begins: i64| match known {
        Some(known) => weight < known.min(HEAVY) && (begins - moment).abs() <= BESIDE_MS,
        None => true,
    };
    let number = about.map_or(0, |about| about.number);
    let others = || {
        told_of(facts).filter(|(weight, begins, found)| {
            found.number != number
                && found.time_unix_ms != moment
                && is_told(*weight, *begins)
                && !told.iter().any(|one| one.time_unix_ms == Some(*begins))
                && !told.iter().any(|one| one.time_unix_ms == Some(found.time_unix_ms))
        })
    };
    let before = others().filter(|(_, begins, _)| *begins < moment).max_by_key(|(_, begins, _)| *begins);
    let after = others().filter(|(_, begins, _)| *begins >= moment).min_by_key(|(_, begins, _)| *begins);
    let word = if about.is_some() { "" } else { "next " };
    let told = [(before, "before"), (after, "after")];
    told.into_iter()
        .filter_map(|(found, side)| {
            let (_, begins, found) = found?;
            let away = lasting((begins - moment).abs());
            let (began, head) = (began(found), headline(facts, found));
            let text = format!("{word}{side} it, {away} away{began}: {}", head.text);
            Some(Sentence::of(head.certainty, text).at(begins))
        })
        .collect()
}

/// That only the beginning of something is meant, which was told later.
fn began(found: &RecordView) -> &'static str {
    if begins(found) < found.time_unix_ms { ", this began" } else { "" }
}
