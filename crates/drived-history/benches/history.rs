//! What the history costs, measured: what writing takes of a core and of the disk, how soon a question is answered, how large it becomes.
//!
//! `cargo bench -p drived-history`. Quicker to build, and hardly slower: `cargo bench -p drived-history --profile dev` with
//! `--config profile.dev.package.NAME.opt-level=3` for `drived-history`, `miniz_oxide`, `simd-adler32`, `flate2`, `rusqlite` and `libsqlite3-sys`.

use std::{
    fs,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use drive_bus::capture::{Captured, Direction, Dissector};
use drived_config::testing::Folder;
use drived_history::{
    quantity::{Quantity, Set},
    read,
    record::{Kind, LineFrames, Moment, Record},
    store,
    tracker::Tracker,
    write::{
        archive::Archive,
        inbox::{Batch, Shown},
        tidy,
    },
};
use rusqlite::Connection;

/// 2026-11-21 00:00 UTC.
const BEGIN_MS: i64 = 1_795_219_200_000;
const MINUTE_MS: i64 = 60_000;
const HOUR_MS: i64 = 3_600_000;
const DAY_MS: i64 = 24 * HOUR_MS;

fn main() {
    println!("| What | Goal | Measured |\n|---|---|---|");
    // What it takes of a core, with blocks of ten minutes; and how large the blocks of whole hours become.
    writing(1_000, 660, "1 000 drives with 8 values a second, all of which move");
    let bytes_a_value =
        writing(20, 7_500, "20 drives with 8 values a second for two hours, all of which move");
    years(bytes_a_value);
    captured();
}

fn row(what: &str, goal: &str, measured: &str) {
    println!("| {what} | {goal} | {measured} |");
}

fn at(steady_ms: i64) -> Moment {
    Moment { steady_ms, wall_ms: BEGIN_MS + steady_ms }
}

/// What this process has used of its processor, and holds in memory.
fn used() -> (Duration, u64) {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks =
        |place: usize| fields.get(place).and_then(|ticks| ticks.parse::<u64>().ok()).unwrap_or_default();
    // utime and stime are the 14th and 15th field, in hundredths of a second; rss is the 24th, in pages.
    (Duration::from_millis((ticks(11) + ticks(12)) * 10), ticks(21) * 4_096)
}

struct Drive {
    name: Arc<str>,
    tracker: Tracker,
    values: [i64; 8],
}

/// Eight that move at each reading by more than they need to be kept: what a running motor shows, with a noisy load.
const EIGHT: [(u32, i64); 8] = [(1, 20), (3, 4), (5, 20), (10, 9), (11, 30), (14, 40), (16, 120), (18, 9)];

impl Drive {
    fn new(number: usize) -> Self {
        Self { name: format!("drive {number}").into(), tracker: Tracker::default(), values: [3_000; 8] }
    }

    fn read(&mut self, steady: i64, random: &mut fastrand::Rng) -> Option<Shown> {
        let mut shown = [(Quantity::STATE, 3); 9];
        for ((value, (number, moves)), place) in self.values.iter_mut().zip(EIGHT).zip(&mut shown[1..]) {
            let least = Quantity(number).deadband() + 1;
            let by = random.i64(least..=least + moves);
            *value += if *value > 3_000 { -by } else { by };
            *place = (Quantity(number), *value);
        }
        let seen = self.tracker.see(steady, 3_000, &shown)?;
        Some(Shown { drive: Arc::clone(&self.name), set: Set::Status, seen })
    }
}

/// Drives with eight values a second, all of which move, for so many seconds. It gives the bytes of a value.
fn writing(count: usize, seconds: i64, what: &str) -> f64 {
    let folder = Folder::new(&format!("history-bench-{count}"));
    let path = folder.file("history.sqlite");
    let mut store = store::open(&path).unwrap().store;
    let mut random = fastrand::Rng::with_seed(30);
    let mut archive = Archive::begin(at(0));
    archive.begin_run(&mut store.connection, "bench").unwrap();
    let mut drives: Vec<Drive> = (0..count).map(Drive::new).collect();
    let (mut values, mut making) = (0_u64, Duration::ZERO);
    let (processor, _) = used();
    let (mut before, mut most) = (0, 0);
    for second in 0..seconds {
        // What is to be kept is made here, and not by the history.
        let (began, _) = used();
        let mut readings = Vec::with_capacity(count);
        for (place, drive) in drives.iter_mut().enumerate() {
            readings.push((second * 1_000 + i64::try_from(place).unwrap() + random.i64(-3..=3), drive));
        }
        making += used().0 - began;
        let shown: Vec<Shown> =
            readings.into_iter().filter_map(|(steady, drive)| drive.read(steady, &mut random)).collect();
        values += shown.iter().map(|shown| shown.seen.changed.len() as u64).sum::<u64>();
        let now = at(second * 1_000 + 999);
        archive.take(Batch { shown, ..Batch::default() }, now);
        if archive.is_due(now) {
            archive.close(now);
            archive.write_values(&mut store.connection).unwrap();
            while tidy::compact(&mut store.connection, now.wall_ms).unwrap() {}
        }
        let (_, memory) = used();
        if second == 5 {
            before = memory;
        }
        most = most.max(memory);
    }
    let written = used().0;
    archive.end_run(&mut store.connection, at(seconds * 1_000)).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    let share = |spent: Duration| spent.as_secs_f64() / seconds as f64 * 100.0;
    let (writing, tidying) = (share(written - processor - making), share(used().0 - written));
    let bytes = sizes(&store.connection);
    let of = |table: &str| {
        bytes.iter().filter(|(name, _)| name.starts_with(table)).map(|(_, size)| size).sum::<u64>()
    };
    let a_value = of("block") as f64 / values as f64;
    row(
        &format!("{what}: of a core, the making of the values included, and the last blocks"),
        "5 %",
        &format!("{:.2} %: {writing:.2} to write it, {tidying:.2} to make blocks of it", writing + tidying),
    );
    row("the same, bytes a value on the disk", "3", &format!("{a_value:.2}, of {values} values"));
    let grown = most.saturating_sub(before) as f64 / f64::from(1 << 20);
    row("the same, growth of memory", "16 MiB", &format!("{grown:.1} MiB"));
    a_value
}

/// Bytes of each table and index.
fn sizes(connection: &Connection) -> Vec<(String, u64)> {
    let mut find = connection.prepare("SELECT name, sum(pgsize) FROM dbstat GROUP BY name").unwrap();
    let rows = find.query_map([], |row| Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?))).unwrap();
    let of =
        |row: rusqlite::Result<(String, i64)>| row.map(|(name, size)| (name, size.unsigned_abs())).unwrap();
    rows.map(of).collect()
}

