//! The story of a moment in words: what came first, what followed, who did what, and what is not known.
//!
//! Nothing is told as certain but what the drive says, what somebody asked for here, and what was seen. A cause that the facts only speak for is
//! told as likely, and one that cannot be told from another with that other.

mod cause;
mod facts;
#[cfg(test)]
mod tests;

use drived_plant::plant::past::{Certainty, RecordView, SentenceView as Sentence, StoryView as Story};
use rusqlite::Connection;

use self::facts::{Facts, body};
use crate::{quantity::Quantity, read::pieces, store::StoreError};

/// So near to a moment is what somebody means who tells its minute.
const NEAR_BEFORE_MS: i64 = 90_000;
const NEAR_AFTER_MS: i64 = 150_000;
/// From so long before the event,
const COURSE_BEFORE_MS: i64 = 120_000;
/// to so long after it is told what happened.
const COURSE_AFTER_MS: i64 = 300_000;
/// So many sentences at the most.
const COURSE: usize = 60;

/// What a story is about, the weightiest first.
const WEIGHT: [&str; 17] = [
    "tripped",
    "stop_unconfirmed",
    "other_family",
    "identity_changed",
    "run_command_stands",
    "output_blocked",
    "reference_taken",
    "command_overridden",
    "control_taken",
    "watchdog_not_in_force",
    "lost",
    "output_departed",
    "state_changed",
    "stop",
    "start",
    "setpoint",
    "connected",
];

/// Tells the story of a drive at a moment.
///
/// # Errors
/// The file cannot be read.
pub fn tell(connection: &Connection, drive: &str, at: i64) -> Result<Story, StoreError> {
    let facts = Facts::gather(connection, drive, at)?;
    let about = about(&facts, at);
    let moment = about.map_or(at, |found| found.time_unix_ms);
    let why = about.map(|about| cause::causes(&facts, about)).unwrap_or_default();
    Ok(Story {
        drive: drive.to_owned(),
        about: about.map(|found| Sentence::of(Certainty::Seen, facts.in_words(found)).at(found.time_unix_ms)),
        why,
        before: before(connection, &facts, moment)?,
        course: course(&facts, moment),
        not_known: not_known(&facts, moment, about.is_some()),
    })
}

/// What somebody means who asks for this moment: the weightiest near it, else what is nearest to it.
fn about(facts: &Facts, at: i64) -> Option<&RecordView> {
    let weight = |found: &RecordView| {
        let place = WEIGHT.iter().position(|what| *what == found.what)?;
        // A motor that begins to run, or goes on from one state at rest to another, is no incident.
        (found.what != "state_changed" || ends_a_run(found)).then_some(place)
    };
    let of_drive = || {
        let is_one =
            |found: &&RecordView| matches!(&*found.kind, "event" | "command") && facts.is_of_drive(found);
        facts.records.iter().filter(is_one).filter_map(|found| Some((weight(found)?, found)))
    };
    let is_near =
        |found: &RecordView| (at - NEAR_BEFORE_MS..=at + NEAR_AFTER_MS).contains(&found.time_unix_ms);
    let near =
        of_drive().filter(|(_, found)| is_near(found)).min_by_key(|(weight, found)| (*weight, found.number));
    let nearest = || of_drive().min_by_key(|(weight, found)| ((found.time_unix_ms - at).abs(), *weight));
    near.or_else(nearest).map(|(_, found)| found)
}

fn ends_a_run(found: &RecordView) -> bool {
    let body = body(found);
    body.from.as_deref() == Some("running") && body.to.as_deref() != Some("running")
}

/// How the drive was a moment before something happened.
fn before(connection: &Connection, facts: &Facts, moment: i64) -> Result<Vec<Sentence>, StoreError> {
    let mut said = Vec::new();
    let shown = [
        (Quantity::STATE, "", ""),
        (Quantity::OUTPUT_FREQUENCY, "output ", " Hz"),
        (Quantity::SETPOINT, "setpoint ", " Hz"),
        (Quantity::CURRENT, "current ", " A"),
        (Quantity::TORQUE, "torque ", " %"),
        (Quantity::DC_BUS_VOLTAGE, "DC bus ", " V"),
        (Quantity::MOTOR_THERMAL, "motor's thermal state ", " %"),
    ];
    // The status that shows what happened was read at that moment; the one before it is asked for.
    let at = moment - 1_000;
    let mut known = Vec::new();
    for (quantity, label, unit) in shown {
        let pieces = pieces(connection, &facts.drive, quantity, moment - 60_000, at)?;
        let points: Vec<_> = pieces.iter().flat_map(|piece| &piece.points).collect();
        let Some(last) = points.last() else { continue };
        let held = pieces.last().filter(|piece| at - piece.end <= 3_000).and(last.count);
        let Some(count) = held else { continue };
        let text = format!("{label}{}{unit}", quantity.text(count));
        let most = points
            .iter()
            .filter_map(|point| point.count)
            .max()
            .filter(|most| quantity.is_number() && *most > count + quantity.deadband());
        known.push(match most {
            Some(most) => format!("{text} ({} at the most in the minute before)", quantity.text(most)),
            None => text,
        });
    }
    match known.is_empty() {
        true => said.push(Sentence::of(Certainty::NotKnown, "how it was a moment before is not known")),
        false => said.push(Sentence::of(Certainty::Seen, known.join(", ")).at(at)),
    }
    Ok(said)
}

