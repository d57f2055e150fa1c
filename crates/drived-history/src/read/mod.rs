//! The reading half: what is known of a quantity between two moments, in steps, and what happened. Each answer has an end.
//!
//! Moments are milliseconds since 1970 by the wall's clock as it stood then. Where that clock was set back, what was told twice of one time is
//! given in the order of the daemon's own clock.

mod as_read;
mod days;
mod frames;
mod lines;
mod parameters;
mod readings;
mod records;
mod steps;
mod then;

use std::{collections::BTreeSet, path::Path};

use rusqlite::{Connection, OptionalExtension as _, params};

pub(crate) use self::as_read::{Page, Read, as_read};
pub use self::{
    days::{Ran, days, ran},
    frames::{AFTER_MS, BEFORE_MS, Frame, Heard, capture, frames},
    lines::{line_minutes, lines_at},
    parameters::parameters,
    readings::{Reading, readings},
    records::{Filter, Found, records},
    steps::{DAY_MS, QUARTER_MS, pack_steps, steps, unpack_steps},
    then::then,
};
use crate::{
    chunk::{Chunk, Packed, piece_of},
    column::{Point, unpack},
    curve::{Piece, joined},
    quantity::{Quantity, Set},
    store::{self, StoreError},
};

/// The bits of a chunk's number that are its source's.
pub const SOURCE_BITS: u32 = 20;
/// Among so many of the newest records a drive is looked for of which no value has been written yet.
const UNSOURCED: i64 = 20_000;
/// No block is longer than this, so that none that begins earlier has to be looked at.
pub const LONGEST_BLOCK_MS: i64 = 2 * 3_600_000;

/// The file, opened to be read; it may be written meanwhile.
#[derive(Debug)]
pub struct History(pub Connection);

impl History {
    /// Opens it.
    ///
    /// # Errors
    /// There is none, or it cannot be read here.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        store::open_to_read(path).map(Self)
    }
}

/// The drives of which there is something: values, or what happened to one in the first minute.
///
/// # Errors
/// It cannot be read.
pub fn drives(connection: &Connection) -> Result<Vec<String>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT drive FROM source UNION
         SELECT drive FROM record WHERE drive IS NOT NULL AND id > (SELECT max(id) FROM record) - ?1
         ORDER BY drive",
    )?;
    let rows = find.query_map([UNSOURCED], |row| row.get(0))?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// When the history begins, and the newest moment of which it knows something; nothing where nothing is there.
///
/// # Errors
/// It cannot be read.
pub fn bounds(connection: &Connection) -> Result<(Option<i64>, Option<i64>), StoreError> {
    let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?));
    Ok(connection.query_row(
        "SELECT (SELECT min(wall_ms) FROM record),
                (SELECT max(at) FROM (SELECT max(wall_ms) AS at FROM record UNION ALL SELECT max(end_ms) FROM flush
                    UNION ALL SELECT end_ms FROM block WHERE id = (SELECT max(id) FROM block)))",
        [],
        row,
    )?)
}

/// The quantities of a drive that are kept as they were read between two moments.
///
/// # Errors
/// It cannot be read.
pub fn quantities(
    connection: &Connection,
    drive: &str,
    from: i64,
    to: i64,
) -> Result<BTreeSet<Quantity>, StoreError> {
    let mut all = BTreeSet::new();
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        let source = source?;
        let mut find = connection.prepare_cached(
            "SELECT DISTINCT quantity FROM block WHERE source = ?1 AND start_ms <= ?2 AND end_ms >= ?3",
        )?;
        let rows = find.query_map(params![source, to, from], |row| row.get(0).map(Quantity))?;
        for quantity in rows {
            all.insert(quantity?);
        }
        for (_, start, end, data) in chunks(connection, source, from, to)? {
            all.extend(Chunk::unpacked(start, end, &data)?.columns.into_keys());
        }
    }
    Ok(all)
}

/// The quantities of a drive of which anything is kept, in whichever form.
///
/// # Errors
/// It cannot be read.
pub fn all_quantities(connection: &Connection, drive: &str) -> Result<Vec<Quantity>, StoreError> {
    // What was read within the last day says what is there; older than that, the steps do.
    let newest: Option<i64> =
        connection.prepare_cached("SELECT max(end_ms) FROM flush")?.query_row([], |row| row.get(0))?;
    let newest = newest.unwrap_or(i64::MAX);
    let mut all = quantities(connection, drive, newest.saturating_sub(LONGEST_BLOCK_MS), newest)?;
    let mut find = connection.prepare_cached(
        "SELECT id FROM quantity AS one WHERE EXISTS
            (SELECT 1 FROM source JOIN hour ON hour.source = source.id AND hour.quantity = one.id WHERE drive = ?1)",
    )?;
    let rows = find.query_map([drive], |row| row.get(0).map(Quantity))?;
    for quantity in rows {
        all.insert(quantity?);
    }
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        let (source, mut last) = (source?, -1_i64);
        let mut next = connection
            .prepare_cached("SELECT min(quantity) FROM change WHERE source = ?1 AND quantity > ?2")?;
        while let Some(found) = next.query_row([source, last], |row| row.get::<_, Option<i64>>(0))? {
            all.extend(u32::try_from(found).map(Quantity));
            last = found;
        }
    }
    Ok(all.into_iter().collect())
}

