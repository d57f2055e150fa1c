//! A week of a plant in virtual time, written and asked at random, against a reference that keeps everything and knows nothing of files.

use drived_config::testing::Folder;
use rusqlite::Connection;

use super::{BEGIN_MS, Pump};
use crate::{
    curve::Piece,
    quantity::Quantity,
    read,
    record::Moment,
    store,
    write::{Limits, archive::Archive, tidy},
};

const QUARTER_MS: i64 = 900_000;
const HOUR_MS: i64 = 3_600_000;
const DAY_MS: i64 = 24 * HOUR_MS;
const MAX_AGE_MS: i64 = 3_000;
const QUANTITIES: [Quantity; 3] = [Quantity::OUTPUT_FREQUENCY, Quantity::CURRENT, Quantity::STATE];

/// Everything that the simulated drive has shown: when by the wall, and what.
#[derive(Default)]
struct Reference(Vec<(i64, [Option<i64>; 3])>);

impl Reference {
    /// What was known of a quantity at a moment: it was shown, and shown again before it was stale.
    fn at(&self, quantity: usize, at: i64) -> Option<i64> {
        let next = self.0.partition_point(|(time, _)| *time <= at);
        let (time, values) = self.0.get(next.checked_sub(1)?)?;
        let is_known = *time == at || self.0.get(next).is_some_and(|(next, _)| next - time <= MAX_AGE_MS);
        values[quantity].filter(|_| is_known)
    }
}

/// What the file knows of a quantity at a moment.
fn told(connection: &Connection, quantity: Quantity, at: i64) -> Option<i64> {
    let pieces = read::pieces(connection, "pump", quantity, at, at).unwrap();
    let [Piece { points, .. }] = &pieces[..] else { return None };
    points.last().and_then(|point| point.count)
}

/// Days that are lived through, and questions: a week and a million with `DRIVED_HISTORY_DAYS=7 DRIVED_HISTORY_QUESTIONS=1000000`.
fn asked(name: &str, unless_said: i64) -> i64 {
    std::env::var(name).ok().and_then(|said| said.parse().ok()).unwrap_or(unless_said)
}

#[test]
fn every_value_told_is_what_the_drive_showed_within_its_deadband_and_every_gap_is_a_gap() {
    let (days, questions) = (asked("DRIVED_HISTORY_DAYS", 1), asked("DRIVED_HISTORY_QUESTIONS", 5_000));
    let seed = u64::try_from(asked("DRIVED_SEED", 30)).unwrap();
    println!("seed {seed}, {days} days, {questions} questions");
    let (folder, mut random) = (Folder::new("history-week"), fastrand::Rng::with_seed(seed));
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let limits = Limits { polled_ms: 30 * DAY_MS, ..Limits::default() };
    let now = |steady_ms| Moment { steady_ms, wall_ms: BEGIN_MS + steady_ms };
    let (mut archive, mut pump) = (Archive::begin(now(0)), Pump::of("pump"));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let (mut reference, mut steady) = (Reference::default(), 0);
    let (mut hertz, mut state) = (0_i64, 2_i64);
    while steady < days * DAY_MS {
        // Polls come half a second apart; sometimes late, sometimes not at all for a while.
        steady += match random.u32(0..2_000) {
            0 => random.i64(1_000..300_000),
            1..=20 => random.i64(500..6_000),
            _ => 500 + random.i64(-5..=5),
        };
        match random.u32(0..400) {
            0 => state = random.i64(0..9),
            1 => hertz = random.i64(0..5_000),
            _ => hertz = (hertz + random.i64(-6..=6)).max(0),
        }
        let decis = hertz / 40;
        let shows_current = state != 7;
        let values = [Some(hertz), shows_current.then_some(decis), Some(state)];
        let shown: Vec<_> = QUANTITIES.into_iter().zip(values).filter_map(|(q, v)| Some((q, v?))).collect();
        let at = now(steady);
        pump.read(&mut archive, at, &shown);
        reference.0.push((at.wall_ms, values));
        if archive.is_due(at) {
            archive.close(at);
            archive.write_values(&mut store.connection).unwrap();
            while tidy::compact(&mut store.connection, at.wall_ms).unwrap()
                || tidy::trim(&mut store.connection, archive.lived(at), &limits).unwrap()
            {}
        }
    }
    archive.end_run(&mut store.connection, now(steady)).unwrap();
    let bytes = tidy::used_bytes(&store.connection).unwrap();
    println!(
        "{} readings, {:.2} bytes for each of {} values",
        reference.0.len(),
        bytes as f64 / (reference.0.len() * 3) as f64,
        reference.0.len() * 3
    );
    drop(store);
    let history = read::History::open(&folder.file("history.sqlite")).unwrap();
    let mut gaps = 0;
    for _ in 0..questions {
        let (place, at) = (random.usize(0..3), BEGIN_MS + random.i64(-HOUR_MS..steady + HOUR_MS));
        let (quantity, expected) = (QUANTITIES[place], reference.at(place, at));
        let found = told(&history.0, quantity, at);
        gaps += i64::from(expected.is_none());
        let is_right = match (expected, found) {
            (None, None) => true,
            (Some(expected), Some(found)) => (expected - found).abs() <= quantity.deadband(),
            _ => false,
        };
        assert!(is_right, "{quantity} at {at}: {expected:?}, and told is {found:?}");
    }
    assert!(gaps > questions / 200 && gaps < questions / 2, "{gaps} gaps");
    steps_are_those_of_the_reference(&history.0, &reference, steady);
    drop(history);
    let file = Connection::open(folder.file("history.sqlite")).unwrap();
    quarters_are_those_of_the_minutes(&file, steady);
    drop(file);
    words_are_told_when_the_values_are_gone(&folder, &reference, steady, &mut random);
}

