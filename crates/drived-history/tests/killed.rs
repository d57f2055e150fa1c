//! A writer that is killed at any write: what it had told to be written is there, the file is whole, and the next run says that it was killed. And a
//! writer at work as the daemon has it, killed at any moment: what is lost is the last of what was told to it, and counted.
//!
//! `DRIVED_HISTORY_KILLS` says how often; 12 and 4 unless it is said.

use std::{
    env,
    io::{BufRead as _, BufReader},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use drived_history::{
    quantity::{Quantity, Set},
    read::{self, Filter, History, records},
    record::{Kind, Moment, Record},
    store,
    tracker::Tracker,
    write::{
        Limits,
        archive::Archive,
        inbox::{Batch, Inbox, Shown},
        tidy,
        writer::{Health, Writer},
    },
};
use tokio::sync::watch;

/// What names the file to the process that writes it.
const FILE: &str = "DRIVED_HISTORY_WRITES";
/// Likewise to the process in which the writer is at work.
const WORKED: &str = "DRIVED_HISTORY_IS_WORKED";
/// So much quicker than the wall's is the clock of that: a minute of values is a second.
const QUICKER: i64 = 60;
const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;

/// The process that is killed: it writes as fast as it can, and says what is written.
#[test]
fn writer() {
    let Some(path) = env::var_os(FILE).map(PathBuf::from) else { return };
    let mut store = store::open(&path).unwrap().store;
    let began = match last(&path) {
        Some(last) => last + 1,
        None => 1,
    };
    let moment = |number: i64| Moment { steady_ms: (number - began) * 1_000, wall_ms: number * 1_000 };
    let (mut archive, mut tracker) = (Archive::begin(moment(began)), Tracker::default());
    archive.begin_run(&mut store.connection, "test").unwrap();
    for number in began.. {
        let now = moment(number);
        let seen = tracker.see(now.steady_ms, 3_000, &[(HZ, number * 10)]).unwrap();
        let shown = vec![Shown { drive: "pump".into(), set: Set::Status, seen }];
        let text = number.to_string();
        let event = Record {
            kind: Kind::Event,
            drive: Some("pump".into()),
            ..Record::of_history(now, "event", text)
        };
        archive.take(Batch { shown, records: vec![event], ..Batch::default() }, now);
        archive.write_records(&mut store.connection, now).unwrap();
        println!("record {number}");
        if archive.is_due(now) {
            archive.close(now);
            archive.write_values(&mut store.connection).unwrap();
            println!("values {number}");
            while tidy::compact(&mut store.connection, now.wall_ms).unwrap() {}
        }
    }
}

/// The process in which the writer is at work as in the daemon: a reading and an event every few milliseconds, each of which it tells with its moments.
#[test]
fn worker() {
    let Some(path) = env::var_os(WORKED).map(PathBuf::from) else { return };
    let began = Instant::now();
    let clock = move || {
        let steady_ms = i64::try_from(began.elapsed().as_millis()).unwrap() * QUICKER;
        Moment { steady_ms, wall_ms: steady_ms }
    };
    let (health, _seen) = watch::channel(Health::Opening);
    let inbox = Inbox::default();
    let _thread =
        Writer { path, limits: Limits::default(), inbox: inbox.clone(), clock, health, is_anew: false }
            .start()
            .unwrap();
    let mut tracker = Tracker::default();
    for number in 1_i64.. {
        let now = clock();
        let event = Record {
            kind: Kind::Event,
            drive: Some("pump".into()),
            ..Record::of_history(now, "event", number.to_string())
        };
        inbox.record(event);
        if let Some(seen) = tracker.see(now.steady_ms, i64::MAX / 4, &[(HZ, number * 10)]) {
            inbox.show(Shown { drive: "pump".into(), set: Set::Status, seen }).unwrap();
        }
        println!("told {number} {} {}", began.elapsed().as_micros(), now.steady_ms);
        std::thread::park_timeout(Duration::from_millis(5));
    }
}

/// The newest record of an earlier run.
fn last(path: &Path) -> Option<i64> {
    let history = History::open(path).ok()?;
    numbers(&history).last().copied()
}

fn numbers(history: &History) -> Vec<i64> {
    let filter =
        Filter { from_ms: 0, to_ms: i64::MAX, kind: Some("event"), limit: usize::MAX, ..Filter::default() };
    records(&history.0, &filter).unwrap().records.iter().map(|found| found.text.parse().unwrap()).collect()
}

#[test]
fn a_writer_that_is_killed_at_any_write_loses_nothing_that_it_said_was_written() {
    let kills = env::var("DRIVED_HISTORY_KILLS").ok().and_then(|said| said.parse().ok()).unwrap_or(12);
    let folder = drived_config::testing::Folder::new("history-kill");
    let path = folder.file("history.sqlite");
    let mut random = fastrand::Rng::with_seed(9);
    let (mut written, mut valued) = (0_i64, 0_i64);
    for kill in 0..kills {
        let mut child = Command::new(env::current_exe().unwrap())
            .args(["--exact", "writer", "--nocapture", "--test-threads=1"])
            .env(FILE, &path)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
        let lines = random.usize(1..400);
        let mut read = |line: &str| {
            let number = |of: &str| line.strip_prefix(of).and_then(|number| number.parse().ok());
            written = number("record ").unwrap_or(written);
            valued = number("values ").unwrap_or(valued);
        };
        said.by_ref().take(lines).for_each(|line| read(&line.unwrap()));
        // It goes on meanwhile: where it is then nobody knows.
        std::thread::park_timeout(Duration::from_micros(random.u64(0..3_000)));
        child.kill().unwrap();
        child.wait().unwrap();
        said.for_each(|line| read(&line.unwrap_or_default()));

        let history = History::open(&path).unwrap();
        let whole: String = history.0.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
        assert_eq!(whole, "ok", "kill {kill}");
        let numbers = numbers(&history);
        let expected: Vec<i64> = (1..=numbers.len() as i64).collect();
        assert_eq!(numbers, expected, "each once, none left out");
        let last = numbers.last().copied().unwrap_or_default();
        assert!(last >= written && last <= written + 1, "kill {kill}: {last} are there, {written} were said");
        // Every value that was said to be written is told, as it was.
        let pieces = read::pieces(&history.0, "pump", HZ, 0, i64::MAX).unwrap();
        let end = pieces.iter().map(|piece| piece.end).max().unwrap_or_default();
        assert!(end >= valued * 1_000, "kill {kill}: values to {end}, and {valued} s were said");
        for point in pieces.iter().flat_map(|piece| &piece.points) {
            assert!(point.count.is_none_or(|count| count * 100 == point.at), "{point:?}");
        }
        let filter = Filter {
            from_ms: 0,
            to_ms: i64::MAX,
            kind: Some("history"),
            limit: usize::MAX,
            ..Filter::default()
        };
        let told: Vec<String> =
            records(&history.0, &filter).unwrap().records.into_iter().map(|found| found.what).collect();
        let killed = told.iter().filter(|what| *what == "began_after_kill").count();
        assert!(killed + 1 == told.len() && killed <= kill, "{told:?}");
    }
    assert!(written > 100 && valued > 0, "it wrote something: {written}, {valued}");
}

#[test]
fn a_writer_at_work_that_is_killed_loses_the_last_of_what_it_was_told_and_that_is_counted() {
    let kills = env::var("DRIVED_HISTORY_KILLS").ok().and_then(|said| said.parse().ok()).unwrap_or(4);
    let mut random = fastrand::Rng::with_seed(30);
    let (mut records_ms, mut values_ms) = (Vec::new(), Vec::new());
    for kill in 0..kills {
        let folder = drived_config::testing::Folder::new("history-kill-at-work");
        let path = folder.file("history.sqlite");
        let mut child = Command::new(env::current_exe().unwrap())
            .args(["--exact", "worker", "--nocapture", "--test-threads=1"])
            .env(WORKED, &path)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut told: Vec<(i64, i64, i64)> = Vec::new();
        let read = |line: &str| {
            let mut words = line.strip_prefix("told ")?.split(' ').map(str::parse);
            Some((words.next()?.ok()?, words.next()?.ok()?, words.next()?.ok()?))
        };
        // Some way behind the first minute of values.
        let many = random.usize(300..1_500);
        told.extend(lines.by_ref().take(many).filter_map(|line| read(&line.unwrap())));
        child.kill().unwrap();
        child.wait().unwrap();
        told.extend(lines.filter_map(|line| read(&line.unwrap_or_default())));

        let history = History::open(&path).unwrap();
        let numbers = numbers(&history);
        let expected: Vec<i64> = (1..=numbers.len() as i64).collect();
        assert_eq!(numbers, expected, "kill {kill}: the last are lost, and none before them");
        // What was told and not said before the kill may be there.
        let last = told.last().copied().unwrap();
        let first_lost = told.iter().find(|(number, ..)| *number > numbers.len() as i64);
        records_ms.push(first_lost.map_or(0, |(_, at_us, _)| (last.1 - at_us) / 1_000));
        let pieces = read::pieces(&history.0, "pump", HZ, 0, i64::MAX).unwrap();
        assert_eq!(pieces.len(), 1, "kill {kill}: one clock, one piece");
        let points: Vec<_> = pieces.iter().flat_map(|piece| &piece.points).collect();
        for (number, point) in (1_i64..).zip(&points) {
            assert_eq!(
                point.count,
                Some(number * 10),
                "kill {kill}: the last are lost, and none before them"
            );
        }
        let end = pieces.last().map_or(0, |piece| piece.end);
        values_ms.push((last.2 - end).max(0));
    }
    let of = |lost: &mut Vec<i64>| {
        lost.sort_unstable();
        let at = |part: usize| lost.get(lost.len() * part / 100).or(lost.last()).copied().unwrap_or_default();
        format!("{} in the middle, {} at the most", at(50), at(100))
    };
    println!(
        "lost by {kills} kills, in milliseconds: events {}; values {}, by their clock",
        of(&mut records_ms),
        of(&mut values_ms)
    );
}