/// What is known of a quantity between two moments, as it was read: one piece for each time the clock was not set in.
///
/// # Errors
/// It cannot be read.
pub fn pieces(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<Vec<Piece>, StoreError> {
    let told = told_in(connection, drive, quantity, from, to)?;
    Ok(told.into_iter().map(|(_, piece)| piece).collect())
}

/// The same, each with the number of its segment: the time in which the clock was not set.
///
/// # Errors
/// It cannot be read.
pub fn told_in(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<Vec<(i64, Piece)>, StoreError> {
    let mut all: Vec<(i64, Piece)> = Vec::new();
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        let (source, mut of_source) = (source?, Vec::new());
        let mut find = connection.prepare_cached(
            "SELECT segment, start_ms, end_ms, data FROM block
             WHERE source = ?1 AND quantity = ?2 AND start_ms BETWEEN ?3 AND ?4 AND end_ms >= ?5
             ORDER BY segment, start_ms, id",
        )?;
        let rows = find.query_map(
            params![source, quantity.0, from.saturating_sub(LONGEST_BLOCK_MS), to, from],
            |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get::<_, Vec<u8>>(3)?)),
        )?;
        for row in rows {
            let (segment, start, end, data) = row?;
            of_source.push((segment, Piece { start, end, points: unpack(start, &data)? }));
        }
        for (segment, start, end, data) in chunks(connection, source, from, to)? {
            of_source.push((segment, piece_of(quantity, start, end, &data)?));
        }
        if quantity.is_kept_by_changes() {
            // What a block begins with is in it.
            let until = oldest_block(connection, source, quantity)?.map_or(i64::MAX, |oldest| oldest - 1);
            of_source.extend(changes(connection, source, quantity, from, to.min(until))?);
        }
        // The other one says nothing of it, also not that it is not known.
        if of_source.iter().any(|(_, piece)| !piece.points.is_empty()) {
            all.extend(of_source);
        }
    }
    // A quantity is of one source; what is in blocks is older than what is in chunks, within each segment.
    all.sort_by_key(|(segment, piece)| (*segment, piece.start));
    let mut pieces = Vec::new();
    for of_one in all.chunk_by(|(one, _), (other, _)| one == other) {
        let whole = joined(of_one.iter().map(|(_, piece)| piece.clone()));
        let part = whole.and_then(|whole| whole.between(from, to)).filter(|piece| !piece.points.is_empty());
        pieces.extend(of_one.first().map(|(segment, _)| *segment).zip(part));
    }
    Ok(pieces)
}

/// From when on a quantity is kept as it was read.
fn oldest_kept(connection: &Connection, drive: &str, quantity: Quantity) -> Result<Option<i64>, StoreError> {
    let mut oldest: Option<i64> =
        connection.prepare_cached("SELECT min(start_ms) FROM flush")?.query_row([], |row| row.get(0))?;
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        oldest = oldest.into_iter().chain(oldest_block(connection, source?, quantity)?).min();
    }
    Ok(oldest)
}

/// When the oldest block of a quantity begins.
fn oldest_block(connection: &Connection, source: i64, quantity: Quantity) -> Result<Option<i64>, StoreError> {
    let mut find =
        connection.prepare_cached("SELECT min(start_ms) FROM block WHERE source = ?1 AND quantity = ?2")?;
    Ok(find.query_row(params![source, quantity.0], |row| row.get(0))?)
}

