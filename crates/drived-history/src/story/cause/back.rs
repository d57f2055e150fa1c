//! How a drive was when it was heard again, and what that says of what it had lost.

use drived_plant::plant::past::{
    Certainty::{Likely, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::body,
        facts::{Facts, begins, lasting},
    },
    evidence::{lost_before, silence_before},
};

/// Drives that fell silent within this time of each other may have done so together: so much the polls and their repetitions lie apart.
pub(super) const SILENT_TOGETHER_MS: i64 = 3_000;

/// What a drive that fell silent showed when it was heard again.
pub(super) struct Back<'a> {
    /// That it was heard again, where it was.
    heard: Option<Sentence>,
    pub(super) shows: Shows<'a>,
}

/// What that says of its supply.
pub(super) enum Shows<'a> {
    /// It was fed all the time, for this.
    Fed(Sentence),
    /// It was not, as far as that is likely: its run command was gone.
    CommandGone(&'a RecordView),
    Nothing,
}

impl<'a> Back<'a> {
    /// Of a drive that was lost.
    pub(super) fn behind(facts: &'a Facts, lost: &RecordView) -> Self {
        let connected = connected(facts, lost);
        let heard = connected.map(|connected| {
            let shown = connected.text.strip_prefix("connected: ").unwrap_or(&connected.text);
            let after = lasting(connected.time_unix_ms - begins(lost));
            let text = format!("it was heard again {after} after it was heard last: {shown}");
            Sentence::of(Seen, text).at(connected.time_unix_ms)
        });
        let shows = match (command_gone(facts, lost), connected.and_then(|back| fed(facts, back))) {
            (Some(gone), _) => Shows::CommandGone(gone),
            (None, Some(fed)) => Shows::Fed(fed),
            (None, None) => Shows::Nothing,
        };
        Self { heard, shows }
    }

    /// What is told of it: how it came back, and what speaks for or against its supply.
    pub(super) fn told(self, facts: &Facts) -> Vec<Sentence> {
        let of_supply = match self.shows {
            Shows::Fed(sentence) => Some(sentence),
            Shows::CommandGone(gone) => of_supply(facts, gone),
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
    facts.records.iter().find(|found| {
        facts.is_of_drive(found)
            && found.number > lost.number
            && matches!(&*found.what, "command_overridden" | "run_not_adopted")
            && silence_before(facts, found.time_unix_ms)
                .is_some_and(|(start, ..)| (start - begins(lost)).abs() <= SILENT_TOGETHER_MS)
    })
}

/// What shows that a drive was fed while it was silent.
fn fed(facts: &Facts, connected: &RecordView) -> Option<Sentence> {
    let at = connected.time_unix_ms;
    let with_it = |what: &str| {
        let mut own = facts.records.iter().filter(|found| {
            found.number > connected.number && found.drive == connected.drive && found.time_unix_ms == at
        });
        own.find(|found| found.what == what)
    };
    if let Some(trip) = with_it("tripped") {
        let faults = [Some(trip), facts.explained(trip)].into_iter().flatten();
        let mut faults = faults.filter_map(|found| body(found).fault);
        let by_watchdog = faults.any(|fault| fault.by_watchdog);
        let text = format!(
            "{}: a watchdog acts in a drive that is fed and not spoken to, so that its supply was not away",
            facts.in_words(trip)
        );
        return by_watchdog.then(|| Sentence::of(Likely, text).at(at));
    }
    // Its state was the same before: else it is told that it became another.
    let shown = body(connected).status.unwrap_or_default();
    let runs_on = shown.state.as_deref() == Some("running")
        && shown.control.as_deref() == Some("bus")
        && with_it("state_changed").is_none();
    let text = "it ran on when it was heard again, and a run command of a bus does not outlast the supply of its drive: that was not away";
    runs_on.then(|| Sentence::of(Likely, text).at(at))
}

/// That a drive whose run command was gone when it was seen again had lost its supply: what else takes a run command away while a drive is silent
/// is somebody who writes to a drive that does not answer here.
pub(super) fn of_supply(facts: &Facts, back: &RecordView) -> Option<Sentence> {
    lost_before(facts, back.time_unix_ms)?;
    let text = "when it was seen again its run command was gone, as it is behind a loss of supply: its supply was away";
    Some(Sentence::of(Likely, text).at(back.time_unix_ms))
}