/// What happened around a moment, in the daemon's order.
fn course(facts: &Facts, moment: i64) -> Vec<Sentence> {
    let is_told = |found: &&RecordView| {
        let is_near = (moment - COURSE_BEFORE_MS..=moment + COURSE_AFTER_MS).contains(&found.time_unix_ms);
        let of_line = found.line.is_some() && found.line == facts.line;
        let weighs =
            matches!(&*found.what, "tripped" | "lost" | "connected" | "line_finding" | "stop_unconfirmed");
        let is_meant = match &*found.kind {
            "event" => facts.is_of_drive(found) || of_line && weighs,
            "command" => facts.is_of_drive(found),
            // What an alarm is of stands beside it as an event, but for those of a line.
            "alarm" => of_line && found.drive.is_none(),
            _ => true,
        };
        is_near && is_meant
    };
    let told: Vec<&RecordView> = facts.records.iter().filter(is_told).collect();
    // What several events show that came with one status is told with the first of them.
    let with_words = |place: usize, found: &RecordView| {
        let is_same =
            |before: &&&RecordView| before.time_unix_ms == found.time_unix_ms && before.drive == found.drive;
        facts.is_of_drive(found) && !told[..place].iter().rev().take(3).any(|before| is_same(&before))
    };
    let first = told.iter().take(COURSE).enumerate();
    let mut course: Vec<Sentence> =
        first.map(|(place, found)| sentence(facts, found, with_words(place, found))).collect();
    if told.len() > COURSE {
        let text = format!("{} more records follow: drived history tells them all", told.len() - COURSE);
        course.push(Sentence::of(Certainty::Seen, text));
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
    let by = match &body.cause {
        Some(facts::Cause::Command { commander, door }) => {
            let door = door.as_ref().map(|door| format!(" through {door}")).unwrap_or_default();
            format!(" (by {commander}{door})")
        }
        Some(facts::Cause::Policy { policy }) => {
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
    Sentence::of(Certainty::Seen, format!("{who}{asked}{}{by}{words}", found.text)).at(found.time_unix_ms)
}

/// What nobody can tell by what is kept.
fn not_known(facts: &Facts, moment: i64, is_about: bool) -> Vec<Sentence> {
    let mut said = Vec::new();
    let is_near = |time: i64| (moment - COURSE_BEFORE_MS..=moment + COURSE_AFTER_MS).contains(&time);
    for found in facts.records.iter().filter(|found| found.kind == "history") {
        if found.what == "began_after_kill"
            && let Some(last) = body(found).last_known_unix_ms
        {
            let text = "this program did not run between its last record and its new beginning: what happened meanwhile was seen by nobody";
            said.push(Sentence::of(Certainty::NotKnown, text).at(last));
        }
        if found.what == "hole" {
            said.push(Sentence::of(Certainty::NotKnown, found.text.clone()).at(found.time_unix_ms));
        }
    }
    for (start, end) in &facts.gaps {
        if is_near(*start) || is_near(*end) || (*start..=*end).contains(&moment) {
            let text =
                format!("for {:.1} s nothing was read from {}", (end - start) as f64 / 1_000.0, facts.drive);
            said.push(Sentence::of(Certainty::NotKnown, text).at(*start));
        }
    }
    if facts.is_cut {
        let text = "so much happened in the plant that the later part of it was not looked at";
        said.push(Sentence::of(Certainty::NotKnown, text));
    }
    let share = facts.known * 100.0;
    let minutes = (facts.to - facts.from) / 60_000;
    let text = match is_about {
        true => format!("{share:.0} % of the {minutes} minutes around it are known"),
        false => {
            format!("nothing is recorded of it then; {share:.0} % of the {minutes} minutes around are known")
        }
    };
    let certainty = if is_about || share >= 99.0 { Certainty::Seen } else { Certainty::NotKnown };
    said.push(Sentence::of(certainty, text));
    if is_about {
        let text = "a drive is looked at from poll to poll: what lies closer together than that may have been the other way round";
        said.push(Sentence::of(Certainty::NotKnown, text));
    }
    said
}
