//! The figures of what a line finds wrong with itself.

use drive_bus::evidence::{Certainty, Defect, Finding};
use serde::{Deserialize, Serialize};

/// What a sentence about a finding is made of, besides its kind.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FindingFigures {
    /// How often it was seen.
    pub part: u32,
    /// Of how many.
    pub of: u32,
    /// The exception by which everything is refused; absent where nothing is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<u8>,
    /// From one request of another master to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every_ms: Option<u64>,
    /// Since when nobody answers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silent_ms: Option<u64>,
    /// From what it cannot be told, by its name; absent where it is certain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alike: Option<String>,
}

impl From<&Finding> for FindingFigures {
    fn from(finding: &Finding) -> Self {
        let milliseconds = |time: std::time::Duration| u64::try_from(time.as_millis()).unwrap_or(u64::MAX);
        let mut figures = Self { part: finding.share.0, of: finding.share.1, ..Self::default() };
        match finding.defect {
            Defect::RefusesAll(code) => figures.code = Some(code),
            Defect::SecondMaster(every) => figures.every_ms = every.map(milliseconds),
            Defect::FellSilent(since) => figures.silent_ms = Some(milliseconds(since)),
            _ => {}
        }
        if let Certainty::CannotBeToldFrom(alike) = finding.certainty {
            figures.alike = Some(alike.name().to_owned());
        }
        figures
    }
}
