//! What turns out later of a command whose outcome was not known.

use drive_core::{Control, Setpoint};
use drive_fleet::{DriveHandle, Snapshot};
use tokio::time::Instant;

use super::{Action, OutcomeWord};

/// Waits until the drive's own words settle it; `None` when they cannot, or the fleet has ended.
pub(super) async fn settled(action: Action, drive: &DriveHandle, ended: Instant) -> Option<OutcomeWord> {
    let (mut verdict, mut watch) = (None, drive.watch());
    watch
        .until(|snapshot| {
            verdict = verdict_of(action, snapshot, ended);
            verdict.is_some()
        })
        .await
        .ok()?;
    verdict
}

/// What a snapshot says of a command that ended without a known outcome.
fn verdict_of(action: Action, snapshot: &Snapshot, ended: Instant) -> Option<OutcomeWord> {
    let status = snapshot.fresh_status(Instant::now())?;
    let is_newer = snapshot.status.as_ref().is_some_and(|status| status.at > ended);
    if !is_newer {
        return None;
    }
    let stands = snapshot.stop.is_none() && status.is_undriven();
    let either = |is_so: bool| Some(if is_so { OutcomeWord::Confirmed } else { OutcomeWord::NotConfirmed });
    match action {
        Action::Stop(_) => stands.then_some(OutcomeWord::Confirmed),
        // The fleet takes such a start back, and repeats that until it is confirmed.
        Action::Start { .. } => stands.then_some(OutcomeWord::NotConfirmed),
        Action::Reset if status.is_explained() => either(!status.is_fault()),
        Action::Reset => None,
        Action::Release => status.control.and_then(|control| either(control != Control::Bus)),
        Action::Save | Action::Accept(_) => None,
        Action::Setpoint { setpoint, .. } => {
            let measured = snapshot.measurements.as_ref().filter(|measured| measured.at > ended)?;
            measured.value.reference.and_then(|reference: Setpoint| either(reference == setpoint))
        }
    }
}
