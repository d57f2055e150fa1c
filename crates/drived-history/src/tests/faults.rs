//! What goes wrong with a file, and what is lost then, counted.

use std::{fs, os::unix::fs::PermissionsExt as _, time::Duration};

use drived_config::testing::Folder;
use drived_plant::plant::past::{
    CurvesAsked, GivenUp, ParameterRead, Past, PastError, RecordView, RecordsAsked, ValuesAsked,
};
use rusqlite::Connection;
use tokio::sync::watch;

use super::{BEGIN_MS, Pump, event, moment};
use crate::{
    clocks::Clocks,
    past::InFile,
    quantity::{Quantity, Set},
    read::{self, Filter, History, records},
    record::{Moment, Setting},
    store::{self, StoreError, schema},
    tracker::Tracker,
    write::{
        Limits,
        age::{self, Lived},
        archive::{Archive, End},
        inbox::{Batch, Inbox, Lost, Shown},
        tidy,
        writer::{Health, Writer},
    },
};

const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;

fn all(connection: &Connection) -> Vec<RecordView> {
    let filter = Filter { from_ms: 0, to_ms: i64::MAX, limit: 1_000_000, ..Filter::default() };
    records(connection, &filter).unwrap().records
}

fn words(connection: &Connection) -> Vec<String> {
    all(connection).into_iter().map(|found| found.what).collect()
}

#[test]
fn a_newer_file_and_one_of_another_program_are_left_as_they_are() {
    let folder = Folder::new("history-newer");
    for (name, application, version) in
        [("newer", schema::APPLICATION, schema::version() + 1), ("foreign", 0, 1)]
    {
        let path = folder.file(name);
        let other = Connection::open(&path).unwrap();
        other.execute_batch("CREATE TABLE theirs (a)").unwrap();
        other.pragma_update(None, "application_id", application).unwrap();
        other.pragma_update(None, "user_version", version).unwrap();
        drop(other);
        let before = fs::read(&path).unwrap();
        let refused = store::open(&path).unwrap_err();
        assert!(refused.is_lasting() && !refused.is_damage(), "{refused}");
        assert!(History::open(&path).is_err());
        assert_eq!(fs::read(&path).unwrap(), before);
    }
}

#[test]
fn a_second_daemon_is_refused_and_a_reader_is_not() {
    let folder = Folder::new("history-two");
    let path = folder.file("history.sqlite");
    let first = store::open(&path).unwrap();
    assert!(matches!(store::open(&path), Err(StoreError::InUse(_))));
    assert!(History::open(&path).is_ok());
    drop(first);
    assert!(store::open(&path).is_ok());
}

#[test]
fn a_damaged_file_is_put_aside_with_all_that_belongs_to_it() {
    let folder = Folder::new("history-damaged");
    let path = folder.file("history.sqlite");
    fs::write(&path, vec![0x5A; 20_000]).unwrap();
    let opened = store::open(&path).unwrap();
    let (aside, _) = opened.aside.unwrap();
    assert_eq!(fs::read(aside).unwrap(), vec![0x5A; 20_000]);
    assert!(all(&opened.store.connection).is_empty());
}

#[test]
fn a_run_that_was_killed_is_told_by_the_next_and_one_that_ended_is_not() {
    let folder = Folder::new("history-killed");
    let path = folder.file("history.sqlite");
    for (is_ended, expected) in [(true, "began"), (false, "began"), (true, "began_after_kill")] {
        let mut store = store::open(&path).unwrap().store;
        let mut archive = Archive::begin(moment(0));
        archive.begin_run(&mut store.connection, "test").unwrap();
        let known: Vec<String> = words(&store.connection);
        assert_eq!(known.last().map(String::as_str), Some(expected), "{known:?}");
        archive.record(event(moment(5), "pump", "tripped"));
        archive.write_records(&mut store.connection, moment(6)).unwrap();
        if is_ended {
            archive.end_run(&mut store.connection, moment(10)).unwrap();
        }
    }
}

