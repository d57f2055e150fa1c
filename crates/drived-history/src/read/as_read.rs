//! What was read of a drive within a time of one run of the daemon, in the order of that run's own clock: [`as_read`].

use rusqlite::{Connection, params};

use super::{SOURCE_BITS, quantities, source, told_in};
use crate::{
    column::Point,
    quantity::{Quantity, Set},
    store::StoreError,
};

/// So much time is read at once,
const WINDOW_MS: i64 = 10 * 60_000;
/// and so many points of it are given.
const AT_ONCE: usize = 4_000;

/// A point of a quantity, with its moment by the run's own clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Read {
    pub(crate) at_ms: i64,
    pub(crate) quantity: Quantity,
    /// By the wall's clock as it stood then.
    pub(crate) point: Point,
}

/// Points, and up to when these are all of them.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Page {
    pub(crate) points: Vec<Read>,
    pub(crate) until_ms: i64,
}

/// A time in which the wall's clock was not set.
struct Segment {
    id: i64,
    /// How far the wall's clock is ahead of the run's own.
    ahead_ms: i64,
}

/// What is known of the quantities of the table behind one moment of a run, up to another: the first of it. Where nothing is known any more a
/// point says so.
///
/// # Errors
/// It cannot be read.
pub(crate) fn as_read(
    connection: &Connection,
    drive: &str,
    run: i64,
    from_ms: i64,
    to_ms: i64,
) -> Result<Page, StoreError> {
    let segments = segments(connection, run)?;
    for (place, Segment { id, ahead_ms }) in segments.iter().enumerate() {
        let (from, to) = (from_ms.saturating_add(*ahead_ms), to_ms.saturating_add(*ahead_ms));
        let Some((start, end)) = bounds(connection, drive, *id, from)? else { continue };
        let is_last = place + 1 == segments.len();
        let from = from.max(start - 1);
        // What is told by the next clock is told by that.
        let to = if is_last { to } else { to.min(end) };
        if to <= from {
            continue;
        }
        let until = from.saturating_add(WINDOW_MS).min(to);
        let mut points = Vec::new();
        for quantity in quantities(connection, drive, from, until)? {
            if quantity.row().is_some() {
                points.extend(news(connection, drive, quantity, *id, (from, until), is_last)?);
            }
        }
        points.sort_by_key(|(quantity, point)| (point.at, *quantity));
        let until = cut(&mut points, until);
        let read =
            |(quantity, point): (Quantity, Point)| Read { at_ms: point.at - ahead_ms, quantity, point };
        let points = points.into_iter().map(read).collect();
        return Ok(Page { points, until_ms: until.saturating_sub(*ahead_ms) });
    }
    Ok(Page { points: Vec::new(), until_ms: to_ms })
}

/// The points of a quantity behind a moment of one clock, up to another.
fn news(
    connection: &Connection,
    drive: &str,
    quantity: Quantity,
    segment: i64,
    (from, until): (i64, i64),
    is_last: bool,
) -> Result<Vec<(Quantity, Point)>, StoreError> {
    let mut all = Vec::new();
    for (of, piece) in told_in(connection, drive, quantity, from, until)? {
        if of != segment {
            continue;
        }
        let is_known = piece.points.last().is_some_and(|last| last.count.is_some());
        let end = Point { at: piece.end + 1, count: None };
        all.extend(piece.points);
        if is_known && is_last && end.at <= until {
            all.push(end);
        }
    }
    all.retain(|point| point.at > from);
    Ok(all.into_iter().map(|point| (quantity, point)).collect())
}

/// Leaves no more than are given at once, and gives up to when they are all. What was read at one moment is not parted.
fn cut(points: &mut Vec<(Quantity, Point)>, until: i64) -> i64 {
    let Some((_, beyond)) = points.get(AT_ONCE) else { return until };
    let first_at = points.first().map(|(_, first)| first.at);
    let at = beyond.at;
    match first_at == Some(at) {
        // A drive has not so many quantities.
        true => points.retain(|(_, point)| point.at <= at),
        false => points.retain(|(_, point)| point.at < at),
    }
    points.last().map_or(until, |(_, last)| last.at)
}

fn segments(connection: &Connection, run: i64) -> Result<Vec<Segment>, StoreError> {
    let mut find = connection
        .prepare_cached("SELECT id, wall_ms - steady_ms FROM segment WHERE run = ?1 ORDER BY id")?;
    let rows = find.query_map([run], |row| Ok(Segment { id: row.get(0)?, ahead_ms: row.get(1)? }))?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// When what is known of a drive by one clock behind a moment begins, and ends.
fn bounds(
    connection: &Connection,
    drive: &str,
    segment: i64,
    from: i64,
) -> Result<Option<(i64, i64)>, StoreError> {
    let mut all: Option<(i64, i64)> = None;
    for set in Set::ALL {
        let Some(source) = source(connection, drive, set)? else { continue };
        let mut find = connection.prepare_cached(
            "SELECT min(start_ms), max(end_ms) FROM (
                SELECT chunk.start_ms, chunk.end_ms FROM flush JOIN chunk ON chunk.id = ((flush.id << ?1) | ?2)
                WHERE flush.segment = ?3 AND flush.end_ms > ?4 AND chunk.end_ms > ?4
                UNION ALL SELECT start_ms, end_ms FROM block WHERE source = ?2 AND segment = ?3 AND end_ms > ?4)",
        )?;
        let (start, end): (Option<i64>, Option<i64>) = find
            .query_row(params![SOURCE_BITS, source, segment, from], |row| Ok((row.get(0)?, row.get(1)?)))?;
        if let (Some(start), Some(end)) = (start, end) {
            let known = all.unwrap_or((start, end));
            all = Some((known.0.min(start), known.1.max(end)));
        }
    }
    Ok(all)
}
