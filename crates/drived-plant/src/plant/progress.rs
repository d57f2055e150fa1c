//! Whether the drives of each line are asked, whether or not they answer and its port is there.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use drive_fleet::Fleet;
use tokio::time::Instant;

/// How long a line may stand, at the least.
const PATIENCE: Duration = Duration::from_secs(10);

/// What was counted on each line, and since when that is the same.
#[derive(Default)]
pub(super) struct Progress(Mutex<BTreeMap<Arc<str>, (u64, Instant)>>);

impl Progress {
    /// Looks at the lines; now and then is enough.
    pub(super) fn look(&self, fleet: &Fleet) {
        let now = Instant::now();
        let mut seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for (line, _) in fleet.lines() {
            let polls = fleet.drives_on(&line).iter().map(|drive| drive.snapshot().counters.polls).sum();
            let known = seen.entry(line).or_insert((polls, now));
            if known.0 != polls {
                *known = (polls, now);
            }
        }
    }

    /// The lines that stand.
    pub(super) fn standing(&self, fleet: &Fleet) -> Vec<String> {
        self.look(fleet);
        let seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_standing = |(line, (_, since)): &(&Arc<str>, &(u64, Instant))| {
            let drives = fleet.drives_on(line);
            let rest = drives.iter().map(|drive| drive.settings().periods.rest).min().unwrap_or_default();
            !drives.is_empty() && since.elapsed() > PATIENCE.max(rest * 3)
        };
        seen.iter().filter(is_standing).map(|(line, _)| line.to_string()).collect()
    }
}
