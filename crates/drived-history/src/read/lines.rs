//! What was counted of the lines, minute by minute.

use drived_plant::plant::past::LineMinuteView;
use rusqlite::{Connection, Row, params};

use crate::store::StoreError;

const COLUMNS: &str = "wall_ms, line, sent, answered, damaged, missing, foreigners, silences, silence_us, \
    busy_permille, is_open";

/// The minutes that ended between two moments, of all lines; so many at the most.
///
/// # Errors
/// It cannot be read.
pub fn line_minutes(
    connection: &Connection,
    from: i64,
    to: i64,
    limit: usize,
) -> Result<Vec<LineMinuteView>, StoreError> {
    let mut find = connection.prepare_cached(&format!(
        "SELECT {COLUMNS} FROM line_minute WHERE wall_ms BETWEEN ?1 AND ?2 ORDER BY wall_ms, line LIMIT ?3"
    ))?;
    let limit = i64::try_from(limit).unwrap_or(i64::MAX);
    let rows = find.query_map(params![from, to, limit], minute)?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// The minute of each line in which a moment lies.
///
/// # Errors
/// It cannot be read.
pub fn lines_at(connection: &Connection, at: i64) -> Result<Vec<LineMinuteView>, StoreError> {
    let mut found = line_minutes(connection, at, at.saturating_add(61_000), 10_000)?;
    let mut told = std::collections::BTreeSet::new();
    found.retain(|minute| told.insert(minute.line.clone()));
    Ok(found)
}

fn minute(row: &Row<'_>) -> rusqlite::Result<LineMinuteView> {
    Ok(LineMinuteView {
        time_unix_ms: row.get(0)?,
        line: row.get(1)?,
        sent: row.get(2)?,
        answered: row.get(3)?,
        damaged: row.get(4)?,
        missing: row.get(5)?,
        foreign: row.get(6)?,
        silences: row.get(7)?,
        silence_us: row.get(8)?,
        busy_permille: row.get(9)?,
        is_open: row.get(10)?,
    })
}
