//! Why a message does nothing, in the same words at every broker.

use serde::Serialize;

use drived_plant::plant::{
    LastCommandView,
    commands::{ActionWord, OutcomeWord, Rejected},
};
use drived_words::strict::Unclear;

/// Why a message does nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    #[error("there is none of this name")]
    NotFound,
    #[error("{0} cannot be written")]
    ReadOnly(String),
    #[error("it is retained: the broker would send it again and again; publish it without the retain flag")]
    Retained,
    #[error("the connection to the broker has stalled, and nobody can say how old it is")]
    Late,
    #[error("the births have not been told: nobody can know what it writes")]
    NotBorn,
    #[error("nobody can say which drive is meant: {0}")]
    NamesLost(String),
    #[error(transparent)]
    Unclear(#[from] Unclear),
    #[error(
        "expected an id: without one it may come again when nobody expects it, and its outcome is not found"
    )]
    IdNeeded,
    #[error("expected issued_unix_ms: without it nobody can say how long it has waited where it comes from")]
    IssuedNeeded,
    #[error("too many commands are waiting")]
    Busy,
    #[error("{0}: until it can, only stops are carried out")]
    Audit(String),
    /// By the plant.
    #[error(transparent)]
    Rejected(#[from] Rejected),
}

impl Refusal {
    /// What is wrong with what a message says.
    pub fn malformed(text: impl Into<String>) -> Self {
        Self::Unclear(Unclear::Malformed(text.into()))
    }

    /// The outcome and the reason, a word each.
    pub const fn told(&self) -> (OutcomeWord, &'static str) {
        let reason = match self {
            Self::Rejected(rejected) => return rejected.told(),
            Self::NotFound => "not_found",
            Self::ReadOnly(_) => "read_only",
            Self::Retained => "retained",
            Self::Late => "late",
            Self::NotBorn => "not_born",
            Self::NamesLost(_) => "names_lost",
            Self::Unclear(Unclear::Ambiguous(_)) => "ambiguous",
            Self::Unclear(_) => "malformed",
            Self::IdNeeded => "id_needed",
            Self::IssuedNeeded => "issued_needed",
            Self::Busy => "busy",
            Self::Audit(_) => "audit",
        };
        (OutcomeWord::Refused, reason)
    }
}

/// A message that does nothing, as it is told.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Refused {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub action: Option<ActionWord>,
    pub outcome: OutcomeWord,
    pub reason: &'static str,
    pub text: String,
    pub caller: String,
    pub origin: String,
    pub time_unix_ms: u64,
}

impl Refused {
    /// The same as what became of the last command of a drive.
    pub fn as_last(&self) -> LastCommandView {
        LastCommandView {
            id: self.id.clone(),
            action: self.action,
            command: None,
            outcome: self.outcome,
            reason: Some(self.reason.into()),
            text: Some(self.text.clone()),
            caller: self.caller.clone(),
            origin: self.origin.clone(),
            arrived_unix_ms: self.time_unix_ms,
        }
    }
}
