//! The file opened by tools of other people: what the README shows of it is run as it stands there, by the shell of SQLite and by Python.

use std::{path::Path, process::Command};

use drived_config::testing::Folder;
use drived_history::{
    quantity::{Quantity, Set},
    read,
    record::{Kind, Moment, Record},
    store,
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Shown},
        tidy,
    },
};

const README: &str = include_str!("../README.md");
/// 2026-11-21 00:00 UTC.
const BEGIN_MS: i64 = 1_795_219_200_000;

const fn at(steady_ms: i64) -> Moment {
    Moment { steady_ms, wall_ms: BEGIN_MS + steady_ms }
}

/// What stands in the README in a language.
fn shown(language: &str) -> &'static str {
    let (_, behind) = README.split_once(&format!("```{language}\n")).unwrap();
    behind.split_once("```").unwrap().0
}

/// An hour and a half of one pump, and a command.
fn written(path: &Path) -> store::Store {
    let mut store = store::open(path).unwrap().store;
    let (mut archive, mut tracker) = (Archive::begin(at(0)), Tracker::default());
    archive.begin_run(&mut store.connection, "test").unwrap();
    for second in 0..5_400 {
        // A gap of ten minutes, and a current of 1.0 to 5.3 A.
        if (1_000..1_600).contains(&second) {
            continue;
        }
        let values = [(Quantity::CURRENT, 10 + second % 44)];
        let seen = tracker.see(second * 1_000, 3_000, &values).unwrap();
        let shown = vec![Shown { drive: "pump".into(), set: Set::Status, seen }];
        archive.take(Batch { shown, ..Batch::default() }, at(second * 1_000));
    }
    let text = "ramp stop by anna from page: confirmed";
    let stop = Record::of_history(at(7_000), "stop", text);
    archive.record(Record { kind: Kind::Command, drive: Some("pump".to_owned()), ..stop });
    archive.end_run(&mut store.connection, at(5_400_000)).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    store
}

/// What a program says; `None`: it is not installed.
fn said(program: &str, arguments: &[&str], folder: &Path) -> Option<String> {
    let Ok(told) = Command::new(program).args(arguments).current_dir(folder).output() else {
        println!("skipped: {program} is not installed");
        return None;
    };
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    Some(String::from_utf8(told.stdout).unwrap())
}

#[test]
fn the_questions_of_the_readme_are_answered_by_the_shell_of_sqlite() {
    let folder = Folder::new("history-shell");
    let path = folder.file("history.sqlite");
    // It is open, as it is beside a daemon.
    let _store = written(&path);
    // What begins with a comment would be taken for an option.
    let question = format!("\n{}", shown("sql"));
    let Some(told) = said("sqlite3", &["-readonly", path.to_str().unwrap(), &question], &folder.file(""))
    else {
        return;
    };
    assert!(told.contains("|pump|ramp stop by anna from page: confirmed"), "{told}");
    // By what was shown: 10 and 43 counts of a tenth of an ampere.
    assert!(told.lines().any(|line| line.starts_with("pump|2026-11-2") && line.ends_with("|5.3")), "{told}");
}

#[test]
fn a_block_is_read_in_python_by_what_the_readme_says() {
    let folder = Folder::new("history-python");
    let path = folder.file("history.sqlite");
    let store = written(&path);
    let Some(told) = said("python3", &["-c", shown("python")], &folder.file("")) else { return };
    let (from, to) = (BEGIN_MS, BEGIN_MS + 3_600_000 - 1);
    let [piece] = &read::pieces(&store.connection, "pump", Quantity::CURRENT, from, to).unwrap()[..] else {
        panic!("one clock, one piece")
    };
    let points = piece.points.iter().map(|point| {
        let count = point.count.map_or_else(|| "None".to_owned(), |count| count.to_string());
        format!("({}, {count})", point.at)
    });
    let expected = format!("[{}", points.collect::<Vec<_>>().join(", "));
    // The block may go on for a flush behind the hour.
    assert!(told.starts_with(&expected), "{told}\n{expected}");
    assert!(told.contains(&format!("({}, None)", BEGIN_MS + 999_001)), "the gap is one: {told}");
}
