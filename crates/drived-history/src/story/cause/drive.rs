//! Who or what did something at a drive: somebody here, the program by its policy, or the drive and whoever else commands it.

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
    back::SILENT_TOGETHER_MS,
    evidence::{
        BESIDE_MS, OBEYED_MS, SILENT_MS, asked_before, found_within, inputs_stayed, loss_before, lost_before,
        names, nobody_asked, seen_beside,
    },
    word::{ONE_READING_MS, Went, how_it_went, of_reference},
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
            open = "what took its supply away cannot be seen from the line";
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

/// That its STOP key has stopped its motor, as its status said with what it shows or shortly before.
fn stop_key(facts: &Facts, at: i64) -> Option<&RecordView> {
    facts.records.iter().find(|found| {
        found.what == "stop_key"
            && found.drive.as_deref() == Some(&*facts.drive)
            && (at - OBEYED_MS..=at + ONE_READING_MS).contains(&found.time_unix_ms)
    })
}

/// Others of which nothing was heard in the same time: what they share may be what was away.
pub(super) fn silent_with(facts: &Facts, at: i64) -> Vec<Sentence> {
    let Some(start) = loss_before(facts, at).map(|(lost, _)| begins(lost)) else { return Vec::new() };
    let silent = facts.elsewhere("lost", start, BESIDE_MS);
    let silent: Vec<&RecordView> =
        silent.into_iter().filter(|other| (begins(other) - start).abs() <= SILENT_TOGETHER_MS).collect();
    if silent.is_empty() {
        return Vec::new();
    }
    let lines: BTreeSet<_> = silent.iter().map(|other| &other.line).collect();
    let place = match lines.iter().any(|line| **line != facts.line) {
        true => "on other lines too",
        false => "of its line",
    };
    vec![
        Sentence::of(Seen, format!("{} fell silent with it, {place}", names(&silent))),
        Sentence::of(Likely, "what feeds them all was away, such as the mains"),
    ]
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
fn withdrew(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let own = facts.records.iter().filter(|found| {
        found.drive == about.drive
            && (0..=BESIDE_MS / 6).contains(&(found.time_unix_ms - about.time_unix_ms))
            && found.number >= about.number
    });
    let mut own = own.filter_map(|ended| Some((ended, facts.was_ending(ended)?)));
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

/// What the drive showed before it came to stand, where that had been done at the drive.
fn shown_before<'a>(facts: &'a Facts, about: &RecordView) -> Option<&'a RecordView> {
    let at = about.time_unix_ms;
    let own = facts.records.iter().rev().filter(|found| {
        found.kind == "event"
            && found.drive == about.drive
            && found.number < about.number
            && found.time_unix_ms >= at - BESIDE_MS
    });
    let mut own = own.take_while(|found| {
        !(matches!(&*found.what, "connected" | "lost" | "tripped")
            || found.what == "state_changed" && body(found).to.as_deref() == Some("running"))
    });
    own.find(|found| matches!(&*found.what, "output_blocked" | "command_overridden"))
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

/// What followed it as the doing of somebody here.
fn followed(facts: &Facts, about: &RecordView) -> Option<Sentence> {
    let at = about.time_unix_ms;
    let mut later = facts.records.iter().filter(|found| {
        found.number > about.number
            && found.drive == about.drive
            && found.what == "state_changed"
            && (at..=at + OBEYED_MS).contains(&found.time_unix_ms)
    });
    later.find_map(|found| {
        let Some(Cause::Command { commander, .. }) = facts.cause_of(found) else { return None };
        let text = format!("what followed was done for {commander}: {}", found.text);
        Some(Sentence::of(Seen, text).at(found.time_unix_ms))
    })
}

pub(super) fn of_change(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    match facts.cause_of(about) {
        Some(Cause::Command { commander, door }) => {
            let door = door.map(|door| format!(" through {door}")).unwrap_or_default();
            let mut said = vec![Sentence::of(Seen, format!("{commander} asked for it{door}"))];
            said.extend(
                asked_before(facts, about, &["start", "stop", "release", "reset"])
                    .map(|asked| Sentence::of(Seen, asked.text.clone()).at(asked.time_unix_ms)),
            );
            said
        }
        Some(Cause::Policy { policy }) => {
            let text = format!("this program did it by itself, by its policy: {}", policy.replace('_', " "));
            let mut said = vec![Sentence::of(Seen, text)];
            // What the policy acted upon is what began it.
            let upon = if policy == "on_loss" { "lost" } else { &*policy };
            let began = facts.records.iter().rev().find(|found| {
                found.what == upon
                    && found.drive == about.drive
                    && (about.time_unix_ms - BESIDE_MS..=about.time_unix_ms).contains(&found.time_unix_ms)
            });
            said.extend(began.map(|began| {
                Sentence::of(Seen, format!("it acted upon this: {}", facts.in_words(began)))
                    .at(began.time_unix_ms)
            }));
            said
        }
        Some(Cause::Found) => {
            let at = about.time_unix_ms;
            let mut said = vec![found_within(facts, at, "it was found so when the drive was seen again")];
            said.extend(lost_before(facts, at));
            // What was asked for before it was seen again may have done it.
            if let Some(asked) = asked_before(facts, about, &["start", "stop", "release", "reset"]) {
                let text = format!("a command of here came shortly before: {}", asked.text);
                said.insert(0, Sentence::of(Likely, text).at(asked.time_unix_ms));
            }
            said
        }
        Some(Cause::Drive) | None => {
            let (mut said, at) = (Vec::new(), about.time_unix_ms);
            let changed = body(about);
            let begins_to_run = changed.to.as_deref() == Some("running");
            if let Some(key) = stop_key(facts, at).filter(|_| !begins_to_run) {
                said.push(
                    Sentence::of(Said, format!("the drive says so: {}", key.text)).at(key.time_unix_ms),
                );
                said.push(Sentence::of(NotKnown, "who pressed it cannot be seen from the line"));
                return said;
            }
            let shown = shown_before(facts, about).filter(|_| !begins_to_run);
            if let Some(shown) = shown {
                let shown_text = facts.told(shown);
                let text = match &*shown.what {
                    "output_blocked" => {
                        format!("it was stopped at the drive, whose own words showed it before: {shown_text}")
                    }
                    _ => format!("the drive's own words had shown before it: {shown_text}"),
                };
                said.push(Sentence::of(Said, text).at(shown.time_unix_ms));
            }
            let actions: &[&str] = match &*about.what {
                "fault_cleared" => &["reset"],
                _ if begins_to_run => &["start"],
                _ => &["stop", "release"],
            };
            let asked = asked_before(facts, about, actions);
            match asked {
                Some(asked) => {
                    let text = format!("a command of here came shortly before: {}", asked.text);
                    said.push(Sentence::of(Likely, text).at(asked.time_unix_ms));
                    said.extend(followed(facts, about));
                }
                None => said.push(nobody_asked(facts, about.time_unix_ms)),
            }
            said.extend(withdrew(facts, about));
            // A drive says with the same status who commands it.
            let fallen_back = facts.fell_back_with(at);
            let control = facts.control_at(at + 1).filter(|_| fallen_back.is_none());
            said.extend(
                fallen_back.map(|found| {
                    Sentence::of(Said, format!("the drive says with it: {}", facts.told(found)))
                }),
            );
            match control {
                Some("bus") if begins_to_run => said.push(Sentence::of(
                    Likely,
                    "it says that a bus commands it: another master has started it",
                )),
                Some(control) if control != "bus" => {
                    said.push(Sentence::of(Said, format!("it says that it is commanded by: {control}")));
                }
                _ => {}
            }
            said.extend(seen_beside(facts, at));
            let by_hand = control.filter(|control| *control != "bus");
            let who = match &*about.what {
                _ if by_hand.is_some() => {
                    "who it was, or which of its inputs and keys, cannot be seen from the line"
                }
                _ if shown.is_some() => "who or what did it cannot be seen from the line",
                "fault_cleared" => {
                    "its panel, its terminals, another master, the drive itself, or its supply that was off and on: which of them cleared it is not known"
                }
                _ if begins_to_run => {
                    "another master, its panel, its terminals or the drive itself started it: which of them is not known for certain"
                }
                _ => {
                    "its terminals, its panel, another master or the drive itself: which of them it was is not known, but for what its words show below"
                }
            };
            if asked.is_none() {
                said.push(Sentence::of(NotKnown, who));
            }
            said
        }
    }
}

/// What was asked for here; of a stop, what it was that ended it.
pub(super) fn of_command(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = vec![Sentence::of(Seen, format!("it was asked for here: {}", about.text))];
    if about.what == "stop" {
        let within = about.time_unix_ms..=about.time_unix_ms + BESIDE_MS;
        let mut own = facts.records.iter().filter(|found| {
            found.kind == "event" && facts.is_of_drive(found) && within.contains(&found.time_unix_ms)
        });
        let ended = own.find(|found| found.what == "stop_confirmed");
        if let Some(trip) = ended.and_then(|ended| facts.trip_behind(ended)) {
            let text = format!("its output was off by a trip, and not by the stop: {}", facts.in_words(trip));
            said.push(Sentence::of(Seen, text).at(trip.time_unix_ms));
        }
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

pub(super) fn of_unconfirmed_stop(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = Vec::new();
    if let Some(asked) = asked_before(facts, about, &["stop"]) {
        said.push(
            Sentence::of(Seen, format!("the stop was asked for here: {}", asked.text)).at(asked.time_unix_ms),
        );
    }
    said.push(Sentence::of(Seen, format!("the drive did not show that it had stopped: {}", about.text)));
    let is_lost = facts.records.iter().any(|found| {
        found.what == "lost"
            && facts.is_of_drive(found)
            && (found.time_unix_ms - about.time_unix_ms).abs() <= SILENT_MS
    });
    said.push(match is_lost {
        true => Sentence::of(
            NotKnown,
            "it did not answer at that time: whether its motor turned nobody here knows",
        ),
        false => {
            Sentence::of(NotKnown, "it answered, and why it did not stop its words do not say for certain")
        }
    });
    said
}
