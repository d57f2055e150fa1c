//! Who or what changed the state of a drive: somebody here, the program by its policy, what was found, or the drive and whoever else commands it.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::{Cause, body},
        facts::{Facts, lasting},
    },
    drive::withdrew,
    evidence::{
        BESIDE_MS, OBEYED_MS, asked_before, found_within, lost_before, nobody_asked, seen_beside,
        without_outcome,
    },
    word::ONE_READING_MS,
};

/// No motor that runs is brought down by its ramp within this time.
const NO_RAMP_MS: i64 = 300;

/// What a drive shows otherwise than before: whose doing it was.
pub(super) fn of_change(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    match facts.cause_of(about) {
        Some(Cause::Command { commander, door }) => asked_for(facts, about, &commander, door),
        Some(Cause::Policy { policy }) => by_policy(facts, about, &policy),
        Some(Cause::Found) => found_so(facts, about),
        Some(Cause::Drive) | None => by_the_drive(facts, about),
    }
}

/// Somebody here asked for it.
fn asked_for(facts: &Facts, about: &RecordView, commander: &str, door: Option<String>) -> Vec<Sentence> {
    let door = door.map(|door| format!(" through {door}")).unwrap_or_default();
    let mut said = vec![Sentence::of(Seen, format!("{commander} asked for it{door}"))];
    if let Some(asked) = asked_before(facts, about, &["start", "stop", "release", "reset"]) {
        said.push(Sentence::of(Seen, asked.text.clone()).at(asked.time_unix_ms));
        said.extend(is_too_quick(about, asked).then(|| {
            let text = format!(
                "its output was off when it was read {} behind that, which no ramp does: what cut it, such as an input or a key, may have come first",
                lasting(about.time_unix_ms - asked.time_unix_ms)
            );
            Sentence::of(NotKnown, text)
        }));
    }
    said
}

/// Whether a motor that ran stands without an output sooner than its ramp could have brought it down.
fn is_too_quick(about: &RecordView, asked: &RecordView) -> bool {
    let changed = body(about);
    let is_off = !matches!(changed.to.as_deref(), Some("stopping" | "quick_stop" | "running") | None);
    asked.text.starts_with("ramp stop")
        && changed.from.as_deref() == Some("running")
        && is_off
        && about.time_unix_ms - asked.time_unix_ms < NO_RAMP_MS
}

/// The program did it by itself.
fn by_policy(facts: &Facts, about: &RecordView, policy: &str) -> Vec<Sentence> {
    let text = format!("this program did it by itself, by its policy: {}", policy.replace('_', " "));
    let mut said = vec![Sentence::of(Seen, text)];
    // What the policy acted upon is what began it.
    let upon = if policy == "on_loss" { "lost" } else { policy };
    let began = facts.records.iter().rev().find(|found| {
        found.what == upon
            && found.drive == about.drive
            && (about.time_unix_ms - BESIDE_MS..=about.time_unix_ms).contains(&found.time_unix_ms)
    });
    said.extend(began.map(|began| {
        Sentence::of(Seen, format!("it acted upon this: {}", facts.in_words(began))).at(began.time_unix_ms)
    }));
    said
}

/// It was so when the drive was seen again.
fn found_so(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
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

/// The drive itself did it, or whoever else commands it.
fn by_the_drive(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let (mut said, at) = (Vec::new(), about.time_unix_ms);
    let changed = body(about);
    let begins_to_run = changed.to.as_deref() == Some("running");
    if let Some(key) = stop_key(facts, at).filter(|_| !begins_to_run) {
        said.push(Sentence::of(Said, format!("the drive says so: {}", key.text)).at(key.time_unix_ms));
        said.push(Sentence::of(NotKnown, "who pressed it cannot be seen from the line"));
        said.extend(asked_before(facts, about, &["stop", "release"]).map(|asked| {
            let text = format!(
                "a stop was asked for here too: {}; what that had done when the key was pressed is not known",
                without_outcome(&asked.text)
            );
            Sentence::of(NotKnown, text).at(asked.time_unix_ms)
        }));
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
        fallen_back.map(|found| Sentence::of(Said, format!("the drive says with it: {}", facts.told(found)))),
    );
    match control {
        Some("bus") if begins_to_run => {
            said.push(Sentence::of(Likely, "it says that a bus commands it: another master has started it"));
        }
        Some(control) if control != "bus" => {
            said.push(Sentence::of(Said, format!("it says that it is commanded by: {control}")));
        }
        _ => {}
    }
    said.extend(seen_beside(facts, at));
    let by_hand = control.filter(|control| *control != "bus");
    let who = match &*about.what {
        _ if by_hand.is_some() => "who it was, or which of its inputs and keys, cannot be seen from the line",
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

/// That its STOP key has stopped its motor, as its status said with what it shows or shortly before.
fn stop_key(facts: &Facts, at: i64) -> Option<&RecordView> {
    facts.records.iter().find(|found| {
        found.what == "stop_key"
            && found.drive.as_deref() == Some(&*facts.drive)
            && (at - OBEYED_MS..=at + ONE_READING_MS).contains(&found.time_unix_ms)
    })
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
