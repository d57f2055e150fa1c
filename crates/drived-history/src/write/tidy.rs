//! What is done with the file beside writing: an hour that is over becomes blocks and steps, and what is too old or too much goes.

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{
    Limits,
    age::{self, Lived},
    captures, changes, packs,
};
use crate::{
    chunk::{Chunk, Packed},
    column::pack,
    curve::{Piece, Step, Steps, joined},
    quantity::{Quantity, TABLE},
    read::{DAY_MS, SOURCE_BITS, pack_steps},
    store::StoreError,
};

const MINUTE_MS: i64 = 60_000;
const HOUR_MS: i64 = 3_600_000;
/// Of so many sources blocks are made in one transaction: each waits for the disk.
const SOURCES_AT_ONCE: usize = 16;
/// So many rows go at once, so that nothing else waits for long.
const AT_ONCE: i64 = 500;
/// Likewise where the file is too large: no more goes than has to.
const FEW: i64 = 20;

/// Makes blocks of a few sources of the oldest hour that is over; gives whether there may be more.
///
/// # Errors
/// It cannot be read or written.
pub fn compact(connection: &mut Connection, now_ms: i64) -> Result<bool, StoreError> {
    let Some(hour) = Hour::oldest(connection, now_ms)? else { return Ok(false) };
    let first = hour.flushes.first().copied().unwrap_or_default();
    let last = hour.flushes.last().copied().unwrap_or_default();
    let within = [first << SOURCE_BITS, (last + 1) << SOURCE_BITS];
    let transaction = connection.transaction()?;
    for _ in 0..SOURCES_AT_ONCE {
        let next: Option<i64> = transaction
            .prepare_cached("SELECT id FROM chunk WHERE id >= ?1 AND id < ?2 LIMIT 1")?
            .query_row(within, |row| row.get(0))
            .optional()?;
        let Some(chunk) = next else {
            transaction.execute("DELETE FROM flush WHERE id BETWEEN ?1 AND ?2", [first, last])?;
            break;
        };
        hour.compact(&transaction, chunk & ((1 << SOURCE_BITS) - 1))?;
    }
    transaction.commit()?;
    Ok(true)
}

/// The flushes that begin in one hour by one clock.
struct Hour {
    segment: i64,
    flushes: Vec<i64>,
}

impl Hour {
    fn oldest(connection: &Connection, now_ms: i64) -> Result<Option<Self>, StoreError> {
        let mut find =
            connection.prepare_cached("SELECT id, segment, start_ms FROM flush ORDER BY id LIMIT 4000")?;
        let mut rows = find.query([])?;
        let mut hour: Option<(Self, i64)> = None;
        while let Some(row) = rows.next()? {
            let (id, segment, start): (i64, i64, i64) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let begins = start - start.rem_euclid(HOUR_MS);
            match &mut hour {
                None => hour = Some((Self { segment, flushes: vec![id] }, begins)),
                Some((known, of)) if known.segment == segment && *of == begins => known.flushes.push(id),
                // Something came after it: it is over.
                Some(_) => return Ok(hour.map(|(hour, _)| hour)),
            }
        }
        Ok(hour.filter(|(_, begins)| begins + HOUR_MS + MINUTE_MS <= now_ms).map(|(hour, _)| hour))
    }

    fn compact(&self, transaction: &Transaction<'_>, source: i64) -> Result<(), StoreError> {
        let mut chunks = Vec::new();
        {
            let mut find =
                transaction.prepare_cached("SELECT start_ms, end_ms, form, data FROM chunk WHERE id = ?1")?;
            let mut delete = transaction.prepare_cached("DELETE FROM chunk WHERE id = ?1")?;
            for flush in &self.flushes {
                let id = (flush << SOURCE_BITS) | source;
                let chunk: Option<(i64, i64, Packed)> = find
                    .query_row([id], |row| {
                        Ok((row.get(0)?, row.get(1)?, Packed::of(row.get(2)?, row.get(3)?)))
                    })
                    .optional()?;
                if let Some((start, end, packed)) = chunk {
                    chunks.push(Chunk::unpacked(start, end, &packed)?);
                    delete.execute([id])?;
                }
            }
        }
        let quantities: std::collections::BTreeSet<Quantity> =
            chunks.iter().flat_map(|chunk| chunk.columns.keys().copied()).collect();
        for quantity in quantities {
            let pieces = chunks.iter().map(|chunk| Piece {
                start: chunk.start,
                end: chunk.end,
                points: chunk.columns.get(&quantity).cloned().unwrap_or_default(),
            });
            // What stood still for more than an hour before is no part of a block of this one.
            for piece in joined(pieces).into_iter().flat_map(short) {
                self.write(transaction, source, quantity, piece)?;
            }
        }
        Ok(())
    }

