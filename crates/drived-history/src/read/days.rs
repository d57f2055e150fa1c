//! What is made of it: hours, starts, trips, energy and warnings of a drive, day by day.

use std::collections::BTreeMap;

use chrono::{DateTime, Days, Local, NaiveTime, TimeZone as _};
use drived_plant::plant::past::{DayView, EnergyFrom, EnergyView, RecordView, StepView};
use drived_words::moment::in_order;
use rusqlite::Connection;
use serde::Deserialize;

use super::{Filter, points, records, steps};
use crate::{column::Point, quantity::Quantity, store::StoreError};

const HOUR_MS: i64 = 3_600_000;
/// So many records of a drive and a day are looked at, at the most.
const RECORDS: usize = 20_000;

/// The days of a drive that begin between two moments, in this machine's zone. It ends when `go_on` says `false`.
///
/// # Errors
/// It cannot be read.
pub fn days(
    connection: &Connection,
    drive: &str,
    from: i64,
    to: i64,
    go_on: &dyn Fn() -> bool,
) -> Result<Vec<DayView>, StoreError> {
    let mut all = Vec::new();
    for (name, start, end) in midnights(from, to) {
        if !go_on() {
            break;
        }
        if let Some(day) = day(connection, drive, name, start, end, go_on)? {
            all.push(day);
        }
    }
    Ok(all)
}

/// The days between two moments: their names, beginnings and ends. The day on which the clocks are changed is as long as it is.
fn midnights(from: i64, to: i64) -> impl Iterator<Item = (String, i64, i64)> {
    let at = |day: chrono::NaiveDate| {
        let midnight = day.and_time(NaiveTime::MIN);
        // Where midnight itself is left out the day begins an hour later.
        let first = |local| in_order(Local.from_local_datetime(&local)).0;
        first(midnight).or_else(|| first(midnight + chrono::Duration::hours(1)))
    };
    let first = DateTime::from_timestamp_millis(from).map(|time| time.with_timezone(&Local).date_naive());
    let days = std::iter::successors(first, |day| day.checked_add_days(Days::new(1)));
    days.map_while(move |day| {
        let (start, end) = (at(day)?, at(day.checked_add_days(Days::new(1))?)?);
        let (start, end) = (start.timestamp_millis(), end.timestamp_millis());
        (start <= to).then(|| (day.to_string(), start, end))
    })
}

fn day(
    connection: &Connection,
    drive: &str,
    name: String,
    start: i64,
    end: i64,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<DayView>, StoreError> {
    let states = Held::of(connection, drive, Quantity::STATE, start, end)?;
    if states.known_ms == 0 {
        return Ok(None);
    }
    let warnings = Held::of(connection, drive, Quantity::WARNING, start, end)?;
    let filter =
        Filter { from_ms: start, to_ms: end - 1, drive: Some(drive), limit: RECORDS, ..Filter::default() };
    let found = records(connection, &filter)?.records;
    let of_drive: Vec<&RecordView> =
        found.iter().filter(|found| found.kind == "event" && found.drive.is_some()).collect();
    let hours = |quantity| steps(connection, drive, quantity, start, end - 1, HOUR_MS, go_on);
    let greatest = |quantity| -> Result<Option<f64>, StoreError> {
        Ok(hours(quantity)?.iter().map(|step| step.greatest).reduce(f64::max))
    };
    let (motor, own) = (greatest(Quantity::MOTOR_THERMAL)?, greatest(Quantity::DRIVE_THERMAL)?);
    Ok(Some(DayView {
        drive: drive.to_owned(),
        day: name,
        start_unix_ms: start,
        known: states.known_ms as f64 / (end - start) as f64,
        running_ms: states.in_ms.get(&Quantity::RUNNING).copied().unwrap_or_default(),
        starts: states.begun.get(&Quantity::RUNNING).copied().unwrap_or_default(),
        trips: trips(&of_drive),
        above_limits_ms: above_limits(&of_drive, start, end.min(states.until)),
        warning_ms: warnings.in_ms.get(&1).copied().unwrap_or_default(),
        energy: energy(&hours)?,
        greatest_current_a: greatest(Quantity::CURRENT)?,
        motor_thermal_percent: motor,
        drive_thermal_percent: own,
        thermal_margin_percent: motor.into_iter().chain(own).reduce(f64::max).map(|most| 100.0 - most),
    }))
}

/// For how long a drive ran, and how often it was seen to begin to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ran {
    pub running_ms: i64,
    pub starts: u64,
    /// Of when something was known last, and a millisecond more.
    pub until: i64,
}

