//! What speaks for a cause: what was asked for here, what was seen beside it, and within which time it happened.

use drive_fleet::Refused;
use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Seen},
    LineMinuteView, RecordView, SentenceView as Sentence,
};

use super::super::{
    body::body,
    facts::{Facts, SEEN_AGAIN_MS, begins, is_silent, lasting},
};

/// What comes within this time of each other may have one cause.
pub(super) const TOGETHER_MS: i64 = 5_000;
/// What was asked for so shortly before something was seen may have come behind it: a drive is looked at from poll to poll.
pub(super) const ONE_POLL_MS: i64 = 5_000;
/// A command may be the cause of what the drive does within this time.
pub(super) const OBEYED_MS: i64 = 10_000;
/// A silence may be the cause of a trip of the watchdog within this time.
pub(super) const SILENT_MS: i64 = 90_000;
/// An input that was read otherwise longer before what it did had done something else: the status is read often.
const INPUT_BEFORE_MS: i64 = 2_000;
/// The slow set is read so rarely that what it shows belongs to something within this time.
pub(super) const BESIDE_MS: i64 = 60_000;

/// What a fault is called in a manual that is one of the supply.
const OF_SUPPLY: [&str; 4] = ["suppl", "mains", "undervoltage", "input phase"];

/// Whether what a drive says of a fault is of its supply.
pub(super) fn is_of_supply(reason: &str) -> bool {
    OF_SUPPLY.iter().any(|word| reason.to_lowercase().contains(word))
}

/// That nobody here asked for something, where that is known: what begins between two looks at a drive was asked for shortly before.
pub(super) fn nobody_asked(facts: &Facts, at: i64) -> Sentence {
    match facts.missing(at - ONE_POLL_MS, at) {
        None => Sentence::of(Seen, "nobody here asked for it"),
        Some(why) => Sentence::of(
            NotKnown,
            format!("whether somebody here asked for it is not known: no command is recorded, and {why}"),
        ),
    }
}

/// The last command to the drive shortly before something, of these actions.
pub(super) fn asked_before<'a>(
    facts: &'a Facts,
    about: &RecordView,
    actions: &[&str],
) -> Option<&'a RecordView> {
    let at = about.time_unix_ms;
    facts.records.iter().rev().find(|found| {
        found.kind == "command"
            && actions.contains(&&*found.what)
            && facts.is_of_drive(found)
            && (at - OBEYED_MS..=at).contains(&found.time_unix_ms)
            && was_sent(facts, found)
    })
}

/// Whether a command was, or may have been, on the wire: one that was refused moved nothing. What something newer overtook may have been
/// carried out in part, unless it is told that it was overtaken before.
fn was_sent(facts: &Facts, found: &RecordView) -> bool {
    let (outcome, why) = match facts.of_several(found) {
        Some(one) => (Some(one.outcome), one.text.unwrap_or_default()),
        None => (body(found).outcome, found.text.clone()),
    };
    match outcome.as_deref() {
        Some("refused" | "expired" | "nothing") => false,
        Some("superseded") => {
            let before = [Refused::Stopped, Refused::Superseded].map(|unsent| unsent.to_string());
            !before.iter().any(|unsent| why.contains(unsent))
        }
        _ => true,
    }
}

/// A command without what became of it, which was told later than what it is told with.
pub(super) fn without_outcome(text: &str) -> &str {
    const OUTCOMES: [&str; 6] =
        [": confirmed", ": refused", ": not confirmed", ": unknown", ": expired", ": superseded"];
    OUTCOMES.iter().find_map(|outcome| text.split_once(outcome)).map_or(text, |(asked, _)| asked)
}

/// What was asked for before a trip was seen: whether it was before the trip is known only where the drive was seen between them.
pub(super) fn in_order(facts: &Facts, about: &RecordView, asked: &RecordView) -> Sentence {
    let between = |found: &RecordView| {
        found.kind == "event"
            && found.drive.as_deref() == Some(&*facts.drive)
            && matches!(&*found.what, "state_changed" | "stop_confirmed")
            && found.time_unix_ms > asked.time_unix_ms
            && found.time_unix_ms < about.time_unix_ms
    };
    let was_seen = facts.records.iter().any(between);
    let is_long = about.time_unix_ms - asked.time_unix_ms > ONE_POLL_MS;
    let said = match was_seen || is_long {
        true => Sentence::of(Seen, format!("shortly before it somebody had asked: {}", asked.text)),
        false => Sentence::of(
            NotKnown,
            format!(
                "at about the same time somebody asked, and which of the two came first is not known, for the drive is looked at from poll to poll: {}",
                asked.text
            ),
        ),
    };
    said.at(asked.time_unix_ms)
}

/// Something that was found, and within which time it happened.
pub(super) fn found_within(facts: &Facts, at: i64, what: &str) -> Sentence {
    let lost = loss_before(facts, at).map_or(i64::MIN, |(lost, _)| begins(lost));
    match facts.gap_before(at).map(|(start, end)| (start.max(lost.min(end)), end)) {
        Some((start, end)) => Sentence::of(
            NotKnown,
            format!(
                "{what}: when that happened is not known, but that it was within the {} from this moment on, in which nothing of it is known",
                lasting(end - start)
            ),
        )
        .at(start),
        None => Sentence::of(NotKnown, format!("{what}: when that happened is not known")),
    }
}

