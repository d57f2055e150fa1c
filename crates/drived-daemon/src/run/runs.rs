//! The run commands of this program, kept before they are given: one that is killed stops nothing, and the next is to know again
//! which motors it has started.

use drive_fleet::{RunKept, RunRecord};
use tokio::{
    sync::mpsc::UnboundedReceiver,
    task::{JoinHandle, spawn_blocking},
};

use drived_config::records::Records;

/// The file of the state folder.
pub(super) const FILE: &str = "runs.json";
/// What is not so where they cannot be kept.
pub(super) const LOSS: &str = "the next run of this program takes no motor that turns for its own";

/// Keeps what is told until the fleet ends.
pub(super) fn follow(mut runs: Records<RunRecord>, mut told: UnboundedReceiver<RunKept>) -> JoinHandle<()> {
    tokio::spawn(async move {
        let mut all = Vec::new();
        // What has come meanwhile is written together.
        while told.recv_many(&mut all, usize::MAX).await > 0 {
            let mut changed = false;
            for RunKept { drive, run, .. } in &all {
                changed |= runs.set(drive, run.clone());
            }
            if changed {
                let written = spawn_blocking(move || {
                    if drive_fleet::mutant!("run-unkept", true, false) {
                        runs.write();
                    }
                    runs
                });
                // The runtime ends.
                let Ok(back) = written.await else { return };
                runs = back;
            }
            all.drain(..).for_each(RunKept::kept);
        }
    })
}
