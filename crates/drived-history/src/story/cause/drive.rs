//! What was done at a drive itself, and what the program did upon it.

use std::collections::BTreeSet;

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::{Cause, body},
        facts::{Facts, begins, lasting},
    },
    back::{Back, SILENT_TOGETHER_MS, Shows},
    evidence::{BESIDE_MS, inputs_stayed, loss_before, lost_before, names, nobody_asked, seen_beside},
    own::runs_on,
    silence::stood_still,
    word::{Went, how_it_went, of_reference},
};

/// What somebody or something did at the drive itself.
pub(super) fn at_the_drive(facts: &Facts, about: &RecordView, said: Sentence, open: &str) -> Vec<Sentence> {
    let has_gone = matches!(&*about.what, "command_overridden" | "run_not_adopted");
    let (mut all, mut by_word, mut said, mut open) = (Vec::new(), None, said, open);
    let gone = "the drive's own words show that its run command does not stand any more";
    match has_gone.then(|| how_it_went(facts, about)) {
        Some(Went::Unfed(supply)) => {
            all.push(supply);
            all.extend(silent_with(facts, about.time_unix_ms));
            said = Sentence::of(Said, gone);
            open = "whether its supply was away, and what took it away, cannot be seen from the line for certain";
        }
        Some(Went::ByWord(word)) => {
            by_word = Some(word);
            said = Sentence::of(Said, gone);
        }
        Some(Went::Open(open)) => by_word = open,
        None => {}
    }
    all.push(said);
    all.extend(of_reference(facts, about).filter(|_| has_gone));
    all.extend(lost_before(facts, about.time_unix_ms));
    all.extend(by_word);
    all.extend(falling(facts, about).filter(|_| has_gone));
    all.extend(acted_upon(facts, about));
    all.extend(withdrew(facts, about));
    all.extend(seen_beside(facts, about.time_unix_ms));
    if about.what == "output_blocked" {
        all.extend(of_low_speed(facts, about));
    }
    all.push(Sentence::of(NotKnown, open));
    all
}

/// Others of which nothing was heard in the same time: what they share may be what was away.
pub(super) fn silent_with(facts: &Facts, at: i64) -> Vec<Sentence> {
    let Some(start) = loss_before(facts, at).map(|(lost, _)| begins(lost)) else { return Vec::new() };
    let mut silent = facts.elsewhere("lost", start, BESIDE_MS);
    silent.retain(|other| {
        // Who was not asked was not silent.
        (begins(other) - start).abs() <= SILENT_TOGETHER_MS
            && stood_still(facts, begins(other), other.time_unix_ms).is_none()
    });
    let is_fed = |other: &&RecordView| {
        runs_on(facts, other) || matches!(Back::behind(facts, other).shows, Shows::Fed(_))
    };
    let were_fed = silent.iter().any(is_fed);
    if silent.is_empty() {
        return Vec::new();
    }
    let lines: BTreeSet<_> = silent.iter().map(|other| &other.line).collect();
    let place = match lines.iter().any(|line| **line != facts.line) {
        true => "on other lines too",
        false => "of its line",
    };
    let with_it = Sentence::of(Seen, format!("{} fell silent with it, {place}", names(&silent)));
    let fed = Sentence::of(Likely, "what feeds them all was away, such as the mains");
    let shared = (!were_fed).then_some(fed);
    [with_it].into_iter().chain(shared).collect()
}

/// What the program did upon it by itself: that may be what brought the motor to a standstill.
fn acted_upon(facts: &Facts, about: &RecordView) -> Option<Sentence> {
    let own = facts.records.iter().filter(|found| {
        found.drive == about.drive
            && found.number > about.number
            && (0..=BESIDE_MS / 6).contains(&(found.time_unix_ms - about.time_unix_ms))
    });
    let mut own = own.filter(
        |found| matches!(facts.cause_of(found), Some(Cause::Policy { policy }) if policy == about.what),
    );
    let ended = own.find(|found| found.what == "state_changed")?;
    let text = format!("upon this, this program ended the run by itself, by its policy: {}", ended.text);
    Some(Sentence::of(Seen, text).at(ended.time_unix_ms))
}

/// Likewise where its output was falling already.
pub(super) fn withdrew(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let own = facts.records.iter().filter(|found| {
        found.drive == about.drive
            && (0..=BESIDE_MS / 6).contains(&(found.time_unix_ms - about.time_unix_ms))
            && found.number >= about.number
    });
    let has_acted = |ended: &&RecordView| match body(ended).cause {
        Some(Cause::Policy { policy }) => !facts.found_nothing_to_do(ended, &policy),
        _ => true,
    };
    let mut own = own.filter(has_acted).filter_map(|ended| Some((ended, facts.was_ending(ended)?)));
    let Some((ended, upon)) = own.next() else { return Vec::new() };
    let text = "upon this, this program withdrew its run command by itself, and its output was falling by then: whether that or what had begun before it ended the run is not known";
    let upon = (upon.number != about.number).then(|| {
        let text = format!("before it the drive had shown: {}", facts.told(upon));
        Sentence::of(Said, text).at(upon.time_unix_ms)
    });
    upon.into_iter().chain([Sentence::of(NotKnown, text).at(ended.time_unix_ms)]).collect()
}

/// That its output was falling before its run command was seen to have gone.
fn falling(facts: &Facts, about: &RecordView) -> Option<Sentence> {
    let at = about.time_unix_ms;
    let fall = facts.fall_before(at)?;
    let (from, ago) = (fall.from(), lasting(at - fall.since));
    let text = match fall.step() {
        Some(to) => {
            format!("its output was read as {to} Hz {ago} before that was seen, and as {from} Hz before it")
        }
        None => format!("its output had been falling from {from} Hz for {ago} when that was seen"),
    };
    Some(Sentence::of(Seen, text).at(fall.since))
}

/// What speaks for a time at low speed, where the drive names it among what may have stopped it: a setpoint before it, and inputs that stayed as they
/// were. Not every input of every drive is read, so that these alone rule nothing out.
fn of_low_speed(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    let setpoint = facts.records.iter().rev().find(|found| {
        found.kind == "command"
            && found.what == "setpoint"
            && facts.is_of_drive(found)
            && (at - BESIDE_MS..=at).contains(&found.time_unix_ms)
    });
    let Some(setpoint) = setpoint.filter(|_| about.text.contains("low speed")) else { return Vec::new() };
    let text = format!("before it somebody here had asked: {}", setpoint.text);
    let mut said = vec![Sentence::of(Seen, text).at(setpoint.time_unix_ms)];
    if let Some(stayed) = inputs_stayed(facts, at) {
        said.push(stayed);
        said.push(Sentence::of(
            Likely,
            "its time at low speed was over, behind that setpoint: no input that is read changed, and a key is the other way",
        ));
    }
    said
}

pub(super) fn of_departure(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = vec![Sentence::of(Seen, about.text.clone()), nobody_asked(facts, about.time_unix_ms)];
    said.extend(seen_beside(facts, about.time_unix_ms));
    said.push(Sentence::of(
        NotKnown,
        "a limit of current or torque, the mains, its settings, or somebody else's reference: which, the line does not show",
    ));
    said
}
