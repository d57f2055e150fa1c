//! The outages of those who are told later, in the file.

use std::collections::BTreeMap;

use rusqlite::{Connection, OptionalExtension as _, params};

use super::StoreError;
use crate::outages::{Changes, Outage};

/// Made where somebody is told later: most files have none, and a program that does not know it leaves it alone.
const TABLE: &str = "CREATE TABLE IF NOT EXISTS outage (
    whom TEXT NOT NULL,
    number INTEGER NOT NULL,
    run INTEGER NOT NULL,
    drive TEXT,
    from_ms INTEGER NOT NULL,
    to_ms INTEGER,
    PRIMARY KEY (whom, number)
) WITHOUT ROWID";

/// Those of somebody.
///
/// # Errors
/// They cannot be read.
pub(crate) fn outages(connection: &Connection, whom: &str) -> Result<BTreeMap<i64, Outage>, StoreError> {
    let is_there = connection
        .query_row("SELECT 1 FROM sqlite_schema WHERE name = 'outage'", [], |_| Ok(()))
        .optional()?;
    if is_there.is_none() {
        return Ok(BTreeMap::new());
    }
    let mut find =
        connection.prepare_cached("SELECT number, run, drive, from_ms, to_ms FROM outage WHERE whom = ?1")?;
    let row = |row: &rusqlite::Row<'_>| {
        let (run, drive, from_ms, to_ms) = (row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?);
        Ok((row.get(0)?, Outage { run: Some(run), drive, from_ms, to_ms }))
    };
    Ok(find.query_map([whom], row)?.collect::<Result<_, _>>()?)
}

/// Writes what has become of them; those of the present run are of this one.
///
/// # Errors
/// They cannot be written, and nothing of it is.
pub(crate) fn write(
    connection: &mut Connection,
    run: i64,
    changes: &BTreeMap<String, Changes>,
) -> Result<(), StoreError> {
    let transaction = connection.transaction()?;
    transaction.execute_batch(TABLE)?;
    for (whom, changes) in changes {
        for (number, change) in changes {
            match change {
                Some(Outage { run: of, drive, from_ms, to_ms }) => transaction.execute(
                    "INSERT OR REPLACE INTO outage (whom, number, run, drive, from_ms, to_ms)
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                    params![whom, number, of.unwrap_or(run), drive, from_ms, to_ms],
                )?,
                None => transaction
                    .execute("DELETE FROM outage WHERE whom = ?1 AND number = ?2", params![whom, number])?,
            };
        }
    }
    Ok(transaction.commit()?)
}
