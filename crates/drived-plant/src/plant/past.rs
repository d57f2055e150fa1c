//! What is known of the past, by whoever keeps it: the faces ask it here, and none of them knows how it is kept.

use std::sync::{Arc, PoisonError};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::Plant;

/// So many steps, points or records are answered at once, at the most.
pub const AT_ONCE: usize = 20_000;

/// Keeps the past of a plant. Each call reads a disk, and may take its time: it is made on a thread that may wait.
pub trait Past: Send + Sync {
    /// The values of a drive.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn values(&self, asked: &ValuesAsked) -> Result<ValuesView, PastError>;

    /// What happened.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn records(&self, asked: &RecordsAsked) -> Result<RecordsView, PastError>;

    /// What happened to a drive at a moment, in words.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn story(&self, drive: &str, at_unix_ms: i64) -> Result<StoryView, PastError>;
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PastError {
    /// What is asked cannot be.
    #[error("{0}")]
    Asked(String),
    /// It cannot be read now.
    #[error("the history cannot be read: {0}")]
    Unreadable(String),
}

/// Which values are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValuesAsked {
    pub drive: String,
    /// By its name, with its unit: `output_frequency_hz`.
    pub value: String,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// In steps of this length; `None`: as they were read.
    pub every_ms: Option<i64>,
}

/// The values of a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValuesView {
    pub drive: String,
    pub value: String,
    /// As they were read: from each point on the value is this, up to the next point.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointView>,
    /// In steps; one of which nothing is known is not there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepView>,
    /// From where to ask on, where that was too much for one answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_from_unix_ms: Option<i64>,
}

/// What was known from one moment on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PointView {
    pub time_unix_ms: i64,
    /// A number in the value's unit, or a word; `null`: nothing is known from then on.
    pub is: Option<IsView>,
}

/// A value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum IsView {
    Number(f64),
    Word(String),
}

/// One step, in the value's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepView {
    /// When it begins.
    pub start_unix_ms: i64,
    pub least: f64,
    /// By time, over what is known.
    pub mean: f64,
    pub greatest: f64,
    /// The share of the step for which something is known, from 0 to 1.
    pub known: f64,
}

/// Which of what happened is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordsAsked {
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// One drive, and what is of no drive alone.
    pub drive: Option<String>,
    /// `event`, `command`, `alarm`, `notice`, `history`.
    pub kind: Option<String>,
    /// Only what stands behind the record of this number.
    pub after: i64,
    /// So many at the most.
    pub limit: Option<usize>,
}

/// What happened.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordsView {
    /// In the daemon's own order.
    pub records: Vec<RecordView>,
    /// The number behind which to ask on, where there may be more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_after: Option<i64>,
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

/// How sure a sentence is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// It was seen here.
    Seen,
    /// The drive says so.
    Said,
    /// The facts speak for it, and something else is possible.
    Likely,
    /// It is not known.
    NotKnown,
}

/// One sentence, with its time where it has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SentenceView {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unix_ms: Option<i64>,
    pub certainty: Certainty,
    pub text: String,
}

impl SentenceView {
    /// Without a time.
    pub fn of(certainty: Certainty, text: impl Into<String>) -> Self {
        Self { time_unix_ms: None, certainty, text: text.into() }
    }

    /// The same, with its time.
    pub fn at(self, time_unix_ms: i64) -> Self {
        Self { time_unix_ms: Some(time_unix_ms), ..self }
    }
}

/// The story of a drive around a moment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct StoryView {
    pub drive: String,
    /// What the story is about; absent where nothing happened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<SentenceView>,
    /// Why, as far as it is known.
    pub why: Vec<SentenceView>,
    /// How it was before.
    pub before: Vec<SentenceView>,
    /// What happened, in order: to the drive, by somebody, and to its line.
    pub course: Vec<SentenceView>,
    /// What is not known.
    pub not_known: Vec<SentenceView>,
}

impl Plant {
    /// This keeps the past from now on; `None`: nobody does.
    pub fn set_past(&self, past: Option<Arc<dyn Past>>) {
        *self.0.past.write().unwrap_or_else(PoisonError::into_inner) = past;
    }

    /// Who keeps the past; `None`: nobody does.
    pub fn past(&self) -> Option<Arc<dyn Past>> {
        self.0.past.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
