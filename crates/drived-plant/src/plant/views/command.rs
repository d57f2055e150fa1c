//! One command and what became of it.

use std::{borrow::Cow, sync::Arc};

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
    /// Of a stop: how often a run command of somebody else, or one kept back on its way, came behind it after the drive had taken it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restarts: Option<u32>,
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
    /// The command was refused for it, or asked nothing of it, such as of a drive that is only read.
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
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct SeveralView {
    /// Each of them; of more than 256 the event stream tells those of which something is new, 256 at the most.
    pub drives: Vec<Arc<CommandView>>,
    pub confirmed: usize,
    /// Those whose outcome is not known yet, and that answer.
    pub pending: usize,
    /// Those that are not confirmed and do not answer.
    pub not_reachable: usize,
    /// Those that it was refused for, or asked nothing of, such as drives that are only read.
    pub refused: usize,
    /// Those that answer and for which it ended otherwise.
    pub failed: usize,
}

impl SeveralView {
    /// Counts these, each as what it says then.
    pub fn of(drives: &mut [Arc<CommandView>], is_silent: impl Fn(usize) -> bool) -> Self {
        let mut several =
            Self { drives: Vec::new(), confirmed: 0, pending: 0, not_reachable: 0, refused: 0, failed: 0 };
        for (number, drive) in drives.iter_mut().enumerate() {
            let counted = match drive.outcome {
                OutcomeWord::Confirmed => Counted::Confirmed,
                OutcomeWord::Refused | OutcomeWord::Nothing => Counted::Refused,
                _ if is_silent(number) => Counted::NotReachable,
                OutcomeWord::Pending => Counted::Pending,
                _ => Counted::Failed,
            };
            *match counted {
                Counted::Confirmed => &mut several.confirmed,
                Counted::Pending => &mut several.pending,
                Counted::NotReachable => &mut several.not_reachable,
                Counted::Refused => &mut several.refused,
                Counted::Failed => &mut several.failed,
            } += 1;
            if drive.counted != Some(counted) {
                Arc::make_mut(drive).counted = Some(counted);
            }
        }
        several.drives = drives.to_vec();
        several
    }

    /// The same counts, with these of its drives.
    pub const fn counts(&self, drives: Vec<Arc<CommandView>>) -> Self {
        let Self { confirmed, pending, not_reachable, refused, failed, .. } = *self;
        Self { drives, confirmed, pending, not_reachable, refused, failed }
    }

    /// Of how many drives.
    pub const fn count(&self) -> usize {
        self.confirmed + self.pending + self.not_reachable + self.refused + self.failed
    }

    /// Those of which something is new since it was told before.
    pub fn news(&self, before: Option<&Self>) -> impl Iterator<Item = &Arc<CommandView>> {
        let known = move |number: usize| before.and_then(|before| before.drives.get(number));
        let is_new = move |(number, drive): &(usize, &Arc<CommandView>)| {
            known(*number).is_none_or(|known| !Arc::ptr_eq(known, drive))
        };
        self.drives.iter().enumerate().filter(is_new).map(|(_, drive)| drive)
    }
}

/// What is one and the same need not be looked at: of many drives most are, from one telling to the next.
impl PartialEq for SeveralView {
    fn eq(&self, other: &Self) -> bool {
        let counts = |of: &Self| (of.confirmed, of.pending, of.not_reachable, of.refused, of.failed);
        let is_same =
            |(one, two): (&Arc<CommandView>, &Arc<CommandView>)| Arc::ptr_eq(one, two) || one == two;
        counts(self) == counts(other)
            && self.drives.len() == other.drives.len()
            && self.drives.iter().zip(&other.drives).all(is_same)
    }
}
