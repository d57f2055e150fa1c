//! What was known of every drive and line at a moment, and what was counted of the lines by minutes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::IsView;

/// What was known at a moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentView {
    pub at_unix_ms: i64,
    /// Every drive of which there is anything.
    pub drives: Vec<DriveThenView>,
    /// The lines, in the minute of that moment.
    pub lines: Vec<LineMinuteView>,
}

/// A drive at a moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveThenView {
    pub drive: String,
    /// By their names; a value that was not known then is not there.
    pub values: std::collections::BTreeMap<String, IsView>,
    /// Whether they are those of the moment itself; else they are the means of its minute or hour, because nothing finer is kept.
    pub exact: bool,
}

/// What was counted of the lines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LineMinutesView {
    pub minutes: Vec<LineMinuteView>,
    /// From where to ask on, where that was too much for one answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_from_unix_ms: Option<i64>,
}

/// A line within a minute.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LineMinuteView {
    /// When the minute ended.
    pub time_unix_ms: i64,
    pub line: String,
    /// Requests, those that were sent again among them.
    pub sent: i64,
    pub answered: i64,
    /// Answers that were damaged, or did not fit the request.
    pub damaged: i64,
    /// Requests that nobody answered.
    pub missing: i64,
    /// Whole frames of somebody else.
    pub foreign: i64,
    /// Silences that were kept before requests.
    pub silences: i64,
    /// Their mean, in microseconds; absent where there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub silence_us: Option<i64>,
    /// Thousandths of the minute in which the line was needed.
    pub busy_permille: i64,
    /// Whether its port was there at the end of the minute.
    pub is_open: bool,
}
