//! The end of the daemon: each drive's policy acts, it is said who is waited for, and what turns on is an alarm.

use std::{sync::Arc, time::Duration};

use drive_fleet::{ExitAction, Fleet, Snapshot};
use tokio::time::{Instant, MissedTickBehavior, interval_at};

use drived_words::{failure::Failure, signals::Ending};

/// From one word about who is waited for to the next.
const WORD: Duration = Duration::from_secs(2);

/// Ends the fleet within `limit`, or at once when the program is asked to end a second time: stops that are not confirmed
/// are given up then.
///
/// # Errors
/// [`Failure::Drive`] that names every motor that may turn although its policy does not leave it turning.
pub(super) async fn end(fleet: &Fleet, limit: Duration, ending: &mut Ending) -> Result<(), Failure> {
    let mut words = interval_at(Instant::now() + WORD, WORD);
    words.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let actions = {
        let mut shutdown = std::pin::pin!(fleet.shutdown(limit));
        loop {
            tokio::select! {
                actions = &mut shutdown => break Some(actions),
                () = ending.asked() => break None,
                _ = words.tick() => tell_whom_it_waits_for(fleet),
            }
        }
    };
    let actions = match actions {
        Some(actions) => actions,
        None => {
            tracing::warn!("asked to end a second time: stops that are not confirmed are given up");
            fleet.shutdown(Duration::ZERO).await
        }
    };
    verdict(&actions)
}

fn verdict(actions: &[(Arc<str>, ExitAction)]) -> Result<(), Failure> {
    let alarms = actions.iter().filter(|(_, action)| action.is_alarm());
    let alarms: Vec<String> = alarms.map(|(name, action)| format!("{name}: {action}")).collect();
    match alarms.is_empty() {
        true => Ok(()),
        false => Err(Failure::Drive(format!("THE MOTOR MAY TURN: {}", alarms.join("; ")))),
    }
}

fn tell_whom_it_waits_for(fleet: &Fleet) {
    let now = Instant::now();
    let waited: Vec<String> =
        fleet.drives().iter().filter_map(|drive| waits_for(&drive.snapshot(), now)).collect();
    if !waited.is_empty() {
        tracing::warn!("the exit waits for {}; asked to end again it gives them up", waited.join(", "));
    }
}

/// A drive whose stop is not confirmed, and what is known of it.
fn waits_for(snapshot: &Snapshot, now: Instant) -> Option<String> {
    let stop = snapshot.stop?;
    let shown = match (snapshot.fresh_status(now), &snapshot.error) {
        (Some(status), _) => {
            status.output_frequency.map_or_else(|| status.state.to_string(), |at| at.to_string())
        }
        (None, Some(error)) => error.to_string(),
        (None, None) => "no status".to_owned(),
    };
    let told = if stop.taken { "on its way down" } else { "not confirmed" };
    Some(format!("{} ({shown}, stop {}, {told})", snapshot.name, stop.sent()))
}
