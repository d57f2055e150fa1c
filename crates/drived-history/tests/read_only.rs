//! A file system that can only be read, mounted here in a name space of mounts of one's own: what is told meanwhile is kept until it can be written,
//! and what stands there is read.
#![cfg(target_os = "linux")]

use std::{env, path::PathBuf, process::Command, time::Duration};

use drived_config::testing::Folder;
use drived_history::{
    quantity::{Quantity, Set},
    read::{self, Filter, History},
    record::{Kind, Moment, Record},
    tracker::Tracker,
    write::{
        Limits,
        inbox::{Inbox, Shown},
        writer::{Health, Writer},
    },
};
use tokio::sync::watch;

/// What names the folder to the process that has mounts of its own.
const MOUNTED: &str = "DRIVED_HISTORY_MOUNTS";
const RECORDS: i64 = 1_000;
const READINGS: i64 = 1_000;

#[test]
fn a_read_only_mount_loses_nothing_that_there_is_room_for_and_the_writer_goes_on_by_itself() {
    let may_mount = Command::new("unshare").args(["--map-root-user", "--mount", "true"]).status();
    if !may_mount.is_ok_and(|status| status.success()) {
        println!("skipped: this machine gives no name space of mounts");
        return;
    }
    let folder = Folder::new("history-mounted");
    let mounted = folder.file("mounted");
    std::fs::create_dir(&mounted).unwrap();
    let told = Command::new("unshare")
        .args(["--map-root-user", "--mount"])
        .arg(env::current_exe().unwrap())
        .args(["--exact", "on_a_mount_of_its_own", "--nocapture"])
        .env(MOUNTED, &mounted)
        .output()
        .unwrap();
    let out = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{out}{}", String::from_utf8_lossy(&told.stderr));
    assert!(out.contains("everything is there"), "{out}");
}

fn mount(arguments: &[&str]) {
    assert!(Command::new("mount").args(arguments).status().unwrap().success(), "mount {arguments:?}");
}

#[tokio::test]
async fn on_a_mount_of_its_own() {
    let Some(mounted) = env::var_os(MOUNTED).map(PathBuf::from) else { return };
    let place = mounted.to_str().unwrap();
    mount(&["-t", "tmpfs", "-o", "ro", "none", place]);
    let path = mounted.join("history.sqlite");
    let (health, mut seen) = watch::channel(Health::Opening);
    let (inbox, began) = (Inbox::default(), std::time::Instant::now());
    let clock = move || {
        let at = i64::try_from(began.elapsed().as_millis()).unwrap();
        Moment { steady_ms: at, wall_ms: at }
    };
    let limits = Limits::default();
    let writer = Writer { path: path.clone(), limits, inbox: inbox.clone(), clock, health, is_anew: false };
    let thread = writer.start().unwrap();
    let patience = Duration::from_secs(60);
    let is_failing = |health: &Health| matches!(health, Health::Failing(_));
    tokio::time::timeout(patience, seen.wait_for(is_failing)).await.unwrap().unwrap();
    for number in 0..RECORDS {
        let event = Record::of_history(clock(), "event", number.to_string());
        inbox.record(Record { kind: Kind::Event, drive: Some("pump".to_owned()), ..event });
    }
    let mut tracker = Tracker::default();
    for at in 0..READINGS {
        let shown = tracker.see(at, 3_000, &[(Quantity::OUTPUT_FREQUENCY, at * 10)]).unwrap();
        inbox.show(Shown { drive: "pump".into(), set: Set::Status, seen: shown }).unwrap();
    }
    mount(&["-o", "remount,rw", place]);
    let is_well = |health: &Health| *health == Health::Writing;
    tokio::time::timeout(patience, seen.wait_for(is_well)).await.unwrap().unwrap();
    inbox.end();
    thread.join().unwrap();
    // It is read where it cannot be written, too: whoever has a copy has it so.
    mount(&["-o", "remount,ro", place]);
    let history = History::open(&path).unwrap();
    let filter = Filter { to_ms: i64::MAX, kind: Some("event"), limit: usize::MAX, ..Filter::default() };
    let told = read::records(&history.0, &filter).unwrap().records;
    assert_eq!(told.len(), usize::try_from(RECORDS).unwrap());
    let filter = Filter { to_ms: i64::MAX, what: Some("hole"), limit: 1, ..Filter::default() };
    assert!(read::records(&history.0, &filter).unwrap().records.is_empty());
    let mut points = 0;
    let each = |_| {
        points += 1;
        Ok::<_, drived_history::store::StoreError>(true)
    };
    read::points(&history.0, "pump", Quantity::OUTPUT_FREQUENCY, 0, i64::MAX / 4, each).unwrap();
    assert_eq!(points, READINGS + 1, "each reading, and that nothing is known behind the last");
    println!("everything is there");
}
