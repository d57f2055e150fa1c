//! Which drives are locked behind a quick stop: [`QuickStops`].
//!
//! In the state chart of the Altivar 28, 58 and 312 a motor that was stopped by a quick stop is started by no run command before its
//! voltage was disabled (BBV51701 p. 10 to 12). The daemon stops it by another word where the drive has a faster one, and starts it from the
//! page out of whatever state: so it is kept here, once for all gateways, for whom it is who writes the chart's words.

use std::{
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

use drive_fleet::DriveHandle;
use serde::{Deserialize, Serialize};
use tokio::runtime::Handle;

use super::Plant;
use drived_config::{
    kept::Stale,
    places::Places,
    records::{Record, Records, in_folder},
};

/// The file of the state folder.
const FILE: &str = "quick_stops.json";

/// Those that are locked, by their places, through gateways that are opened anew and restarts of the program. Cheap to clone.
#[derive(Debug, Clone)]
pub struct QuickStops {
    locked: Records<Locked>,
    /// One writes the file after the other.
    writes: Arc<Mutex<()>>,
}

/// A drive that is locked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Locked {}

impl Record for Locked {
    const LOSS: &'static str = "a motor that a gateway's client has stopped by a quick stop may be started before its voltage was disabled";
    // One that locks too many is better than one that locks none.
    const STALE: Stale = Stale::Left;

    fn alone(&self) -> &'static str {
        "it is locked behind a quick stop"
    }
}

impl Default for QuickStops {
    fn default() -> Self {
        Self::in_folder(None, &Places::default())
    }
}

impl QuickStops {
    /// Those of this state folder; without one they live as long as the program.
    pub fn in_folder(folder: Option<&Path>, places: &Places) -> Self {
        let file = in_folder(folder, FILE);
        Self { locked: Records::open(file.as_deref(), places), writes: Arc::default() }
    }

    /// A client of a gateway has written a quick stop to a drive: it is locked from now on. That is kept in the background, for a stop waits
    /// for no disk.
    pub fn lock(&self, drive: &DriveHandle) {
        self.set(drive, Some(Locked {}));
    }

    /// A drive has shown that its voltage was disabled.
    pub fn unlock(&self, drive: &DriveHandle) {
        self.set(drive, None);
    }

    /// Whether a drive is locked.
    pub fn locks(&self, drive: &DriveHandle) -> bool {
        self.locked.of(drive.place()).is_some()
    }

    /// A drive is called otherwise from now on.
    pub(super) fn call(&self, drive: &DriveHandle) {
        self.set(drive, self.locked.of(drive.place()));
    }

    fn set(&self, drive: &DriveHandle, locked: Option<Locked>) {
        if self.locked.set(drive.place(), drive.name(), locked) {
            let Self { locked, writes } = self.clone();
            Handle::current().spawn_blocking(move || {
                let _first = writes.lock().unwrap_or_else(PoisonError::into_inner);
                locked.write();
            });
        }
    }
}

impl Plant {
    /// Which drives are locked behind a quick stop.
    pub fn quick_stops(&self) -> &QuickStops {
        &self.0.quick_stops
    }
}

#[cfg(test)]
mod tests {
    use tokio::task::yield_now;

    use super::*;
    use crate::plant::testing::TestPlant;
    use drived_config::testing::Folder;

    #[tokio::test(start_paused = true)]
    async fn a_drive_is_locked_behind_a_quick_stop_also_for_the_program_that_comes_after_a_kill() {
        let (folder, test) = (Folder::new("quick-stops"), TestPlant::of(2).await);
        let place = folder.file("");
        let drives = test.plant.fleet().drives();
        let there: Places =
            drives.iter().map(|drive| (drive.name().to_string(), drive.place().clone())).collect();
        let open = || QuickStops::in_folder(Some(&place), &there);
        let locked = |stops: &QuickStops| [0, 1].map(|number: usize| stops.locks(&drives[number]));
        let stops = open();
        assert_eq!(locked(&stops), [false, false]);
        stops.lock(&drives[1]);
        assert_eq!(locked(&stops), [false, true]);
        while locked(&open()) != [false, true] {
            yield_now().await;
        }
        stops.unlock(&drives[1]);
        assert_eq!(locked(&stops), [false, false]);
        while locked(&open()) != [false, false] {
            yield_now().await;
        }
    }
}