    fn write(
        &self,
        transaction: &Transaction<'_>,
        source: i64,
        quantity: Quantity,
        piece: Piece,
    ) -> Result<(), StoreError> {
        let points = i64::try_from(piece.points.len()).unwrap_or(i64::MAX);
        transaction
            .prepare_cached(
                "INSERT INTO block (source, quantity, segment, start_ms, end_ms, points, data)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            )?
            .execute(params![
                source,
                quantity.0,
                self.segment,
                piece.start,
                piece.end,
                points,
                pack(piece.start, &piece.points),
            ])?;
        if quantity.is_kept_by_changes() {
            changes::keep(transaction, source, quantity, self.segment, &piece)?;
        }
        if !quantity.is_number() {
            return Ok(());
        }
        let mut hours = Steps::of(HOUR_MS);
        packs::keep(transaction, source, quantity, piece.clone())?;
        hours.add(piece);
        for (start, step) in hours.all {
            transaction
                .prepare_cached(
                    "INSERT INTO hour (source, quantity, start_ms, least, mean, greatest, known_ms)
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)
                     ON CONFLICT DO UPDATE SET
                        least = min(least, excluded.least), greatest = max(greatest, excluded.greatest),
                        mean = CASE known_ms + excluded.known_ms WHEN 0 THEN (mean + excluded.mean) / 2
                            ELSE (mean * known_ms + excluded.mean * excluded.known_ms) / (known_ms + excluded.known_ms) END,
                        known_ms = known_ms + excluded.known_ms",
                )?
                .execute(params![
                    source,
                    quantity.0,
                    start,
                    step.least,
                    step.mean,
                    step.greatest,
                    step.known_ms
                ])?;
        }
        Ok(())
    }
}

/// Parts of a piece that are no longer than a block may be.
fn short(piece: Piece) -> Vec<Piece> {
    let mut parts = Vec::new();
    let mut start = piece.start;
    loop {
        let end = (start - start.rem_euclid(HOUR_MS) + HOUR_MS).min(piece.end);
        parts.extend(piece.clone().between(start, end).filter(|part| !part.points.is_empty()));
        if end >= piece.end {
            return parts;
        }
        start = end;
    }
}

/// What a record takes beside its words, in bytes, with its places in the indexes.
const BESIDE_WORDS: i64 = 120;
/// So many hours of a quantity are packed together, when
const HOURS_A_PACK: usize = 720;
/// so many younger ones stand beside them as rows, for the tools of others.
const HOURS_AS_ROWS: usize = 2_160;

/// Takes away some of what is too old, or, where the file is too large, of what is oldest; gives whether there may be more. What is too old
/// is told by how long daemons have run since it was written: see [`age`].
///
/// # Errors
/// It cannot be read or written.
pub fn trim(connection: &mut Connection, now: Lived, limits: &Limits) -> Result<bool, StoreError> {
    if age::mark(connection, now, age::MARKED_EVERY_MS)? {
        trim_series(connection, now, limits)?;
        age::forget(connection, now, limits.years_ms)?;
    }
    let mut gone = 0;
    if let Some(then) = age::newest_then(connection, now, limits.polled_ms)? {
        gone += trim_table(connection, "block", then.block)?;
    }
    // A pack is as old as its first minute.
    if let Some(then) = age::newest_then(connection, now, limits.minutes_ms + DAY_MS)? {
        gone += trim_table(connection, "minute", then.minute)?;
    }
    if let Some(then) = age::newest_then(connection, now, limits.years_ms)? {
        gone += trim_table(connection, "record", then.record)?;
        gone += trim_frames(connection, then.frame)?;
    }
    if used_bytes(connection)? > limits.bytes {
        gone += trim_largest(connection, limits)?;
    }
    Ok(gone > 0)
}

