//! The run commands of this program, kept before they are given: one that is killed stops nothing, and the next is to know again
//! which motors it has started.

use drive_fleet::{Event, EventKind, RunKept, RunRecord};
use tokio::{
    sync::mpsc::UnboundedReceiver,
    task::{JoinHandle, spawn_blocking},
};

use drived_config::records::Records;

/// The file of the state folder.
pub(super) const FILE: &str = "runs.json";

/// Keeps what is told until the fleet ends.
pub(super) fn follow(runs: Records<RunRecord>, mut told: UnboundedReceiver<RunKept>) -> JoinHandle<()> {
    tokio::spawn(async move {
        let mut all = Vec::new();
        // What has come meanwhile is written together.
        while told.recv_many(&mut all, usize::MAX).await > 0 {
            let mut changed = false;
            for RunKept { drive, place, run, .. } in &all {
                changed |= runs.set(place, drive, run.clone());
            }
            if changed {
                let runs = runs.clone();
                let written = spawn_blocking(move || {
                    if drive_fleet::mutant!("run-unkept", true, false) {
                        runs.write();
                    }
                });
                // The runtime ends.
                let Ok(()) = written.await else { return };
            }
            all.drain(..).for_each(RunKept::kept);
        }
    })
}

/// A run that is adopted is nowhere else. Gives whether the file is another for it.
pub(super) fn note(runs: &Records<RunRecord>, event: &Event) -> bool {
    matches!(event.kind, EventKind::RunAdopted(_)) && runs.settle(&event.place, &event.drive)
}
