//! Power is cut at any write: the file is made again as the disk may have it then, and opened. `DRIVED_HISTORY_CUTS` says how often; 150 unless it is
//! said.

use std::{env, fs, path::Path};

use drived_config::testing::Folder;
use drived_history::{
    quantity::{Quantity, Set},
    read::{self, Filter, records},
    record::{Kind, Moment, Record},
    store::{self, Store},
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Shown},
    },
};

const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;
/// What a disk writes as a whole.
const SECTOR: usize = 512;

/// What had been written when the log was so long.
#[derive(Debug, Clone, Copy)]
struct Said {
    log: usize,
    records: i64,
    /// Up to which second values are there.
    values: i64,
}

/// The file with its log, as they stood when it had been written; and what was said to be written when.
struct Disk {
    file: Vec<u8>,
    log: Vec<u8>,
    said: Vec<Said>,
    /// The file once its log has been carried over into it.
    carried: Vec<u8>,
}

fn written(path: &Path) -> Disk {
    let at = |second: i64| Moment { steady_ms: second * 1_000, wall_ms: second * 1_000 };
    let log = path.with_extension("sqlite-wal");
    let mut store = store::open(path).unwrap().store;
    let mut archive = Archive::begin(at(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let _: (i64, i64, i64) = store
        .connection
        .query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
        .unwrap();
    let file = fs::read(path).unwrap();
    let mut tracker = Tracker::default();
    let mut said = vec![Said { log: 0, records: 0, values: 0 }];
    for second in 1..=400 {
        let now = at(second);
        let seen = tracker.see(now.steady_ms, 3_000, &[(HZ, second * 10)]).unwrap();
        let shown = vec![Shown { drive: "pump".into(), set: Set::Status, seen }];
        archive.take(Batch { shown, ..Batch::default() }, now);
        let mut last = *said.last().unwrap();
        if second % 7 == 0 {
            let event = Record::of_history(now, "event", (last.records + 1).to_string());
            archive.record(Record { kind: Kind::Event, drive: Some("pump".into()), ..event });
            archive.write_records(&mut store.connection, now).unwrap();
            last.records += 1;
        }
        if archive.is_due(now) {
            archive.close(now);
            archive.write_values(&mut store.connection).unwrap();
            last.values = second;
        }
        last.log = usize::try_from(fs::metadata(&log).unwrap().len()).unwrap();
        said.push(last);
    }
    assert_eq!(fs::read(path).unwrap(), file, "all of it is in the log");
    let log = fs::read(&log).unwrap();
    let _: (i64, i64, i64) = store
        .connection
        .query_row("PRAGMA wal_checkpoint(FULL)", [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
        .unwrap();
    Disk { file, log, said, carried: fs::read(path).unwrap() }
}

/// Opens a file that is made of this; gives how many records there are, and up to which second values.
fn opened(folder: &Folder, name: &str, file: &[u8], log: &[u8]) -> (i64, i64) {
    let path = folder.file(&format!("{name}.sqlite"));
    fs::write(&path, file).unwrap();
    fs::write(path.with_extension("sqlite-wal"), log).unwrap();
    let opened = store::open(&path).unwrap();
    assert_eq!(opened.aside, None, "{name}: it is no damage");
    let Store { connection, .. } = opened.store;
    let whole: String = connection.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
    assert_eq!(whole, "ok", "{name}");
    let filter =
        Filter { from_ms: 0, to_ms: i64::MAX, kind: Some("event"), limit: usize::MAX, ..Filter::default() };
    let told = records(&connection, &filter).unwrap().records;
    for (number, found) in (1..).zip(&told) {
        assert_eq!(found.text, i64::to_string(&number), "{name}: each once, none left out");
    }
    let pieces = read::pieces(&connection, "pump", HZ, 0, i64::MAX).unwrap();
    for point in pieces.iter().flat_map(|piece| &piece.points) {
        assert!(point.count.is_none_or(|count| count * 100 == point.at), "{name}: {point:?}");
    }
    let end = pieces.iter().map(|piece| piece.end).max().unwrap_or_default();
    for ending in ["sqlite", "sqlite-wal", "sqlite-shm"] {
        let _ = fs::remove_file(path.with_extension(ending));
    }
    (i64::try_from(told.len()).unwrap(), end / 1_000)
}

#[test]
fn a_power_cut_takes_what_was_not_said_to_be_written_and_nothing_else() {
    let folder = Folder::new("history-power");
    let disk = written(&folder.file("history.sqlite"));
    let cuts = env::var("DRIVED_HISTORY_CUTS").ok().and_then(|said| said.parse().ok()).unwrap_or(150);
    let mut random = fastrand::Rng::with_seed(30);
    for cut in 0..cuts {
        // The log ends anywhere, and behind that, to the end of a sector or of a few, stands what stood there before.
        let length = random.usize(..=disk.log.len());
        let mut log = disk.log[..length].to_vec();
        log.extend((0..random.usize(..=3 * SECTOR)).map(|_| random.u8(..)));
        let said = disk.said.iter().rev().find(|said| said.log <= length).unwrap();
        let found = opened(&folder, &format!("cut-{cut}"), &disk.file, &log);
        assert_eq!(found, (said.records, said.values), "cut at {length}");
    }
}

#[test]
fn a_power_cut_while_the_log_is_carried_over_takes_nothing() {
    let folder = Folder::new("history-carried");
    let disk = written(&folder.file("history.sqlite"));
    let last = *disk.said.last().unwrap();
    assert!(disk.carried != disk.file, "it was carried over");
    let mut random = fastrand::Rng::with_seed(31);
    for cut in 0..40 {
        // Any of its sectors is there as it was before, or as it is to become.
        let mut file = disk.carried.clone();
        for (place, sector) in file.chunks_mut(SECTOR).enumerate() {
            let from = place * SECTOR;
            if let Some(before) = disk.file.get(from..from + sector.len())
                && random.bool()
            {
                sector.copy_from_slice(before);
            }
        }
        let found = opened(&folder, &format!("carried-{cut}"), &file, &disk.log);
        assert_eq!(found, (last.records, last.values));
    }
}