#[test]
fn a_history_that_a_reload_opens_anew_is_no_end_of_the_daemon() {
    let folder = Folder::new("history-anew");
    let path = folder.file("history.sqlite");
    let run = |is_anew: bool, end: Option<End>| {
        let mut store = store::open(&path).unwrap().store;
        let mut archive = Archive::begin(moment(0));
        archive.is_anew = is_anew;
        archive.begin_run(&mut store.connection, "test").unwrap();
        if let Some(end) = end {
            archive.end_run_by(end, &mut store.connection, moment(10)).unwrap();
        }
    };
    run(false, Some(End::Closed));
    run(true, Some(End::Closed));
    // The program ended, or was killed, while no history was kept: nobody knows which.
    run(false, None);
    run(true, Some(End::Ended));
    let told = all(&store::open(&path).unwrap().store.connection);
    let told: Vec<(&str, &str)> = told.iter().map(|found| (&*found.what, &*found.text)).collect();
    let closed = ("history_closed", "the history was closed by a reload; the daemon goes on");
    let opened = ("history_opened", "the history was opened anew by a reload; the daemon goes on");
    let silent =
        (opened.0, "the history was opened anew by a reload; the run before ended in it without a word");
    let first = ("began", "the history begins: nothing is known of before");
    let began = ("began", "the daemon began; a reload had closed the history before");
    let ended = ("ended", "the daemon ended as it should");
    assert_eq!(told, [first, closed, opened, closed, began, silent, ended]);
}

#[test]
fn a_full_disk_loses_nothing_for_as_long_as_there_is_room_in_memory_and_counts_what_it_loses_then() {
    let folder = Folder::new("history-full");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    // No page more than there is: what a full disk answers.
    let pages: i64 = store.connection.pragma_query_value(None, "page_count", |row| row.get(0)).unwrap();
    let set = |connection: &Connection, pages: i64| {
        let _: i64 =
            connection.pragma_update_and_check(None, "max_page_count", pages, |row| row.get(0)).unwrap();
    };
    set(&store.connection, pages);
    let (mut steady, mut failed, mut readings) = (0, 0, 0);
    while steady < 24 * 3_600_000 {
        steady += 250;
        // Every reading leaves the deadband.
        pump.read(&mut archive, moment(steady), &[(HZ, if steady % 500 == 0 { 0 } else { 5_000 })]);
        readings += 1;
        if steady % 600_000 == 0 {
            archive.record(event(moment(steady), "pump", &"x".repeat(3_000)));
            failed += u32::from(archive.write_records(&mut store.connection, moment(steady)).is_err());
        }
        if archive.is_due(moment(steady)) {
            archive.close(moment(steady));
            failed += u32::from(archive.write_values(&mut store.connection).is_err());
        }
        assert!(archive.points() <= 260_000, "memory has a bound");
    }
    assert!(failed > 1_000, "{failed}");
    let lost = archive.lost();
    assert!(lost.values > 50_000 && lost.values < 120_000 && lost.records == 0, "{lost:?} of {readings}");
    // There is room again.
    set(&store.connection, i64::from(i32::MAX));
    archive.write_records(&mut store.connection, moment(steady)).unwrap();
    archive.write_values(&mut store.connection).unwrap();
    let told = all(&store.connection);
    assert_eq!(told.iter().filter(|found| found.drive.is_some()).count(), 144, "no record was lost");
    let hole = told.iter().find(|found| found.what == "hole").unwrap();
    assert!(hole.text.starts_with(&format!("{} readings and 0 records", lost.values)), "{}", hole.text);
    // Each point that is not told as lost is there; each flush tells its first once more.
    let points: Vec<_> = crate::read::pieces(&store.connection, "pump", HZ, 0, i64::MAX).unwrap();
    let kept: usize = points.iter().map(|piece| piece.points.len()).sum();
    assert!((kept as i64 + lost.values as i64 - readings).abs() < 1_000, "{kept} kept of {readings}");
}

#[test]
fn what_no_room_was_for_is_a_record() {
    let folder = Folder::new("history-hole");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    archive.take(Batch { lost: Lost { values: 7, records: 2 }, ..Batch::default() }, moment(1_000));
    archive.write_records(&mut store.connection, moment(3_000)).unwrap();
    let told = all(&store.connection);
    let hole = told.last().unwrap();
    assert!(hole.alarm && hole.text.starts_with("7 readings and 2 records of the last 2 s"), "{}", hole.text);
    archive.write_records(&mut store.connection, moment(4_000)).unwrap();
    assert_eq!(all(&store.connection).len(), told.len(), "once");
}