/// What is known of a word from its changes, where no block is kept any more: one piece for each time the clock was not set in.
fn changes(
    connection: &Connection,
    source: i64,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<Vec<(i64, Piece)>, StoreError> {
    if from > to {
        return Ok(Vec::new());
    }
    let mut find = connection.prepare_cached(
        "SELECT segment, at_ms, count FROM change WHERE source = ?1 AND quantity = ?2 AND at_ms <= ?4 AND at_ms >=
            coalesce((SELECT max(at_ms) FROM change WHERE source = ?1 AND quantity = ?2 AND at_ms <= ?3), ?3)
         ORDER BY at_ms",
    )?;
    let rows = find.query_map(params![source, quantity.0, from, to], |row| {
        Ok((row.get::<_, i64>(0)?, Point { at: row.get(1)?, count: row.get(2)? }))
    })?;
    let mut all: std::collections::BTreeMap<i64, Piece> = std::collections::BTreeMap::new();
    for row in rows {
        let (segment, point) = row?;
        let piece = all.entry(segment).or_insert_with(|| Piece {
            start: point.at,
            end: point.at,
            points: Vec::new(),
        });
        piece.end = if point.count.is_none() { point.at - 1 } else { to.max(point.at) };
        piece.points.push(point);
    }
    let ended = |piece: Piece| {
        let mut points = piece.points;
        if points.last().is_some_and(|last| last.count.is_none()) {
            points.pop();
        }
        Piece { points, ..piece }
    };
    Ok(all.into_iter().map(|(segment, piece)| (segment, ended(piece))).collect())
}

/// The same as points, each in its turn: what is read of a long time is never in memory at once. It ends when `each` says `false`.
///
/// # Errors
/// It cannot be read, or `each` fails.
pub fn points<E: From<StoreError>>(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    from: i64,
    to: i64,
    mut each: impl FnMut(Point) -> Result<bool, E>,
) -> Result<(), E> {
    // Where what was told last ends, and what held there.
    let mut open: Option<(i64, i64)> = None;
    let (from, to) = kept(connection, drive, quantity, from, to)?;
    for (start, end) in windows(from, to) {
        for piece in pieces(connection, drive, quantity, start, end)? {
            let first = piece.points.first().copied();
            let goes_on = open.is_some_and(|(until, count)| {
                until == piece.start && first == Some(Point { at: until, count: Some(count) })
            });
            if let (Some((until, _)), false) = (open, goes_on)
                && !each(Point { at: until + 1, count: None })?
            {
                return Ok(());
            }
            let last = piece.points.last().and_then(|point| point.count);
            for point in piece.points.into_iter().skip(usize::from(goes_on)) {
                if !each(point)? {
                    return Ok(());
                }
            }
            open = last.map(|count| (piece.end, count));
        }
    }
    if let Some((until, _)) = open {
        each(Point { at: until + 1, count: None })?;
    }
    Ok(())
}

/// The part of a time from which there may be points of a quantity.
fn kept(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    from: i64,
    to: i64,
) -> Result<(i64, i64), StoreError> {
    let mut find = connection.prepare_cached("SELECT min(start_ms), max(end_ms) FROM flush")?;
    let (mut first, mut last): (Option<i64>, Option<i64>) =
        find.query_row([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    for source in Set::ALL.into_iter().filter_map(|set| source(connection, drive, set).transpose()) {
        let mut find = connection.prepare_cached(
            "SELECT min(start_ms), max(start_ms) FROM block WHERE source = ?1 AND quantity = ?2",
        )?;
        let source = source?;
        let (oldest, newest): (Option<i64>, Option<i64>) =
            find.query_row(params![source, quantity.0], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let mut find =
            connection.prepare_cached("SELECT min(at_ms) FROM change WHERE source = ?1 AND quantity = ?2")?;
        let changed: Option<i64> = find.query_row(params![source, quantity.0], |row| row.get(0))?;
        let mut find =
            connection.prepare_cached("SELECT max(at_ms) FROM change WHERE source = ?1 AND quantity = ?2")?;
        let last_changed: Option<i64> = find.query_row(params![source, quantity.0], |row| row.get(0))?;
        last = [last, last_changed].into_iter().flatten().max();
        first = [first, oldest, changed].into_iter().flatten().min();
        last = [last, newest.map(|start| start.saturating_add(LONGEST_BLOCK_MS))].into_iter().flatten().max();
    }
    Ok((from.max(first.unwrap_or(i64::MAX)), to.min(last.unwrap_or(i64::MIN))))
}

/// A time in parts of six hours, or of a week where it is longer than a year, each of which begins where the one before ends.
fn windows(from: i64, to: i64) -> impl Iterator<Item = (i64, i64)> {
    const HOUR_MS: i64 = 3_600_000;
    let window = if to.saturating_sub(from) > 366 * 24 * HOUR_MS { 168 * HOUR_MS } else { 6 * HOUR_MS };
    let first = (from <= to).then_some((from, from.saturating_add(window).min(to)));
    std::iter::successors(first, move |(_, end)| {
        (*end < to).then(|| (*end, end.saturating_add(window).min(to)))
    })
}

/// The number of a set of a drive.
fn source(connection: &Connection, drive: &str, set: Set) -> Result<Option<i64>, StoreError> {
    let mut find = connection.prepare_cached("SELECT id FROM source WHERE drive = ?1 AND part = ?2")?;
    Ok(find.query_row(params![drive, set.name()], |row| row.get(0)).optional()?)
}

/// A chunk as it is written: its segment, start, end, and bytes.
type Written = (i64, i64, i64, Packed);

/// The chunks of a source between two moments.
fn chunks(connection: &Connection, source: i64, from: i64, to: i64) -> Result<Vec<Written>, StoreError> {
    // A flush begins where its oldest chunk does.
    let mut find = connection.prepare_cached(
        "SELECT flush.segment, chunk.start_ms, chunk.end_ms, chunk.form, chunk.data
         FROM flush JOIN chunk ON chunk.id = ((flush.id << ?1) | ?2)
         WHERE flush.end_ms >= ?3 AND flush.start_ms <= ?4 AND chunk.end_ms >= ?3 AND chunk.start_ms <= ?4
         ORDER BY flush.id",
    )?;
    let rows = find.query_map(params![SOURCE_BITS, source, from, to], |row| {
        Ok((row.get(0)?, row.get(1)?, row.get(2)?, Packed::of(row.get(3)?, row.get(4)?)))
    })?;
    Ok(rows.collect::<Result<_, _>>()?)
}
