//! What happened around a moment, in its order, and what of it nobody knows.

use std::collections::BTreeSet;

use drived_plant::plant::past::{Certainty, RecordView, SentenceView as Sentence};
use rusqlite::Connection;

use super::{
    body::{Cause, body},
    facts::{Facts, lasting},
    journal::{is_of_one_reading, is_to_fault, is_told_by, with_change},
};
use crate::{read::parameters, store::StoreError};

/// From so long before the event,
pub(super) const BEFORE_MS: i64 = 120_000;
/// to so long after it is told what happened.
pub(super) const AFTER_MS: i64 = 300_000;
/// What is recorded within this time is recorded in any order.
const MOMENT_MS: i64 = 100;
/// So many sentences at the most.
const COURSE: usize = 60;

/// So many settings that were seen for the first time are told one by one.
const FIRST_SEEN: usize = 4;

/// What happened around a moment, in the daemon's order.
pub(super) fn course(facts: &Facts, moment: i64) -> Vec<Sentence> {
    let is_told = |found: &&RecordView| {
        let is_near = (moment - BEFORE_MS..=moment + AFTER_MS).contains(&found.time_unix_ms);
        let of_line = found.line.is_some() && found.line == facts.line;
        let weighs = matches!(
            &*found.what,
            "tripped" | "lost" | "connected" | "line_finding" | "line_errors" | "stop_unconfirmed"
        );
        let is_meant = match &*found.kind {
            "event" => facts.is_of_drive(found) || of_line && weighs,
            "command" => facts.is_of_drive(found),
            // What an alarm is of stands beside it as an event, but for those of a line.
            "alarm" => {
                of_line
                    && found.drive.is_none()
                    && matches!(&*found.what, "unacknowledged" | "returned" | "over")
            }
            _ => found.what != "command_refused" || facts.is_refused(found),
        };
        is_near && is_meant
    };
    let mut told: Vec<&RecordView> = facts.records.iter().filter(is_told).collect();
    // A trip is one fact: what it was by, and the state that it was shown with, are told with it.
    let trips: Vec<&RecordView> = told.iter().copied().filter(|found| found.what == "tripped").collect();
    let explained: BTreeSet<i64> =
        trips.iter().filter_map(|trip| facts.explained(trip)).map(|explained| explained.number).collect();
    told.retain(|found| {
        let is_shown = || trips.iter().any(|trip| is_of_one_reading(trip, found));
        !(explained.contains(&found.number) || is_to_fault(found) && is_shown())
    });
    let steps: Vec<&RecordView> =
        told.iter().copied().filter(|found| found.what == "clock_stepped").collect();
    told.retain(|found| !steps.iter().any(|step| is_told_by(found, step)));
    // What several events show that came with one status is told with the first of them.
    let with_words = |place: usize, found: &RecordView| {
        let is_same =
            |before: &&&RecordView| before.time_unix_ms == found.time_unix_ms && before.drive == found.drive;
        facts.is_of_drive(found) && !told[..place].iter().rev().take(3).any(|before| is_same(&before))
    };
    let first = told.iter().take(COURSE).enumerate();
    let mut course: Vec<Sentence> =
        first.map(|(place, found)| sentence(facts, found, with_words(place, found))).collect();
    in_order(&mut course);
    if told.len() > COURSE {
        let text = format!("{} more records follow: drived history tells them all", told.len() - COURSE);
        course.push(Sentence::of(Certainty::Seen, text));
    }
    course
}

/// Puts what was recorded in another order than its times within a moment in that of its times; a clock that was set back leaves the daemon's order.
fn in_order(course: &mut [Sentence]) {
    for end in 1..course.len() {
        for at in (1..=end).rev() {
            let [before, after] = [at - 1, at].map(|at| course[at].time_unix_ms.unwrap_or_default());
            if !(1..=MOMENT_MS).contains(&(before - after)) {
                break;
            }
            course.swap(at - 1, at);
        }
    }
}

/// Settings of the drive that were read or written here between two moments as another value than before.
pub(super) fn settings(
    connection: &Connection,
    drive: &str,
    from: i64,
    to: i64,
) -> Result<Vec<Sentence>, StoreError> {
    let settings = parameters(connection, drive)?;
    let (mut said, mut first) = (Vec::new(), Vec::new());
    for (place, setting) in settings.iter().enumerate() {
        let at = setting.first_unix_ms;
        if !(from..=to).contains(&at) {
            continue;
        }
        let before = place.checked_sub(1).map(|before| &settings[before]);
        let (to, was) = match before.filter(|before| before.address == setting.address) {
            Some(before) => (&mut said, format!("it was {}", before.text)),
            None => (&mut first, "what it was before is not recorded".to_owned()),
        };
        let text =
            format!("its setting {} was read, or written, as {}; {was}", setting.mnemonic, setting.text);
        to.push(Sentence::of(Certainty::Seen, text).at(at));
    }
    // A report and a backup read all of them, which is no news.
    if first.len() > FIRST_SEEN {
        let at = first.iter().filter_map(|sentence| sentence.time_unix_ms).min().unwrap_or(from);
        let text = format!(
            "{} of its settings were read, or written, for the first time from then on, as by a report or a backup: what they were before is not recorded",
            first.len()
        );
        first = vec![Sentence::of(Certainty::Seen, text).at(at)];
    }
    said.append(&mut first);
    Ok(said)
}