#[test]
fn a_clock_that_is_set_back_makes_two_tellings_of_one_time_in_the_order_of_the_daemons_own() {
    let folder = Folder::new("history-clock");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let back = 3_600_000;
    for second in 0..1_200 {
        let by = if second < 600 { 0 } else { back };
        let now = Moment { steady_ms: second * 1_000, wall_ms: BEGIN_MS + second * 1_000 - by };
        archive.look_at_clock(now);
        pump.read(&mut archive, now, &[(HZ, second * 10)]);
        if second % 300 == 0 {
            archive.record(event(now, "pump", "event"));
        }
        archive.write_records(&mut store.connection, now).unwrap();
    }
    let end = Moment { steady_ms: 1_200_000, wall_ms: BEGIN_MS + 1_200_000 - back };
    archive.end_run(&mut store.connection, end).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    let told = all(&store.connection);
    let steady: Vec<i64> = told.iter().map(|found| found.steady_ms).collect();
    assert!(steady.is_sorted(), "{steady:?}");
    let stepped: Vec<&RecordView> = told.iter().filter(|found| found.what == "clock_stepped").collect();
    assert_eq!(stepped.len(), 1);
    assert!(stepped[0].text.starts_with("the clock was set back by 3600.0 s"), "{}", stepped[0].text);
    let pieces = crate::read::pieces(&store.connection, "pump", HZ, 0, i64::MAX).unwrap();
    let spans: Vec<(i64, i64)> =
        pieces.iter().map(|piece| (piece.start - BEGIN_MS, piece.end - BEGIN_MS)).collect();
    assert_eq!(spans, [(0, 599_000), (599_000 - back, 1_199_000 - back)]);
    let values: Vec<Option<i64>> =
        pieces.iter().flat_map(|piece| &piece.points).map(|point| point.count).collect();
    assert!(values.is_sorted(), "the later telling stands behind the earlier");
}

#[test]
fn what_is_too_much_goes_and_what_is_finest_goes_first() {
    let folder = Folder::new("history-size");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let mut random = fastrand::Rng::with_seed(4);
    for step in 1..200_000_i64 {
        let now = moment(step * 1_000);
        pump.read(&mut archive, now, &[(HZ, random.i64(0..5_000))]);
        if archive.is_due(now) {
            archive.close(now);
        }
    }
    archive.record(event(moment(5), "pump", "tripped"));
    archive.end_run(&mut store.connection, moment(200_000_000)).unwrap();
    let end = BEGIN_MS + 210_000_000;
    while tidy::compact(&mut store.connection, end).unwrap() {}
    let count = |connection: &Connection, table: &str| -> i64 {
        connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap()
    };
    let counts = |connection: &Connection| ["hour", "minute", "record"].map(|table| count(connection, table));
    let before = counts(&store.connection);
    let blocks = count(&store.connection, "block");
    assert!(blocks > 50 && before[0] > 50, "{blocks} {before:?}");
    let limits = Limits { bytes: tidy::used_bytes(&store.connection).unwrap() * 2 / 3, ..Limits::default() };
    let lived = |steady_ms| archive.lived(moment(steady_ms));
    while tidy::trim(&mut store.connection, lived(210_000_000), &limits).unwrap() {}
    assert!(tidy::used_bytes(&store.connection).unwrap() <= limits.bytes);
    let (all, blocks) = (blocks, count(&store.connection, "block"));
    assert!(blocks > 0 && blocks < all, "{blocks} of {all}");
    assert_eq!(counts(&store.connection), before);
    // A clock that is twenty years ahead makes nothing older.
    let ahead = Lived { wall_ms: end + 2 * Limits::default().years_ms, ..lived(211_000_000) };
    while tidy::trim(&mut store.connection, ahead, &Limits::default()).unwrap() {}
    assert_eq!((count(&store.connection, "block"), counts(&store.connection)), (blocks, before));
    // By age: each has its turn within so many marks.
    for turn in 0..24 {
        let past = (150 + turn) * age::MARKED_EVERY_MS;
        let old = lived(210_000_000 + Limits::default().years_ms + past);
        while tidy::trim(&mut store.connection, old, &Limits::default()).unwrap() {}
    }
    assert_eq!((count(&store.connection, "block"), counts(&store.connection)), (0, [0, 0, 0]));
}

