//! A stop that somebody undoes while it goes on: it is sent again, and whoever asked for it has to know.

use std::pin::pin;

use drive_fleet::{DriveHandle, Outcome, PendingStop, StopTicket};

/// What is told of it, beside what became of the stop.
pub(super) const UNDONE: &str =
    "a run command of somebody else, or one kept back on its way, came behind it, and it was sent again";

/// Waits for what becomes of a stop, and tells each run command that is seen to come behind it.
pub(super) async fn finished(stop: &StopTicket, drive: &DriveHandle, mut undone: impl FnMut()) -> Outcome {
    let (mut watch, mut finished, mut before) = (drive.watch(), pin!(stop.finished()), None);
    loop {
        tokio::select! {
            biased;
            outcome = &mut finished => return outcome,
            Ok(()) = watch.changed() => {
                let seen = watch.look();
                let Some(now) = seen.stop else { continue };
                let times = before.replace(now).map_or(0, |before: PendingStop| now.undone_since(&before));
                (0..times).for_each(|_| undone());
            }
        }
    }
}
