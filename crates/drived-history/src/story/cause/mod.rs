//! Why something happened, as far as the facts say so. What is told, and what has to be known for it:
//!
//! | Told | Certainty | By what evidence |
//! |---|---|---|
//! | what it tripped by, who commands it, what blocks it | said | the drive's own words |
//! | somebody here asked for it | seen | the act that the event names |
//! | this program did it by a policy | seen | the policy that the event names, of what that policy can do |
//! | nobody here asked for it | seen | no command within ten seconds, and nothing is missing of them |
//! | a command of here | likely | it was sent within ten seconds before, and is of a kind that can do it |
//! | another master | likely | the drive says that a bus commands it, or its line heard frames of somebody else |
//! | an input | likely | the inputs were read otherwise before and after |
//! | the time at low speed | likely | the drive names it among others, a setpoint came before, and no input changed |
//! | its supply | likely | it was silent, and its run command was gone when it was seen again |
//! | its supply, and not what a block is by | likely | it was silent, others fell silent with it and did not run on, and its output was off when it was heard again |
//! | that this program stopped it | likely | the run command was one that it had given before it was killed, and it was ending |
//! | its supply | likely | a poll was not answered, and its run command was gone when it was seen again |
//! | its cable, and not its supply | likely | it was silent, and when it was heard again it ran on by a bus, or its watchdog had acted |
//! | its supply, and no other word | likely | its reference went to 0 with its run command |
//! | another word, and no power cycle | likely | its run command went, and its reference stayed |
//! | what feeds several | likely | its supply was away, and others fell silent with it |
//! | its fault was reset, or it was switched off and on | likely | it had tripped, fell silent, and its fault was gone when it was heard again |
//! | what spoils answers on the line | likely | it was lost by answers that were damaged |
//! | another drive in its place | said | it names another one when it is heard again |
//! | that it was not cut off | said | it was lost, and had answered by an exception |
//! | that control fell back | said | who commands it now had commanded it before who had it last |
//! | that its output had been falling | seen | its values, before its run command was seen to have gone |
//! | its STOP key | said | its status has a bit for it, and that was set with the stop |
//! | that this program did not ask | seen | it stood still for most of the silence |
//! | what a line's drives share | likely | they fell silent together, and nobody of them answered meanwhile |
//! | what lines share | likely | drives of other lines fell silent with it |
//! | one cause of several trips | likely | within two seconds, and by the same, or all by the supply |
//! | that nobody here spoke to it | likely | its watchdog acted, and the program was away then |
//! | the port of the line | seen | it could not be opened |
//!
//! Where a row's evidence is not there, its cause is not told, or told as what is not known.

mod asked;
mod back;
mod change;
mod drive;
mod evidence;
mod own;
mod silence;
mod trip;
mod word;

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use self::{
    asked::{of_command, of_unconfirmed_stop},
    change::of_change,
    drive::{at_the_drive, of_departure, silent_with},
    evidence::{BESIDE_MS, SILENT_MS, TOGETHER_MS, lost_for},
    own::{is_block_of_supply, of_blocked_by_supply, of_run_before_kill},
    silence::of_loss,
    trip::of_trip,
    word::{Went, how_it_went},
};
use super::facts::{Facts, lasting};

