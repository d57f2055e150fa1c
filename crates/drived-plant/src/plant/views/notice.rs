//! What happens to the program itself.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use drived_words::json::unix;

/// Something that concerns no drive alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct NoticeView {
    pub time_unix_ms: u64,
    /// What, in one word.
    pub event: Cow<'static, str>,
    /// Whether somebody has to see to it.
    pub alarm: bool,
    /// The same in words.
    pub text: String,
}

impl NoticeView {
    pub fn new(event: &'static str, alarm: bool, text: impl Into<String>) -> Self {
        Self { time_unix_ms: unix(Instant::now()), event: event.into(), alarm, text: text.into() }
    }
}

/// What happened to a drive or to the program, as far as somebody reads it who does not know each kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HappenedView {
    pub time_unix_ms: u64,
    /// Absent where it concerns no drive alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    pub alarm: bool,
    pub text: String,
}

impl From<NoticeView> for HappenedView {
    fn from(notice: NoticeView) -> Self {
        let NoticeView { time_unix_ms, alarm, text, .. } = notice;
        Self { time_unix_ms, drive: None, alarm, text }
    }
}
