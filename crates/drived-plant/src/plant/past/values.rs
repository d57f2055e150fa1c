//! Values of a drive as they were read, and those of several drives in steps of one length.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which curves are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CurvesAsked {
    /// All of which there is something, where none is named.
    pub drives: Vec<String>,
    pub values: Vec<String>,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    pub every_ms: i64,
}

/// Curves in steps of one length, all of them of the same steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepsView {
    /// When the first step begins: at a whole multiple of their length since 1970.
    pub from_unix_ms: i64,
    pub every_ms: i64,
    /// How many there are in each list below.
    pub steps: usize,
    pub curves: Vec<CurveView>,
}

/// The steps of a value of a drive, in the value's unit; `null`: nothing is known of that step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveView {
    pub drive: String,
    pub value: String,
    pub least: Vec<Option<f64>>,
    /// By time, over what is known; of a word or of bits it means nothing, and the list is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mean: Vec<Option<f64>>,
    pub greatest: Vec<Option<f64>>,
    /// The share of each step for which something is known, from 0 to 1.
    pub known: Vec<f64>,
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepView {
    /// When it begins.
    pub start_unix_ms: i64,
    /// Of a word its place among the value's words.
    pub least: f64,
    /// By time, over what is known. Of words and bits there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    pub greatest: f64,
    /// The share of the step for which something is known, from 0 to 1.
    pub known: f64,
    /// Of a value in words: each that it was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<ShareView>,
}

/// For how much of a step a value was this word.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShareView {
    /// `running`.
    pub is: String,
    /// From 0 to 1: those of a step are together what is known of it.
    pub share: f64,
}