/// Why this happened, the surest first. It is never empty.
pub(super) fn causes(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = match &*about.what {
        "tripped" => of_trip(facts, about),
        "lost" => of_loss(facts, about),
        "state_changed" | "fault_cleared" => of_change(facts, about),
        "control_taken" if facts.is_fallen_back(about) => at_the_drive(
            facts,
            about,
            Sentence::of(Said, format!("the drive says so: {}", facts.told(about))),
            "whether who had it before has given up, or somebody wrote that it should, or a reset emptied what it was by, cannot be seen from the line",
        ),
        "control_taken" => at_the_drive(
            facts,
            about,
            Sentence::of(Said, format!("the drive says so: {}", about.text)),
            "who it was cannot be seen from the line",
        ),
        // That the motor follows another reference than the one that was given the drive shows, and not which one does it.
        "reference_taken" if about.text.contains("another reference") => at_the_drive(
            facts,
            about,
            Sentence::of(Likely, format!("the drive's own words speak for it: {}", about.text)),
            "a reference or a limit that was changed at the drive, or by another master: which, and who did it, cannot be seen from the line for certain",
        ),
        "output_blocked" if is_block_of_supply(facts, about) => {
            of_blocked_by_supply(facts, about, silent_with(facts, about.time_unix_ms))
        }
        "run_not_adopted" if facts.begun_before_kill(about).is_some() => {
            of_run_before_kill(facts, about).unwrap_or_default()
        }
        "output_blocked" | "reference_taken" | "command_overridden" | "run_not_adopted" => at_the_drive(
            facts,
            about,
            Sentence::of(Said, format!("the drive's own words show it: {}", facts.told(about))),
            match facts.control_at(about.time_unix_ms + 1) {
                Some(control) if control != "bus" => {
                    "whether another master, an input or a key did it cannot be seen from the line"
                }
                _ => "who or what did it cannot be seen from the line",
            },
        ),
        "other_family" | "identity_changed" => {
            let mut said = vec![Sentence::of(Seen, about.text.clone())];
            said.extend(lost_for(facts, about));
            said
        }
        "stop_unconfirmed" => of_unconfirmed_stop(facts, about),
        "output_departed" => of_departure(facts, about),
        _ if about.kind == "command" => of_command(facts, about),
        _ => vec![Sentence::of(Seen, about.text.clone())],
    };
    let of_program = program(facts, about.time_unix_ms);
    let is_told = |one: &Sentence| said.iter().any(|told| told.text == one.text);
    let of_program: Vec<Sentence> = of_program.into_iter().filter(|one| !is_told(one)).collect();
    said.extend(of_program);
    said
}

/// What happened, in one line; of a run command that went, by what it went as far as that is likely.
pub(super) fn headline(facts: &Facts, about: &RecordView) -> Sentence {
    let is_open = about.what == "command_overridden" && about.text.contains("power cycle");
    if is_block_of_supply(facts, about) {
        let text = "its run ended, likely with its supply";
        return Sentence::of(Likely, text).at(about.time_unix_ms);
    }
    let (certainty, text) = match is_open.then(|| how_it_went(facts, about)) {
        Some(Went::Unfed(_)) => (Likely, "its run command went, likely with its supply".to_owned()),
        Some(Went::ByWord(_)) => {
            (Likely, "its run command went by another word that was written to it".to_owned())
        }
        Some(Went::Open(_)) | None => (Seen, facts.in_words(about)),
    };
    Sentence::of(certainty, text).at(about.time_unix_ms)
}

/// That nothing happened, or that nobody knows.
pub(super) fn of_nothing(facts: &Facts, at: i64, has_moved: bool) -> Vec<Sentence> {
    if let Some(step) = &facts.skipped {
        let text = format!(
            "there was no such time: {}. What happened is told under the new time, from then on",
            step.text
        );
        return vec![Sentence::of(Seen, text).at(step.time_unix_ms)];
    }
    let mut said = match facts.gap_at(at) {
        Some((start, end)) => vec![
            Sentence::of(
                NotKnown,
                format!("whether something happened then is not known: for {} from this moment on no value of it is known", lasting(end - start)),
            )
            .at(start),
        ],
        None if at < facts.from || at > facts.to => {
            vec![Sentence::of(NotKnown, "the history does not reach to that moment")]
        }
        None if has_moved => {
            vec![Sentence::of(Seen, "no event of it is recorded then, and its values moved").at(at)]
        }
        None => vec![Sentence::of(Seen, "nothing happened to it then that is recorded").at(at)],
    };
    let errors = facts.records.iter().find(|found| {
        found.what == "line_errors"
            && found.line == facts.line
            && (found.time_unix_ms - at).abs() <= BESIDE_MS
    });
    said.extend(
        errors
            .map(|errors| Sentence::of(Seen, format!("on its line {}", errors.text)).at(errors.time_unix_ms)),
    );
    // What ended a time in which nothing is known may be told with it.
    said.extend(program(facts, facts.gap_at(at).map_or(at, |(_, end)| end)));
    said
}

/// What the program itself has to do with it: it was not there, or its clock was set.
fn program(facts: &Facts, at: i64) -> Vec<Sentence> {
    let is_near = |found: &&RecordView| {
        found.kind == "history" && (at - SILENT_MS..=at + TOGETHER_MS).contains(&found.time_unix_ms)
    };
    let stepped = facts.stepped.as_ref().filter(|step| !is_near(step));
    facts
        .records
        .iter()
        .filter(is_near)
        .chain(stepped)
        .filter(|found| {
            matches!(
                &*found.what,
                "began" | "began_after_kill" | "ended" | "hole" | "clock_stepped" | "stood_still"
            )
        })
        .map(|found| Sentence::of(Seen, found.text.clone()).at(found.time_unix_ms))
        .collect()
}
