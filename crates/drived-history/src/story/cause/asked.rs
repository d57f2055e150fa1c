//! What somebody asked for here, and what became of it.

use drived_plant::plant::past::{
    Certainty::{NotKnown, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::facts::Facts,
    evidence::{BESIDE_MS, SILENT_MS, asked_before, without_outcome},
};

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

pub(super) fn of_unconfirmed_stop(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = Vec::new();
    if let Some(asked) = asked_before(facts, about, &["stop"]) {
        said.push(
            Sentence::of(Seen, format!("the stop was asked for here: {}", without_outcome(&asked.text)))
                .at(asked.time_unix_ms),
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
