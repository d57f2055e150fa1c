//! What is told of lines: their ports come and go, and what is heard on them.

use std::{sync::Arc, time::Duration};

use drive_bus::stats::Stats;
use drive_fleet::{DriveHandle, Snapshot};
use tokio::time::Instant;
use tracing::Level;

use super::Teller;
use crate::journal::{
    Entry, Place,
    words::{Span, left, listed},
};

/// A port that is opened for the first time has this long before it is an alarm.
const FIRST_OPENING: Duration = Duration::from_secs(1);

/// A line as it is now.
pub(in crate::journal) struct LineLook {
    pub(in crate::journal) is_open: bool,
    pub(in crate::journal) stats: Stats,
    /// Its drives as they are, or were when they were last heard.
    pub(in crate::journal) drives: Vec<Arc<Snapshot>>,
}

impl LineLook {
    pub(in crate::journal) fn at(place: &Place) -> Self {
        let stats = place.line.stats();
        let drives = place.drives.iter().map(DriveHandle::snapshot).collect();
        Self { is_open: stats.opened > stats.lost, stats, drives }
    }
}

impl Teller {
    /// How a line is now.
    pub(in crate::journal) fn handle_look(&mut self, now: Instant, line: &str, look: LineLook) {
        let LineLook { is_open, stats, drives } = look;
        let Some(index) = self.index_of(line) else { return };
        let Some(line) = self.lines.get_mut(index) else { return };
        match (is_open, line.away) {
            (true, Some((since, true))) => {
                line.away = None;
                let after = Span(now.saturating_duration_since(since)).to_string();
                let text = match stats.opened {
                    1 => format!("line {} is open after {after}", line.name),
                    _ => format!("line {} back after {after}", line.name),
                };
                self.note(now, format!("{index} back"), Level::INFO, text);
            }
            (true, _) => line.away = None,
            (false, None) => line.away = Some((now, false)),
            (false, Some((since, false))) => {
                let first = stats.opened == 0;
                if first && now.saturating_duration_since(self.began) < FIRST_OPENING {
                    return;
                }
                line.away = Some((since, true));
                let why = stats.away.as_deref().unwrap_or("its port is gone");
                let text = match first {
                    true => format!("line {} cannot be opened, and is tried again: {why}", line.name),
                    false => format!("line {} lost: {why}; {}", line.name, with_it(&drives)),
                };
                self.note(now, format!("{index} lost"), Level::ERROR, text);
            }
            (false, Some((_, true))) => {}
        }
        self.listen(now, index, &stats);
    }

    fn listen(&mut self, now: Instant, index: usize, stats: &Stats) {
        let Some(line) = self.lines.get_mut(index).filter(|line| line.noise.is_due(now)) else { return };
        let minute_ago = now.checked_sub(Duration::from_secs(60)).unwrap_or(now);
        let drive =
            |slave: u8| line.drives.iter().find(|(_, address)| *address == slave).map(|(drive, _)| drive);
        let was_away = |slave| {
            let state = drive(slave).and_then(|drive| self.drives.get(drive));
            state.is_none_or(|state| {
                !state.seen || state.lost.is_some() || state.changed_at.is_some_and(|at| at >= minute_ago)
            })
        };
        let name = |slave| drive(slave).map_or_else(|| format!("address {slave}"), ToString::to_string);
        if let Some(text) = line.noise.minute(now, stats, was_away, name) {
            let text = format!("line {}: {text}", line.name);
            self.entries.push_back(Entry { level: Level::WARN, text });
        }
    }
}

/// What the drives of a line did when it was lost.
fn with_it(drives: &[Arc<Snapshot>]) -> String {
    let said = drives.iter().map(|drive| {
        let status = drive.status.as_ref().map(|status| left(&status.value));
        (Arc::clone(&drive.name), status.unwrap_or_else(|| "never heard".to_owned()))
    });
    format!("with it {}", listed(&said.collect::<Vec<_>>(), drives.len()))
}
