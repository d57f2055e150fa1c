//! What is a word or bits, at each of its changes: kept for as long as the records are, when the blocks it came in are gone.

use rusqlite::{OptionalExtension as _, Transaction, params};

use crate::{curve::Piece, quantity::Quantity};

/// So often a word of a drive changes within an hour at the most that is kept by its changes: more often it is a number, or a bit that beats.
/// That nothing is known is kept of such an hour.
const CHANGES: usize = 400;

/// Keeps the changes of a piece. Where it ends nothing is known, until the next one that goes on from there takes that back.
pub(super) fn keep(
    transaction: &Transaction<'_>,
    source: i64,
    quantity: Quantity,
    segment: i64,
    piece: &Piece,
) -> rusqlite::Result<()> {
    let mut held = None;
    if piece.points.first().is_some_and(|first| first.at == piece.start) {
        let went_on = transaction
            .prepare_cached(
                "DELETE FROM change
                 WHERE source = ?1 AND quantity = ?2 AND at_ms = ?3 AND segment = ?4 AND count IS NULL",
            )?
            .execute(params![source, quantity.0, piece.start + 1, segment])?;
        if went_on > 0 {
            held = transaction
                .prepare_cached(
                    "SELECT count FROM change WHERE source = ?1 AND quantity = ?2 AND at_ms <= ?3
                     ORDER BY at_ms DESC LIMIT 1",
                )?
                .query_row(params![source, quantity.0, piece.start], |row| row.get::<_, Option<i64>>(0))
                .optional()?
                .flatten();
        }
    }
    if piece.points.len() > CHANGES {
        let mut end = transaction.prepare_cached(
            "INSERT OR REPLACE INTO change (source, quantity, at_ms, segment, count) VALUES (?1, ?2, ?3, ?4, NULL)",
        )?;
        // What was held before goes as far as it did.
        if held.is_some() {
            end.execute(params![source, quantity.0, piece.start + 1, segment])?;
        }
        return Ok(());
    }
    let mut insert = transaction.prepare_cached(
        "INSERT OR REPLACE INTO change (source, quantity, at_ms, segment, count) VALUES (?1, ?2, ?3, ?4, ?5)",
    )?;
    for point in &piece.points {
        if point.count != held {
            insert.execute(params![source, quantity.0, point.at, segment, point.count])?;
            held = point.count;
        }
    }
    if held.is_some() {
        insert.execute(params![source, quantity.0, piece.end + 1, segment, None::<i64>])?;
    }
    Ok(())
}
