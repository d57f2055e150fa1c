//! What of a drive is to be seen to after so many hours of running or so many starts: counted from what is kept, told as an alarm, and counted
//! anew once somebody says that it was done.

use std::{fmt, path::PathBuf, sync::Arc, time::Duration};

use drived_face::Plant;
use rusqlite::Connection;
use serde::Deserialize;
use tokio::{sync::Notify, time::timeout};

use crate::{
    clocks::Clocks,
    read::{Filter, History, Ran, bounds, ran, records},
    record::{Kind, Moment, Record},
    store::StoreError,
    write::inbox::Inbox,
};

/// How the record is called that something was done.
const DONE: &str = "maintained";
/// So often it is counted on: hours of running do not hurry.
const COUNTED_EVERY: Duration = Duration::from_secs(60);
/// For what was read until now to be written, where somebody waits for the count.
const WRITTEN_WITHIN: Duration = Duration::from_secs(5);
const HOUR_MS: i64 = 3_600_000;

/// Something of a drive that is to be seen to, and when.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Maintained {
    pub drive: String,
    /// What, in the owner's words.
    pub part: String,
    /// After so many hours of running,
    pub hours: Option<u32>,
    /// or so many starts.
    pub starts: Option<u32>,
}

/// What of which drive, and when.
impl fmt::Display for Maintained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} after {}", self.part, self.drive, after(self.hours, self.starts))
    }
}

/// Hours, starts, or both, in words.
fn after(hours: Option<u32>, starts: Option<u32>) -> String {
    let hours = hours.map(|hours| format!("{hours} h of running"));
    let starts = starts.map(|starts| format!("{starts} starts"));
    hours.into_iter().chain(starts).collect::<Vec<_>>().join(" or ")
}

/// That it was done.
#[derive(Debug, Deserialize)]
struct Done {
    part: String,
}

/// The record that something was done.
pub(crate) fn done(now: Moment, drive: &str, part: &str, by: &str, note: Option<&str>) -> Record {
    let said = note.map(|note| format!(": {note}")).unwrap_or_default();
    let body = serde_json::json!({ "part": part, "by": by, "note": note });
    Record {
        kind: Kind::Event,
        drive: Some(drive.to_owned()),
        body: Some(body.to_string()),
        ..Record::of_history(now, DONE, format!("maintenance done by {by}: {part}{said}"))
    }
}

/// The record that something is due: it happens at a moment, as everything else does.
fn became_due(now: Moment, drive: &str, part: &str, why: &str) -> Record {
    Record {
        kind: Kind::Event,
        drive: Some(drive.to_owned()),
        body: Some(serde_json::json!({ "part": part }).to_string()),
        ..Record::of_history(now, "maintenance_due", format!("maintenance is due: {why}"))
    }
}

/// What is due: of which drive, which part, and why.
type Due = (String, String, String);

/// Counts until it is dropped, and tells the plant what is due.
pub(crate) async fn count(
    path: PathBuf,
    maintained: Vec<Maintained>,
    plant: Plant,
    inbox: Inbox,
    done: Arc<Notify>,
    clocks: Clocks,
) {
    if maintained.is_empty() {
        return;
    }
    let mut counts: Vec<Count> = maintained.into_iter().map(Count::new).collect();
    // What was due at the beginning became so in another run, which has told it.
    let mut known: Option<Vec<Due>> = None;
    loop {
        let (path, writing, mut next) = (path.clone(), inbox.clone(), counts.clone());
        let counted = tokio::task::spawn_blocking(move || {
            writing.have_written(WRITTEN_WITHIN);
            let mut history = History::open(&path)?;
            // What becomes blocks meanwhile is counted once.
            let at_once = history.0.transaction()?;
            next.iter_mut().try_for_each(|count| count.go_on(&at_once))?;
            Ok::<_, StoreError>(next)
        });
        // A file that cannot be read now has an alarm of its own.
        if let Ok(Ok(counted)) = counted.await {
            counts = counted;
            tell(&plant, &counts);
            let due: Vec<Due> = counts.iter().filter_map(Count::due_of).collect();
            if let Some(known) = &known {
                due.iter().filter(|one| !known.contains(one)).for_each(|(drive, part, why)| {
                    inbox.record(became_due(clocks.now(), drive, part, why));
                });
            }
            known = Some(due);
        }
        let _ = timeout(COUNTED_EVERY, done.notified()).await;
    }
}

/// Tells what is due of each drive that has something to be seen to.
fn tell(plant: &Plant, counts: &[Count]) {
    for drive in plant.fleet().drives() {
        let mut own = counts.iter().filter(|count| *count.maintained.drive == **drive.name()).peekable();
        if own.peek().is_some() {
            let due: Vec<(String, String)> = own.filter_map(Count::due).collect();
            plant.tell_maintenance(drive.line().0.as_ref(), drive.name(), &due);
        }
    }
}

/// How far something is.
#[derive(Debug, Clone)]
struct Count {
    maintained: Maintained,
    /// The last record that was looked at for when it was done.
    seen: i64,
    /// Up to where it is counted.
    until: i64,
    running_ms: i64,
    starts: u64,
}

impl Count {
    const fn new(maintained: Maintained) -> Self {
        Self { maintained, seen: 0, until: i64::MIN, running_ms: 0, starts: 0 }
    }

