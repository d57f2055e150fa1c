//! Why a drive tripped.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::body,
        facts::{Facts, lasting},
    },
    evidence::{
        SILENT_MS, TOGETHER_MS, asked_before, found_within, in_order, inputs_changed, is_of_supply,
        lost_before, names,
    },
    silence::of_silence,
};

/// How the drives' own words tell of a code that their manual does not name.
const UNLISTED: &str = "a code that the manual does not list";
/// Trips of one cause are seen within this time of each other.
const ONE_CAUSE_MS: i64 = 2_000;
/// So many others that trip at once do not do so by chance.
const MANY: usize = 3;

pub(super) fn of_trip(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    // What the drive said of it was read a moment later.
    let explained = facts.explained(about);
    let faults = [Some(about), explained].into_iter().flatten().filter_map(|found| body(found).fault);
    let (mut by_watchdog, mut is_found, mut unheard) = (false, false, false);
    for fault in faults {
        by_watchdog |= fault.by_watchdog;
        is_found |= fault.found;
        unheard |= fault.watchdog_after_ms.is_some();
    }
    let words = facts.in_words(about);
    let mut said = vec![match reason(&words) {
        Some(_) if words.contains(UNLISTED) => Sentence::of(
            Said,
            format!("the drive says by what code it tripped, and not what that means: {words}"),
        ),
        Some(_) => Sentence::of(Said, format!("the drive itself says what it tripped by: {words}")),
        None => Sentence::of(NotKnown, "that it tripped the drive shows; by what was not read from it"),
    }];
    if let Some(kept) = facts.own_record(about) {
        said.push(Sentence::of(Said, kept.text.clone()));
    }
    if is_found {
        said.push(found_within(facts, at, "it was found tripped when it was seen again"));
    }
    if by_watchdog {
        said.extend(of_silence(facts, at));
    } else {
        if unheard {
            let text = "it had heard no message for longer than its watchdog waits: whether that tripped it, its code does not say";
            said.push(Sentence::of(NotKnown, text));
        }
        if is_found {
            said.extend(lost_before(facts, at));
        }
        said.extend(inputs_changed(facts, at));
    }
    said.extend(beside(facts, about, is_found, by_watchdog));
    if let Some(asked) = asked_before(facts, about, &["start", "setpoint", "stop"]) {
        said.push(in_order(facts, about, asked));
    }
    said.extend(of_stop(facts, about));
    let departed = facts.records.iter().rev().find(|found| {
        found.what == "output_departed"
            && facts.is_of_drive(found)
            && (at - SILENT_MS..=at).contains(&found.time_unix_ms)
    });
    if let Some(departed) = departed {
        said.push(Sentence::of(Seen, format!("before it, its {}", departed.text)).at(departed.time_unix_ms));
    }
    if !by_watchdog {
        let text = "what brought it there (load, mains, wiring, setting) the line does not show";
        said.push(Sentence::of(NotKnown, text));
    }
    said
}

/// That a stop which is told as confirmed was ended by the trip.
fn of_stop(facts: &Facts, trip: &RecordView) -> Option<Sentence> {
    let own = facts.records.iter().filter(|found| found.number > trip.number && found.drive == trip.drive);
    let mut own = own.take_while(|found| found.what != "fault_cleared");
    let stop = own.find(|found| found.what == "stop_confirmed" && facts.trip_behind(found).is_some())?;
    let text = "a stop is told as confirmed behind it: the output was off by the trip, and not by the stop";
    Some(Sentence::of(Seen, text).at(stop.time_unix_ms))
}

/// What a trip was by, of its words: none where that was not read.
fn reason(text: &str) -> Option<&str> {
    text.split_once(": ").map(|(_, reason)| reason)
}

/// What happened to other drives at about the same time, and whether one cause may be behind it.
fn beside(facts: &Facts, about: &RecordView, is_found: bool, by_watchdog: bool) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    let mut tripped = facts.elsewhere("tripped", at, TOGETHER_MS);
    // Of what nobody saw happening nobody knows that it was together.
    let was_found = |found: &&RecordView| body(found).fault.is_some_and(|fault| fault.found);
    // What was seen to trip before this one was heard last, or behind it, did so apart from it.
    let window = facts.gap_before(at).filter(|_| is_found);
    let is_apart = |other: &&RecordView| {
        window.is_some_and(|(start, end)| {
            !was_found(other) && !(start - ONE_CAUSE_MS..=end).contains(&other.time_unix_ms)
        })
    };
    tripped.retain(|other| !is_apart(other));
    let found_too: Vec<&RecordView> =
        tripped.extract_if(.., |other| is_found || was_found(&&**other)).collect();
    let mut said = Vec::new();
    if is_found && !found_too.is_empty() {
        let text = format!("found tripped too: {}; whether at the same time is not known", names(&found_too));
        said.push(Sentence::of(NotKnown, text));
    }
    // Those whose watchdog acted share the line, and what became of that is told before.
    if is_found || by_watchdog {
        return said;
    }
    let own = facts.in_words(about);
    let own = reason(&own);
    let is_at_once = |other: &RecordView| (other.time_unix_ms - at).abs() <= ONE_CAUSE_MS;
    let are_many = tripped.iter().filter(|other| is_at_once(other)).count() >= MANY;
    let (one_cause, apart): (Vec<&RecordView>, Vec<&RecordView>) = tripped.into_iter().partition(|other| {
        let text = facts.in_words(other);
        let is_like = own
            .zip(reason(&text))
            .is_some_and(|(own, other)| own == other || is_of_supply(own) && is_of_supply(other));
        is_at_once(other) && (is_like || are_many)
    });
    if !one_cause.is_empty() {
        let text = format!(
            "{} tripped within {} s of it{}: one cause outside of this drive, such as the mains, is likely",
            names(&one_cause),
            ONE_CAUSE_MS / 1_000,
            if are_many { "" } else { ", by the like" },
        );
        said.push(Sentence::of(Likely, text));
    }
    for other in apart.iter().take(MANY) {
        let away = other.time_unix_ms - at;
        let side = if away < 0 { "before" } else { "after" };
        let text = format!(
            "{}: {}, seen {} {side} it: nothing shows that one cause is behind both",
            names(&[other]),
            facts.in_words(other),
            lasting(away.abs()),
        );
        said.push(Sentence::of(NotKnown, text).at(other.time_unix_ms));
    }
    let silent = facts.elsewhere("lost", at, TOGETHER_MS);
    match (silent.is_empty(), own.is_some_and(is_of_supply)) {
        (true, _) => {}
        (false, true) => said.push(Sentence::of(
            Likely,
            format!(
                "{} fell silent within {} s of it: what both show speaks for their supply",
                names(&silent),
                TOGETHER_MS / 1_000
            ),
        )),
        (false, false) => said.push(Sentence::of(
            NotKnown,
            format!(
                "{} fell silent within {} s of it: whether one cause is behind both is not known",
                names(&silent),
                TOGETHER_MS / 1_000
            ),
        )),
    }
    said
}
