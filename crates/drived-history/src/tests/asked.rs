//! What the faces ask, on a file whose story is known: curves, moments, days, records, and who gives up.

use std::sync::Arc;

use drived_config::testing::Folder;
use drived_plant::plant::past::{
    CurvesAsked, DaysAsked, GivenUp, IsView, Past as _, PastError, RecordsAsked, ValuesAsked,
};

use super::{BEGIN_MS, Pump, event, moment};
use crate::{
    clocks::Clocks,
    past::InFile,
    quantity::Quantity,
    record::{LineMinute, Record},
    store::{self, Store},
    write::{
        Limits,
        archive::Archive,
        inbox::{Batch, Inbox},
        tidy,
    },
};

const MINUTE_MS: i64 = 60_000;
const HOUR_MS: i64 = 60 * MINUTE_MS;
const WAITING: fn() -> GivenUp = GivenUp::default;

/// Two pumps through two hours. `a` runs at 10 Hz for half an hour, then at 20 Hz to the end of the first hour; for ten minutes nobody hears of it;
/// then it is ready, at 0 Hz, and runs at 30 Hz in the last twenty minutes. `b` is ready all the time.
fn lived(folder: &Folder) -> (InFile, Store) {
    let path = folder.file("history.sqlite");
    let mut store = store::open(&path).unwrap().store;
    let (mut archive, mut a, mut b) = (Archive::begin(moment(0)), Pump::of("a"), Pump::of("b"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for second in 0..=7_200 {
        let now = moment(second * 1_000);
        let (hertz, state) = match second {
            0..1_800 => (1_000, 3),
            1_800..3_600 => (2_000, 3),
            3_600..6_000 => (0, 2),
            _ => (3_000, 3),
        };
        let shown = [
            (Quantity::OUTPUT_FREQUENCY, hertz),
            (Quantity::STATE, state),
            (Quantity::OUTPUT_POWER, hertz / 10),
        ];
        if !(3_600..4_200).contains(&second) {
            a.read(&mut archive, now, &shown);
        }
        b.read(&mut archive, now, &[(Quantity::OUTPUT_FREQUENCY, 0), (Quantity::STATE, 2)]);
        if archive.is_due(now) {
            archive.close(now);
            archive.write_values(&mut store.connection).unwrap();
        }
    }
    let line = LineMinute {
        wall_ms: BEGIN_MS + MINUTE_MS,
        line: "north".into(),
        sent: 120,
        answered: 118,
        damaged: 1,
        missing: 1,
        foreign: 4,
        silences: 120,
        silence_us: Some(2_000),
        busy_permille: 700,
        is_open: true,
    };
    archive.take(Batch { lines: vec![line], ..Batch::default() }, moment(0));
    let told = |at: i64, drive: &str, what: &str, text: &str| Record {
        text: text.to_owned(),
        ..event(moment(at * 1_000), drive, what)
    };
    archive.record(told(100, "a", "tripped", "tripped"));
    archive.record(told(101, "a", "trip_explained", "trip explained: 18 ObF: DC bus overvoltage"));
    archive.record(Record { is_alarm: true, ..told(200, "b", "lost", "lost for 2.0 s") });
    archive.record(told(300, "a", "tripped", "tripped: 18 ObF: DC bus overvoltage"));
    archive.end_run(&mut store.connection, moment(7_200_000)).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    let (inbox, clocks, done) = (Inbox::default(), Clocks::begin(), Arc::default());
    (InFile { path, limits: Limits::default(), inbox, clocks, done }, store)
}

fn curves(every_ms: i64) -> CurvesAsked {
    CurvesAsked {
        drives: Vec::new(),
        values: vec!["output_frequency_hz".to_owned(), "state".to_owned()],
        from_unix_ms: BEGIN_MS,
        to_unix_ms: BEGIN_MS + 2 * HOUR_MS - 1,
        every_ms,
    }
}

#[test]
fn curves_of_several_drives_have_one_grid_and_nothing_stands_where_nothing_is_known() {
    let folder = Folder::new("history-curves");
    let (past, _store) = lived(&folder);
    let told = past.curves(&curves(10 * MINUTE_MS), &WAITING()).unwrap();
    assert_eq!((told.from_unix_ms, told.steps, told.curves.len()), (BEGIN_MS, 12, 4));
    let [hertz, state, other, _] = &told.curves[..] else { panic!("{told:?}") };
    assert_eq!((&*hertz.drive, &*hertz.value, &*other.drive), ("a", "output_frequency_hz", "b"));
    let some = |values: [f64; 12]| values.map(|value| (value >= 0.0).then_some(value)).to_vec();
    let gap = -1.0;
    assert_eq!(hertz.mean, some([10.0, 10.0, 10.0, 20.0, 20.0, 20.0, gap, 0.0, 0.0, 0.0, 30.0, 30.0]));
    assert_eq!(hertz.least, hertz.mean);
    assert_eq!((hertz.known[0], hertz.known[6], hertz.known[11]), (1.0, 0.0, 1.0));
    assert_eq!(state.greatest, some([3.0, 3.0, 3.0, 3.0, 3.0, 3.0, gap, 2.0, 2.0, 2.0, 3.0, 3.0]));
    assert!(state.mean.is_empty() && other.known.iter().all(|known| *known == 1.0));
}

/// A state is no number: half of "disabled" and "running" is no "ready".
#[test]
fn a_step_of_states_tells_for_how_much_of_it_each_was_and_no_mean() {
    let folder = Folder::new("history-shares");
    let (past, _store) = lived(&folder);
    let steps = |value: &str, from: i64, every_ms: i64| {
        let (from_unix_ms, drive, value) = (BEGIN_MS + from, "a".to_owned(), value.to_owned());
        let to_unix_ms = from_unix_ms + every_ms - 1;
        let asked = ValuesAsked { drive, value, from_unix_ms, to_unix_ms, every_ms: Some(every_ms) };
        serde_json::to_value(past.values(&asked, &WAITING()).unwrap().steps).unwrap()
    };
    // It is ready for thirty minutes of the second hour, runs for twenty, and is not heard of for ten.
    let told = steps("state", HOUR_MS, HOUR_MS);
    let share = |of: usize| (told[0]["shares"][of]["share"].as_f64().unwrap() * 60.0).round();
    assert_eq!((&told[0]["shares"][0]["is"], share(0)), (&"ready".into(), 30.0), "{told}");
    assert_eq!((&told[0]["shares"][1]["is"], share(1)), (&"running".into(), 20.0), "{told}");
    assert_eq!((told[0].get("mean"), told[0]["shares"].as_array().unwrap().len()), (None, 2), "{told}");
    let told = steps("output_frequency_hz", 0, HOUR_MS);
    let mean = told[0]["mean"].as_f64().unwrap();
    assert!((mean - 15.0).abs() < 0.01 && told[0].get("shares").is_none(), "{told}");
}

#[test]
fn what_is_too_much_is_refused_with_what_would_not_be_and_who_has_gone_is_not_answered() {
    let folder = Folder::new("history-bound");
    let (past, _store) = lived(&folder);
    let PastError::Asked(text) = past.curves(&curves(100), &WAITING()).unwrap_err() else { panic!() };
    let every = text.split("every_ms has to be ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    past.curves(&curves(every.parse().unwrap()), &WAITING()).unwrap();
    let gone = GivenUp::default();
    gone.give_up();
    assert_eq!(past.curves(&curves(MINUTE_MS), &gone).unwrap_err(), PastError::GivenUp);
    let values = ValuesAsked {
        drive: "a".to_owned(),
        value: "state".to_owned(),
        from_unix_ms: 0,
        to_unix_ms: i64::MAX / 4,
        every_ms: None,
    };
    assert_eq!(past.values(&values, &gone).unwrap_err(), PastError::GivenUp);
    assert_eq!(past.moment(BEGIN_MS, &gone).unwrap_err(), PastError::GivenUp);
}

#[test]
fn a_moment_is_told_as_it_was_read_or_by_its_minute_and_a_gap_as_nothing() {
    let folder = Folder::new("history-moment");
    let (past, store) = lived(&folder);
    let at = |second: i64| past.moment(BEGIN_MS + second * 1_000, &WAITING()).unwrap();
    let then = at(30);
    let a = &then.drives[0];
    assert_eq!((&*a.drive, a.exact), ("a", true));
    assert_eq!(a.values["output_frequency_hz"], IsView::Number(10.0));
    assert_eq!(a.values["state"], IsView::Word("running".to_owned()));
    assert_eq!((then.lines[0].foreign, then.lines[0].silence_us), (4, Some(2_000)));
    assert!(at(3_900).drives[0].values.is_empty(), "nobody heard of it");
    assert_eq!(at(3_900).drives[1].values.len(), 2);
    // When nothing is there any more as it was read.
    store.connection.execute("DELETE FROM block", []).unwrap();
    let a = &at(1_805).drives[0];
    assert!(!a.exact, "{a:?}");
    assert_eq!(a.values["output_frequency_hz"], IsView::Number(20.0));
    assert_eq!(a.values["state"], IsView::Word("running".to_owned()));
    assert!(at(3_900).drives[0].values.is_empty());
}

#[test]
fn days_tell_hours_starts_trips_and_energy_of_what_is_known() {
    let folder = Folder::new("history-days");
    let (past, _store) = lived(&folder);
    let asked = DaysAsked {
        drives: vec!["a".to_owned()],
        from_unix_ms: BEGIN_MS,
        to_unix_ms: BEGIN_MS + 2 * HOUR_MS,
    };
    // Whichever zone this machine is in: two days of it at the most.
    let days = past.days(&asked, &WAITING()).unwrap();
    let sum = |of: fn(&drived_plant::plant::past::DayView) -> i64| days.iter().map(of).sum::<i64>();
    assert_eq!(sum(|day| day.running_ms), 3_599_000 + 1_200_000);
    // That it ran when it was first seen is no start: it had run before.
    assert_eq!(sum(|day| i64::try_from(day.starts).unwrap()), 1);
    let trips: u64 = days.iter().filter_map(|day| day.trips.get("18 ObF: DC bus overvoltage")).sum();
    assert_eq!(trips, 2, "{days:?}");
    // 1, 2 and 3 kW, as the power was shown: half an hour of the first two, twenty minutes of the last.
    let energy: f64 = days.iter().filter_map(|day| day.energy.as_ref()).map(|energy| energy.amount).sum();
    assert!((energy - (0.5 + 1.0 + 1.0)).abs() < 0.02, "{energy}");
}

#[test]
fn records_are_told_onward_or_the_newest_first_and_only_those_that_are_meant() {
    let folder = Folder::new("history-records");
    let (past, _store) = lived(&folder);
    let asked = RecordsAsked { to_unix_ms: i64::MAX / 4, ..RecordsAsked::default() };
    let told = |asked: &RecordsAsked| -> Vec<String> {
        past.records(asked).unwrap().records.into_iter().map(|found| found.what).collect()
    };
    let all = ["began", "tripped", "trip_explained", "lost", "tripped", "ended"];
    assert_eq!(told(&asked), all);
    let first = RecordsAsked { before: Some(i64::MAX), limit: Some(2), ..asked.clone() };
    assert_eq!(told(&first), ["ended", "tripped"]);
    let next_before = past.records(&first).unwrap().next_before;
    assert_eq!(told(&RecordsAsked { before: next_before, ..first }), ["lost", "trip_explained"]);
    let tripped = RecordsAsked { what: Some("tripped".to_owned()), ..asked.clone() };
    assert_eq!(told(&tripped), ["tripped", "tripped"]);
    assert_eq!(told(&RecordsAsked { only_alarms: true, ..asked }), ["lost"]);
}

#[test]
fn a_drive_of_which_no_value_is_written_yet_is_there_by_what_happened_to_it() {
    let folder = Folder::new("history-first-minute");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let mut archive = Archive::begin(moment(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    archive.record(event(moment(6_000), "pump", "tripped"));
    archive.write_records(&mut store.connection, moment(6_500)).unwrap();
    assert_eq!(crate::read::drives(&store.connection).unwrap(), ["pump"]);
}

/// A drive that ran four seconds behind the beginning, in a time that ended when the clock was set: asked from before that beginning.
#[test]
fn what_is_asked_of_a_time_that_begins_before_the_first_value_does_not_end_with_that_value() {
    let folder = Folder::new("history-before-first");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let (mut archive, mut pump) = (Archive::begin(moment(0)), Pump::of("a"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    for second in 0..28 {
        let state = if second < 4 { 1 } else { 3 };
        pump.read(&mut archive, moment(second * 1_000), &[(Quantity::STATE, state)]);
    }
    archive.end_run(&mut store.connection, moment(28_000)).unwrap();
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    let (from, to) = (BEGIN_MS - MINUTE_MS, BEGIN_MS + 20_000);
    let pieces = crate::read::pieces(&store.connection, "a", Quantity::STATE, from, to).unwrap();
    let points: Vec<_> = pieces
        .iter()
        .flat_map(|piece| &piece.points)
        .map(|point| (point.at - BEGIN_MS, point.count))
        .collect();
    assert_eq!(points, [(0, Some(1)), (4_000, Some(3))]);
}