/// 31 drives through 91 days, one value of each, and what becomes of ten years.
fn years(bytes_a_value: f64) {
    const DRIVES: usize = 31;
    const DAYS: i64 = 91;
    const EVERY_MS: i64 = 60_000;
    let folder = Folder::new("history-bench-years");
    let path = folder.file("history.sqlite");
    let mut store = store::open(&path).unwrap().store;
    let mut random = fastrand::Rng::with_seed(31);
    let mut archive = Archive::begin(at(0));
    archive.begin_run(&mut store.connection, "bench").unwrap();
    let mut trackers: Vec<(Arc<str>, Tracker, i64)> =
        (0..DRIVES).map(|number| (format!("drive {number}").into(), Tracker::default(), 3_000)).collect();
    let mut steady = 0;
    while steady < DAYS * DAY_MS {
        steady += EVERY_MS;
        let now = at(steady);
        let mut shown = Vec::with_capacity(DRIVES);
        for (name, tracker, hertz) in &mut trackers {
            *hertz = (*hertz + random.i64(-9..=9)).clamp(2_000, 5_000);
            let values = [(Quantity::STATE, 3), (Quantity::OUTPUT_FREQUENCY, *hertz)];
            let seen = tracker.see(steady, 2 * EVERY_MS, &values);
            shown.extend(seen.map(|seen| Shown { drive: Arc::clone(name), set: Set::Status, seen }));
        }
        archive.take(Batch { shown, ..Batch::default() }, now);
        if steady % HOUR_MS == 0 {
            archive.close(now);
            archive.write_values(&mut store.connection).unwrap();
            while tidy::compact(&mut store.connection, now.wall_ms).unwrap() {}
        }
    }
    for number in 0..1_000 {
        archive.record(a_trip(number));
    }
    archive.end_run(&mut store.connection, at(steady)).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    questions(&path, steady);
    let bytes = sizes(&store.connection);
    let of = |names: &[&str]| -> f64 {
        let sum: u64 =
            bytes.iter().filter(|(name, _)| names.contains(&name.as_str())).map(|(_, size)| size).sum();
        sum as f64
    };
    let series = DRIVES as f64 * DAYS as f64;
    let a_minute = of(&["minute", "minute_of"]) / series / 1_440.0;
    let a_row = of(&["hour"]) / series / 24.0;
    let a_record = of(&["record", "record_at", "sqlite_autoindex_record_1"]) / 1_000.0;
    // A pack of hours is what a pack of minutes is, in other steps.
    let packed = packed_hour(&store.connection);
    row(
        "bytes of a minute, of an hour as a row (90 days), of an hour in a pack (older), of a record",
        "",
        &format!("{a_minute:.2}, {a_row:.1}, {packed:.2}, {a_record:.0}"),
    );
    // Sixteen numbers of each drive; half of them move at each poll, and so does nothing at night: as if it were all day.
    let numbers = DRIVES as f64 * 16.0;
    let polled = DRIVES as f64 * 8.0 * 2.0 * 86_400.0 * bytes_a_value;
    let minutes = numbers * 90.0 * 1_440.0 * a_minute;
    let hours = numbers * 24.0 * (90.0 * a_row + (3_652.0 - 90.0) * packed);
    let records = DRIVES as f64 * 3_652.0 * 10.0 * a_record;
    let gigabytes = (polled + minutes + hours + records) / 1e9;
    row(
        "31 drives for ten years: 8 values a second that all move, 16 in minutes and hours, 10 events a drive and day",
        "2 GB",
        &format!(
            "{gigabytes:.2} GB: {:.0} MB as polled, {:.0} minutes, {:.0} hours, {:.0} records",
            polled / 1e6,
            minutes / 1e6,
            hours / 1e6,
            records / 1e6
        ),
    );
}