#[test]
fn freeze_frames_go_with_what_was_kept_of_them_where_it_is_too_much_and_where_they_are_too_old() {
    let folder = Folder::new("history-frames-go");
    let kept = |name: &str| {
        let mut store = store::open(&folder.file(name)).unwrap().store;
        let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
        archive.begin_run(&mut store.connection, "test").unwrap();
        for second in 1..400 {
            let now = moment(second * 1_000);
            pump.read(&mut archive, now, &[(HZ, second * 10)]);
            if second % 100 == 0 {
                archive.record(event(now, "pump", "tripped"));
            }
        }
        archive.end_run(&mut store.connection, moment(400_000)).unwrap();
        while crate::write::frames::fill(&mut store.connection, archive.run().unwrap(), 400_000).unwrap() {}
        let blocks = of(&store.connection, "frame_block");
        assert!(of(&store.connection, "frame") == 3 && blocks >= 3, "{blocks}");
        (store, archive)
    };
    let (mut large, archive) = kept("large.sqlite");
    let none = Limits { bytes: 0, ..Limits::default() };
    while tidy::trim(&mut large.connection, archive.lived(moment(500_000)), &none).unwrap() {}
    assert_eq!(["frame", "frame_block", "record"].map(|table| of(&large.connection, table)), [0; 3]);
    let (mut old, archive) = kept("old.sqlite");
    let later = archive.lived(moment(400_000 + Limits::default().years_ms + 2 * age::MARKED_EVERY_MS));
    while tidy::trim(&mut old.connection, later, &Limits::default()).unwrap() {}
    assert_eq!(["frame", "frame_block"].map(|table| of(&old.connection, table)), [0; 2]);
}

/// How many rows a table has.
fn of(connection: &Connection, table: &str) -> i64 {
    connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap()
}

/// A drive that comes and goes writes words as long as it does so.
#[test]
fn words_that_take_half_of_a_file_go_before_its_values_do() {
    let folder = Folder::new("history-size-words");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for step in 1..20_000_i64 {
        let now = moment(step * 1_000);
        pump.read(&mut archive, now, &[(HZ, step % 5_000)]);
        archive.record(event(now, "pump", "lost"));
        if archive.is_due(now) {
            archive.close(now);
        }
    }
    archive.end_run(&mut store.connection, moment(20_000_000)).unwrap();
    while tidy::compact(&mut store.connection, BEGIN_MS + 30_000_000).unwrap() {}
    let count = |connection: &Connection, table: &str| -> i64 {
        connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap()
    };
    let before = ["block", "minute", "record"].map(|table| count(&store.connection, table));
    let limits = Limits { bytes: tidy::used_bytes(&store.connection).unwrap() * 2 / 3, ..Limits::default() };
    while tidy::trim(&mut store.connection, archive.lived(moment(20_000_000)), &limits).unwrap() {}
    let after = ["block", "minute", "record"].map(|table| count(&store.connection, table));
    assert!(tidy::used_bytes(&store.connection).unwrap() <= limits.bytes);
    assert_eq!(after[..2], before[..2], "no value goes");
    assert!(after[2] > 0 && after[2] < before[2], "{after:?} of {before:?}");
}

#[test]
fn a_file_of_the_first_version_is_brought_to_this_one_with_all_that_is_in_it() {
    let folder = Folder::new("history-first");
    let path = folder.file("history.sqlite");
    let first = Connection::open(&path).unwrap();
    first.execute_batch(schema::FIRST).unwrap();
    first
        .execute_batch(
            "INSERT INTO run (began_ms, program) VALUES (1, 'first');
             INSERT INTO record (run, steady_ms, wall_ms, kind, what, drive, alarm, text)
             VALUES (1, 0, 1000, 'event', 'tripped', 'pump', 1, 'tripped')",
        )
        .unwrap();
    first.pragma_update(None, "application_id", schema::APPLICATION).unwrap();
    first.pragma_update(None, "user_version", 1).unwrap();
    drop(first);
    let mut store = store::open(&path).unwrap().store;
    assert_eq!(schema::version_of(&store.connection).unwrap(), schema::version());
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    archive.end_run(&mut store.connection, moment(1_000)).unwrap();
    assert_eq!(words(&store.connection), ["tripped", "began_after_kill", "ended"]);
}

