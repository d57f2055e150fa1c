//! What looks as if it had been done at a drive, and was its supply's doing or this program's own.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::{Cause, body},
        facts::{Facts, begins, is_silent},
    },
    back::SILENT_TOGETHER_MS,
    evidence::{BESIDE_MS, loss_before, lost_before},
};

/// A program that ends stops what it runs within this time.
const ENDING_MS: i64 = 5_000;

/// Whether a block that a drive shows when it is heard again goes with its supply: others fell silent with it, and did not all run on.
pub(super) fn is_block_of_supply(facts: &Facts, about: &RecordView) -> bool {
    let at = about.time_unix_ms;
    let Some((lost, _)) = loss_before(facts, at).filter(|(lost, _)| is_silent(lost)) else { return false };
    let others = facts.elsewhere("lost", begins(lost), BESIDE_MS);
    let mut others =
        others.into_iter().filter(|other| (begins(other) - begins(lost)).abs() <= SILENT_TOGETHER_MS);
    about.what == "output_blocked" && !runs_on(facts, lost) && others.any(|other| !runs_on(facts, other))
}

/// Whether a drive that was lost was running when it was heard again: its supply had not been away.
pub(super) fn runs_on(facts: &Facts, lost: &RecordView) -> bool {
    let mut own =
        facts.records.iter().filter(|found| found.number > lost.number && found.drive == lost.drive);
    own.find(|found| found.what == "connected")
        .is_some_and(|back| body(back).status.unwrap_or_default().state.as_deref() == Some("running"))
}

/// Why a drive shows a block when it is heard again behind a loss of supply: that first, and its words at the most as likely.
pub(super) fn of_blocked_by_supply(
    facts: &Facts,
    about: &RecordView,
    silent_with: Vec<Sentence>,
) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    let text =
        "its supply was away: others fell silent with it, and its output was off when it was heard again";
    let mut said = vec![Sentence::of(Likely, text).at(at)];
    said.extend(silent_with);
    said.extend(lost_before(facts, at));
    let text = format!("its own words name what may hold it besides: {}", facts.told(about));
    said.push(Sentence::of(Likely, text).at(at));
    let open = "what took its supply away, and whether anything else holds it, cannot be seen from the line";
    said.push(Sentence::of(NotKnown, open));
    said
}

/// Why a run command of this program does not stand any more that was given before the program was killed.
pub(super) fn of_run_before_kill(facts: &Facts, about: &RecordView) -> Option<Vec<Sentence>> {
    let begun = facts.begun_before_kill(about)?;
    let at = about.time_unix_ms;
    let start = facts.records.iter().rev().find(|found| {
        found.kind == "command"
            && found.what == "start"
            && found.number < begun.number
            && facts.is_of_drive(found)
            && (begun.time_unix_ms - BESIDE_MS..=begun.time_unix_ms).contains(&found.time_unix_ms)
    });
    let start = start.unwrap_or(begun);
    let text = format!("that run had been begun here: {}", start.text);
    let mut said = vec![
        Sentence::of(Said, "the drive's own words show that its run command does not stand any more"),
        Sentence::of(Seen, text).at(start.time_unix_ms),
    ];
    let ending = facts.records.iter().find(|found| {
        found.drive == about.drive
            && matches!(&*found.what, "command" | "stop_confirmed")
            && (at..=at + ENDING_MS).contains(&found.time_unix_ms)
            && matches!(facts.cause_of(found), Some(Cause::Policy { policy }) if policy == "exit")
    });
    said.extend(ending.map(|ending| {
        let text = format!("this program was ending, and stopped it: {}", ending.text);
        Sentence::of(Likely, text).at(ending.time_unix_ms)
    }));
    let open = match ending {
        Some(_) => "whether something else had taken its run command away before that is not known",
        None => "who or what took its run command away cannot be seen from the line",
    };
    said.push(Sentence::of(NotKnown, open));
    Some(said)
}
