//! What each watchdog was before this program armed it, kept beyond the life of the program: one that is killed puts
//! nothing back, and the next finds the drive armed.

use std::{collections::BTreeMap, io, path::Path};

use drive_fleet::{Event, EventKind, Events, Received, WatchdogBefore};
use tokio::task::{JoinHandle, spawn_blocking};

use crate::kept::{self, Readers};

/// The watchdogs that are to be put back, by drive, in a file.
#[derive(Debug, Default)]
pub(super) struct Kept {
    file: Option<kept::Kept>,
    drives: BTreeMap<String, WatchdogBefore>,
}

impl Kept {
    /// Reads the file. One that cannot be read keeps no motor from being watched: what it said stays armed, which is told
    /// at the exit.
    pub(super) fn open(file: Option<&Path>) -> Self {
        let file = file.map(kept::Kept::at);
        let drives = file.as_ref().map_or_else(BTreeMap::new, |file| match file.read() {
            Ok(Some((text, _))) => {
                serde_json::from_slice(&text).unwrap_or_else(|error| not_read(file.path(), &error))
            }
            Ok(None) => BTreeMap::new(),
            Err(error) => not_read(file.path(), &error),
        });
        Self { file, drives }
    }

    /// What a drive's watchdog was before an earlier run armed it.
    pub(super) fn of(&self, drive: &str) -> Option<WatchdogBefore> {
        self.drives.get(drive).cloned()
    }

    /// Follows the drives until the fleet ends.
    pub(super) fn follow(self, events: Events) -> JoinHandle<()> {
        tokio::spawn(follow(self, events))
    }

    /// Notes what has happened. Gives whether the file is another now.
    fn note(&mut self, drive: &str, kind: &EventKind) -> bool {
        match kind {
            EventKind::WatchdogVerified { before: Some(before), .. } => {
                self.drives.insert(drive.to_owned(), (**before).clone()).as_ref() != Some(&**before)
            }
            EventKind::WatchdogRestored(_) | EventKind::IdentityChanged { .. } => {
                self.drives.remove(drive).is_some()
            }
            _ => false,
        }
    }

    fn write(&self) -> io::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        file.replace(&serde_json::to_vec_pretty(&self.drives)?, Readers::Owner)
    }
}

fn not_read(file: &Path, error: &dyn std::fmt::Display) -> BTreeMap<String, WatchdogBefore> {
    tracing::warn!("{}: {error}: watchdogs that an earlier run has armed stay armed", file.display());
    BTreeMap::new()
}

async fn follow(mut kept: Kept, mut events: Events) {
    let mut failing = false;
    loop {
        let Event { drive, kind, .. } = match events.recv().await {
            Received::Event(event) => event,
            Received::Missed(_) => continue,
            Received::End => return,
        };
        if !kept.note(&drive, &kind) {
            continue;
        }
        let written = spawn_blocking(move || (kept.write(), kept)).await;
        // The runtime ends.
        let Ok((written, back)) = written else { return };
        kept = back;
        if let (Err(error), false) = (&written, failing) {
            let file = kept.file.as_ref().map_or(Path::new(""), kept::Kept::path).display();
            tracing::warn!(
                "{file}: {error}: if this program is killed, watchdogs stay armed at the next exit"
            );
        }
        failing = written.is_err();
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::Arc, time::Duration};

    use drive_core::{Reaction, Watchdog};

    use super::*;

    fn armed(seconds: u64) -> Watchdog {
        Watchdog { timeout: Some(Duration::from_secs(seconds)), reaction: Some(Reaction::Freewheel) }
    }

    fn verified() -> EventKind {
        let found = Watchdog { timeout: None, reaction: Some(Reaction::Unknown(7)) };
        let before = WatchdogBefore { identity: "ATV312 1.3".to_owned(), set: armed(10), found };
        EventKind::WatchdogVerified { watchdog: armed(10), written: true, before: Some(Arc::new(before)) }
    }

    #[test]
    fn what_was_found_is_known_after_a_kill_and_forgotten_once_it_is_put_back() {
        let folder = std::env::temp_dir().join(format!("drived-watchdogs-{}", std::process::id()));
        let file = folder.join("state").join("watchdogs.json");
        let mut kept = Kept::open(Some(&file));
        assert!(kept.note("pump 1", &verified()));
        assert!(!kept.note("pump 1", &verified()), "nothing is written twice");
        kept.write().unwrap();
        // The program was killed.
        let mut kept = Kept::open(Some(&file));
        let EventKind::WatchdogVerified { before: Some(before), .. } = verified() else { unreachable!() };
        assert_eq!(kept.of("pump 1").as_ref(), Some(&*before));
        assert_eq!(kept.of("pump 2"), None);
        assert!(kept.note("pump 1", &EventKind::WatchdogRestored(armed(10))));
        kept.write().unwrap();
        assert_eq!(Kept::open(Some(&file)).of("pump 1"), None);
        fs::write(&file, "{\"pump 1\":").unwrap();
        assert_eq!(Kept::open(Some(&file)).of("pump 1"), None, "half a file says nothing");
        fs::remove_dir_all(folder).unwrap();
    }
}
