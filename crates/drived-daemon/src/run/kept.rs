//! What earlier runs have left of the drives, by their places.

use drive_fleet::{EepromLedger, Left, Place, RunRecord, WatchdogBefore};

use super::runs;
use drived_config::{
    config::State,
    places::Places,
    records::{Records, in_folder},
};
use drived_file::ledger;

/// The files of the state folder that say it. Cheap to clone.
#[derive(Clone)]
pub(super) struct Kept {
    pub(super) runs: Records<RunRecord>,
    pub(super) watchdogs: Records<WatchdogBefore>,
    pub(super) eeproms: Records<EepromLedger>,
}

impl Kept {
    pub(super) fn open(state: &State, places: &Places) -> Self {
        let file = |name| in_folder(state.folder.as_deref(), name);
        Self {
            runs: Records::open(file(runs::FILE).as_deref(), places),
            watchdogs: Records::open(state.watchdogs.as_deref(), places),
            eeproms: Records::open(file(ledger::FILE).as_deref(), places),
        }
    }

    /// What is left of the drive at a place.
    pub(super) fn of(&self, place: &Place) -> Left {
        Left {
            identity: None,
            watchdog: self.watchdogs.of(place),
            run: self.runs.of(place),
            eeprom: self.eeproms.of(place),
        }
    }

    /// Whether a run command of this program may stand in the drive at a place.
    pub(super) fn runs(&self, place: &Place) -> bool {
        self.runs.of(place).is_some_and(|run| run.lease.is_some())
    }
}
