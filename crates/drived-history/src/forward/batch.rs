//! What is sent next: [`next_part`], from a [`Place`] in what the history keeps. Nothing is sent twice, and nothing is left out but what is not
//! kept any more.

use rusqlite::{Connection, params};

use super::line::Lines;
use crate::{
    quantity::Quantity,
    read::{self, told_in},
    store::{Place, StoreError},
};

/// So much time of one drive is sent at once.
const WINDOW_MS: i64 = 10 * 60_000;
/// What was read just before a flush may come with the next one.
const LATE_MS: i64 = 5_000;
/// A value that stays as it is is told again so often.
const TOLD_EVERY_MS: i64 = 60_000;
/// What is passed over is told, where it is longer than this and was not kept any more.
const SKIPPED_MS: i64 = 3_600_000;

/// Lines, and the place behind them.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) lines: String,
    pub(super) next: Place,
    skipped_ms: i64,
}

impl Part {
    /// What was passed over because it is not kept any more.
    pub(super) fn skipped(&self) -> Option<String> {
        let hours = self.skipped_ms / SKIPPED_MS;
        (hours > 0).then(|| {
            format!(
                "nothing is there to be sent of {hours} h: no value was read then, or none is kept any more"
            )
        })
    }
}

/// What comes behind a place; `None`: nothing yet.
///
/// # Errors
/// It cannot be read.
pub(super) fn next_part(connection: &Connection, place: &Place) -> Result<Option<Part>, StoreError> {
    let Some((segment, from, to)) = window(connection, place)? else { return Ok(None) };
    let skipped_ms = match place.segment == segment && place.until_ms > i64::MIN && place.is_whole() {
        true => from - place.until_ms,
        false => 0,
    };
    let last = place.window.as_ref().map_or("", |(_, drive)| drive);
    let drive = read::drives(connection)?.into_iter().find(|drive| drive.as_str() > last);
    let Some(drive) = drive else {
        let next = Place { segment, until_ms: to, window: None };
        return Ok(Some(Part { lines: String::new(), next, skipped_ms }));
    };
    let lines = lines(connection, &drive, segment, from, to)?;
    let next = Place { segment, until_ms: from, window: Some((to, drive)) };
    Ok(Some(Part { lines, next, skipped_ms }))
}

/// The segment and the time that are sent next: behind `from`, up to `to`.
fn window(connection: &Connection, place: &Place) -> Result<Option<(i64, i64, i64)>, StoreError> {
    if let Some((to, _)) = &place.window {
        return Ok(Some((place.segment, place.until_ms, *to)));
    }
    let mut segments = connection.prepare_cached("SELECT id FROM segment WHERE id >= ?1 ORDER BY id")?;
    let segments: Vec<i64> =
        segments.query_map([place.segment], |row| row.get(0))?.collect::<Result<_, _>>()?;
    for (number, segment) in segments.iter().enumerate() {
        let from = if *segment == place.segment { place.until_ms } else { i64::MIN };
        let mut bounds = connection.prepare_cached(
            "SELECT min(start_ms), max(end_ms) FROM (
                SELECT start_ms, end_ms FROM flush WHERE segment = ?1 AND end_ms > ?2
                UNION ALL SELECT start_ms, end_ms FROM block WHERE segment = ?1 AND end_ms > ?2)",
        )?;
        let (start, end): (Option<i64>, Option<i64>) =
            bounds.query_row(params![segment, from], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let (Some(start), Some(end)) = (start, end) else { continue };
        // Only what is over: a later segment has begun, or what may come late has come.
        let end = if number + 1 < segments.len() { end } else { end - LATE_MS };
        let from = from.max(start - 1);
        if end > from {
            // Whole windows have whole multiples: however often it is interrupted, they are the same.
            let to = (from.div_euclid(WINDOW_MS) + 1).saturating_mul(WINDOW_MS).min(end);
            return Ok(Some((*segment, from, to)));
        }
    }
    Ok(None)
}

/// What was known of a drive by one clock behind `from`, up to `to`.
fn lines(
    connection: &Connection,
    drive: &str,
    segment: i64,
    from: i64,
    to: i64,
) -> Result<String, StoreError> {
    let mut lines = Lines::default();
    for quantity in read::quantities(connection, drive, from, to)? {
        let told = told_in(connection, drive, quantity, from, to)?;
        for (_, piece) in told.into_iter().filter(|(of, _)| *of == segment) {
            let (end, mut points) = (piece.end, piece.points.into_iter().peekable());
            while let Some(point) = points.next() {
                let is_new = point.at > from;
                let Some(count) = point.count else {
                    if is_new && quantity == Quantity::STATE {
                        lines.known(point.at, false);
                    }
                    continue;
                };
                if is_new {
                    lines.add(point.at, quantity, count);
                    if quantity == Quantity::STATE {
                        lines.known(point.at, true);
                    }
                }
                // It stays so until the next one: told each minute, so that nobody takes a steady value for none.
                let until = points.peek().map_or(end, |next| next.at - 1);
                let mut at = (point.at.div_euclid(TOLD_EVERY_MS) + 1) * TOLD_EVERY_MS;
                while at <= until {
                    if at > from {
                        lines.add(at, quantity, count);
                    }
                    at += TOLD_EVERY_MS;
                }
            }
            // Behind the last reading nothing is known, where none has come for so long.
            if quantity == Quantity::STATE && end >= from && to - end > TOLD_EVERY_MS {
                lines.known(end + 1, false);
            }
        }
    }
    Ok(lines.of_drive(drive))
}
