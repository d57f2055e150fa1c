//! A writer that is killed at any write: what it had told to be written is there, the file is whole, and the next run says that it was killed.
//!
//! `DRIVED_HISTORY_KILLS` says how often; 12 unless it is said.

use std::{
    env,
    io::{BufRead as _, BufReader},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use drived_history::{
    quantity::{Quantity, Set},
    read::{self, Filter, History, records},
    record::{Kind, Moment, Record},
    store,
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Shown},
        tidy,
    },
};

/// What names the file to the process that writes it.
const FILE: &str = "DRIVED_HISTORY_WRITES";
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
