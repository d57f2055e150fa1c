//! By what a run command went: with the supply of its drive, or by another word.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{body::body, facts::Facts},
    evidence::loss_before,
};

/// What was seen of one reading is recorded within this time.
pub(super) const ONE_READING_MS: i64 = 1_000;
/// A drive that was heard for so long before was not away for longer than two polls.
const HEARD_MS: i64 = 2_000;

/// By what the run command of a drive went.
pub(super) enum Went {
    /// With its supply, for this.
    Unfed(Sentence),
    /// By another word, for this: it was fed all the time.
    ByWord(Sentence),
    /// Which of them it was is not known, for this.
    Open(Option<Sentence>),
}

/// By what a run command went that was gone when its drive was seen. What became of its reference tells that surest; else, that the drive
/// was silent: what else takes a run command away meanwhile is somebody who writes to a drive that does not answer here.
pub(super) fn how_it_went(facts: &Facts, gone: &RecordView) -> Went {
    let at = gone.time_unix_ms;
    let is_open = gone.text.contains("power cycle");
    let shown = found(facts, gone).filter(|_| is_open).map(body).unwrap_or_default();
    match (shown.reference_before_hz, shown.reference_hz) {
        // No drive is fed again, and answers, within a second.
        (Some(_), Some(0.0)) if shown.unread_ms.is_some_and(|apart| apart <= ONE_READING_MS) => {
            let text = "no run command stands in it, the reference that it shows is 0, and it had answered within a second before: another master that writes to it leaves it so, or its supply was away for a moment; which of them is not known";
            return Went::Open(Some(Sentence::of(NotKnown, text).at(at)));
        }
        (Some(_), Some(0.0)) => {
            let text = "its supply was away: no run command stands in a drive that is fed again, and the reference that it shows is 0; another master that writes to it leaves it so too";
            return Went::Unfed(Sentence::of(Likely, text).at(at));
        }
        (Some(before), Some(now)) if before == now => {
            let text = "its supply was not away, for its reference stayed: another word was written to it, as another master does";
            return Went::ByWord(Sentence::of(Likely, text).at(at));
        }
        _ => {}
    }
    if loss_before(facts, at).is_some() {
        let text = "when it was seen again its run command was gone, as it is behind a loss of supply: its supply was away";
        return Went::Unfed(Sentence::of(Likely, text).at(at));
    }
    if facts.is_found_unanswered(at) {
        let text = "a poll of it had not been answered, and when it was seen again its run command was gone, as it is behind a loss of supply: its supply was away";
        return Went::Unfed(Sentence::of(Likely, text).at(at));
    }
    // That no silence was told tells nothing: a drive is off and on again between two looks at it.
    let is_heard = is_open && facts.is_heard(at - HEARD_MS, at);
    Went::Open(is_heard.then(|| {
        let text = "no silence of it was told: another word was written to it, as another master does, or its supply was away for less than two polls; which of them is not known";
        Sentence::of(NotKnown, text)
    }))
}

/// What was seen of its reference.
pub(super) fn of_reference(facts: &Facts, gone: &RecordView) -> Option<Sentence> {
    found(facts, gone).map(|found| Sentence::of(Seen, facts.told(found)).at(found.time_unix_ms))
}

fn found<'a>(facts: &'a Facts, gone: &RecordView) -> Option<&'a RecordView> {
    facts.records.iter().find(|found| {
        found.what == "command_gone"
            && found.drive == gone.drive
            && (found.time_unix_ms - gone.time_unix_ms).abs() <= ONE_READING_MS
    })
}
