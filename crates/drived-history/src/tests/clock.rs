//! A wall's clock that is set back: what is told of a time that it had twice, and of one that ends before it begins.

use drived_config::testing::Folder;

use super::{BEGIN_MS, Pump, event};
use crate::{
    quantity::Quantity,
    read::{self, Filter, Reading},
    record::Moment,
    store::{self, Store},
    write::archive::Archive,
};

const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;
const HOUR_S: i64 = 3_600;

/// A pump of which each second tells its number, by these clocks: the seconds of a run, and by how many seconds the wall's is back in them.
fn lived(folder: &Folder, runs: &[&[(std::ops::Range<i64>, i64)]]) -> Store {
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    for run in runs {
        let at = |second: i64, back: i64| Moment {
            steady_ms: (second - run[0].0.start) * 1_000,
            wall_ms: BEGIN_MS + (second - back) * 1_000,
        };
        let mut archive = Archive::begin(at(run[0].0.start, run[0].1));
        let mut pump = Pump::of("pump");
        archive.begin_run(&mut store.connection, "test").unwrap();
        let mut last = at(0, 0);
        for (seconds, back) in *run {
            for second in seconds.clone() {
                let now = at(second, *back);
                archive.look_at_clock(now);
                pump.read(&mut archive, now, &[(HZ, second * 10)]);
                if second % 300 == 0 {
                    archive.record(event(now, "pump", &format!("event {second}")));
                }
                last = now;
            }
        }
        archive.end_run(&mut store.connection, last).unwrap();
    }
    store
}

/// The first and the last second of which a value of this reading is told, and its events.
fn told(store: &Store, reading: &Reading) -> (i64, i64, Vec<String>) {
    let pieces = reading.pieces(&store.connection, "pump", HZ).unwrap();
    let counts: Vec<i64> =
        pieces.iter().flat_map(|piece| &piece.points).filter_map(|point| point.count).collect();
    let filter = Filter { from_ms: reading.from_ms, to_ms: reading.to_ms, limit: 1_000, ..Filter::default() };
    let records = read::records(&store.connection, &filter).unwrap().records;
    let of_pump =
        records.iter().filter(|found| found.drive.is_some() && reading.has(found.run, found.steady_ms));
    (counts[0] / 10, counts[counts.len() - 1] / 10, of_pump.map(|found| found.what.clone()).collect())
}

fn readings(store: &Store, from: i64, to: i64) -> Vec<(i64, i64, Vec<String>)> {
    let [from, to] = [from, to].map(|second| BEGIN_MS + second * 1_000);
    let readings = read::readings(&store.connection, from, to).unwrap();
    readings.iter().map(|reading| told(store, reading)).collect()
}

fn events<const N: usize>(seconds: [i64; N]) -> Vec<String> {
    seconds.map(|second| format!("event {second}")).to_vec()
}

#[test]
fn a_time_that_ends_before_it_begins_has_what_was_before_the_clock_was_set_back_and_what_was_after() {
    let folder = Folder::new("history-turned");
    // It runs for two hours, is set back by one, and runs for two more.
    let store = lived(&folder, &[&[(0..2 * HOUR_S, 0), (2 * HOUR_S..4 * HOUR_S, HOUR_S)]]);
    let told = readings(&store, 2 * HOUR_S - 400, HOUR_S + 400);
    assert_eq!(told, [(6_800, 7_199, events([6_900])), (7_200, 7_600, events([7_200, 7_500]))]);
    // It was twice, so that each is told by itself.
    let told = readings(&store, HOUR_S + 100, HOUR_S + 500);
    assert_eq!(told, [(3_700, 4_100, events([3_900])), (7_300, 7_700, events([7_500]))]);
    let once = readings(&store, 100, 500);
    assert_eq!(once, [(100, 500, events([300]))]);
    assert_eq!(readings(&store, 2 * HOUR_S + 400, HOUR_S + 400), [], "the clock had not come so far");
    let reading = &read::readings(&store.connection, BEGIN_MS + 7_000_000, BEGIN_MS + 3_700_000).unwrap()[0];
    let steps =
        reading.steps(&store.connection, "pump", HZ, 60_000).unwrap().expect("it is kept as it was read");
    assert!(steps.iter().all(|step| step.least >= 700.0 && step.greatest < 720.0), "{steps:?}");
}

/// As behind a kill within the minute, or where it is asked before what was read since is written.
#[test]
fn values_of_before_are_not_told_again_as_those_after_a_clock_was_set_back_of_which_there_are_none_yet() {
    let folder = Folder::new("history-turned-killed");
    let mut store = lived(&folder, &[&[(0..HOUR_S, 0)]]);
    let at = |second: i64, back: i64| Moment {
        steady_ms: second * 1_000,
        wall_ms: BEGIN_MS + (HOUR_S + second - back) * 1_000,
    };
    let mut archive = Archive::begin(at(0, 0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    archive.look_at_clock(at(1, HOUR_S / 2));
    archive.record(event(at(1, HOUR_S / 2), "pump", "stop"));
    archive.end_run(&mut store.connection, at(2, HOUR_S / 2)).unwrap();
    let readings = read::readings(&store.connection, BEGIN_MS, BEGIN_MS + HOUR_S * 1_000).unwrap();
    let steps = |reading: &Reading| reading.steps(&store.connection, "pump", HZ, 60_000).unwrap();
    let [before, after] = &readings[..] else { panic!("{readings:?}") };
    assert_eq!(steps(before).map(|steps| steps.len()), Some(60));
    assert_eq!(steps(after), Some(Vec::new()), "nothing was read since");
}

#[test]
fn a_clock_that_stood_lower_when_the_program_began_again_is_told_likewise() {
    let folder = Folder::new("history-turned-run");
    let store = lived(&folder, &[&[(0..HOUR_S, 0)], &[(HOUR_S..2 * HOUR_S, HOUR_S / 2)]]);
    let told = readings(&store, HOUR_S - 100, HOUR_S / 2 + 100);
    assert_eq!(told, [(3_500, 3_599, Vec::new()), (3_600, 3_700, events([3_600]))]);
}
