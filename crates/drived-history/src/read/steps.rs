//! What is known of a quantity in steps of equal length.

use drived_plant::plant::past::{ShareView, StepView};
use rusqlite::{Connection, params};

use super::{chunks, kept, pieces, source, windows};
use crate::{
    chunk::piece_of,
    column::{Rows, pack_numbers},
    curve::{Step, Steps},
    quantity::{Quantity, Set},
    store::StoreError,
};

const MINUTE_MS: i64 = 60_000;
const HOUR_MS: i64 = 3_600_000;
/// Steps of which those of a season are drawn.
pub const QUARTER_MS: i64 = 15 * MINUTE_MS;
/// No pack of minutes is longer.
pub const DAY_MS: i64 = 24 * HOUR_MS;

/// The steps of a quantity between two moments; a step of which nothing is known is not there. From a minute on they are summed up from
/// what was kept in minutes, or, where that is not kept any more, in hours: those stand at the beginning of their hour. It ends when `go_on`
/// says `false`.
///
/// # Errors
/// It cannot be read.
pub fn steps(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    from: i64,
    to: i64,
    length_ms: i64,
    go_on: &dyn Fn() -> bool,
) -> Result<Vec<StepView>, StoreError> {
    let length_ms = length_ms.max(1);
    let from = from - from.rem_euclid(length_ms);
    let mut steps = empty(quantity, length_ms);
    if length_ms % MINUTE_MS != 0 || !quantity.is_number() {
        let (first, last) = kept(connection, drive, quantity, from, to)?;
        for (start, end) in windows(first, last) {
            if !go_on() {
                break;
            }
            pieces(connection, drive, quantity, start, end)?.into_iter().for_each(|piece| steps.add(piece));
        }
    } else {
        for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
            let source = source?;
            let minutes_from = match length_ms % HOUR_MS {
                0 => i64::MAX,
                _ => oldest_minute(connection, source, quantity)?.unwrap_or(i64::MAX),
            };
            add_hours(
                connection,
                &mut steps,
                source,
                quantity,
                from,
                to.min(minutes_from.saturating_sub(1)),
            )?;
            let quarters_from = match length_ms % QUARTER_MS {
                0 => oldest_quarter(connection, source, quantity)?.unwrap_or(i64::MAX).max(minutes_from),
                _ => i64::MAX,
            };
            let minutes_to = to.min(quarters_from.saturating_sub(1));
            add_packs(
                connection,
                &mut steps,
                Packs::Minutes,
                source,
                quantity,
                from.max(minutes_from),
                minutes_to,
            )?;
            add_packs(
                connection,
                &mut steps,
                Packs::Quarters,
                source,
                quantity,
                from.max(quarters_from),
                to,
            )?;
            for (_, start, end, data) in chunks(connection, source, from, to)? {
                if let Some(piece) = piece_of(quantity, start, end, &data)?.between(from, to) {
                    steps.add(piece);
                }
            }
        }
    }
    Ok(told(&steps, quantity, length_ms))
}

/// No steps yet, of what is to be told of a quantity.
pub(super) fn empty(quantity: Quantity, length_ms: i64) -> Steps {
    let has_words = quantity.row().is_some_and(|row| !row.words.is_empty());
    if has_words { Steps::of_words(length_ms) } else { Steps::of(length_ms) }
}

/// Steps in the unit of their quantity.
pub(super) fn told(steps: &Steps, quantity: Quantity, length_ms: i64) -> Vec<StepView> {
    let share = |ms: i64| (ms as f64 / length_ms as f64).min(1.0);
    let shares = |start| {
        steps
            .held(start)
            .map(|(count, ms)| ShareView { is: quantity.text(count), share: share(ms) })
            .collect()
    };
    let told = |(&start, step): (&i64, &Step)| StepView {
        start_unix_ms: start,
        least: quantity.value(step.least as f64),
        mean: quantity.is_number().then(|| quantity.value(step.mean)),
        greatest: quantity.value(step.greatest as f64),
        known: share(step.known_ms),
        shares: shares(start),
    };
    steps.all.iter().map(told).collect()
}

/// The beginning of the hour from which on minutes of a quantity are kept.
pub(super) fn oldest_minute_of(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
) -> Result<Option<i64>, StoreError> {
    let mut oldest = None;
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        oldest = oldest.into_iter().chain(oldest_minute(connection, source?, quantity)?).min();
    }
    Ok(oldest)
}

fn oldest_minute(
    connection: &Connection,
    source: i64,
    quantity: Quantity,
) -> Result<Option<i64>, StoreError> {
    let mut find =
        connection.prepare_cached("SELECT min(start_ms) FROM minute WHERE source = ?1 AND quantity = ?2")?;
    // Hours are whole where they are told instead.
    let oldest: Option<i64> = find.query_row(params![source, quantity.0], |row| row.get(0))?;
    Ok(oldest.map(|start| start - start.rem_euclid(HOUR_MS)))
}