#[test]
fn a_file_of_the_second_version_is_read_as_it_stands() {
    let folder = Folder::new("history-second");
    let path = folder.file("history.sqlite");
    let store = store::open(&path).unwrap().store;
    let column = crate::column::pack(0, &[crate::column::Point { at: 1_000, count: Some(50) }]);
    let mut data = Vec::new();
    crate::column::write_number(&mut data, u64::from(HZ.0));
    crate::column::write_number(&mut data, column.len() as u64);
    data.extend(column);
    store
        .connection
        .execute_batch(
            "ALTER TABLE chunk DROP COLUMN form; PRAGMA user_version = 2;
             INSERT INTO source (id, drive, part) VALUES (1, 'pump', 'status');
             INSERT INTO flush (id, segment, start_ms, end_ms) VALUES (1, 1, 0, 2000);",
        )
        .unwrap();
    let id = (1_i64 << crate::read::SOURCE_BITS) | 1;
    store
        .connection
        .execute("INSERT INTO chunk (id, start_ms, end_ms, data) VALUES (?1, 0, 2000, ?2)", (id, data))
        .unwrap();
    drop(store);
    let before = fs::read(&path).unwrap();
    let history = History::open(&path).unwrap();
    let pieces = crate::read::pieces(&history.0, "pump", HZ, 0, 5_000).unwrap();
    assert_eq!(pieces[0].points, [crate::column::Point { at: 1_000, count: Some(50) }]);
    assert_eq!(fs::read(&path).unwrap(), before);
}

#[test]
fn every_value_of_a_setting_that_was_read_is_kept_with_its_times() {
    let folder = Folder::new("history-settings");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for (at, word) in [(1, 30), (2, 30), (3, 50), (4, 30)] {
        let text = format!("{word} s");
        let read = ParameterRead { drive: "pump".into(), address: 9_001, code: "ACC", word, text };
        let setting = Setting { wall_ms: BEGIN_MS + at, read };
        archive.take(Batch { settings: vec![setting], ..Batch::default() }, moment(at));
        archive.write_values(&mut store.connection).unwrap();
    }
    let told = crate::read::parameters(&store.connection, "pump").unwrap();
    let told: Vec<_> = told
        .iter()
        .map(|one| {
            (one.raw, &*one.text, one.first_unix_ms - BEGIN_MS, one.last_unix_ms - BEGIN_MS, one.times)
        })
        .collect();
    assert_eq!(told, [(30, "30 s", 1, 2, 2), (50, "50 s", 3, 3, 1), (30, "30 s", 4, 4, 1)]);
}

/// A writer on a folder, with its inbox and its health.
fn writer(path: std::path::PathBuf) -> (Inbox, watch::Receiver<Health>, std::thread::JoinHandle<()>) {
    let (health, seen) = watch::channel(Health::Opening);
    let (inbox, began) = (Inbox::default(), std::time::Instant::now());
    let clock = move || moment(i64::try_from(began.elapsed().as_millis()).unwrap());
    let writer =
        Writer { path, limits: Limits::default(), inbox: inbox.clone(), clock, health, is_anew: false };
    (inbox, seen, writer.start().unwrap())
}

async fn becomes(health: &mut watch::Receiver<Health>, is_so: fn(&Health) -> bool) {
    tokio::time::timeout(Duration::from_secs(60), health.wait_for(is_so)).await.unwrap().unwrap();
}

