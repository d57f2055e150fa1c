//! Freeze-frames: what was known of a drive around something that happened to it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PointView;
use crate::plant::views::ExchangeView;

/// What was known of a drive around something that happened to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameView {
    /// The event.
    pub why: String,
    pub at_unix_ms: i64,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// Whether what came after it is in it too.
    pub is_whole: bool,
    pub curves: Vec<FrameCurveView>,
    /// The last exchanges of its line before it was told, where they were kept: the newest last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exchanges: Vec<ExchangeView>,
    /// What captures of its line have heard around it; absent where none ran.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capture: Option<FrameCaptureView>,
}

/// How much captures have heard of the line of a drive around a freeze-frame. The frames themselves are told as a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FrameCaptureView {
    /// When the first and the last of them were heard.
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    pub frames: u64,
    /// So many others there were between them, for which there was no room.
    pub left_out: u64,
    /// Whether there were others before them, for which there was no room.
    pub is_cut: bool,
}

/// A value in a freeze-frame, as it was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameCurveView {
    pub value: String,
    pub points: Vec<PointView>,
}