    /// Counts what is kept since it was counted last, from when it was done last on.
    fn go_on(&mut self, connection: &Connection) -> Result<(), StoreError> {
        let (Some(first), Some(last)) = bounds(connection)? else { return Ok(()) };
        let newest = connection.query_row("SELECT max(id) FROM record", [], |row| row.get(0))?;
        if let Some(at) = last_done(connection, &self.maintained, self.seen)? {
            *self = Self { until: at, ..Self::new(self.maintained.clone()) };
        }
        self.seen = newest;
        let Ran { running_ms, starts, until } =
            ran(connection, &self.maintained.drive, self.until.max(first), last)?;
        self.running_ms += running_ms;
        self.starts += starts;
        // It is counted on from the moment of which something was known last.
        self.until = self.until.max(until.saturating_sub(1));
        Ok(())
    }

    /// The same with its drive.
    fn due_of(&self) -> Option<Due> {
        let (part, why) = self.due()?;
        Some((self.maintained.drive.clone(), part, why))
    }

    /// Its name and why, where it is due.
    fn due(&self) -> Option<(String, String)> {
        let Maintained { part, hours, starts, .. } = &self.maintained;
        let hours = hours.filter(|hours| self.running_ms >= i64::from(*hours) * HOUR_MS);
        let starts = starts.filter(|starts| self.starts >= u64::from(*starts));
        let is_due = hours.is_some() || starts.is_some();
        is_due.then(|| (part.clone(), format!("{part}, after {}", after(hours, starts))))
    }
}

/// When something was done last, of what is told behind a record.
fn last_done(connection: &Connection, of: &Maintained, after: i64) -> Result<Option<i64>, StoreError> {
    let filter = Filter {
        to_ms: i64::MAX,
        from_ms: i64::MIN,
        after,
        drive: Some(&of.drive),
        kind: Some(Kind::Event.name()),
        what: Some(DONE),
        limit: 1_000,
        before: Some(i64::MAX),
        line: None,
        only_alarms: false,
    };
    let done = records(connection, &filter)?.records;
    let is_of_part = |body: &str| serde_json::from_str::<Done>(body).is_ok_and(|done| done.part == of.part);
    let last = done.iter().find(|record| record.body.as_ref().is_some_and(|body| is_of_part(body.get())));
    Ok(last.map(|last| last.time_unix_ms))
}

#[cfg(test)]
mod tests {
    use drived_config::testing::Folder;

    use super::*;
    use crate::{
        quantity::{Quantity, Set},
        store,
        tracker::Tracker,
        write::{
            archive::Archive,
            inbox::{Batch, Shown},
            tidy,
        },
    };

    const MINUTE_MS: i64 = 60_000;

    #[test]
    fn hours_and_starts_are_counted_once_however_often_they_are_looked_at_and_from_when_it_was_done() {
        let folder = Folder::new("history-maintenance");
        let mut file = store::open(&folder.file("history.sqlite")).unwrap().store;
        let moment = |at: i64| Moment { steady_ms: at, wall_ms: 1_795_219_200_000 + at };
        let mut archive = Archive::begin(moment(0));
        archive.begin_run(&mut file.connection, "test").unwrap();
        let maintained = |part: &str, hours, starts| {
            Count::new(Maintained { drive: "pump".to_owned(), part: part.to_owned(), hours, starts })
        };
        let (mut bearings, mut contactor) =
            (maintained("bearings", Some(2), None), maintained("contactor", None, Some(3)));
        let mut tracker = Tracker::default();
        let mut due = Vec::new();
        // 40 minutes of each hour it runs, and for 10 minutes of each third nothing is known of it while it stands.
        for minute in 0..6 * 60 {
            let at = minute * MINUTE_MS;
            let state = if minute % 60 < 40 { 3 } else { 2 };
            if minute % 180 < 170
                && let Some(seen) = tracker.see(at, 2 * MINUTE_MS, &[(Quantity::STATE, state)])
            {
                let shown = vec![Shown { drive: "pump".into(), set: Set::Status, seen }];
                archive.take(Batch { shown, ..Batch::default() }, moment(at));
            }
            if minute == 200 {
                archive.record(done(moment(at), "pump", "bearings", "anna", Some("both of them")));
                archive.record(done(moment(at), "fan", "contactor", "anna", None));
                archive.write_records(&mut file.connection, moment(at)).unwrap();
            }
            if minute % 7 == 0 {
                archive.close(moment(at));
                archive.write_values(&mut file.connection).unwrap();
                while tidy::compact(&mut file.connection, moment(at).wall_ms).unwrap() {}
                for count in [&mut bearings, &mut contactor] {
                    count.go_on(&file.connection).unwrap();
                    due.extend(count.due().map(|(part, _)| (minute, part)));
                }
            }
        }
        let first = |of: &str, from: i64| {
            due.iter().find(|(minute, part)| part == of && *minute >= from).map(|(minute, _)| *minute)
        };
        // Two hours of running are over with minute 160; they are kept in steps of seven.
        assert_eq!(first("bearings", 0), Some(161), "{due:?}");
        assert_eq!(
            due.iter().filter(|(minute, part)| part == "bearings" && *minute < 203).count(),
            6,
            "{due:?}"
        );
        // From minute 200 on: 20 + 40 + 40 minutes until minute 340.
        assert_eq!(first("bearings", 203), None, "{due:?}");
        assert_eq!(bearings.running_ms, 100 * MINUTE_MS);
        // It was seen to begin at 60, 120, 240 and 300; behind what nobody saw, at 180, it may have begun before.
        assert_eq!(first("contactor", 0), Some(245), "{due:?}");
        assert_eq!(contactor.starts, 4);
    }
}
