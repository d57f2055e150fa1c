//! What happened between two moments.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

/// Which of what happened is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordsAsked {
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// One drive, and what is of no drive alone.
    pub drive: Option<String>,
    /// Of one line.
    pub line: Option<String>,
    /// `event`, `command`, `alarm`, `notice`, `history`.
    pub kind: Option<String>,
    /// In one word: `tripped`, `stop`.
    pub what: Option<String>,
    /// Only what somebody had to see to.
    pub only_alarms: bool,
    /// Only what stands behind the record of this number.
    pub after: i64,
    /// Only what stands before the record of this number, the newest first.
    pub before: Option<i64>,
    /// So many at the most.
    pub limit: Option<usize>,
}

/// What happened.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordsView {
    /// In the daemon's own order; where `before` is said, the newest first.
    pub records: Vec<RecordView>,
    /// The number behind which to ask on, where there may be more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_after: Option<i64>,
    /// Likewise, where the newest come first: the number before which to ask on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_before: Option<i64>,
}

/// Something that happened.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordView {
    /// Its place in the order of the history, which the wall's clock does not change.
    pub number: i64,
    /// The run of the daemon.
    pub run: i64,
    /// By the wall's clock as it stood then.
    pub time_unix_ms: i64,
    /// By the daemon's own clock, since its run began.
    pub steady_ms: i64,
    /// `event`, `command`, `alarm`, `notice`, or `history`: what the black box tells of itself.
    pub kind: String,
    /// In one word.
    pub what: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<String>,
    pub alarm: bool,
    pub text: String,
    /// As the API told it then.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<serde_json::Value>")]
    pub body: Option<Box<RawValue>>,
}
