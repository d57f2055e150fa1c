//! What is kept of each drive in a file of the state folder, beyond the life of the program.

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use drive_fleet::{Event, EventKind, Events, Received};
use serde::{Serialize, de::DeserializeOwned};
use tokio::task::{JoinHandle, spawn_blocking};

use crate::kept::{Kept, Readers};

/// One record of each drive, in a file.
#[derive(Debug)]
pub struct Records<T> {
    file: Option<Kept>,
    drives: BTreeMap<String, T>,
    /// Writing has failed, which is told once.
    failing: bool,
    /// What is not so while they cannot be kept.
    loss: &'static str,
}

impl<T: Serialize + DeserializeOwned + PartialEq> Records<T> {
    /// Reads the file. One that cannot be read keeps no motor from being watched: `loss` says what is missing then.
    pub fn open(file: Option<&Path>, loss: &'static str) -> Self {
        let file = file.map(Kept::at);
        let read = file.as_ref().map(|file| match file.read() {
            Ok(Some((text, _))) => serde_json::from_slice(&text).map_err(io::Error::from),
            Ok(None) => Ok(BTreeMap::new()),
            Err(error) => Err(error),
        });
        let drives = read.unwrap_or_else(|| Ok(BTreeMap::new())).unwrap_or_else(|error| {
            let file = file.as_ref().map_or(Path::new(""), Kept::path).display();
            tracing::warn!("{file}: {error}: {loss}");
            BTreeMap::new()
        });
        Self { file, drives, failing: false, loss }
    }

    /// The record of a drive.
    pub fn of(&self, drive: &str) -> Option<&T> {
        self.drives.get(drive)
    }

    /// Has this be the record of a drive. Gives whether the file is to be written for it.
    pub fn set(&mut self, drive: &str, record: Option<T>) -> bool {
        match record {
            Some(record) if self.drives.get(drive) == Some(&record) => false,
            Some(record) => {
                self.drives.insert(drive.to_owned(), record);
                true
            }
            None => self.drives.remove(drive).is_some(),
        }
    }

    /// The drive is called otherwise: its record goes with it. Gives whether the file is to be written for it.
    pub fn rename(&mut self, old: &str, new: &str) -> bool {
        let Some(record) = self.drives.remove(old) else { return false };
        self.drives.insert(new.to_owned(), record);
        true
    }

    /// Writes the file. What cannot be written is told once, until it can be again.
    pub fn write(&mut self) {
        let Some(file) = &self.file else { return };
        let written = serde_json::to_vec_pretty(&self.drives)
            .map_err(io::Error::from)
            .and_then(|text| file.replace(&text, Readers::Owner));
        if let (Err(error), false) = (&written, self.failing) {
            tracing::warn!("{}: {error}: {}", file.path().display(), self.loss);
        }
        self.failing = written.is_err();
    }
}

/// Follows the drives until the fleet ends: `note` says whether the file is another after an event.
pub fn follow<T>(
    mut records: Records<T>,
    mut events: Events,
    note: fn(&mut Records<T>, &str, &EventKind) -> bool,
) -> JoinHandle<()>
where
    T: Serialize + DeserializeOwned + PartialEq + Send + 'static,
{
    tokio::spawn(async move {
        loop {
            let Event { drive, kind, .. } = match events.recv().await {
                Received::Event(event) => event,
                Received::Missed(_) => continue,
                Received::End => return,
            };
            let is_another = match &kind {
                EventKind::Renamed(old) => records.rename(old, &drive),
                kind => note(&mut records, &drive, kind),
            };
            if !is_another {
                continue;
            }
            let written = spawn_blocking(move || {
                records.write();
                records
            });
            // The runtime ends.
            let Ok(back) = written.await else { return };
            records = back;
        }
    })
}

/// The file of this name in the state folder.
pub fn in_folder(folder: Option<&Path>, name: &str) -> Option<PathBuf> {
    folder.map(|folder| folder.join(name))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_was_kept_is_known_after_a_kill_and_half_a_file_says_nothing() {
        let folder = std::env::temp_dir().join(format!("drived-records-{}", std::process::id()));
        let file = folder.join("state").join("numbers.json");
        let open = || Records::<u32>::open(Some(&file), "nothing is known");
        let mut records = open();
        assert!(records.set("pump 1", Some(7)));
        assert!(!records.set("pump 1", Some(7)), "nothing is written twice");
        records.write();
        // The program was killed.
        let mut records = open();
        assert_eq!((records.of("pump 1"), records.of("pump 2")), (Some(&7), None));
        assert!(records.rename("pump 1", "mixer") && !records.rename("pump 1", "mixer"));
        assert_eq!((records.of("pump 1"), records.of("mixer")), (None, Some(&7)));
        assert!(records.rename("mixer", "pump 1"));
        assert!(records.set("pump 1", None) && !records.set("pump 1", None));
        records.write();
        assert_eq!(open().of("pump 1"), None);
        fs::write(&file, "{\"pump 1\":").unwrap();
        assert_eq!(open().of("pump 1"), None);
        fs::remove_dir_all(folder).unwrap();
    }
}
