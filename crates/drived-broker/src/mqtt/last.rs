//! What became of the last command of each drive, whoever gave it, retained: the outcomes of a commander's own commands go to him alone.

use std::collections::BTreeMap;

use serde_json::json;
use tokio::{sync::watch, time::Instant};

use super::Face;
use drived_plant::plant::{LastCommandView, commands::OutcomeWord};
use drived_words::json::unix;

/// What is not known yet, as it is told to who has asked, too.
pub(super) const ACCEPTED: &str = "accepted";

/// What tells it.
pub(super) struct LastCommands {
    changes: watch::Receiver<u64>,
    told: BTreeMap<String, LastCommandView>,
    told_at: Option<Instant>,
}

impl LastCommands {
    pub(super) fn new(face: &Face) -> Self {
        Self { changes: face.plant.last_command_changes(), told: BTreeMap::new(), told_at: None }
    }

    /// Waits until one of them is another.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub(super) async fn changed(&mut self) {
        if self.changes.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Tells them all at each heartbeat and when they are to be told again, and else those that are others.
    pub(super) fn tell(&mut self, face: &Face, again: bool) {
        let now = Instant::now();
        let again = again || self.told_at.is_none_or(|at| now >= at + face.config.heartbeat);
        let drives = face.plant.fleet().drives();
        let last = |name: &str| Some((name.to_owned(), face.plant.last_command(name)?));
        let commands: BTreeMap<String, LastCommandView> =
            drives.iter().filter_map(|drive| last(drive.name())).collect();
        for (drive, last) in &commands {
            if again || self.told.get(drive) != Some(last) {
                let mut told = json!(last);
                if last.outcome == OutcomeWord::Pending {
                    told["outcome"] = ACCEPTED.into();
                }
                told["time_unix_ms"] = unix(now).into();
                face.tell(face.topics.drive(drive, "last_command"), told.to_string());
            }
        }
        if again {
            self.told_at = Some(now);
        }
        self.told = commands;
    }
}
