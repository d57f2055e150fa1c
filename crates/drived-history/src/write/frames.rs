//! Freeze-frames: what is known of a drive around a trip or a stop that was not confirmed, kept for as long as the records are.

use rusqlite::{Connection, Transaction, params};

use crate::{
    column::{deflated, pack},
    read::{self, AFTER_MS, BEFORE_MS},
    record::{Kind, Record},
    store::StoreError,
};

/// The events that have one.
const EVENTS: [&str; 2] = ["tripped", "stop_unconfirmed"];

/// Whether a record is of something that has one.
#[must_use]
pub fn has_one(record: &Record) -> bool {
    record.kind == Kind::Event && EVENTS.contains(&&*record.what)
}

/// Notes that a frame is to be kept where a record asks for one.
pub fn note(transaction: &Transaction<'_>, run: i64, record: &Record) -> rusqlite::Result<()> {
    let Some(drive) = record.drive.as_ref().filter(|_| has_one(record)) else { return Ok(()) };
    let at = record.at.wall_ms;
    transaction.execute(
        "INSERT INTO frame (drive, why, at_ms, start_ms, end_ms, is_whole, run, steady_ms, exchanges, line)
         VALUES (?1, ?2, ?3, ?4, ?5, 0, ?6, ?7, ?8, ?9)",
        params![
            drive,
            record.what,
            at,
            at - BEFORE_MS,
            at + AFTER_MS,
            run,
            record.at.steady_ms,
            record.exchanges.as_ref().map(|said| deflated(said.as_bytes())),
            record.line,
        ],
    )?;
    Ok(())
}

/// Fills the frames whose time is over by the daemon's own clock, with what is in the file by then; gives whether there was one. Those of a
/// run before this one get no more than there is.
///
/// # Errors
/// It cannot be read or written.
pub fn fill(connection: &mut Connection, run: i64, known_until_ms: i64) -> Result<bool, StoreError> {
    let waiting: Vec<(i64, String, i64, i64)> = {
        let mut find = connection.prepare_cached(
            "SELECT id, drive, start_ms, end_ms FROM frame
             WHERE is_whole = 0 AND (run <> ?1 OR steady_ms < ?2) LIMIT 1",
        )?;
        let rows = find.query_map([run, known_until_ms.saturating_sub(AFTER_MS)], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
        })?;
        rows.collect::<Result<_, _>>()?
    };
    for (id, drive, start, end) in &waiting {
        let mut columns = Vec::new();
        for quantity in read::quantities(connection, drive, *start, *end)? {
            for piece in read::pieces(connection, drive, quantity, *start, *end)? {
                columns.push((quantity, piece));
            }
        }
        let transaction = connection.transaction()?;
        for (quantity, piece) in columns {
            transaction.execute(
                "INSERT INTO frame_block (frame, quantity, start_ms, end_ms, data) VALUES (?1, ?2, ?3, ?4, ?5)",
                params![id, quantity.0, piece.start, piece.end, pack(piece.start, &piece.points)],
            )?;
        }
        transaction.execute("UPDATE frame SET is_whole = 1 WHERE id = ?1", [id])?;
        transaction.commit()?;
    }
    Ok(!waiting.is_empty())
}
