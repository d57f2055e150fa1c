//! Ten years are asked for at once: the answer has an end, and so has the memory that it takes. It is a program of its own, because it looks at the
//! most memory that there ever was.
#![cfg(target_os = "linux")]

use std::fs;

use drived_config::testing::Folder;
use drived_history::{
    quantity::Quantity,
    read::{self, History},
    record::Moment,
    store::{self, StoreError},
    write::archive::Archive,
};

/// 2026-11-21 00:00 UTC.
const BEGIN_MS: i64 = 1_795_219_200_000;
const HOUR_MS: i64 = 3_600_000;
const HOURS: i64 = 87_600;
/// So many changes of its state in each hour.
const CHANGES: i64 = 6;

/// The most memory that this process ever had, in KiB.
fn most_memory() -> i64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

#[test]
fn ten_years_are_read_in_bounded_memory_and_given_up_at_once() {
    let folder = Folder::new("history-ten-years");
    let path = folder.file("history.sqlite");
    let mut store = store::open(&path).unwrap().store;
    let begin = Moment { steady_ms: 0, wall_ms: BEGIN_MS };
    Archive::begin(begin).begin_run(&mut store.connection, "test").unwrap();
    store
        .connection
        .execute_batch(&format!(
            "INSERT INTO source (id, drive, part) VALUES (1, 'pump', 'status');
             WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < {HOURS} - 1)
             INSERT INTO hour SELECT 1, 1, {BEGIN_MS} + i * {HOUR_MS}, i % 4000, i % 4000 + 50, i % 4000 + 100, {HOUR_MS} FROM n;
             WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < {HOURS} * {CHANGES} - 1)
             INSERT INTO change SELECT 1, 0, {BEGIN_MS} + i * {HOUR_MS} / {CHANGES}, 1, 2 + i % 2 FROM n;"
        ))
        .unwrap();
    drop(store);
    let history = History::open(&path).unwrap();
    let (from, to) = (BEGIN_MS, BEGIN_MS + HOURS * HOUR_MS);
    let before = most_memory();

    let mut told = 0_i64;
    read::points(&history.0, "pump", Quantity::STATE, from, to, |_| {
        told += 1;
        Ok::<_, StoreError>(true)
    })
    .unwrap();
    assert_eq!(told, HOURS * CHANGES + 1, "each change, and that nothing is known behind the last");
    let every = |length_ms: i64| {
        read::steps(&history.0, "pump", Quantity::OUTPUT_FREQUENCY, from, to - 1, length_ms, &|| true)
            .unwrap()
    };
    // Days of 24 hours since 1970, as they are asked for here.
    let days = every(24 * HOUR_MS);
    assert_eq!(i64::try_from(days.len()).unwrap(), HOURS / 24);
    assert!(days.iter().all(|day| day.known == 1.0));
    let grown = most_memory() - before;
    println!("{told} points and {} steps of ten years: {grown} KiB of memory more at the most", days.len());
    assert!(grown < 16 << 10, "{grown} KiB");

    // Whoever goes gets no more.
    let mut told = 0;
    read::points(&history.0, "pump", Quantity::STATE, from, to, |_| {
        told += 1;
        Ok::<_, StoreError>(told < 10)
    })
    .unwrap();
    assert_eq!(told, 10);
    let looked = std::cell::Cell::new(0);
    let go_on = || {
        looked.set(looked.get() + 1);
        looked.get() < 3
    };
    read::steps(&history.0, "pump", Quantity::STATE, from, to, HOUR_MS, &go_on).unwrap();
    assert_eq!(looked.get(), 3, "it is looked at once a part, and it ends with it");
}