/// What is a word is kept at each of its changes, for years: the same questions, when nothing is there any more as it was read.
fn words_are_told_when_the_values_are_gone(
    folder: &Folder,
    reference: &Reference,
    steady: i64,
    random: &mut fastrand::Rng,
) {
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    while tidy::compact(&mut store.connection, i64::MAX / 2).unwrap() {}
    let whole: i64 = store.connection.query_row("SELECT count(*) FROM flush", [], |row| row.get(0)).unwrap();
    assert_eq!(whole, 0);
    store.connection.execute("DELETE FROM block", []).unwrap();
    let mut gaps = 0;
    for _ in 0..1_000 {
        let at = BEGIN_MS + random.i64(-HOUR_MS..steady + HOUR_MS);
        let expected = reference.at(2, at);
        gaps += usize::from(expected.is_none());
        assert_eq!(told(&store.connection, Quantity::STATE, at), expected, "at {at}");
        assert_eq!(told(&store.connection, Quantity::OUTPUT_FREQUENCY, at), None);
    }
    assert!(gaps > 5 && gaps < 500, "{gaps} gaps");
    // As one story from beginning to end.
    let mut points = Vec::new();
    let end = BEGIN_MS + steady;
    let each = |point| {
        points.push(point);
        Ok::<_, store::StoreError>(true)
    };
    read::points(&store.connection, "pump", Quantity::STATE, BEGIN_MS, end, each).unwrap();
    for point in points {
        assert_eq!(reference.at(2, point.at), point.count, "at {}", point.at);
    }
}

/// A file that was brought to this version tells the quarters of an hour that it has no pack of by its minutes.
fn quarters_are_those_of_the_minutes(connection: &Connection, steady: i64) {
    let quarters = || {
        let (quantity, end) = (Quantity::OUTPUT_FREQUENCY, BEGIN_MS + steady);
        read::steps(connection, "pump", quantity, BEGIN_MS, end, QUARTER_MS, &|| true).unwrap()
    };
    let of_packs = quarters();
    let middle = of_packs[of_packs.len() / 2].start_unix_ms;
    let gone = connection.execute("DELETE FROM quarter WHERE start_ms < ?1", [middle]).unwrap();
    let of_minutes = quarters();
    assert!(gone > 0, "there was none to be taken away");
    assert_eq!(of_packs.len(), of_minutes.len());
    for (one, other) in of_packs.iter().zip(&of_minutes) {
        let is_same = (one.start_unix_ms, one.least, one.greatest)
            == (other.start_unix_ms, other.least, other.greatest);
        // Each minute's mean is kept to a count.
        let is_near = (one.mean.unwrap() - other.mean.unwrap()).abs() < 0.011
            && (one.known - other.known).abs() < 0.000_1;
        assert!(is_same && is_near, "{one:?} {other:?}");
    }
}

/// Steps of a minute, of a quarter of an hour and of an hour against sums made millisecond by millisecond over what was shown.
fn steps_are_those_of_the_reference(connection: &Connection, reference: &Reference, steady: i64) {
    let quantity = Quantity::OUTPUT_FREQUENCY;
    for length in [60_000, QUARTER_MS, HOUR_MS] {
        let steps =
            read::steps(connection, "pump", quantity, BEGIN_MS, BEGIN_MS + steady, length, &|| true).unwrap();
        for step in steps.iter().step_by(steps.len().div_ceil(40)) {
            let (start, end) = (step.start_unix_ms, step.start_unix_ms + length);
            let (mut known, mut sum, mut least, mut greatest) = (0, 0.0, i64::MAX, i64::MIN);
            let first = reference.0.partition_point(|(at, _)| *at < start).saturating_sub(1);
            for pair in reference.0[first..].windows(2) {
                let ((from, values), (until, _)) = (pair[0], pair[1]);
                if from >= end {
                    break;
                }
                let Some(count) = values[0] else { continue };
                let held = (until.min(end) - from.max(start)).max(0);
                if until - from <= MAX_AGE_MS {
                    known += held;
                    sum += (count * held) as f64;
                }
                if held > 0 && until - from <= MAX_AGE_MS || from >= start {
                    (least, greatest) = (least.min(count), greatest.max(count));
                }
            }
            // Each value is told within its deadband, and so is what is made of them.
            let within = quantity.deadband() as f64 / 100.0 + 0.011;
            assert!(
                (step.known - known as f64 / length as f64).abs() < 0.000_1,
                "{step:?}: {known} ms known"
            );
            if known > 0 {
                let mean = sum / known as f64 / 100.0;
                assert!((step.mean.unwrap() - mean).abs() <= within, "{step:?}: mean {mean}");
            }
            let near = |told: f64, count: i64| (told - count as f64 / 100.0).abs() <= within;
            assert!(
                near(step.least, least) && near(step.greatest, greatest),
                "{step:?}: {least} to {greatest}"
            );
        }
    }
}
