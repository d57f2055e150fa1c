//! What happens to the program itself.

use schemars::JsonSchema;
use serde::Serialize;
use tokio::time::Instant;

use crate::json::unix;

/// Something that concerns no drive alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct NoticeView {
    pub(crate) time_unix_ms: u64,
    /// What, in one word.
    pub(crate) event: &'static str,
    /// Whether somebody has to see to it.
    pub(crate) alarm: bool,
    /// The same in words.
    pub(crate) text: String,
}

impl NoticeView {
    pub(crate) fn new(event: &'static str, alarm: bool, text: impl Into<String>) -> Self {
        Self { time_unix_ms: unix(Instant::now()), event, alarm, text: text.into() }
    }
}
