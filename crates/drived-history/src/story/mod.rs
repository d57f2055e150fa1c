//! The story of a moment in words: what came first, what followed, who did what, and what is not known.
//!
//! Nothing is told as certain but what the drive says, what somebody asked for here, and what was seen. A cause that the facts only speak for is
//! told as likely, and one that cannot be told from another with that other.

mod cause;
mod facts;
#[cfg(test)]
mod tests;
mod values;

use drived_plant::plant::past::{Certainty, RecordView, SentenceView as Sentence, StoryView as Story};
use rusqlite::Connection;

use self::{
    facts::{Facts, body, lasting},
    values::{before, moved},
};
use crate::{read::parameters, store::StoreError};

/// A moment that is a whole minute means that minute.
const MINUTE_MS: i64 = 60_000;
/// So long after it happened a drive shows something at the latest, as a rule; the clock of whoever asks is not this one.
const SHOWN_MS: i64 = 3_000;
const CLOCK_MS: i64 = 1_000;
/// What is farther away than this is not what is asked for.
const FAR_MS: i64 = 10_000;
/// What is heavier than what is asked for is told beside it within this time.
const BESIDE_MS: i64 = 300_000;
/// From so long before the event,
const COURSE_BEFORE_MS: i64 = 120_000;
/// to so long after it is told what happened.
const COURSE_AFTER_MS: i64 = 300_000;
/// So many sentences at the most.
const COURSE: usize = 60;

/// What a story is about, the weightiest first. `run`: a motor began or ceased to run.
const WEIGHT: [&str; 24] = [
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
    "fault_cleared",
    "run",
    "output_departed",
    "limit",
    "stop",
    "start",
    "reset",
    "release",
    "setpoint",
    "state_changed",
    "warning",
    "control_returned",
];
/// What is heavier than anything that a person does.
const HEAVY: usize = 12;

/// Tells the story of a drive at a moment; at that minute, where it is a whole one.
///
/// # Errors
/// The file cannot be read.
pub fn tell(connection: &Connection, drive: &str, at: i64) -> Result<Story, StoreError> {
    let facts = Facts::gather(connection, drive, at)?;
    let asked = Asked::of(at);
    let about = about(&facts, asked);
    let moment = about.map_or(at, |found| found.time_unix_ms);
    let mut why = match about {
        Some(about) => cause::causes(&facts, about),
        None => cause::of_nothing(&facts, at),
    };
    let settings = settings(connection, drive, moment - COURSE_BEFORE_MS, moment + COURSE_AFTER_MS)?;
    if about.is_some_and(|about| about.what == "tripped") {
        let written = settings.iter().filter(|setting| setting.time_unix_ms < Some(moment));
        why.extend(written.cloned());
    }
    if about.is_none_or(|about| about.what == "limit") {
        why.extend(moved(connection, &facts, at)?);
    }
    let beside = beside(&facts, about, moment, &why);
    why.extend(beside);
    Ok(Story {
        drive: drive.to_owned(),
        about: about.map(|found| Sentence::of(Certainty::Seen, facts.in_words(found)).at(found.time_unix_ms)),
        why,
        before: before(connection, &facts, moment)?,
        course: with_settings(course(&facts, moment), settings),
        not_known: not_known(&facts, moment, about.is_some()),
    })
}

/// What is asked for: a moment, or the minute that begins with it.
#[derive(Debug, Clone, Copy)]
struct Asked {
    from: i64,
    to: i64,
}

impl Asked {
    const fn of(at: i64) -> Self {
        let lasts = if at.rem_euclid(MINUTE_MS) == 0 { MINUTE_MS - 1 } else { 0 };
        Self { from: at, to: at + lasts }
    }

    /// How far away something is.
    fn distance(self, at: i64) -> i64 {
        (self.from - at).max(at - self.to).max(0)
    }

    /// Whether it is what was meant, as exactly as a clock is read and a drive is polled.
    fn is_met_by(self, at: i64) -> bool {
        (self.from - CLOCK_MS..=self.to + SHOWN_MS).contains(&at)
    }
}

/// How much something weighs; `None`: no story is about it.
fn weight(found: &RecordView) -> Option<usize> {
    let of = |what: &str| WEIGHT.iter().position(|one| *one == what);
    let is_run = || {
        let body = body(found);
        let runs = |state: Option<&str>| state == Some("running");
        let begins = !runs(body.from.as_deref()) && runs(body.to.as_deref());
        let ends = runs(body.from.as_deref()) && !runs(body.to.as_deref());
        // A start that was asked for is told as that.
        ends || begins && !matches!(body.cause, Some(facts::Cause::Command { .. }))
    };
    match &*found.what {
        "state_changed" if is_run() => of("run"),
        what => of(what),
    }
}

/// What there is of the drive that a story can be about, with its weight and its beginning.
fn told_of(facts: &Facts) -> impl Iterator<Item = (usize, i64, &RecordView)> {
    let is_one =
        |found: &&RecordView| matches!(&*found.kind, "event" | "command") && facts.is_of_drive(found);
    facts
        .records
        .iter()
        .filter(is_one)
        .filter_map(|found| Some((weight(found)?, facts::begins(found), found)))
}

/// What somebody means who asks for this moment: the weightiest of what was then; else what is nearest, within seconds; else what was found
/// when the drive was seen again, where nobody saw it then. `None`: nothing happened.
fn about(facts: &Facts, asked: Asked) -> Option<&RecordView> {
    let then = told_of(facts)
        .filter(|(_, begins, _)| asked.is_met_by(*begins))
        .min_by_key(|(weight, begins, found)| (*weight, asked.distance(*begins), found.number));
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
                    && (*begins >= asked.from || found.what == "lost")
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

/// What is heavier than what is asked for, before and after it: and not as its cause. Where nothing happened, what
/// was next.
fn beside(facts: &Facts, about: Option<&RecordView>, moment: i64, told: &[Sentence]) -> Vec<Sentence> {
    let known = about.and_then(weight);
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
            let text = format!("{word}{side} it, {away} away: {}", facts.in_words(found));
            Some(Sentence::of(Certainty::Seen, text).at(found.time_unix_ms))
        })
        .collect()
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
            "alarm" => {
                of_line
                    && found.drive.is_none()
                    && matches!(&*found.what, "unacknowledged" | "returned" | "over")
            }
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

/// Settings of the drive that were read or written here between two moments as another value than before.
fn settings(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Vec<Sentence>, StoreError> {
    let settings = parameters(connection, drive)?;
    let mut said = Vec::new();
    for (place, setting) in settings.iter().enumerate() {
        let at = setting.first_unix_ms;
        if !(from..=to).contains(&at) {
            continue;
        }
        let before = place.checked_sub(1).map(|before| &settings[before]);
        let was = match before.filter(|before| before.address == setting.address) {
            Some(before) => format!("it was {}", before.text),
            None => "what it was before is not recorded".to_owned(),
        };
        let text =
            format!("its setting {} was read, or written, as {}; {was}", setting.mnemonic, setting.text);
        said.push(Sentence::of(Certainty::Seen, text).at(at));
    }
    Ok(said)
}

/// What happened, with what else was.
fn with_settings(mut course: Vec<Sentence>, settings: Vec<Sentence>) -> Vec<Sentence> {
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