/// What is finest goes first: an hour of ten years ago tells more than a second of yesterday.
fn trim_largest(connection: &Connection, limits: &Limits) -> Result<usize, StoreError> {
    // Words that take half of the room would leave none for values.
    if record_bytes(connection)? > limits.bytes / 2 {
        return trim_table(connection, "record", i64::MAX);
    }
    let gone = connection.execute(
        &format!(
            "DELETE FROM line_minute WHERE (wall_ms, line) IN
                (SELECT wall_ms, line FROM line_minute ORDER BY wall_ms, line LIMIT {AT_ONCE})"
        ),
        [],
    )?;
    if gone > 0 {
        return Ok(gone);
    }
    for table in ["block", "minute"] {
        let gone = trim_table(connection, table, i64::MAX)?;
        if gone > 0 {
            return Ok(gone);
        }
    }
    let gone = trim_frames(connection, i64::MAX)?;
    if gone > 0 {
        return Ok(gone);
    }
    let mut gone = 0;
    for (table, key) in
        [("quarter", "start_ms"), ("hours", "start_ms"), ("hour", "start_ms"), ("change", "at_ms")]
    {
        gone += connection.execute(
            &format!(
                "DELETE FROM {table} WHERE (source, quantity, {key}) IN
                    (SELECT source, quantity, {key} FROM {table} ORDER BY {key} LIMIT {AT_ONCE})"
            ),
            [],
        )?;
        if gone > 0 {
            break;
        }
    }
    Ok(gone + trim_table(connection, "record", i64::MAX)?)
}

/// What has no place in an order goes once nothing that is younger can have its time. Each source has its turn once in a day.
fn trim_series(connection: &mut Connection, now: Lived, limits: &Limits) -> Result<(), StoreError> {
    if let Some(before) = age::all_younger_from(connection, now, limits.minutes_ms)? {
        connection.execute("DELETE FROM line_minute WHERE wall_ms < ?1", [before])?;
    }
    // A pack is as old as its first quarter of an hour.
    let quarters_before = age::all_younger_from(connection, now, limits.minutes_ms + DAY_MS)?;
    let before = age::all_younger_from(connection, now, limits.years_ms)?;
    if let Some(before) = before {
        connection.execute("DELETE FROM parameter WHERE last_ms < ?1", [before])?;
    }
    let turn = now.lived_ms.div_euclid(age::MARKED_EVERY_MS).rem_euclid(24);
    let sources: Vec<i64> = {
        let mut find = connection.prepare_cached("SELECT id FROM source WHERE id % 24 = ?1")?;
        let rows = find.query_map([turn], |row| row.get(0))?;
        rows.collect::<Result<_, _>>()?
    };
    for source in sources {
        let transaction = connection.transaction()?;
        for (number, _) in (0_u32..).zip(TABLE) {
            if let Some(before) = quarters_before {
                transaction
                    .prepare_cached(
                        "DELETE FROM quarter WHERE source = ?1 AND quantity = ?2 AND start_ms < ?3",
                    )?
                    .execute(params![source, number, before])?;
            }
            if let Some(before) = before {
                transaction
                    .prepare_cached("DELETE FROM hour WHERE source = ?1 AND quantity = ?2 AND start_ms < ?3")?
                    .execute(params![source, number, before])?;
            }
            pack_hours(&transaction, source, Quantity(number))?;
        }
        if let Some(before) = before {
            // A pack goes with the last of its hours.
            let last = before.saturating_sub(i64::try_from(HOURS_A_PACK).unwrap_or_default() * HOUR_MS);
            transaction.execute("DELETE FROM hours WHERE source = ?1 AND start_ms < ?2", [source, last])?;
            transaction.execute("DELETE FROM change WHERE source = ?1 AND at_ms < ?2", [source, before])?;
        }
        transaction.commit()?;
    }
    Ok(())
}