/// Bytes of an hour in a pack, of those that are there as rows.
fn packed_hour(connection: &Connection) -> f64 {
    let mut find = connection
        .prepare("SELECT start_ms, least, mean, greatest, known_ms FROM hour WHERE source = 1 AND quantity = 1 LIMIT 720")
        .unwrap();
    let rows = find.query_map([], |row| {
        let (least, mean, greatest) = (row.get(1)?, row.get(2)?, row.get(3)?);
        Ok((row.get(0)?, drived_history::curve::Step { least, mean, greatest, known_ms: row.get(4)? }))
    });
    let hours: Vec<(i64, drived_history::curve::Step)> = rows.unwrap().map(Result::unwrap).collect();
    let bytes = read::pack_steps(HOUR_MS, hours[0].0, &hours).len();
    bytes as f64 / hours.len() as f64
}

/// As many frames of a capture as are taken at once: 31 drives that are read in their turn.
fn captured() {
    const FRAMES: usize = 16_384;
    let folder = Folder::new("history-bench-captured");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let mut random = fastrand::Rng::with_seed(32);
    let mut archive = Archive::begin(at(0));
    archive.begin_run(&mut store.connection, "bench").unwrap();
    let frame = |number: usize| {
        let slave = u8::try_from(number / 2 % 31 + 1).unwrap();
        let bytes: Vec<u8> = match number % 2 {
            0 => vec![slave, 3, 0x0C, 0x81, 0, 6, random.u8(..), random.u8(..)],
            _ => [slave, 3, 12, 6, 0x27].into_iter().chain((0..12).map(|_| random.u8(..))).collect(),
        };
        let direction = if number.is_multiple_of(2) { Direction::Sent } else { Direction::Received };
        let at = Duration::from_micros(number as u64 * 9_000 + random.u64(..200));
        Captured { at, direction, bytes: bytes.into() }
    };
    let frames = LineFrames {
        line: "north".into(),
        dissector: Dissector::Rtu,
        first_ms: 0,
        last_ms: 147_000,
        frames: (0..FRAMES).map(frame).collect(),
        left_out: 0,
        is_cut: false,
    };
    let (began, _) = used();
    archive.take(Batch { frames: vec![frames], ..Batch::default() }, at(0));
    archive.write_values(&mut store.connection).unwrap();
    let spent = used().0 - began;
    let bytes: i64 =
        store.connection.query_row("SELECT sum(length(data)) FROM captured", [], |row| row.get(0)).unwrap();
    row(
        "16 384 frames of a capture, of 12 bytes in the mean, put beside a freeze-frame: of the thread that writes",
        "",
        &format!("{} ms, {:.1} bytes a frame", spent.as_millis(), bytes as f64 / FRAMES as f64),
    );
}

