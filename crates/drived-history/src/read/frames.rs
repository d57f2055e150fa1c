//! Freeze-frames.

use rusqlite::{Connection, OptionalExtension as _, params};

use crate::{
    column::{Damaged, inflated, unpack},
    curve::Piece,
    quantity::Quantity,
    store::StoreError,
};

/// A freeze-frame is from so long before what it is of,
pub const BEFORE_MS: i64 = 60_000;
/// to so long after.
pub const AFTER_MS: i64 = 30_000;

/// What was known of a drive around something that happened to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The event.
    pub why: String,
    pub at_unix_ms: i64,
    /// When that was by the daemon's own clock, in its run.
    pub run: i64,
    pub steady_ms: i64,
    /// Whether what came after it is in it too.
    pub is_whole: bool,
    pub start_ms: i64,
    pub end_ms: i64,
    pub curves: Vec<(Quantity, Piece)>,
    /// What its line had said until then, as JSON; empty where that was not kept.
    pub exchanges: String,
    /// What a capture has heard of its line around it, where one ran.
    pub capture: Option<Heard>,
}

/// How much a capture has heard around a freeze-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heard {
    pub frames: i64,
    /// So many others there were between them, for which there was no room,
    pub left_out: i64,
    /// and whether there were others before them.
    pub is_cut: bool,
    /// When the first and the last of them were heard.
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
}

/// Parts of captures that reach into the time of a freeze-frame, by its line, run, and moment of the daemon's own clock.
const PARTS: &str =
    "FROM captured WHERE line = ?1 AND run = ?2 AND first_ms <= ?3 + ?5 AND last_ms >= ?3 - ?4";

/// The frames of a drive between two moments.
///
/// # Errors
/// It cannot be read.
pub fn frames(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Vec<Frame>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT id, why, at_ms, is_whole, start_ms, end_ms, exchanges, line, run, steady_ms FROM frame WHERE drive = ?1 AND at_ms BETWEEN ?2 AND ?3 ORDER BY id LIMIT 100",
    )?;
    let rows = find.query_map(params![drive, from, to], |row| {
        let frame = Frame {
            why: row.get(1)?,
            at_unix_ms: row.get(2)?,
            run: row.get(8)?,
            steady_ms: row.get(9)?,
            is_whole: row.get(3)?,
            start_ms: row.get(4)?,
            end_ms: row.get(5)?,
            curves: Vec::new(),
            exchanges: String::new(),
            capture: None,
        };
        let line = row.get::<_, Option<String>>(7)?;
        Ok((row.get::<_, i64>(0)?, frame, row.get::<_, Option<Vec<u8>>>(6)?, line))
    })?;
    let mut all = Vec::new();
    for row in rows {
        let (id, mut frame, exchanges, line) = row?;
        if let Some(exchanges) = exchanges {
            frame.exchanges = String::from_utf8(inflated(&exchanges)?).map_err(|_| Damaged)?;
        }
        if let Some(line) = line {
            frame.capture = heard(connection, &line, &frame)?;
        }
        let mut find = connection.prepare_cached(
            "SELECT quantity, start_ms, end_ms, data FROM frame_block WHERE frame = ?1 ORDER BY quantity, start_ms",
        )?;
        let curves = find
            .query_map([id], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get::<_, Vec<u8>>(3)?)))?;
        for curve in curves {
            let (quantity, start, end, data) = curve?;
            frame.curves.push((Quantity(quantity), Piece { start, end, points: unpack(start, &data)? }));
        }
        all.push(frame);
    }
    Ok(all)
}

/// How much was heard on this line around it.
fn heard(connection: &Connection, line: &str, of: &Frame) -> Result<Option<Heard>, StoreError> {
    let Frame { run, steady_ms, at_unix_ms, .. } = of;
    let mut find = connection.prepare_cached(&format!(
        "SELECT sum(frames), sum(left_out), max(is_cut), min(first_ms), max(last_ms) {PARTS}"
    ))?;
    let heard = find.query_row(params![line, run, steady_ms, BEFORE_MS, AFTER_MS], |row| {
        let Some(frames) = row.get(0)? else { return Ok(None) };
        let unix_ms = |place| row.get(place).map(|at: i64| at - steady_ms + at_unix_ms);
        Ok(Some(Heard {
            frames,
            left_out: row.get(1)?,
            is_cut: row.get(2)?,
            from_unix_ms: unix_ms(3)?,
            to_unix_ms: unix_ms(4)?,
        }))
    })?;
    Ok(heard)
}

/// What captures have heard of the line of a drive around the freeze-frame of this moment, as a file of the form in which they are; `None`: there
/// is no such freeze-frame, or no capture ran then.
///
/// # Errors
/// It cannot be read.
pub fn capture(connection: &Connection, drive: &str, at_unix_ms: i64) -> Result<Option<Vec<u8>>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT line, run, steady_ms FROM frame WHERE drive = ?1 AND at_ms = ?2 AND line IS NOT NULL",
    )?;
    let of: Option<(String, i64, i64)> = find
        .query_row(params![drive, at_unix_ms], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
        .optional()?;
    let Some((line, run, steady_ms)) = of else { return Ok(None) };
    let mut find = connection.prepare_cached(&format!("SELECT data {PARTS} ORDER BY first_ms, id"))?;
    let parts =
        find.query_map(params![line, run, steady_ms, BEFORE_MS, AFTER_MS], |row| row.get::<_, Vec<u8>>(0))?;
    // Each part is a section of the file.
    let mut file = Vec::new();
    for part in parts {
        file.extend(inflated(&part?)?);
    }
    Ok((!file.is_empty()).then_some(file))
}