/// When the oldest quarter of an hour of a quantity begins: from there on all are there.
fn oldest_quarter(
    connection: &Connection,
    source: i64,
    quantity: Quantity,
) -> Result<Option<i64>, StoreError> {
    let mut find =
        connection.prepare_cached("SELECT min(start_ms) FROM quarter WHERE source = ?1 AND quantity = ?2")?;
    Ok(find.query_row(params![source, quantity.0], |row| row.get(0))?)
}

/// Packs of days, in which steps of one length are.
#[derive(Clone, Copy)]
enum Packs {
    Minutes,
    Quarters,
}

fn add_hours(
    connection: &Connection,
    steps: &mut Steps,
    source: i64,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<(), StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT start_ms, least, mean, greatest, known_ms FROM hour
         WHERE source = ?1 AND quantity = ?2 AND start_ms BETWEEN ?3 AND ?4",
    )?;
    let rows = find.query_map(params![source, quantity.0, from, to], |row| {
        let step =
            Step { least: row.get(1)?, mean: row.get(2)?, greatest: row.get(3)?, known_ms: row.get(4)? };
        Ok((row.get(0)?, step))
    })?;
    for row in rows {
        let (start, step) = row?;
        steps.add_step(start, step);
    }
    let mut find = connection.prepare_cached(
        "SELECT start_ms, data FROM hours WHERE source = ?1 AND quantity = ?2 AND start_ms <= ?4 AND start_ms >=
            coalesce((SELECT max(start_ms) FROM hours WHERE source = ?1 AND quantity = ?2 AND start_ms <= ?3), ?3)",
    )?;
    let rows = find.query_map(params![source, quantity.0, from, to], |row| {
        Ok((row.get::<_, i64>(0)?, row.get::<_, Vec<u8>>(1)?))
    })?;
    for row in rows {
        let (start, data) = row?;
        for (at, step) in unpack_steps(HOUR_MS, start, &data)? {
            if (from..=to).contains(&at) {
                steps.add_step(at, step);
            }
        }
    }
    Ok(())
}

fn add_packs(
    connection: &Connection,
    steps: &mut Steps,
    packs: Packs,
    source: i64,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<(), StoreError> {
    if from > to {
        return Ok(());
    }
    let (table, length_ms) = match packs {
        Packs::Minutes => ("minute", MINUTE_MS),
        Packs::Quarters => ("quarter", QUARTER_MS),
    };
    let mut find = connection.prepare_cached(&format!(
        "SELECT start_ms, data FROM {table} WHERE source = ?1 AND quantity = ?2 AND start_ms BETWEEN ?3 AND ?4"
    ))?;
    let earliest = from.saturating_sub(DAY_MS);
    let mut rows = find.query(params![source, quantity.0, earliest, to])?;
    while let Some(row) = rows.next()? {
        let packed = row.get_ref(1)?.as_blob().map_err(rusqlite::Error::from)?;
        let all = unpack_steps(length_ms, row.get(0)?, packed)?;
        steps.add_steps(all.filter(|(at, _)| (from..=to).contains(at)));
    }
    Ok(())
}

/// Minutes, or hours, as bytes, from the first on: all beginnings, then all least, and so on, each by its difference.
#[must_use]
pub fn pack_steps(length_ms: i64, start: i64, minutes: &[(i64, Step)]) -> Vec<u8> {
    let mut numbers = Vec::with_capacity(minutes.len() * 5);
    let mut before = start;
    for (at, _) in minutes {
        numbers.push((at - before) / length_ms);
        before = *at;
    }
    let mut before = 0;
    for (_, step) in minutes {
        numbers.push(step.least.wrapping_sub(before));
        before = step.least;
    }
    // Within a step of a count.
    numbers.extend(minutes.iter().map(|(_, step)| (step.mean.round() as i64).wrapping_sub(step.least)));
    numbers.extend(minutes.iter().map(|(_, step)| step.greatest.wrapping_sub(step.least)));
    numbers.extend(minutes.iter().map(|(_, step)| length_ms - step.known_ms));
    pack_numbers(&numbers)
}

/// The minutes, or hours, of such bytes.
///
/// # Errors
/// They are none.
pub fn unpack_steps(
    length_ms: i64,
    start: i64,
    data: &[u8],
) -> Result<impl Iterator<Item = (i64, Step)>, StoreError> {
    let (mut at, mut least) = (start, 0_i64);
    let rows = Rows::<5>::unpacked(data)?;
    Ok(rows.map(move |[after, by, mean, greatest, missing]| {
        at = at.wrapping_add(after.wrapping_mul(length_ms));
        least = least.wrapping_add(by);
        let step = Step {
            least,
            mean: least.wrapping_add(mean) as f64,
            greatest: least.wrapping_add(greatest),
            known_ms: length_ms.wrapping_sub(missing),
        };
        (at, step)
    }))
}