#[tokio::test]
async fn a_folder_that_cannot_be_written_is_told_and_the_writer_goes_on_by_itself() {
    let folder = Folder::new("history-readonly");
    let (place, path) = (folder.file("place"), folder.file("place/history.sqlite"));
    // Something else stands in the way of its folder: root may write into any.
    fs::write(&place, "").unwrap();
    let (inbox, mut health, thread) = writer(path.clone());
    becomes(&mut health, |health| matches!(health, Health::Failing(_))).await;
    inbox.record(event(moment(1), "pump", "tripped"));
    fs::remove_file(&place).unwrap();
    fs::create_dir(&place).unwrap();
    fs::set_permissions(&place, fs::Permissions::from_mode(0o700)).unwrap();
    becomes(&mut health, |health| *health == Health::Writing).await;
    inbox.end();
    thread.join().unwrap();
    let history = History::open(&path).unwrap();
    assert_eq!(words(&history.0), ["began", "tripped", "ended"]);
}

#[tokio::test]
async fn a_writer_that_is_closed_by_a_reload_says_that_the_daemon_goes_on() {
    let folder = Folder::new("history-closed");
    let path = folder.file("history.sqlite");
    let (inbox, mut health, thread) = writer(path.clone());
    becomes(&mut health, |health| *health == Health::Writing).await;
    inbox.record(event(moment(1), "pump", "tripped"));
    inbox.close();
    thread.join().unwrap();
    assert_eq!(words(&History::open(&path).unwrap().0), ["began", "tripped", "history_closed"]);
}

#[tokio::test]
async fn what_was_read_within_the_minute_is_there_for_whoever_asks() {
    let folder = Folder::new("history-live");
    let path = folder.file("history.sqlite");
    let (inbox, mut health, thread) = writer(path.clone());
    becomes(&mut health, |health| *health == Health::Writing).await;
    let mut tracker = Tracker::default();
    for at in [100, 1_100, 2_100] {
        let seen = tracker.see(at, 3_000, &[(Quantity::STATE, 3)]);
        let shown = seen.map(|seen| Shown { drive: "pump".into(), set: Set::Status, seen });
        inbox.show(shown.unwrap()).unwrap();
    }
    let limits = Limits::default();
    let (clocks, done) = (crate::clocks::Clocks::begin(), std::sync::Arc::default());
    let past = crate::past::InFile { path: path.clone(), limits, inbox: inbox.clone(), clocks, done };
    let asked = tokio::task::spawn_blocking(move || Past::story(&past, "pump", i64::MAX / 4));
    asked.await.unwrap().unwrap();
    let known =
        read::pieces(&History::open(&path).unwrap().0, "pump", Quantity::STATE, BEGIN_MS, i64::MAX / 4);
    assert_eq!(known.unwrap().len(), 1, "the writer has not been ended, and its minute is not over");
    inbox.end();
    thread.join().unwrap();
    // Behind its end nobody is waited for: this would hang for three seconds, and tell nothing.
    assert_eq!(words(&History::open(&path).unwrap().0), ["began", "ended"]);
}

#[tokio::test]
async fn values_of_the_last_minute_are_known_to_whoever_asks_for_them() {
    type Asks = fn(&InFile, i64) -> bool;
    let curve: Asks = |past, at| {
        let asked = CurvesAsked {
            drives: vec!["pump".to_owned()],
            values: vec!["state".to_owned()],
            from_unix_ms: at - 500,
            to_unix_ms: at + 500,
            every_ms: 1_000,
        };
        let told = past.curves(&asked, &GivenUp::default()).unwrap();
        told.curves.iter().any(|curve| curve.known.iter().any(|known| *known > 0.0))
    };
    let values: Asks = |past, at| {
        let (drive, value) = ("pump".to_owned(), "state".to_owned());
        let asked =
            ValuesAsked { drive, value, from_unix_ms: at - 500, to_unix_ms: at + 500, every_ms: None };
        !past.values(&asked, &GivenUp::default()).unwrap().points.is_empty()
    };
    let moment: Asks = |past, at| {
        let told = past.moment(at, &GivenUp::default()).unwrap();
        told.drives.iter().any(|drive| drive.values.contains_key("state"))
    };
    let folder = Folder::new("history-last-minute");
    for (name, asks) in [("curves", curve), ("values", values), ("moment", moment)] {
        let (path, clocks) = (folder.file(name), Clocks::begin());
        let (health, mut seen) = watch::channel(Health::Opening);
        let (inbox, limits) = (Inbox::default(), Limits::default());
        let writer = Writer {
            path: path.clone(),
            limits,
            inbox: inbox.clone(),
            clock: move || clocks.now(),
            health,
            is_anew: false,
        };
        let thread = writer.start().unwrap();
        becomes(&mut seen, |health| *health == Health::Writing).await;
        let (mut tracker, now) = (Tracker::default(), clocks.now());
        for before in [3_000, 2_000, 1_000] {
            let seen = tracker.see(now.steady_ms - before, 3_000, &[(Quantity::STATE, 3)]);
            let shown = seen.map(|seen| Shown { drive: "pump".into(), set: Set::Status, seen });
            inbox.show(shown.unwrap()).unwrap();
        }
        let past = InFile { path, limits, inbox: inbox.clone(), clocks, done: std::sync::Arc::default() };
        let at = now.wall_ms - 2_000;
        assert!(tokio::task::spawn_blocking(move || asks(&past, at)).await.unwrap(), "{name}");
        inbox.end();
        thread.join().unwrap();
    }
}

