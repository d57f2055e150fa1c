//! The last ten minutes of every drive, so that a trend is there when a page opens.
//!
//! Four numbers each half second: 1 200 × 16 bytes, 19 KiB a drive.

use std::{
    collections::{BTreeMap, HashSet, VecDeque},
    sync::{Arc, Mutex, PoisonError, Weak},
    time::Duration,
};

use drive_core::{Current, Frequency, Percent, Setpoint};
use drive_fleet::{DriveHandle, Freshness};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::{Instant, MissedTickBehavior, interval};

use super::Inner;
use drived_words::json::{milliseconds, unix};

/// Between two samples.
const STEP: Duration = Duration::from_millis(500);
/// How many are kept.
const KEPT: usize = 1_200;
/// So many samples are one step of a small curve.
const CURVE_STEP: usize = 30;
/// Nothing fresh was known.
const NOTHING: i32 = i32::MIN;

/// What was known at one moment, in the units' own steps.
#[derive(Debug, Clone, Copy)]
struct Sample {
    frequency: i32,
    setpoint: i32,
    current: i32,
    torque: i32,
}

/// The samples of a plant.
#[derive(Default)]
pub(super) struct History(Mutex<Rings>);

#[derive(Default)]
struct Rings {
    times: VecDeque<Instant>,
    drives: BTreeMap<Arc<str>, VecDeque<Sample>>,
}

/// The last ten minutes of a drive: `null` where nothing fresh was known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HistoryView {
    pub step_ms: u64,
    pub time_unix_ms: Vec<u64>,
    pub frequency_hz: Vec<Option<f64>>,
    pub setpoint_hz: Vec<Option<f64>>,
    pub current_a: Vec<Option<f64>>,
    pub torque_percent: Vec<Option<f64>>,
}

/// The output frequencies of all drives in the last ten minutes, for a small curve of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurvesView {
    pub step_ms: u64,
    /// When the last step ended.
    pub time_unix_ms: u64,
    /// By drive, the newest last: what was known last in each step, `null` where nothing fresh was.
    pub frequency_hz: BTreeMap<String, Vec<Option<f64>>>,
}

/// Samples every drive for as long as anybody holds the plant.
pub(super) fn start(plant: &Arc<Inner>) {
    let plant = Arc::downgrade(plant);
    tokio::spawn(sampling(plant));
}

async fn sampling(plant: Weak<Inner>) {
    let mut ticks = interval(STEP);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        ticks.tick().await;
        let Some(plant) = plant.upgrade() else { return };
        plant.history.sample(&plant.fleet.drives());
    }
}

impl History {
    fn sample(&self, drives: &[DriveHandle]) {
        let now = Instant::now();
        let mut rings = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        push(&mut rings.times, now);
        let there: HashSet<&Arc<str>> = drives.iter().map(DriveHandle::name).collect();
        rings.drives.retain(|name, _| there.contains(name));
        let known = rings.times.len();
        for drive in drives {
            let ring = rings.drives.entry(Arc::clone(drive.name())).or_default();
            push(ring, Sample::of(drive, now));
            // A drive that came later has nothing to say of before.
            while ring.len() < known {
                ring.push_front(Sample {
                    frequency: NOTHING,
                    setpoint: NOTHING,
                    current: NOTHING,
                    torque: NOTHING,
                });
            }
        }
    }

    /// A drive is called otherwise.
    pub(super) fn rename(&self, old: &str, new: &str) {
        let mut rings = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(ring) = rings.drives.remove(old) {
            rings.drives.insert(Arc::from(new), ring);
        }
    }

    pub(super) fn curves(&self) -> CurvesView {
        let rings = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let drives = rings.drives.iter().map(|(name, ring)| {
            // From the newest on, so that the last step is a whole one.
            let newest_first: Vec<&Sample> = ring.iter().rev().collect();
            let steps = newest_first.chunks(CURVE_STEP).rev();
            let curve =
                steps.map(|step| step.iter().map(|sample| hertz(sample.frequency)).find(Option::is_some));
            (name.to_string(), curve.map(Option::flatten).collect())
        });
        CurvesView {
            step_ms: milliseconds(STEP) * CURVE_STEP as u64,
            time_unix_ms: rings.times.back().map_or(0, |at| unix(*at)),
            frequency_hz: drives.collect(),
        }
    }

    /// What is known of a drive: all, or what a reader lacks who has the sample of this time. A time that is still to come
    /// was told before the clock was put back, and its reader is told everything again.
    pub(super) fn of(&self, drive: &str, since_unix_ms: Option<u64>) -> HistoryView {
        let rings = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let times: Vec<u64> = rings.times.iter().map(|at| unix(*at)).collect();
        let half = milliseconds(STEP / 2);
        let is_past = |since: &u64| times.last().is_some_and(|last| *since <= last + half);
        let known =
            since_unix_ms.filter(is_past).map_or(0, |since| times.partition_point(|at| *at <= since + half));
        let samples = || rings.drives.get(drive).into_iter().flatten().skip(known);
        let column = |of: fn(&Sample) -> i32, step: f64| {
            samples().map(of).map(|count| (count != NOTHING).then(|| f64::from(count) / step)).collect()
        };
        HistoryView {
            step_ms: milliseconds(STEP),
            time_unix_ms: times[known..].to_vec(),
            frequency_hz: column(|sample| sample.frequency, 100.0),
            setpoint_hz: column(|sample| sample.setpoint, 100.0),
            current_a: column(|sample| sample.current, 10.0),
            torque_percent: column(|sample| sample.torque, 100.0),
        }
    }
}

impl Sample {
    fn of(drive: &DriveHandle, now: Instant) -> Self {
        let snapshot = drive.snapshot();
        let status = snapshot.fresh_status(now);
        let is_fresh = snapshot.measurements_freshness(now) == Freshness::Fresh;
        let measured = snapshot.measurements.as_ref().filter(|_| is_fresh).map(|measured| &measured.value);
        let setpoint = match snapshot.setpoint.filter(|_| status.is_some()) {
            Some(Setpoint::Frequency(frequency)) => Some(frequency),
            _ => None,
        };
        Self {
            frequency: count(status.and_then(|status| status.output_frequency).map(Frequency::centihertz)),
            setpoint: count(setpoint.map(Frequency::centihertz)),
            current: count(status.and_then(|status| status.current).map(Current::deciamperes)),
            torque: measured.and_then(|measured| measured.torque).map_or(NOTHING, Percent::hundredths),
        }
    }
}

fn hertz(count: i32) -> Option<f64> {
    (count != NOTHING).then(|| f64::from(count) / 100.0)
}

fn count(value: Option<u32>) -> i32 {
    value.and_then(|value| i32::try_from(value).ok()).unwrap_or(NOTHING)
}

fn push<T>(ring: &mut VecDeque<T>, value: T) {
    if ring.len() >= KEPT {
        ring.pop_front();
    }
    ring.push_back(value);
}
