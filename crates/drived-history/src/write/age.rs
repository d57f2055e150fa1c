//! How old something in the file is: by how long daemons have run since, and never by the wall's clock. A clock that is years ahead takes nothing
//! away, and while no daemon runs nothing grows older.

use rusqlite::{Connection, OptionalExtension as _, params};

const HOUR_MS: i64 = 3_600_000;

/// Now, by the time that daemons have run with the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lived {
    pub lived_ms: i64,
    /// By the wall's clock as it stands.
    pub wall_ms: i64,
}

/// What was the newest of each table at some time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Newest {
    pub block: i64,
    pub minute: i64,
    pub record: i64,
    pub frame: i64,
}

/// For how long daemons have run with a file, as far as it knows: the last ten minutes before a kill are not counted.
///
/// # Errors
/// It cannot be read.
pub fn lived(connection: &Connection) -> rusqlite::Result<i64> {
    connection.query_row("SELECT coalesce(max(lived_ms), 0) FROM mark", [], |row| row.get(0))
}

/// Marks what is in the file now, unless that was done within the last `every_ms`; gives whether it was.
///
/// # Errors
/// It cannot be written.
pub fn mark(connection: &Connection, now: Lived, every_ms: i64) -> rusqlite::Result<bool> {
    let last: Option<i64> = connection
        .prepare_cached("SELECT lived_ms FROM mark ORDER BY id DESC LIMIT 1")?
        .query_row([], |row| row.get(0))
        .optional()?;
    if last.is_some_and(|last| now.lived_ms - last < every_ms) {
        return Ok(false);
    }
    connection.execute(
        "INSERT INTO mark (lived_ms, wall_ms, block, minute, record, frame) VALUES (?1, ?2,
            (SELECT coalesce(max(id), 0) FROM block), (SELECT coalesce(max(id), 0) FROM minute),
            (SELECT coalesce(max(id), 0) FROM record), (SELECT coalesce(max(id), 0) FROM frame))",
        params![now.lived_ms, now.wall_ms],
    )?;
    Ok(true)
}

/// How often it is marked: a plant that is switched off at the mains after each shift grows older too.
pub const MARKED_EVERY_MS: i64 = HOUR_MS / 6;

/// What was the newest when the file was younger by `age_ms`; `None`: it was not there then.
///
/// # Errors
/// It cannot be read.
pub fn newest_then(connection: &Connection, now: Lived, age_ms: i64) -> rusqlite::Result<Option<Newest>> {
    connection
        .prepare_cached(
            "SELECT block, minute, record, frame FROM mark WHERE lived_ms <= ?1 ORDER BY id DESC LIMIT 1",
        )?
        .query_row([now.lived_ms.saturating_sub(age_ms)], |row| {
            Ok(Newest { block: row.get(0)?, minute: row.get(1)?, record: row.get(2)?, frame: row.get(3)? })
        })
        .optional()
}

/// A moment of the wall's clock before which nothing younger than `age_ms` can lie, for what has no place in an order; `None`: all may be.
///
/// # Errors
/// It cannot be read.
pub fn all_younger_from(connection: &Connection, now: Lived, age_ms: i64) -> rusqlite::Result<Option<i64>> {
    let then = now.lived_ms.saturating_sub(age_ms);
    let was_there: bool = connection
        .prepare_cached("SELECT EXISTS (SELECT 1 FROM mark WHERE lived_ms <= ?1)")?
        .query_row([then], |row| row.get(0))?;
    if !was_there {
        return Ok(None);
    }
    let least: Option<i64> = connection
        .prepare_cached("SELECT min(wall_ms) FROM mark WHERE lived_ms >= ?1")?
        .query_row([then], |row| row.get(0))?;
    // What is written after a mark may have begun some hours before it.
    Ok(Some(least.unwrap_or(now.wall_ms).min(now.wall_ms).saturating_sub(3 * HOUR_MS)))
}

/// Marks that nothing is measured by any more go.
///
/// # Errors
/// It cannot be written.
pub fn forget(connection: &Connection, now: Lived, age_ms: i64) -> rusqlite::Result<()> {
    let then = now.lived_ms.saturating_sub(age_ms);
    // The youngest of the old ones says what was there then.
    connection
        .execute("DELETE FROM mark WHERE id < (SELECT max(id) FROM mark WHERE lived_ms <= ?1)", [then])?;
    Ok(())
}
