//! What became of the last command of each drive, for faces that show it beside the drive.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize};
use tokio::{sync::watch, time::Instant};

use super::{
    Inner, Plant,
    commands::{ActionWord, OutcomeWord},
    views::{CommandView, SeveralView},
};
use drived_words::json::unix;

/// What became of a command of a drive, whoever gave it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastCommandView {
    /// Absent where what came had no name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Absent where it cannot be understood.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<ActionWord>,
    /// The same in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    pub outcome: OutcomeWord,
    /// Why, in one word.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Cow<'static, str>>,
    /// Why, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    pub caller: String,
    /// Where it came from.
    pub origin: String,
    /// When it arrived.
    pub arrived_unix_ms: u64,
}

/// The last of each drive.
#[derive(Default)]
pub(super) struct LastCommands {
    by_drive: Mutex<BTreeMap<String, LastCommandView>>,
    /// How often one of them has changed.
    changed: watch::Sender<u64>,
}

impl Plant {
    /// What became of the last command of a drive; `None`: there was none since the program began.
    pub fn last_command(&self, drive: &str) -> Option<LastCommandView> {
        self.0.last_commands.by_drive.lock().unwrap_or_else(PoisonError::into_inner).get(drive).cloned()
    }

    /// A reader of how often one of them has changed.
    pub fn last_command_changes(&self) -> watch::Receiver<u64> {
        self.0.last_commands.changed.subscribe()
    }

    /// A face has refused a command of a drive before the plant heard of it.
    pub fn note_refused_command(&self, drive: &str, refused: LastCommandView) {
        self.0.note_last_command(drive, refused);
    }
}

impl Inner {
    /// Notes what became of a command, for each drive that it was for and of which something is new.
    pub(super) fn note_last_commands(&self, command: &CommandView, before: Option<&SeveralView>) {
        let news = command.several.iter().flat_map(|several| several.news(before));
        for part in std::iter::once(command).chain(news.map(|part| &**part)) {
            if let Some(drive) = &part.drive {
                self.note_last_command(drive, LastCommandView::of(part));
            }
        }
    }

    /// What arrived earlier is not the last, though its outcome may come later.
    fn note_last_command(&self, drive: &str, last: LastCommandView) {
        let mut commands = self.last_commands.by_drive.lock().unwrap_or_else(PoisonError::into_inner);
        // One of the future was noted before the clock was set back.
        let now = unix(Instant::now());
        let is_newer =
            |known: &LastCommandView| (last.arrived_unix_ms + 1..=now).contains(&known.arrived_unix_ms);
        if commands.get(drive).is_some_and(is_newer) {
            return;
        }
        if commands.insert(drive.to_owned(), last).is_none() && commands.len().is_power_of_two() {
            // Drives come and go: who is not there any more is not remembered. Seldom, for a stop of all passes here.
            let known: BTreeSet<String> =
                self.fleet.drives().iter().map(|drive| drive.name().to_string()).collect();
            commands.retain(|name, _| known.contains(name));
        }
        self.last_commands.changed.send_modify(|times| *times += 1);
    }
}

impl LastCommandView {
    fn of(command: &CommandView) -> Self {
        Self {
            id: Some(command.id.clone()),
            action: Some(command.action),
            command: Some(command.command.clone()),
            outcome: command.outcome,
            reason: command.reason.clone(),
            text: command.text.clone(),
            caller: command.caller.clone(),
            origin: command.origin.clone(),
            arrived_unix_ms: command.time_unix_ms,
        }
    }
}
