//! What is wrong, how certain that is, and what to do next.

use std::fmt;

use serde::Serialize;

/// What can be wrong with a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Defect {
    NeverQuiet,
    NothingHeard,
    OnlyOurEcho,
    Polarity,
    WrongFraming,
    SecondMaster,
    TwoAtOneAddress,
    Interference,
    DamagedAtOneAddress,
    NoAnswer,
    NeedsPause,
    AdapterHoldsBack,
    AnswersInPieces,
    LateAnswers,
    SlowDrive,
    Noise,
    Interrupted,
    FarEndFaster,
    FirstByteCut,
    LastByteCut,
    BytesBehind,
    OneAnswerBehind,
    RefusesAll,
    NumberZero,
    FellSilent,
    LinkTimeout,
}

/// How sure a verdict is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Certainty {
    Certain,
    Likely,
    /// Any master hears the same from this; the steps tell them apart.
    CannotBeToldFrom(String),
}

impl fmt::Display for Certainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Certain => f.write_str("This is certain."),
            Self::Likely => f.write_str("This is likely, not proved."),
            Self::CannotBeToldFrom(other) => write!(f, "A master cannot tell it from {other}."),
        }
    }
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Verdict {
    pub(super) defect: Defect,
    /// Whom it concerns; empty: the line.
    pub(super) slaves: Vec<u8>,
    pub(super) certainty: Certainty,
    /// What is wrong, with the figures that show it.
    pub(super) finding: String,
    /// What to do next, the likeliest first.
    pub(super) next: Vec<String>,
}

impl Verdict {
    pub(super) fn new(
        defect: Defect,
        slaves: &[u8],
        certainty: Certainty,
        finding: impl Into<String>,
        next: &[&str],
    ) -> Self {
        let next = next.iter().map(|step| (*step).to_owned()).collect();
        Self { defect, slaves: slaves.to_vec(), certainty, finding: finding.into(), next }
    }
}