/// As long as the API's telling of a trip is.
fn a_trip(number: i64) -> Record {
    let body = serde_json::json!({
        "order": number, "time_unix_ms": BEGIN_MS + number, "drive": "drive 7", "event": "state_changed", "from": "ready",
        "to": "running", "alarm": false, "text": "state changed: ready to running",
        "cause": {"by": "command", "commander": "operator", "door": "page", "act": format!("page-{number}")},
        "words": [{"address": 3_201, "code": "ETA", "value": 567, "before": 563}],
    });
    Record {
        kind: Kind::Event,
        drive: Some("drive 7".to_owned()),
        line: Some("north".to_owned()),
        body: Some(body.to_string()),
        ..Record::of_history(at(number), "state_changed", "state changed: ready to running")
    }
}

/// The best of a few tries, with the file open as a face opens it: anew. And what one took of the processor, which others do not want meanwhile.
fn time<T>(mut ask: impl FnMut() -> T) -> String {
    const TRIES: u32 = 5;
    let (began, _) = used();
    let once = |ask: &mut dyn FnMut() -> T| {
        let began = Instant::now();
        std::hint::black_box(ask());
        began.elapsed()
    };
    let best = (0..TRIES).map(|_| once(&mut ask)).min().unwrap_or_default();
    let processor = (used().0 - began) / TRIES;
    format!("{:.1} ms; {} ms of processor", best.as_secs_f64() * 1e3, processor.as_millis())
}

fn questions(path: &Path, steady: i64) {
    let open = || read::History::open(path).unwrap();
    let (hz, end) = (Quantity::OUTPUT_FREQUENCY, BEGIN_MS + steady);
    let day = time(|| {
        let (history, mut points) = (open(), 0_u64);
        let each = |_| {
            points += 1;
            Ok::<_, store::StoreError>(true)
        };
        read::points(&history.0, "drive 7", hz, end - DAY_MS, end, each).unwrap();
        points
    });
    row("a day of one value, every point", "50 ms", &day);
    for (what, every) in [("hours", HOUR_MS), ("quarters of an hour", 15 * MINUTE_MS)] {
        let all = time(|| {
            let history = open();
            (0..31)
                .map(|number| {
                    let drive = format!("drive {number}");
                    let from = end - 90 * DAY_MS;
                    read::steps(&history.0, &drive, hz, from, end, every, &|| true).unwrap().len()
                })
                .sum::<usize>()
        });
        row(&format!("90 days of 31 drives in {what}"), "300 ms", &all);
    }
}
