//! One command and what became of it.

use std::borrow::Cow;

use drive_fleet::{Started, view::StopModesView};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Shown;
use crate::plant::commands::{ActionWord, OutcomeWord};

/// A command: for one drive, or with one entry for each of several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandView {
    pub id: String,
    /// The drive; absent where several are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    /// The group; absent where a drive, some that were selected, or all, are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// The drives that were selected for it; absent where others are meant.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub selected: Vec<String>,
    pub action: ActionWord,
    /// The action in words.
    pub command: String,
    pub caller: String,
    /// Where it came from.
    pub origin: String,
    pub outcome: OutcomeWord,
    /// Whether something else may still become of it, which is told under the same id.
    pub open: bool,
    /// Why, in one word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<Cow<'static, str>>,
    /// The reason in words; of a start that is in force, at what.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// When it arrived.
    pub time_unix_ms: u64,
    /// From its arrival to its outcome.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub took_ms: Option<u64>,
    /// What the drive showed then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status: Option<Shown>,
    /// Of one of several drives: as what it is counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counted: Option<Counted>,
    /// Of a start that is in force: which way, and the setpoint that it uses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started: Option<Started>,
    /// Of a stop that was sent: how it was asked for, and how the drive stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<StopModesView>,
    #[serde(flatten)]
    pub several: Option<SeveralView>,
}

/// As what a drive is counted that a command for several was meant for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    Confirmed,
    /// Its outcome is not known yet, and it answers.
    Pending,
    /// It is not confirmed and does not answer.
    NotReachable,
    /// The command was refused for it, such as for a drive that is only read.
    Refused,
    /// It answers, and the command ended otherwise.
    Failed,
}

impl CommandView {
    /// How many of its drives ended how.
    pub fn several_in_words(&self) -> String {
        let Some(several) = &self.several else { return self.command.clone() };
        let SeveralView { confirmed, pending, not_reachable, refused, failed, .. } = several;
        format!(
            "{confirmed} confirmed, {pending} pending, {not_reachable} not reachable, {refused} refused, {failed} not done"
        )
    }
}

/// What became of a command for several drives: every drive is counted once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SeveralView {
    pub drives: Vec<CommandView>,
    pub confirmed: usize,
    /// Those whose outcome is not known yet, and that answer.
    pub pending: usize,
    /// Those that are not confirmed and do not answer.
    pub not_reachable: usize,
    /// Those that it was refused for, such as drives that are only read.
    pub refused: usize,
    /// Those that answer and for which it ended otherwise.
    pub failed: usize,
}

impl SeveralView {
    pub fn of(mut drives: Vec<CommandView>, is_silent: impl Fn(&CommandView) -> bool) -> Self {
        for drive in &mut drives {
            drive.counted = Some(match drive.outcome {
                OutcomeWord::Confirmed => Counted::Confirmed,
                OutcomeWord::Refused => Counted::Refused,
                _ if is_silent(drive) => Counted::NotReachable,
                OutcomeWord::Pending => Counted::Pending,
                _ => Counted::Failed,
            });
        }
        let count = |kind| drives.iter().filter(|drive| drive.counted == Some(kind)).count();
        Self {
            confirmed: count(Counted::Confirmed),
            pending: count(Counted::Pending),
            not_reachable: count(Counted::NotReachable),
            refused: count(Counted::Refused),
            failed: count(Counted::Failed),
            drives,
        }
    }
}
