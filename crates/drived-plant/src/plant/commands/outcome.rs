//! The words for what became of a command, which are the same at every face.

use drive_core::Status;
use drive_fleet::{Became, Outcome, Refused, Snapshot};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OutcomeWord {
    /// It is not known yet.
    Pending,
    /// The drive's own words show it.
    Confirmed,
    /// It was sent, and the drive's words do not show it. Of a stop that may be settled later, under the same id.
    NotConfirmed,
    /// It was sent, or may have been, and the drive could not be asked. It may be settled later, under the same id.
    Unknown,
    /// Nothing moved because of it.
    Refused,
    /// Its time was over before it was sent. It never will be.
    Expired,
    /// A stop or a newer command took its place.
    Superseded,
    /// There was nothing to be done.
    Nothing,
}

drive_core::named! { OutcomeWord {
    Pending => "pending",
    Confirmed => "confirmed",
    NotConfirmed => "not_confirmed",
    Unknown => "unknown",
    Refused => "refused",
    Expired => "expired",
    Superseded => "superseded",
    Nothing => "nothing",
} }

/// Nobody of a group was started, because another of its drives was not ready.
pub(super) const GROUP_NOT_READY: &str = "group_not_ready";
/// A group was stopped again, because not all of its drives started.
pub(super) const GROUP_FAILED: &str = "group_failed";
/// Another start of a group was under way for as long as this one could wait.
pub(super) const GROUP_BUSY: &str = "group_busy";
/// The word, the reason and a sentence for an outcome of the fleet.
pub(super) fn told(outcome: &Outcome) -> (OutcomeWord, Option<&'static str>, Option<String>) {
    let word = match outcome.became() {
        Became::Confirmed => OutcomeWord::Confirmed,
        Became::NotConfirmed => OutcomeWord::NotConfirmed,
        Became::Unknown => OutcomeWord::Unknown,
        Became::Refused => OutcomeWord::Refused,
        Became::Expired => OutcomeWord::Expired,
        Became::Superseded => OutcomeWord::Superseded,
        Became::Nothing => OutcomeWord::Nothing,
    };
    (word, outcome.reason(), outcome.text())
}

/// What becomes of a stop of several for a drive that is only read: where it shows what would confirm a stop, there is nothing to be
/// done; where its motor turns, or nobody knows, it was not stopped.
pub(super) fn of_watched(seen: &Snapshot) -> (OutcomeWord, Option<&'static str>, Option<String>) {
    let (word, reason, text) = told(&Outcome::Refused(Refused::ReadOnly));
    let needs_none = seen.fresh_status(Instant::now()).is_some_and(Status::is_undriven);
    (if needs_none { OutcomeWord::Nothing } else { word }, reason, text)
}

/// What becomes of a command for several drives: pending while one is, else the worst of them.
pub(super) fn of_all(outcomes: impl Iterator<Item = OutcomeWord>) -> OutcomeWord {
    let rank = |word: &OutcomeWord| match word {
        OutcomeWord::Nothing => 0,
        OutcomeWord::Confirmed => 1,
        OutcomeWord::Superseded => 2,
        OutcomeWord::Refused => 3,
        OutcomeWord::Expired => 4,
        OutcomeWord::NotConfirmed => 5,
        OutcomeWord::Unknown => 6,
        OutcomeWord::Pending => 7,
    };
    outcomes.max_by_key(rank).unwrap_or(OutcomeWord::Refused)
}
