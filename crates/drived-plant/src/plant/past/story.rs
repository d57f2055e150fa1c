//! What happened to a drive at a moment, in sentences, each as sure as it is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
