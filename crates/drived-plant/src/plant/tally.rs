//! How many commands ended how, and how long stops took: what is added up over many hosts.

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use super::{
    commands::{ActionWord, OutcomeWord},
    views::CommandView,
};

/// The bounds by which the time of stops is counted: from one answer to a long ramp.
pub const STOP_BOUNDS: [Duration; 8] = {
    const MILLISECONDS: [u64; 8] = [50, 100, 250, 500, 1_000, 2_500, 5_000, 10_000];
    let mut bounds = [Duration::ZERO; 8];
    let mut at = 0;
    while at < bounds.len() {
        bounds[at] = Duration::from_millis(MILLISECONDS[at]);
        at += 1;
    }
    bounds
};

/// Counts since the start of the plant.
#[derive(Default)]
pub struct Tally(Mutex<Counts>);

/// What was counted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Counts {
    pub commands: BTreeMap<Ended, u64>,
    /// Confirmed stops, by the first bound that their time does not exceed, and those that took longer.
    stops: [u64; STOP_BOUNDS.len() + 1],
    /// The time of them all.
    pub stopping: Duration,
}

/// A command to one drive, as it is counted.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ended {
    /// The id of the drive, which it keeps whatever it is called.
    pub drive: String,
    pub action: ActionWord,
    pub outcome: OutcomeWord,
    /// The face that it came by: the first word of its origin.
    pub face: String,
}

impl Tally {
    /// Counts a command that has ended to the drive of this id.
    pub(super) fn count(&self, drive: String, command: &CommandView) {
        let face = command.origin.split(' ').next().unwrap_or_default().to_owned();
        let action = command.action;
        let mut counts = self.lock();
        *counts.commands.entry(Ended { drive, action, outcome: command.outcome, face }).or_default() += 1;
        if action == ActionWord::Stop && command.outcome == OutcomeWord::Confirmed {
            let took = Duration::from_millis(command.took_ms.unwrap_or_default());
            let at = STOP_BOUNDS.partition_point(|bound| *bound < took);
            if let Some(count) = counts.stops.get_mut(at) {
                *count += 1;
            }
            counts.stopping += took;
        }
    }

    pub fn counts(&self) -> Counts {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Counts {
    /// How many confirmed stops did not take longer than each of the bounds, and at last how many there were.
    pub fn stops_up_to(&self) -> impl Iterator<Item = u64> + '_ {
        self.stops.iter().scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        })
    }
}
