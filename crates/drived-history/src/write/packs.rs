//! Minutes and quarters of an hour, in a pack for each day of a quantity.

use rusqlite::{OptionalExtension as _, Transaction, params};

use crate::{
    curve::{Piece, Step, Steps},
    quantity::Quantity,
    read::{DAY_MS, QUARTER_MS, pack_steps, unpack_steps},
    store::StoreError,
};

const MINUTE_MS: i64 = 60_000;

/// Keeps the minutes and quarters of an hour of a piece.
///
/// # Errors
/// It cannot be read or written.
pub(super) fn keep(
    transaction: &Transaction<'_>,
    source: i64,
    quantity: Quantity,
    piece: Piece,
) -> Result<(), StoreError> {
    let (mut minutes, mut quarters) = (Steps::of(MINUTE_MS), Steps::of(QUARTER_MS));
    minutes.add(piece.clone());
    quarters.add(piece);
    let is_of_day =
        |(one, _): &(i64, Step), (other, _): &(i64, Step)| one.div_euclid(DAY_MS) == other.div_euclid(DAY_MS);
    let minutes: Vec<(i64, Step)> = minutes.all.into_iter().collect();
    for of_day in minutes.chunk_by(is_of_day) {
        keep_minutes(transaction, source, quantity, of_day)?;
    }
    let quarters: Vec<(i64, Step)> = quarters.all.into_iter().collect();
    for of_day in quarters.chunk_by(is_of_day) {
        keep_quarters(transaction, source, quantity, of_day)?;
    }
    Ok(())
}

/// Keeps minutes of one day, in one pack with those of the day before them: of a quarter of a year it is read in a few large parts.
fn keep_minutes(
    transaction: &Transaction<'_>,
    source: i64,
    quantity: Quantity,
    minutes: &[(i64, Step)],
) -> Result<(), StoreError> {
    let Some((first, _)) = minutes.first() else { return Ok(()) };
    let day = first - first.rem_euclid(DAY_MS);
    let before: Option<(i64, i64, Vec<u8>)> = transaction
        .prepare_cached(
            "SELECT id, start_ms, data FROM minute WHERE source = ?1 AND quantity = ?2 AND start_ms BETWEEN ?3 AND ?4
             ORDER BY start_ms DESC LIMIT 1",
        )?
        .query_row(params![source, quantity.0, day, first], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
        .optional()?;
    if let Some((id, start, data)) = before {
        let mut all: Vec<(i64, Step)> = unpack_steps(MINUTE_MS, start, &data)?.collect();
        // Where the clock was set back they stand beside it.
        if all.last().is_none_or(|(last, _)| last <= first) {
            all.extend_from_slice(minutes);
            transaction
                .prepare_cached("UPDATE minute SET data = ?2 WHERE id = ?1")?
                .execute(params![id, pack_steps(MINUTE_MS, start, &all)])?;
            return Ok(());
        }
    }
    transaction
        .prepare_cached("INSERT INTO minute (source, quantity, start_ms, data) VALUES (?1, ?2, ?3, ?4)")?
        .execute(params![source, quantity.0, first, pack_steps(MINUTE_MS, *first, minutes)])?;
    Ok(())
}

/// Keeps quarters of an hour of one day, each of them once, with what was known of that day before.
fn keep_quarters(
    transaction: &Transaction<'_>,
    source: i64,
    quantity: Quantity,
    quarters: &[(i64, Step)],
) -> Result<(), StoreError> {
    let Some((first, _)) = quarters.first() else { return Ok(()) };
    let day = first - first.rem_euclid(DAY_MS);
    let mut all = Steps::of(QUARTER_MS);
    let before: Option<(i64, Vec<u8>)> = transaction
        .prepare_cached(
            "SELECT start_ms, data FROM quarter WHERE source = ?1 AND quantity = ?2 AND start_ms BETWEEN ?3 AND ?4",
        )?
        .query_row(params![source, quantity.0, day, day + DAY_MS - 1], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()?;
    if let Some((start, data)) = &before {
        all.add_steps(unpack_steps(QUARTER_MS, *start, data)?);
    }
    all.add_steps(quarters.iter().copied());
    let all: Vec<(i64, Step)> = all.all.into_iter().collect();
    let start = all.first().map_or(*first, |(start, _)| *start);
    if let Some((before, _)) = before.filter(|(before, _)| *before != start) {
        transaction
            .prepare_cached("DELETE FROM quarter WHERE source = ?1 AND quantity = ?2 AND start_ms = ?3")?
            .execute(params![source, quantity.0, before])?;
    }
    transaction
        .prepare_cached(
            "INSERT OR REPLACE INTO quarter (source, quantity, start_ms, data) VALUES (?1, ?2, ?3, ?4)",
        )?
        .execute(params![source, quantity.0, start, pack_steps(QUARTER_MS, start, &all)])?;
    Ok(())
}
