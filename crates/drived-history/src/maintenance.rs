//! What of a drive is to be seen to after so many hours of running or so many starts: counted from what is kept, told as an alarm, and counted
//! anew once somebody says that it was done.

use std::{fmt, path::PathBuf, sync::Arc, time::Duration};

use drive_fleet::alarms::{Alarm, AlarmKind};
use drived_face::Plant;
use drived_plant::plant::past::RecordView;
use rusqlite::Connection;
use serde::Deserialize;
use tokio::{sync::Notify, time::timeout};

use crate::{
    clocks::Clocks,
    doubt::ask,
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

/// How the event is called by which a drive is called otherwise,
const RENAMED: &str = "renamed";
/// and so many names of one it is followed through.
const NAMES: usize = 64;

/// What it was called before.
#[derive(Debug, Deserialize)]
struct Renamed {
    was: String,
}

/// A name of a drive, and from when to when it was its name: by the wall's clock, and by the records between which it was.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Called {
    name: String,
    from_ms: i64,
    to_ms: i64,
    after: i64,
    before: i64,
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
        let (path, writing, before) = (path.clone(), inbox.clone(), counts.clone());
        let counted = tokio::task::spawn_blocking(move || {
            writing.have_written(WRITTEN_WITHIN);
            ask(&writing, || {
                let (mut history, mut next) = (History::open(&path)?, before.clone());
                // What becomes blocks meanwhile is counted once.
                let at_once = history.0.transaction()?;
                next.iter_mut().try_for_each(|count| count.go_on(&at_once))?;
                Ok::<_, StoreError>(next)
            })
        });
        // A file that cannot be read now has an alarm of its own, or is put aside with one.
        if let Ok(Ok(counted)) = counted.await {
            counts = counted;
            let due = tell(&plant, &counts);
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

/// Tells what is due of each drive that has something to be seen to, and gives all of it.
fn tell(plant: &Plant, counts: &[Count]) -> Vec<Due> {
    let alarms: Vec<Alarm> = plant.alarms().alarms.into_iter().map(|view| view.alarm).collect();
    let due_of = |count: &Count| {
        let (part, why) = count.due().or_else(|| count.stands(&alarms))?;
        Some((count.maintained.drive.clone(), part, why))
    };
    let all: Vec<Due> = counts.iter().filter_map(due_of).collect();
    for drive in plant.fleet().drives() {
        if counts.iter().any(|count| *count.maintained.drive == **drive.name()) {
            let own = all.iter().filter(|(of, ..)| **of == **drive.name());
            let own: Vec<(String, String)> = own.map(|(_, part, why)| (part.clone(), why.clone())).collect();
            plant.tell_maintenance(drive.line().0.as_ref(), drive.name(), &own);
        }
    }
    all
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
    /// When it was done last, as far as the file tells,
    done: Option<i64>,
    /// and whether that was said since it was counted before.
    is_just_done: bool,
}

impl Count {
    const fn new(maintained: Maintained) -> Self {
        Self {
            maintained,
            seen: 0,
            until: i64::MIN,
            running_ms: 0,
            starts: 0,
            done: None,
            is_just_done: false,
        }
    }

    /// Counts what is kept since it was counted last, from when it was done last on.
    fn go_on(&mut self, connection: &Connection) -> Result<(), StoreError> {
        let (Some(first), Some(last)) = bounds(connection)? else { return Ok(()) };
        let newest = connection.query_row("SELECT max(id) FROM record", [], |row| row.get(0))?;
        // Records that are fewer than they were are those of a file that was begun anew.
        let mut seen = if newest < self.seen { 0 } else { self.seen };
        let mut called = called(connection, &self.maintained.drive, seen)?;
        if seen > 0 && called.len() > 1 {
            // It has this name since it was counted last: what it did before belongs to it, and what another of this name did does not.
            *self = Self::new(self.maintained.clone());
            (seen, called) = (0, self::called(connection, &self.maintained.drive, 0)?);
        }
        let done = last_done(connection, &self.maintained.part, &called, seen)?;
        let is_just_done = done.is_some() && self.seen > 0;
        if let Some(at) = done {
            *self = Self { until: at, done, ..Self::new(self.maintained.clone()) };
        }
        (self.seen, self.is_just_done) = (newest, is_just_done);
        for Called { name, from_ms, to_ms, .. } in called.iter().rev() {
            let (from, to) = (self.until.max(first).max(*from_ms), last.min(*to_ms));
            if from > to {
                continue;
            }
            let Ran { running_ms, starts, until } = ran(connection, name, from, to)?;
            self.running_ms += running_ms;
            self.starts += starts;
            // It is counted on from the moment of which something was known last.
            self.until = self.until.max(until.saturating_sub(1));
        }
        Ok(())
    }

    /// Its name and why, where it is due.
    fn due(&self) -> Option<(String, String)> {
        let Maintained { part, hours, starts, .. } = &self.maintained;
        let hours = hours.filter(|hours| self.running_ms >= i64::from(*hours) * HOUR_MS);
        let starts = starts.filter(|starts| self.starts >= u64::from(*starts));
        let is_due = hours.is_some() || starts.is_some();
        is_due.then(|| (part.clone(), why(part, hours, starts)))
    }

    /// Its name and why, where an alarm of it stands that nobody has answered by saying that it was done. What that was counted from may be
    /// kept no more, as behind a file that was put aside: that is no maintenance. One of other hours or starts than are asked for now says
    /// nothing of these.
    fn stands(&self, alarms: &[Alarm]) -> Option<(String, String)> {
        let Maintained { drive, part, hours, starts } = &self.maintained;
        let is_asked_for = |said: &str| {
            [(*hours, None), (None, *starts), (*hours, *starts)].into_iter().any(|(hours, starts)| {
                (hours.is_some() || starts.is_some()) && said == why(part, hours, starts)
            })
        };
        let is_done_since = |alarm: &Alarm| {
            let came = i64::try_from(alarm.last_unix_ms).unwrap_or(i64::MAX);
            self.is_just_done || self.done.is_some_and(|done| done >= came)
        };
        let is_it = |alarm: &&Alarm| {
            alarm.kind == AlarmKind::Maintenance
                && alarm.is_active()
                && alarm.drive.as_ref() == Some(drive)
                && alarm.mark.as_ref() == Some(part)
                && !is_done_since(alarm)
        };
        let said = alarms.iter().find(is_it)?.detail.clone()?;
        is_asked_for(&said).then(|| (part.clone(), said))
    }
}

/// That a part is due, and after what.
fn why(part: &str, hours: Option<u32>, starts: Option<u32>) -> String {
    format!("{part}, after {}", after(hours, starts))
}

/// What a drive is called and was called, as far as it is told behind a record: the newest name first.
fn called(connection: &Connection, drive: &str, after: i64) -> Result<Vec<Called>, StoreError> {
    let mut all =
        vec![Called { name: drive.to_owned(), from_ms: i64::MIN, to_ms: i64::MAX, after, before: i64::MAX }];
    while all.len() < NAMES
        && let Some(now) = all.last_mut()
    {
        let found = told(connection, now, RENAMED, 1)?;
        let was = |body: &str| serde_json::from_str::<Renamed>(body).ok();
        let Some((renamed, Renamed { was })) = found.into_iter().next().and_then(|renamed| {
            let was = was(renamed.body.as_ref()?.get())?;
            Some((renamed, was))
        }) else {
            break;
        };
        let (at, number) = (renamed.time_unix_ms, renamed.number);
        (now.from_ms, now.after) = (at, number);
        all.push(Called { name: was, from_ms: i64::MIN, to_ms: at, after, before: number });
    }
    Ok(all)
}

/// When something was done last, by whichever name of its drive, of what is told behind a record.
fn last_done(
    connection: &Connection,
    part: &str,
    called: &[Called],
    after: i64,
) -> Result<Option<i64>, StoreError> {
    let is_of_part = |body: &str| serde_json::from_str::<Done>(body).is_ok_and(|done| done.part == part);
    for called in called {
        let called = Called { after: called.after.max(after), ..called.clone() };
        let done = told(connection, &called, DONE, 1_000)?;
        let last = done.iter().find(|record| record.body.as_ref().is_some_and(|body| is_of_part(body.get())));
        if let Some(last) = last {
            return Ok(Some(last.time_unix_ms));
        }
    }
    Ok(None)
}

/// Events of one word of a drive, while it was called so: the newest first.
fn told(
    connection: &Connection,
    of: &Called,
    what: &str,
    limit: usize,
) -> Result<Vec<RecordView>, StoreError> {
    let filter = Filter {
        to_ms: i64::MAX,
        from_ms: i64::MIN,
        after: of.after,
        drive: Some(&of.name),
        kind: Some(Kind::Event.name()),
        what: Some(what),
        limit,
        before: Some(of.before),
        line: None,
        only_alarms: false,
    };
    Ok(records(connection, &filter)?.records)
}

#[cfg(test)]
mod tests {
    use drive_fleet::alarms::AlarmState;
    use drived_config::testing::Folder;
    use drived_plant::plant::testing::TestPlant;

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

    #[tokio::test(start_paused = true)]
    async fn an_alarm_that_stands_stands_also_behind_a_file_that_was_put_aside() {
        let test = TestPlant::of(1).await;
        let stands = || {
            let alarms = test.plant.alarms().alarms;
            alarms.into_iter().map(|view| (view.state, view.alarm.last_unix_ms)).next().unwrap()
        };
        let bearings = |hours| {
            let (drive, part) = ("pump 1".to_owned(), "bearings".to_owned());
            Count::new(Maintained { drive, part, hours: Some(hours), starts: None })
        };
        let due = [("bearings".to_owned(), "bearings, after 2 h of running".to_owned())];
        test.plant.tell_maintenance("north", "pump 1", &due);
        let came = i64::try_from(stands().1).unwrap();
        // A run that finds a file in which nothing is.
        let folder = Folder::new("history-maintenance-aside");
        let mut file = store::open(&folder.file("history.sqlite")).unwrap().store;
        let moment = |after: i64| Moment { steady_ms: after, wall_ms: came + after };
        let mut archive = Archive::begin(moment(10));
        archive.begin_run(&mut file.connection, "test").unwrap();
        let mut count = bearings(2);
        count.go_on(&file.connection).unwrap();
        let told = tell(&test.plant, std::slice::from_ref(&count));
        assert_eq!(stands().0, AlarmState::Unacknowledged);
        assert_eq!(told, [("pump 1".to_owned(), due[0].0.clone(), due[0].1.clone())], "it is no news later");
        // By whatever the wall's clock is now.
        archive.record(done(moment(-3_600_000), "pump 1", "bearings", "anna", None));
        archive.write_records(&mut file.connection, moment(1_000)).unwrap();
        count.go_on(&file.connection).unwrap();
        tell(&test.plant, std::slice::from_ref(&count));
        assert_eq!(stands().0, AlarmState::Returned);
        // Who asks for more hours than those by which it came asks for another thing.
        test.plant.tell_maintenance("north", "pump 1", &due);
        tell(&test.plant, &[bearings(2)]);
        assert_eq!(stands().0, AlarmState::Unacknowledged);
        tell(&test.plant, &[bearings(9)]);
        assert_eq!(stands().0, AlarmState::Returned);
    }

    #[test]
    fn a_drive_that_is_called_otherwise_keeps_its_hours_and_starts_and_takes_none_of_another() {
        let folder = Folder::new("history-maintenance-renamed");
        let mut file = store::open(&folder.file("history.sqlite")).unwrap().store;
        let moment = |at: i64| Moment { steady_ms: at, wall_ms: 1_795_219_200_000 + at };
        let mut archive = Archive::begin(moment(0));
        archive.begin_run(&mut file.connection, "test").unwrap();
        let count = |drive: &str| {
            let (drive, part) = (drive.to_owned(), "belt".to_owned());
            Count::new(Maintained { drive, part, hours: None, starts: Some(6) })
        };
        let mut trackers = [Tracker::default(), Tracker::default()];
        let (mut fan, mut other) = (count("fan"), count("pump"));
        // For two hours a fan runs under the name of pump, while another one has its name; then each has another.
        for minute in 0..240 {
            let (at, is_renamed) = (minute * MINUTE_MS, minute >= 120);
            let names = if is_renamed { ["fan", "mill"] } else { ["pump", "fan"] };
            let runs = [minute % 60 >= 30, minute % 10 >= 5];
            for ((name, runs), tracker) in names.into_iter().zip(runs).zip(&mut trackers) {
                let state = if runs { 3 } else { 2 };
                let seen = tracker.see(at, 2 * MINUTE_MS, &[(Quantity::STATE, state)]);
                let shown = seen.map(|seen| Shown { drive: name.into(), set: Set::Status, seen });
                archive.take(Batch { shown: shown.into_iter().collect(), ..Batch::default() }, moment(at));
            }
            if minute == 120 {
                trackers = [Tracker::default(), Tracker::default()];
                for (was, name) in [("fan", "mill"), ("pump", "fan")] {
                    archive.record(Record {
                        kind: Kind::Event,
                        drive: Some(name.to_owned()),
                        body: Some(serde_json::json!({ "was": was }).to_string()),
                        ..Record::of_history(moment(at), RENAMED, "called otherwise")
                    });
                }
                archive.write_records(&mut file.connection, moment(at)).unwrap();
            }
            if minute % 7 == 0 {
                archive.close(moment(at));
                archive.write_values(&mut file.connection).unwrap();
                // The one that counts before it is told of the new name counts anew then.
                fan.go_on(&file.connection).unwrap();
            }
        }
        archive.end_run(&mut file.connection, moment(240 * MINUTE_MS)).unwrap();
        fan.go_on(&file.connection).unwrap();
        let mut anew = count("fan");
        anew.go_on(&file.connection).unwrap();
        assert_eq!((fan.starts, anew.starts), (4, 4));
        assert!((anew.running_ms - 120 * MINUTE_MS).abs() <= 2 * MINUTE_MS, "{}", anew.running_ms);
        let mut mill = count("mill");
        mill.go_on(&file.connection).unwrap();
        assert!((20..=24).contains(&mill.starts), "{}", mill.starts);
        other.go_on(&file.connection).unwrap();
        assert_eq!(other.starts, 2, "of a name that nobody has now it is what was told under it");
    }

    #[test]
    fn what_was_done_is_found_also_in_a_file_that_was_begun_while_it_was_counted() {
        let folder = Folder::new("history-maintenance-anew");
        let moment = |at: i64| Moment { steady_ms: at, wall_ms: 1_795_219_200_000 + at };
        let begun = |name: &str| {
            let mut file = store::open(&folder.file(name)).unwrap().store;
            let mut archive = Archive::begin(moment(0));
            archive.begin_run(&mut file.connection, "test").unwrap();
            (file, archive)
        };
        let (mut first, mut archive) = begun("first.sqlite");
        (0..9).for_each(|at| archive.record(done(moment(at), "fan", "belt", "anna", None)));
        archive.write_records(&mut first.connection, moment(9)).unwrap();
        let (drive, part) = ("pump".to_owned(), "belt".to_owned());
        let mut count = Count::new(Maintained { drive, part, hours: Some(1), starts: None });
        count.go_on(&first.connection).unwrap();
        let (mut second, mut archive) = begun("second.sqlite");
        archive.record(done(moment(20), "pump", "belt", "anna", None));
        archive.write_records(&mut second.connection, moment(20)).unwrap();
        count.go_on(&second.connection).unwrap();
        assert_eq!((count.done, count.is_just_done), (Some(moment(20).wall_ms), true));
    }

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
