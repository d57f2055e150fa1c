//! What captures have heard of a line, beside the freeze-frames of its drives.

use std::time::Duration;

use bytes::Bytes;
use drive_bus::capture::{self, Captured, Direction, Dissector};
use drived_config::testing::Folder;
use drived_plant::plant::past::{FrameCaptureView, Past as _, PastError};
use rusqlite::Connection;

use super::{BEGIN_MS, event, moment};
use crate::{
    clocks::Clocks,
    past::InFile,
    read::{self, History},
    record::{LineFrames, Moment, Record},
    store::{self, Store},
    write::{
        Limits,
        age::MARKED_EVERY_MS,
        archive::Archive,
        inbox::{Batch, Inbox, Lost},
        tidy,
    },
};

/// Frames of a line, one a second.
fn frames(line: &str, seconds: std::ops::RangeInclusive<u64>) -> LineFrames {
    let frame = |second: u64| Captured {
        at: Duration::from_millis(BEGIN_MS as u64) + Duration::from_secs(second),
        direction: if second.is_multiple_of(2) { Direction::Sent } else { Direction::Received },
        bytes: Bytes::copy_from_slice(&second.to_be_bytes()),
    };
    LineFrames {
        line: line.into(),
        dissector: Dissector::Rtu,
        first_ms: *seconds.start() as i64 * 1_000,
        last_ms: *seconds.end() as i64 * 1_000,
        frames: seconds.map(frame).collect(),
        left_out: 0,
        is_cut: false,
    }
}

fn trip(second: i64, drive: &str, line: &str) -> Record {
    Record { line: Some(line.to_owned()), ..event(moment(second * 1_000), drive, "tripped") }
}

fn heard(archive: &mut Archive, at: Moment, frames: LineFrames) {
    archive.take(Batch { frames: vec![frames], ..Batch::default() }, at);
}

/// `a` and `b` of the line `north` trip within a capture, `c` of `south` without one.
fn written(folder: &Folder) -> (Store, Archive) {
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for (second, drive, line) in [(100, "a", "north"), (120, "b", "north"), (120, "c", "south")] {
        archive.record(trip(second, drive, line));
    }
    let cut = LineFrames { is_cut: true, left_out: 7, ..frames("north", 40..=100) };
    for part in [cut, frames("north", 101..=110), frames("north", 111..=150), frames("east", 90..=120)] {
        heard(&mut archive, moment(150_000), part);
    }
    archive.end_run(&mut store.connection, moment(200_000)).unwrap();
    (store, archive)
}

fn kept(connection: &Connection) -> i64 {
    connection.query_row("SELECT count(*) FROM captured", [], |row| row.get(0)).unwrap()
}

fn past(folder: &Folder) -> InFile {
    let path = folder.file("history.sqlite");
    InFile {
        path,
        limits: Limits::default(),
        inbox: Inbox::default(),
        clocks: Clocks::begin(),
        done: Default::default(),
    }
}

#[test]
fn a_trip_while_a_capture_runs_has_the_frames_of_its_line_and_one_without_says_that_there_are_none() {
    let folder = Folder::new("history-captures");
    let (_store, _) = written(&folder);
    let past = past(&folder);
    let [a, b, c] = ["a", "b", "c"].map(|drive| past.frames(drive, 0, i64::MAX).unwrap().remove(0));
    let of_a = FrameCaptureView {
        from_unix_ms: BEGIN_MS + 40_000,
        to_unix_ms: BEGIN_MS + 150_000,
        frames: 61 + 10 + 40,
        left_out: 7,
        is_cut: true,
    };
    assert_eq!((a.capture.as_ref(), b.capture.as_ref(), c.capture), (Some(&of_a), Some(&of_a), None));
    // Its bytes are those of a capture, for whoever reads captures.
    let file = past.capture("a", a.at_unix_ms).unwrap();
    let recording = capture::read(&file).unwrap();
    assert_eq!(recording.dissector, Dissector::Rtu);
    let whole: Vec<Captured> = [frames("north", 40..=100), frames("north", 101..=150)]
        .into_iter()
        .flat_map(|part| part.frames)
        .collect();
    assert_eq!(recording.frames, whole);
    for (drive, at) in [("c", c.at_unix_ms), ("a", 7), ("nobody", 7)] {
        assert!(matches!(past.capture(drive, at), Err(PastError::Asked(_))), "{drive}");
    }
}

#[test]
fn what_captures_have_heard_goes_with_the_last_freeze_frame_that_has_it() {
    let folder = Folder::new("history-captures-gone");
    let (mut store, archive) = written(&folder);
    assert_eq!(kept(&store.connection), 4);
    store.connection.execute("DELETE FROM frame WHERE drive = 'a'", []).unwrap();
    let tiny = Limits { bytes: 1, ..Limits::default() };
    let mut left = vec![kept(&store.connection)];
    while tidy::trim(&mut store.connection, archive.lived(moment(MARKED_EVERY_MS * 2)), &tiny).unwrap() {
        left.push(kept(&store.connection));
    }
    assert_eq!((left[0], left.last()), (4, Some(&0)));
}

#[test]
fn a_full_disk_keeps_no_more_of_captures_than_there_is_room_for_and_counts_the_rest() {
    let mut archive = Archive::begin(moment(0));
    let mut random = fastrand::Rng::with_seed(3);
    let noise: Vec<Captured> = (0..4_000)
        .map(|number| Captured {
            at: Duration::from_millis(number),
            direction: Direction::Received,
            bytes: (0..250).map(|_| random.u8(..)).collect(),
        })
        .collect();
    for _ in 0..8 {
        heard(&mut archive, moment(0), LineFrames { frames: noise.clone(), ..frames("north", 0..=0) });
    }
    let Lost { records, .. } = archive.lost();
    assert!((4..8).contains(&records), "{records}");
    // And the way to it has its bound too.
    let inbox = Inbox::default();
    for _ in 0..20 {
        inbox.frames(LineFrames { frames: noise.clone(), ..frames("north", 0..=0) });
    }
    let batch = inbox.take(Duration::ZERO);
    assert_eq!((batch.frames.len(), batch.lost.records), (16, 4));
}

#[test]
fn a_file_of_the_fourth_version_is_read_as_it_stands_and_brought_to_this_one() {
    let folder = Folder::new("history-captures-fourth");
    let (store, _) = written(&folder);
    store
        .connection
        .execute_batch("DROP TABLE captured; DROP INDEX frame_on_line; ALTER TABLE frame DROP COLUMN line; PRAGMA user_version = 4;")
        .unwrap();
    drop(store);
    let path = folder.file("history.sqlite");
    let history = History::open(&path).unwrap();
    let of_a =
        |connection: &Connection| read::frames(connection, "a", 0, i64::MAX).unwrap().remove(0).capture;
    assert_eq!(of_a(&history.0), None);
    assert_eq!(read::capture(&history.0, "a", BEGIN_MS + 100_000).unwrap(), None);
    drop(history);
    let mut store = store::open(&path).unwrap().store;
    assert_eq!(of_a(&store.connection), None);
    let mut archive = Archive::begin(moment(300_000));
    archive.begin_run(&mut store.connection, "test").unwrap();
    archive.record(trip(400, "a", "north"));
    heard(&mut archive, moment(400_000), frames("north", 390..=410));
    archive.end_run(&mut store.connection, moment(500_000)).unwrap();
    let newest = read::frames(&store.connection, "a", 0, i64::MAX).unwrap().pop().unwrap();
    assert_eq!(newest.capture.map(|heard| heard.frames), Some(21));
}
