//! The words for what became of a command, which are the same at every face.

use drive_fleet::{Became, Outcome, Refused};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OutcomeWord {
    /// It is not known yet.
    Pending,
    /// The drive's own words show it.
    Confirmed,
    /// It was sent, and the drive's words do not show it.
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
/// The configuration says that the drive is only read.
pub(super) const READ_ONLY: &str = Refused::ReadOnly.word();

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

/// What becomes of a command for several drives: confirmed when all are that may be commanded, pending while one is, else
/// the worst of them.
pub(super) fn of_all<'a>(outcomes: impl Iterator<Item = (OutcomeWord, Option<&'a str>)>) -> OutcomeWord {
    let rank = |word| match word {
        OutcomeWord::Nothing | OutcomeWord::Confirmed => 0,
        OutcomeWord::Superseded => 1,
        OutcomeWord::Refused => 2,
        OutcomeWord::Expired => 3,
        OutcomeWord::NotConfirmed => 4,
        OutcomeWord::Unknown => 5,
        OutcomeWord::Pending => 6,
    };
    let commanded = outcomes.filter(|(_, reason)| *reason != Some(READ_ONLY));
    commanded.map(|(word, _)| word).max_by_key(|word| rank(*word)).unwrap_or(OutcomeWord::Refused)
}