/// What happened, with what else was.
pub(super) fn with_settings(mut course: Vec<Sentence>, settings: Vec<Sentence>) -> Vec<Sentence> {
    for setting in settings {
        let later = |one: &Sentence| one.time_unix_ms > setting.time_unix_ms;
        let place = course.iter().position(later).unwrap_or(course.len());
        course.insert(place, setting);
    }
    course
}

fn sentence(facts: &Facts, found: &RecordView, with_words: bool) -> Sentence {
    let who = match (&found.drive, &found.line) {
        (Some(drive), _) if *drive == facts.drive => String::new(),
        (Some(drive), _) => format!("{drive}: "),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    };
    let body = body(found);
    let by = match facts.cause_of(found) {
        Some(Cause::Command { commander, door }) => {
            let door = door.as_ref().map(|door| format!(" through {door}")).unwrap_or_default();
            format!(" (by {commander}{door})")
        }
        Some(Cause::Policy { policy }) => {
            format!(" (by this program's policy: {})", policy.replace('_', " "))
        }
        _ => String::new(),
    };
    let words: Vec<String> = body
        .words
        .iter()
        .filter(|_| with_words)
        .map(|word| match word.before {
            Some(before) => format!("{} {before:04X}h to {:04X}h", word.code, word.value),
            None => format!("{} {:04X}h", word.code, word.value),
        })
        .collect();
    let words = if words.is_empty() { String::new() } else { format!(" [{}]", words.join(", ")) };
    let asked = if found.kind == "command" { "asked: " } else { "" };
    let text = match found.text.strip_prefix("returned: ") {
        Some(alarm) if found.kind == "alarm" => format!("over: {alarm}"),
        _ if found.what == "tripped" => {
            let change = facts.records.iter().find(|one| is_to_fault(one) && is_of_one_reading(found, one));
            with_change(facts.in_words(found), change)
        }
        _ => facts.told(found),
    };
    // A line on which nothing is heard is opened anew: that its port was away nobody has seen.
    let text = match text.split_once("nothing was heard for ") {
        Some((_, detail)) if found.kind == "alarm" && found.line.is_some() => {
            let over = if text.starts_with("over: ") { "over: " } else { "" };
            format!("{over}nothing was heard for {detail}")
        }
        _ => text,
    };
    let text = match found.kind == "alarm" && text.starts_with("no drive of the line answers") {
        true if facts.stood_still_until(found.time_unix_ms) => {
            format!("{text}: nobody had asked them, for this program stood still")
        }
        _ => text,
    };
    let text = match facts.trip_behind(found) {
        Some(_) => format!("{text}; its output was off by the trip, and not by the stop"),
        None => text,
    };
    Sentence::of(Certainty::Seen, format!("{who}{asked}{text}{by}{words}")).at(found.time_unix_ms)
}

/// What nobody can tell by what is kept.
pub(super) fn not_known(facts: &Facts, moment: i64, is_about: bool) -> Vec<Sentence> {
    let mut said = Vec::new();
    let is_near = |time: i64| (moment - BEFORE_MS..=moment + AFTER_MS).contains(&time);
    for found in facts.records.iter().filter(|found| found.kind == "history") {
        if found.what == "began_after_kill"
            && let Some(last) = body(found).last_known_unix_ms
        {
            let text = "this is the last that was kept before this program was killed: when that was is not known, and of what it read and did until then up to a minute may be missing here; then it did not run until it began again";
            said.push(Sentence::of(Certainty::NotKnown, text).at(last));
        }
        if found.what == "hole" {
            said.push(Sentence::of(Certainty::NotKnown, found.text.clone()).at(found.time_unix_ms));
        }
    }
    for (start, end) in &facts.gaps {
        if is_near(*start) || is_near(*end) || (*start..=*end).contains(&moment) {
            let text =
                format!("for {} from then on no value of {} is known", lasting(end - start), facts.drive);
            said.push(Sentence::of(Certainty::NotKnown, text).at(*start));
        }
    }
    if facts.is_cut {
        let text = "so much happened in the plant that the later part of it was not looked at";
        said.push(Sentence::of(Certainty::NotKnown, text));
    }
    if facts.to <= facts.from {
        said.push(Sentence::of(Certainty::NotKnown, "the history does not reach to that moment"));
        return said;
    }
    if let Some(after) = facts.ends_soon_after(moment) {
        let text = format!(
            "what is kept ends {} behind it: what is read or counted more rarely, such as inputs, what the drive tripped by, and frames of others on its line, may not be there yet",
            lasting(after)
        );
        said.push(Sentence::of(Certainty::NotKnown, text));
    }
    let share = facts.known * 100.0;
    let around = lasting(facts.to - facts.from);
    let text = match is_about {
        true => format!("{share:.0} % of the {around} around it are known"),
        false => format!("nothing is recorded of it then; {share:.0} % of the {around} around are known"),
    };
    let certainty = if is_about || share >= 99.0 { Certainty::Seen } else { Certainty::NotKnown };
    said.push(Sentence::of(certainty, text));
    if is_about {
        let text = "a drive is looked at from poll to poll: what lies closer together than that may have been the other way round";
        said.push(Sentence::of(Certainty::NotKnown, text));
    }
    said
}