#[tokio::test]
async fn a_disk_that_does_not_answer_is_told_once_and_nothing_is_lost_that_there_was_room_for() {
    let folder = Folder::new("history-slow");
    let path = folder.file("history.sqlite");
    let (inbox, mut health, thread) = writer(path.clone());
    becomes(&mut health, |health| *health == Health::Writing).await;
    // As long as somebody else holds the file no write of it comes back.
    let other = Connection::open(&path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    // Together no more than there is room for, however late the writer takes them.
    for number in 1..=1_000 {
        inbox.record(event(moment(number), "pump", "tripped"));
    }
    becomes(&mut health, |health| matches!(health, Health::Failing(_))).await;
    for number in 1_001..=2_000 {
        inbox.record(event(moment(number), "pump", "tripped"));
    }
    other.execute_batch("ROLLBACK").unwrap();
    becomes(&mut health, |health| *health == Health::Writing).await;
    inbox.end();
    thread.join().unwrap();
    let told = words(&History::open(&path).unwrap().0);
    assert_eq!(told.iter().filter(|what| *what == "tripped").count(), 2_000);
    assert!(!told.contains(&"hole".to_owned()), "{told:?}");
}

#[tokio::test]
async fn a_file_that_is_damaged_while_it_is_written_is_put_aside_and_a_new_one_begun() {
    let folder = Folder::new("history-midway");
    let path = folder.file("history.sqlite");
    let (inbox, mut health, thread) = writer(path.clone());
    inbox.record(event(moment(1), "pump", "tripped"));
    becomes(&mut health, |health| *health == Health::Writing).await;
    // Somebody overwrites it: its pages, its log, and the index of that.
    for ending in ["", "-wal", "-shm"] {
        let file = folder.file(&format!("history.sqlite{ending}"));
        let length = fs::metadata(&file).unwrap().len();
        let open = fs::OpenOptions::new().write(true).open(&file).unwrap();
        std::os::unix::fs::FileExt::write_all_at(&open, &vec![0x5A; usize::try_from(length).unwrap()], 0)
            .unwrap();
    }
    let aside = || {
        fs::read_dir(folder.file(""))
            .unwrap()
            .flatten()
            .any(|entry| entry.file_name().to_string_lossy().contains(".damaged-"))
    };
    let mut number = 0;
    while !aside() {
        assert!(number < 200, "it is not noticed");
        number += 1;
        inbox.record(event(moment(number), "pump", "tripped"));
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    becomes(&mut health, |health| *health == Health::Writing).await;
    inbox.end();
    thread.join().unwrap();
    let told = words(&History::open(&path).unwrap().0);
    assert!(told.contains(&"damaged".to_owned()) && told.contains(&"ended".to_owned()), "{told:?}");
}

/// A file that a run before has left, in which something is overwritten where no writer looks.
fn damaged(path: &std::path::Path, overwrite: fn(&mut [u8], usize)) {
    let mut store = store::open(path).unwrap().store;
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for number in 0..50 {
        archive.record(event(moment(number), "pump", "tripped and spoilt"));
    }
    archive.end_run(&mut store.connection, moment(100)).unwrap();
    let of = "SELECT rootpage FROM sqlite_schema WHERE name = 'parameter_of'";
    let page: i64 = store.connection.query_row(of, [], |row| row.get(0)).unwrap();
    drop(store);
    let mut bytes = fs::read(path).unwrap();
    overwrite(&mut bytes, usize::try_from(page - 1).unwrap() * 4_096);
    fs::write(path, bytes).unwrap();
}

#[tokio::test]
async fn what_only_readers_find_damaged_is_put_aside_and_a_new_one_begun() {
    let zeroed = |bytes: &mut [u8], page: usize| bytes[page..page + 4_096].fill(0);
    let flipped = |bytes: &mut [u8], _: usize| {
        let text = b"tripped and spoilt at";
        let at = bytes.windows(text.len()).position(|found| found == text).unwrap();
        bytes[at + 3] ^= 0x80;
    };
    let folder = Folder::new("history-doubted");
    for (name, overwrite) in [("zeroed", zeroed as fn(&mut [u8], usize)), ("flipped", flipped)] {
        let path = folder.file(name);
        damaged(&path, overwrite);
        let (inbox, mut health, thread) = writer(path.clone());
        becomes(&mut health, |health| *health == Health::Writing).await;
        let (clocks, done) = (crate::clocks::Clocks::begin(), std::sync::Arc::default());
        let (limits, waiting) = (Limits::default(), inbox.clone());
        let past = crate::past::InFile { path: path.clone(), limits, inbox: waiting, clocks, done };
        let past = crate::asked::Asked(past);
        let ask = |past: &crate::asked::Asked| {
            let all = RecordsAsked { to_unix_ms: i64::MAX, ..RecordsAsked::default() };
            past.parameters("pump").and_then(|_| past.records(&all))
        };
        let refused = ask(&past).unwrap_err();
        assert!(matches!(refused, PastError::Damaged(_)), "{name}: {refused}");
        becomes(&mut health, |health| matches!(health, Health::Failing(_))).await;
        becomes(&mut health, |health| *health == Health::Writing).await;
        let told = ask(&past).unwrap().records.into_iter().map(|found| found.what).collect::<Vec<_>>();
        assert!(told.contains(&"damaged".to_owned()), "{name}: {told:?}");
        // What was said of the one that is aside says nothing of this one.
        inbox.is_damaged(0, "of another".to_owned());
        inbox.end();
        thread.join().unwrap();
        let kept = words(&History::open(&path).unwrap().0);
        assert_eq!(kept.iter().filter(|what| *what == "damaged").count(), 1, "{name}: {kept:?}");
    }
}

#[test]
fn frames_of_a_trip_are_kept_when_the_values_around_it_are_not() {
    let folder = Folder::new("history-frame");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for second in 1..400 {
        let now = moment(second * 1_000);
        pump.read(&mut archive, now, &[(HZ, second * 10)]);
        if second == 200 {
            archive.record(event(now, "pump", "tripped"));
        }
    }
    archive.end_run(&mut store.connection, moment(400_000)).unwrap();
    while crate::write::frames::fill(&mut store.connection, archive.run().unwrap(), 400_000).unwrap() {}
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    for at in [4_000_000, 60 * 86_400_000] {
        while tidy::trim(&mut store.connection, archive.lived(moment(at)), &Limits::default()).unwrap() {}
    }
    assert_eq!(crate::read::pieces(&store.connection, "pump", HZ, 0, i64::MAX).unwrap(), []);
    let frames = crate::read::frames(&store.connection, "pump", 0, i64::MAX).unwrap();
    let [frame] = &frames[..] else { panic!("{frames:?}") };
    assert_eq!((&*frame.why, frame.at_unix_ms), ("tripped", BEGIN_MS + 200_000));
    let (quantity, piece) = &frame.curves[0];
    assert_eq!((*quantity, piece.start, piece.end), (HZ, BEGIN_MS + 140_000, BEGIN_MS + 230_000));
    assert_eq!(piece.points.len(), 91);
}