/// Packs the oldest hours of a quantity, where enough younger ones stand beside them.
fn pack_hours(transaction: &Transaction<'_>, source: i64, quantity: Quantity) -> Result<(), StoreError> {
    loop {
        let hours: Vec<(i64, Step)> = {
            let mut find = transaction.prepare_cached(
                "SELECT start_ms, least, mean, greatest, known_ms FROM hour
                 WHERE source = ?1 AND quantity = ?2 ORDER BY start_ms LIMIT ?3",
            )?;
            let enough = i64::try_from(HOURS_A_PACK + HOURS_AS_ROWS).unwrap_or(i64::MAX);
            let rows = find.query_map(params![source, quantity.0, enough], |row| {
                let (least, mean, greatest) = (row.get(1)?, row.get(2)?, row.get(3)?);
                Ok((row.get(0)?, Step { least, mean, greatest, known_ms: row.get(4)? }))
            })?;
            rows.collect::<Result<_, _>>()?
        };
        let (Some((start, _)), Some((last, _))) = (hours.first(), hours.get(HOURS_A_PACK - 1)) else {
            return Ok(());
        };
        if hours.len() < HOURS_A_PACK + HOURS_AS_ROWS {
            return Ok(());
        }
        let data = pack_steps(HOUR_MS, *start, &hours[..HOURS_A_PACK]);
        transaction
            .prepare_cached(
                "INSERT OR REPLACE INTO hours (source, quantity, start_ms, data) VALUES (?1, ?2, ?3, ?4)",
            )?
            .execute(params![source, quantity.0, start, data])?;
        transaction
            .prepare_cached("DELETE FROM hour WHERE source = ?1 AND quantity = ?2 AND start_ms <= ?3")?
            .execute(params![source, quantity.0, last])?;
    }
}

/// The oldest rows of a table, not younger than this one.
fn trim_table(connection: &Connection, table: &str, last: i64) -> Result<usize, StoreError> {
    let sql = format!("DELETE FROM {table} WHERE id IN ({})", oldest(table, last));
    Ok(connection.prepare_cached(&sql)?.execute([last])?)
}

/// How those are asked for that go at once.
fn oldest(table: &str, last: i64) -> String {
    let at_once = if last == i64::MAX { FEW } else { AT_ONCE };
    format!("SELECT id FROM {table} WHERE id <= ?1 ORDER BY id LIMIT {at_once}")
}

/// What belongs to a freeze-frame goes before it: the file lets none go that something in it names.
fn trim_frames(connection: &Connection, last: i64) -> Result<usize, StoreError> {
    let blocks = format!("DELETE FROM frame_block WHERE frame IN ({})", oldest("frame", last));
    let transaction = connection.unchecked_transaction()?;
    transaction.prepare_cached(&blocks)?.execute([last])?;
    let gone = trim_table(&transaction, "frame", last)?;
    if gone > 0 {
        captures::trim(&transaction)?;
    }
    transaction.commit()?;
    Ok(gone)
}

/// How much the records take, by how long the youngest are.
fn record_bytes(connection: &Connection) -> Result<i64, StoreError> {
    let all: i64 =
        connection.query_row("SELECT ifnull(max(id) - min(id) + 1, 0) FROM record", [], |row| row.get(0))?;
    let words: f64 = connection.query_row(
        "SELECT ifnull(avg(length(text) + ifnull(length(body), 0)), 0) FROM
            (SELECT text, body FROM record ORDER BY id DESC LIMIT 100)",
        [],
        |row| row.get(0),
    )?;
    Ok(all.saturating_mul(BESIDE_WORDS + words as i64))
}

/// How much of the file is in use.
///
/// # Errors
/// It cannot be read.
pub fn used_bytes(connection: &Connection) -> Result<i64, StoreError> {
    let number = |name| connection.pragma_query_value(None, name, |row| row.get::<_, i64>(0));
    Ok((number("page_count")? - number("freelist_count")?) * number("page_size")?)
}