/// That it had not answered until it was seen again.
pub(super) fn lost_before(facts: &Facts, at: i64) -> Option<Sentence> {
    let (lost, end) = loss_before(facts, at)?;
    let nothing =
        if is_silent(lost) { "nothing had been heard of it" } else { "its status had not been read" };
    let text = format!("{nothing} before, for {}: {}", lasting(end - begins(lost)), lost.text);
    Some(Sentence::of(Seen, text).at(lost.time_unix_ms))
}

/// That it had been lost shortly before something that it showed.
pub(super) fn lost_for(facts: &Facts, about: &RecordView) -> Option<Sentence> {
    let at = about.time_unix_ms;
    let lost = facts.records.iter().rev().find(|found| {
        found.what == "lost"
            && found.drive == about.drive
            && (at - BESIDE_MS..=at).contains(&found.time_unix_ms)
    })?;
    let text = format!("{} before, it had been lost: {}", lasting(at - begins(lost)), lost.text);
    Some(Sentence::of(Seen, text).at(lost.time_unix_ms))
}

/// The loss of the drive that had ended when it was seen again at a moment, and when it ended.
pub(super) fn loss_before(facts: &Facts, at: i64) -> Option<(&RecordView, i64)> {
    let own =
        || facts.records.iter().rev().filter(|found| facts.is_of_drive(found) && found.time_unix_ms <= at);
    let back = own().find(|found| found.what == "connected" && at - found.time_unix_ms <= SEEN_AGAIN_MS);
    // That it was heard again may be among what is missing: its values show it too.
    let (number, end) = match back {
        Some(back) => (back.number, back.time_unix_ms),
        None => (i64::MAX, facts.gap_before(at)?.1),
    };
    let lost = own().filter(|found| found.number < number);
    let lost = lost.take_while(|found| found.what != "connected").find(|found| found.what == "lost")?;
    Some((lost, end))
}

/// What its line counted in the minute in which a moment lies.
pub(super) fn minute(facts: &Facts, at: i64) -> Option<&LineMinuteView> {
    facts.minutes.iter().find(|minute| (at..=at + BESIDE_MS).contains(&minute.time_unix_ms))
}

/// That its inputs were read otherwise behind something than before it.
pub(super) fn inputs_changed(facts: &Facts, at: i64) -> Option<Sentence> {
    let changed = facts.inputs.windows(2).find(|pair| {
        pair[0].1 != pair[1].1 && (at - INPUT_BEFORE_MS..=at + BESIDE_MS).contains(&pair[1].0)
    })?;
    let ((_, before), (seen, now)) = (changed[0], changed[1]);
    let text = format!(
        "its inputs changed from {before:04X}h to {now:04X}h, seen when they were read next ({})",
        bits(before, now)
    );
    Some(Sentence::of(Seen, text).at(seen))
}

/// That they were read before it and behind it, and were the same.
pub(super) fn inputs_stayed(facts: &Facts, at: i64) -> Option<Sentence> {
    let (_, count) = facts.inputs.iter().rev().find(|(since, _)| *since <= at)?;
    let is_known = facts.inputs_known.iter().any(|(start, end)| *start <= at && *end > at);
    (is_known && inputs_changed(facts, at).is_none()).then(|| {
        let text = format!(
            "its inputs, as far as they are read, were the same before it and after it ({count:04X}h)"
        );
        Sentence::of(Seen, text)
    })
}

/// What was seen at the drive and on its line beside something that nobody here asked for: inputs, and frames of others.
pub(super) fn seen_beside(facts: &Facts, at: i64) -> Vec<Sentence> {
    let mut said = Vec::new();
    if let Some(changed) = inputs_changed(facts, at) {
        said.push(changed);
        let text = "an input of the drive may have done it: what each does is in the drive's settings";
        said.push(Sentence::of(Likely, text));
    }
    let heard = minute(facts, at).filter(|minute| minute.foreign > 0);
    if let Some(minute) = heard {
        let text =
            format!("its line heard {} frames of somebody else in the minute until then", minute.foreign);
        said.push(Sentence::of(Seen, text).at(minute.time_unix_ms));
        said.push(Sentence::of(
            Likely,
            "another master speaks on the line: it may have written to the drive",
        ));
    }
    let finding = facts.records.iter().find(|found| {
        found.what == "line_finding"
            && found.line == facts.line
            && (found.time_unix_ms - at).abs() <= 5 * BESIDE_MS
    });
    if let Some(finding) = finding {
        said.push(
            Sentence::of(Seen, format!("what was found of its line: {}", finding.text))
                .at(finding.time_unix_ms),
        );
    }
    said
}

/// Which bits changed, in words.
fn bits(before: i64, now: i64) -> String {
    let changed = (0..16).filter(|bit| (before ^ now) >> bit & 1 == 1);
    let told = changed.map(|bit| format!("bit {bit} is {} now", now >> bit & 1));
    told.collect::<Vec<_>>().join(", ")
}

pub(super) fn names(found: &[&RecordView]) -> String {
    let mut names: Vec<&str> = found.iter().filter_map(|found| found.drive.as_deref()).collect();
    names.sort_unstable();
    names.dedup();
    match names.len() {
        0..=5 => names.join(", "),
        more => format!("{} and {} more", names[..5].join(", "), more - 5),
    }
}
