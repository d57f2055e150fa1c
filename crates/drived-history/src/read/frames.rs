//! Freeze-frames.

use rusqlite::{Connection, params};

use crate::{column::unpack, curve::Piece, quantity::Quantity, store::StoreError};

/// What was known of a drive around something that happened to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The event.
    pub why: String,
    pub at_unix_ms: i64,
    /// Whether what came after it is in it too.
    pub is_whole: bool,
    pub curves: Vec<(Quantity, Piece)>,
}

/// The frames of a drive between two moments.
///
/// # Errors
/// It cannot be read.
pub fn frames(connection: &Connection, drive: &str, from: i64, to: i64) -> Result<Vec<Frame>, StoreError> {
    let mut find = connection.prepare_cached(
        "SELECT id, why, at_ms, is_whole FROM frame WHERE drive = ?1 AND at_ms BETWEEN ?2 AND ?3 ORDER BY id LIMIT 100",
    )?;
    let rows = find.query_map(params![drive, from, to], |row| {
        let frame =
            Frame { why: row.get(1)?, at_unix_ms: row.get(2)?, is_whole: row.get(3)?, curves: Vec::new() };
        Ok((row.get::<_, i64>(0)?, frame))
    })?;
    let mut all = Vec::new();
    for row in rows {
        let (id, mut frame) = row?;
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