/// For how long a drive ran between two moments, as far as it is known.
///
/// # Errors
/// It cannot be read.
pub fn ran(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Ran, StoreError> {
    let states = Held::of(connection, drive, Quantity::STATE, from, to)?;
    let running_ms = states.in_ms.get(&Quantity::RUNNING).copied().unwrap_or_default();
    let starts = states.begun.get(&Quantity::RUNNING).copied().unwrap_or_default();
    Ok(Ran { running_ms, starts, until: states.until })
}

/// For how long a word held, and how often it was seen to begin.
#[derive(Default)]
struct Held {
    known_ms: i64,
    until: i64,
    in_ms: BTreeMap<i64, i64>,
    begun: BTreeMap<i64, u64>,
}

impl Held {
    fn of(
        connection: &Connection,
        drive: &str,
        quantity: Quantity,
        start: i64,
        end: i64,
    ) -> Result<Self, StoreError> {
        let (mut held, mut open) = (Self::default(), None::<Point>);
        points(connection, drive, quantity, start, end, |point: Point| {
            if let Some(Point { at, count: Some(count) }) = open {
                // Where nothing is known any more stands a millisecond behind what was known last.
                let until = point.at - i64::from(point.count.is_none());
                let lasts = (until - at).max(0);
                held.known_ms += lasts;
                *held.in_ms.entry(count).or_default() += lasts;
                // What it began from has to be known: behind a gap it may have begun before.
                if let Some(next) = point.count.filter(|next| *next != count) {
                    *held.begun.entry(next).or_default() += 1;
                }
            }
            held.until = held.until.max(point.at);
            open = Some(point);
            Ok::<_, StoreError>(true)
        })?;
        Ok(held)
    }
}

/// By what it tripped, as the drive said once it was asked, and how often.
fn trips(found: &[&RecordView]) -> BTreeMap<String, u64> {
    let mut all = BTreeMap::new();
    for (place, trip) in found.iter().enumerate().filter(|(_, found)| found.what == "tripped") {
        let mut later = found[place + 1..].iter().take_while(|found| found.what != "tripped");
        let said = later.find(|found| found.what == "trip_explained").unwrap_or(trip);
        let cause = said.text.split_once(": ").map_or("not said by the drive", |(_, cause)| cause);
        *all.entry(cause.to_owned()).or_default() += 1;
    }
    all
}

/// For how long a value was above its limit, as far as that was seen.
fn above_limits(found: &[&RecordView], start: i64, end: i64) -> i64 {
    #[derive(Deserialize)]
    struct Limit {
        of: String,
        exceeded: bool,
    }
    let (mut open, mut ended, mut spans) = (BTreeMap::new(), std::collections::BTreeSet::new(), Vec::new());
    for found in found {
        let limit = found.body.as_ref().and_then(|body| serde_json::from_str::<Limit>(body.get()).ok());
        match (&*found.what, limit) {
            ("limit", Some(Limit { of, exceeded: true })) => _ = open.entry(of).or_insert(found.time_unix_ms),
            ("limit", Some(Limit { of, exceeded: false })) => {
                // One that was above since the day before ends here.
                let is_first = ended.insert(of.clone());
                let since = open.remove(&of).or_else(|| is_first.then_some(start));
                spans.extend(since.map(|since| (since, found.time_unix_ms)));
            }
            ("lost", _) => {
                spans
                    .extend(std::mem::take(&mut open).into_values().map(|since| (since, found.time_unix_ms)));
            }
            _ => {}
        }
    }
    spans.extend(open.into_values().map(|since| (since, end)));
    spans.sort_unstable();
    let (mut sum, mut until) = (0, i64::MIN);
    for (since, to) in spans {
        sum += (to - since.max(until)).max(0);
        until = until.max(to);
    }
    sum
}

/// The energy of a day: the drive's own counter where it has one, else its power over the time in which that is known.
fn energy(
    hours: &dyn Fn(Quantity) -> Result<Vec<StepView>, StoreError>,
) -> Result<Option<EnergyView>, StoreError> {
    for counter in [Quantity::INPUT_ENERGY, Quantity::OUTPUT_ENERGY] {
        let counted = hours(counter)?;
        if counted.len() > 1 {
            // Between two hours it has counted on, or began anew from nothing.
            let steps = counted.windows(2).map(|pair| pair[1].greatest - pair[0].greatest);
            let first = counted[0].greatest - counted[0].least;
            let amount = first + steps.filter(|more| *more > 0.0).sum::<f64>();
            return Ok(Some(EnergyView { amount, from: EnergyFrom::Counter }));
        }
    }
    for power in [Quantity::INPUT_POWER, Quantity::OUTPUT_POWER] {
        let known = hours(power)?;
        if !known.is_empty() {
            let amount = known.iter().map(|step| step.mean.unwrap_or_default() * step.known).sum();
            return Ok(Some(EnergyView { amount, from: EnergyFrom::Summed }));
        }
    }
    Ok(None)
}
