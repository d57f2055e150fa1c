//! What the log says of the plant: the one place that tells what happens to lines and drives.
//!
//! It is read by somebody who was called in the night. One line tells a loss and one a return; what has one cause is told
//! together; what happens again and again is counted. The libraries below tell the same at the level `debug`, each in its
//! own words, for whoever looks for a fault in them.

mod noise;
mod repeats;
mod teller;
mod words;

#[cfg(test)]
mod tests;

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_bus::Line;
use drive_fleet::{DriveHandle, Events, Fleet, Received};
use tokio::time::{Instant, MissedTickBehavior, interval};
use tracing::Level;

use self::teller::{LineLook, Teller};

/// Between two looks at the ports, and at what has been held back to be told together.
const LOOK: Duration = Duration::from_millis(250);

/// A line of the plant and its drives.
struct Place {
    name: Arc<str>,
    line: Line,
    drives: Vec<DriveHandle>,
}

impl Place {
    /// All lines of a fleet.
    fn all(fleet: &Fleet) -> Vec<Self> {
        let lines = fleet.lines().into_iter();
        lines.map(|(name, line)| Self { line, drives: fleet.drives_on(&name), name }).collect()
    }
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    pub level: Level,
    pub text: String,
}

/// Tells until the fleet has ended. Safe to drop: what was held back is not told then.
pub async fn keep(fleet: Fleet, mut events: Events, mut tell: impl FnMut(Entry)) {
    let mut teller = Teller::new(Instant::now());
    let mut places = Vec::new();
    // Those that a reload has taken out are told of to their end.
    let mut drives = BTreeMap::new();
    look(&fleet, &mut teller, &mut places, &mut drives);
    let mut looks = interval(LOOK);
    looks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        tokio::select! {
            biased;
            received = events.recv() => match received {
                Received::Event(event) => {
                    if !drives.contains_key(&event.drive) {
                        look(&fleet, &mut teller, &mut places, &mut drives);
                    }
                    if let Some(drive) = drives.get(&event.drive) {
                        teller.handle_event(Instant::now(), &event, &drive.snapshot());
                    }
                }
                Received::Missed(events) => teller.handle_missed(events),
                Received::End => {
                    teller.handle_end(Instant::now());
                    while let Some(entry) = teller.poll_entry() {
                        tell(entry);
                    }
                    return;
                }
            },
            _ = looks.tick() => {
                look(&fleet, &mut teller, &mut places, &mut drives);
                let now = Instant::now();
                for place in &places {
                    teller.handle_look(now, &place.name, LineLook::at(place));
                }
                teller.handle_time(now);
            }
        }
        while let Some(entry) = teller.poll_entry() {
            tell(entry);
        }
    }
}

/// Who belongs to the fleet now.
fn look(
    fleet: &Fleet,
    teller: &mut Teller,
    places: &mut Vec<Place>,
    drives: &mut BTreeMap<Arc<str>, DriveHandle>,
) {
    *places = Place::all(fleet);
    for place in &*places {
        drives.extend(place.drives.iter().map(|drive| (Arc::clone(drive.name()), drive.clone())));
        let on_line = place.drives.iter().map(|drive| (Arc::clone(drive.name()), drive.slave().number()));
        teller.handle_members(Instant::now(), &place.name, on_line.collect());
    }
}

/// Writes an entry to the log.
pub fn log(Entry { level, text }: Entry) {
    match level {
        Level::ERROR => tracing::error!("{text}"),
        Level::WARN => tracing::warn!("{text}"),
        _ => tracing::info!("{text}"),
    }
}
