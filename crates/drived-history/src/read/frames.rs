//! Freeze-frames.

use rusqlite::{Connection, params};

use crate::{
    column::{Damaged, inflated, unpack},
    curve::Piece,
    quantity::Quantity,
    store::StoreError,
};

/// What was known of a drive around something that happened to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The event.
    pub why: String,
    pub at_unix_ms: i64,
    /// Whether what came after it is in it too.
    pub is_whole: bool,
    pub start_ms: i64,
    pub end_ms: i64,
    pub curves: Vec<(Quantity, Piece)>,
    /// What its line had said until then, as JSON; empty where that was not kept.
    pub exchanges: String,
}

/// The frames of a drive between two moments.
///
/// # Errors
/// It cannot be read.
pub fn frames(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Vec<Frame>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT id, why, at_ms, is_whole, start_ms, end_ms, exchanges FROM frame WHERE drive = ?1 AND at_ms BETWEEN ?2 AND ?3 ORDER BY id LIMIT 100",
    )?;
    let rows = find.query_map(params![drive, from, to], |row| {
        let frame = Frame {
            why: row.get(1)?,
            at_unix_ms: row.get(2)?,
            is_whole: row.get(3)?,
            start_ms: row.get(4)?,
            end_ms: row.get(5)?,
            curves: Vec::new(),
            exchanges: String::new(),
        };
        Ok((row.get::<_, i64>(0)?, frame, row.get::<_, Option<Vec<u8>>>(6)?))
    })?;
    let mut all = Vec::new();
    for row in rows {
        let (id, mut frame, exchanges) = row?;
        if let Some(exchanges) = exchanges {
            frame.exchanges = String::from_utf8(inflated(&exchanges)?).map_err(|_| Damaged)?;
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
