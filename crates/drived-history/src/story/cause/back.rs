//! How a drive was when it was heard again, and what that says of what it had lost.

use drived_plant::plant::past::{
    Certainty::{Likely, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::body,
        facts::{Facts, begins, is_silent, lasting},
    },
    evidence::{is_of_supply, loss_before},
    word::{Went, how_it_went},
};

/// Drives that fell silent within this time of each other may have done so together: so much the polls and their repetitions lie apart.
pub(super) const SILENT_TOGETHER_MS: i64 = 3_000;

/// What is told with a drive that is heard again is told of the same status: each has its own reading of the clock.
const WITH_IT_MS: i64 = 500;
/// Who it is is read when it is heard again, within this time.
const IDENTIFIED_MS: i64 = 10_000;

/// What a drive that fell silent showed when it was heard again.
pub(super) struct Back {
    /// That it was heard again, where it was.
    heard: Option<Sentence>,
    pub(super) shows: Shows,
}

/// What that says of its supply.
pub(super) enum Shows {
    /// It was fed all the time, for this.
    Fed(Sentence),
    /// It was not, as far as that is likely, for this.
    Unfed(Sentence),
    /// It was another drive, for this.
    Another(Sentence),
    /// Its fault was gone.
    Reset(Sentence),
    Nothing,
}

impl Back {
    /// Of a drive that was lost.
    pub(super) fn behind(facts: &Facts, lost: &RecordView) -> Self {
        let connected = connected(facts, lost);
        let heard = connected.map(|connected| {
            let shown = connected.text.strip_prefix("connected: ").unwrap_or(&connected.text);
            let after = lasting(connected.time_unix_ms - begins(lost));
            let text = match is_silent(lost) {
                true => format!("it was heard again {after} after it was heard last: {shown}"),
                false => format!("its status was read again {after} after it was read last: {shown}"),
            };
            Sentence::of(Seen, text).at(connected.time_unix_ms)
        });
        let another = connected.and_then(|back| another(facts, back)).map(Shows::Another);
        let gone = || match how_it_went(facts, command_gone(facts, lost)?) {
            Went::Unfed(sentence) => Some(Shows::Unfed(sentence)),
            Went::ByWord(sentence) => Some(Shows::Fed(sentence)),
            Went::Open(_) => None,
        };
        let shown = || connected.and_then(|back| fed(facts, back));
        let reset = || connected.and_then(|back| reset(facts, back)).map(Shows::Reset);
        let shows = another.or_else(gone).or_else(shown).or_else(reset).unwrap_or(Shows::Nothing);
        Self { heard, shows }
    }

    /// What is told of it: how it came back, and what speaks for or against its supply.
    pub(super) fn told(self) -> Vec<Sentence> {
        let of_supply = match self.shows {
            Shows::Fed(sentence)
            | Shows::Unfed(sentence)
            | Shows::Another(sentence)
            | Shows::Reset(sentence) => Some(sentence),
            Shows::Nothing => None,
        };
        self.heard.into_iter().chain(of_supply).collect()
    }
}

/// When the same run of the program heard it again: another run knows nothing of what it had done.
fn connected<'a>(facts: &'a Facts, lost: &RecordView) -> Option<&'a RecordView> {
    let later = facts.records.iter().filter(|found| found.number > lost.number);
    let mut of_run = later.take_while(|found| {
        !(matches!(&*found.what, "began" | "began_after_kill")
            || found.what == "lost" && found.drive == lost.drive)
    });
    of_run.find(|found| found.what == "connected" && found.drive == lost.drive)
}

/// Its run command, which had gone when it was seen again behind this loss.
fn command_gone<'a>(facts: &'a Facts, lost: &RecordView) -> Option<&'a RecordView> {
    let is_gone = |found: &&RecordView| matches!(&*found.what, "command_overridden" | "run_not_adopted");
    let gone = facts.records.iter().filter(|found| found.number > lost.number && found.drive == lost.drive);
    gone.filter(is_gone).find(|found| {
        loss_before(facts, found.time_unix_ms).is_some_and(|(before, _)| before.number == lost.number)
    })
}

/// What is told of a drive within this time of its being heard again.
fn behind<'a>(
    facts: &'a Facts,
    connected: &RecordView,
    what: &[&str],
    within: i64,
) -> Option<&'a RecordView> {
    let later = facts.records.iter().filter(|found| {
        found.number > connected.number
            && found.kind == "event"
            && found.drive == connected.drive
            && (0..=within).contains(&(found.time_unix_ms - connected.time_unix_ms))
    });
    later.take_while(|found| found.what != "lost").find(|found| what.contains(&&*found.what))
}

/// That another drive answers in its place.
fn another(facts: &Facts, connected: &RecordView) -> Option<Sentence> {
    let found = behind(facts, connected, &["other_family", "identity_changed"], IDENTIFIED_MS)?;
    let text = format!("another drive answers in its place: {}", found.text);
    Some(Sentence::of(Said, text).at(found.time_unix_ms))
}

/// That a fault had gone while nothing was heard of it: some drives begin anew with a reset, and answer nobody meanwhile.
fn reset(facts: &Facts, connected: &RecordView) -> Option<Sentence> {
    let cleared = behind(facts, connected, &["fault_cleared"], WITH_IT_MS)?;
    let text = "its fault was gone when it was heard again: it was reset, or switched off and on, and a drive that begins anew answers nobody meanwhile";
    Some(Sentence::of(Likely, text).at(cleared.time_unix_ms))
}

/// What shows whether a drive was fed while it was silent.
fn fed(facts: &Facts, connected: &RecordView) -> Option<Shows> {
    let at = connected.time_unix_ms;
    let with_it = |what: &str| behind(facts, connected, &[what], WITH_IT_MS);
    if let Some(trip) = with_it("tripped") {
        let faults = [Some(trip), facts.explained(trip)].into_iter().flatten();
        let mut faults = faults.filter_map(|found| body(found).fault);
        let by_watchdog = faults.any(|fault| fault.by_watchdog);
        let words = facts.in_words(trip);
        if is_of_supply(&words) {
            let text = format!("{words}: the drive itself speaks of its supply");
            return Some(Shows::Unfed(Sentence::of(Likely, text).at(at)));
        }
        let text = "its watchdog acted, which it does in a drive that is fed and not spoken to: its supply was not away";
        return by_watchdog.then(|| Shows::Fed(Sentence::of(Likely, text).at(at)));
    }
    // Its state was the same before: else it is told that it became another.
    let shown = body(connected).status.unwrap_or_default();
    let runs_on = shown.state.as_deref() == Some("running")
        && shown.control.as_deref() == Some("bus")
        && with_it("state_changed").is_none();
    let text = "it ran on behind it, and a run command of a bus does not outlast the supply of its drive: that was not away";
    runs_on.then(|| Shows::Fed(Sentence::of(Likely, text).at(at)))
}
