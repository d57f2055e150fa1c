//! One command and what became of it.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Shown;
use crate::plant::commands::{ActionWord, OutcomeWord};

/// A command: for one drive, or with one entry for each of several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct CommandView {
    pub(crate) id: String,
    /// The drive; absent where several are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drive: Option<String>,
    /// The group; absent where a drive, or all, are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) group: Option<String>,
    pub(crate) action: ActionWord,
    /// The action in words.
    pub(crate) command: String,
    pub(crate) caller: String,
    /// Where it came from.
    pub(crate) origin: String,
    pub(crate) outcome: OutcomeWord,
    /// Whether something else may still become of it, which is told under the same id.
    pub(crate) open: bool,
    /// Why, in one word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<Cow<'static, str>>,
    /// The reason in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) text: Option<String>,
    /// When it arrived.
    pub(crate) time_unix_ms: u64,
    /// From its arrival to its outcome.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) took_ms: Option<u64>,
    /// What the drive showed then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) status: Option<Shown>,
    #[serde(flatten)]
    pub(crate) several: Option<SeveralView>,
}

impl CommandView {
    /// How many of its drives ended how.
    pub(crate) fn several_in_words(&self) -> String {
        let Some(several) = &self.several else { return self.command.clone() };
        let SeveralView { confirmed, pending, not_reachable, refused, failed, .. } = several;
        format!(
            "{confirmed} confirmed, {pending} pending, {not_reachable} not reachable, {refused} refused, {failed} not done"
        )
    }
}

/// What became of a command for several drives: every drive is counted once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct SeveralView {
    pub(crate) drives: Vec<CommandView>,
    pub(crate) confirmed: usize,
    /// Those whose outcome is not known yet, and that answer.
    pub(crate) pending: usize,
    /// Those that are not confirmed and do not answer.
    pub(crate) not_reachable: usize,
    /// Those that it was refused for, such as drives that are only read.
    pub(crate) refused: usize,
    /// Those that answer and for which it ended otherwise.
    pub(crate) failed: usize,
}

impl SeveralView {
    pub(crate) fn of(drives: Vec<CommandView>, is_silent: impl Fn(&CommandView) -> bool) -> Self {
        let (mut confirmed, mut pending, mut not_reachable, mut refused, mut failed) = (0, 0, 0, 0, 0);
        for drive in &drives {
            let count = match drive.outcome {
                OutcomeWord::Confirmed => &mut confirmed,
                OutcomeWord::Refused => &mut refused,
                _ if is_silent(drive) => &mut not_reachable,
                OutcomeWord::Pending => &mut pending,
                _ => &mut failed,
            };
            *count += 1;
        }
        Self { drives, confirmed, pending, not_reachable, refused, failed }
    }
}
