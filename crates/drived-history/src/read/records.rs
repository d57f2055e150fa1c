//! What happened, in words.

use drived_plant::plant::past::RecordView;
use rusqlite::{Connection, params};
use serde_json::value::RawValue;

use crate::store::StoreError;

/// Which of what happened is meant.
#[derive(Debug, Clone, Default)]
pub struct Filter<'a> {
    pub from_ms: i64,
    pub to_ms: i64,
    /// One drive, and what concerns its line or the program.
    pub drive: Option<&'a str>,
    /// Those of this line only.
    pub line: Option<&'a str>,
    /// Those of this kind only.
    pub kind: Option<&'a str>,
    /// Those that are this in one word only.
    pub what: Option<&'a str>,
    pub only_alarms: bool,
    /// So many at the most.
    pub limit: usize,
    /// The number of the last that the reader has: only what stands behind it.
    pub after: i64,
    /// Only what stands before the record of this number, the newest first.
    pub before: Option<i64>,
}

/// How much is read at once, in bytes: a command for a whole plant is long, and whoever asks is any viewer.
const BYTES: usize = 8 << 20;

/// What was found.
#[derive(Debug)]
pub struct Found {
    /// In the daemon's own order.
    pub records: Vec<RecordView>,
    /// Whether there may be more behind them.
    pub is_cut: bool,
}

/// What happened, in the daemon's own order, or the newest first.
///
/// # Errors
/// It cannot be read.
pub fn records(connection: &Connection, filter: &Filter<'_>) -> Result<Found, StoreError> {
    let order = if filter.before.is_some() { "DESC" } else { "ASC" };
    let mut find = connection.prepare_cached(&format!(
        "SELECT id, run, wall_ms, steady_ms, kind, what, drive, line, alarm, text, body FROM record
         WHERE wall_ms BETWEEN ?1 AND ?2 AND id > ?3 AND id < ?4
           AND (?5 IS NULL OR drive = ?5 OR drive IS NULL) AND (?6 IS NULL OR kind = ?6)
           AND (?7 IS NULL OR line = ?7) AND (?8 IS NULL OR what = ?8) AND (?9 = 0 OR alarm = 1)
         ORDER BY id {order} LIMIT ?10"
    ))?;
    let limit = i64::try_from(filter.limit).unwrap_or(i64::MAX);
    let rows = find.query_map(
        params![
            filter.from_ms,
            filter.to_ms,
            filter.after,
            filter.before.unwrap_or(i64::MAX),
            filter.drive,
            filter.kind,
            filter.line,
            filter.what,
            filter.only_alarms,
            limit
        ],
        |row| {
            Ok(RecordView {
                number: row.get(0)?,
                run: row.get(1)?,
                time_unix_ms: row.get(2)?,
                steady_ms: row.get(3)?,
                kind: row.get(4)?,
                what: row.get(5)?,
                drive: row.get(6)?,
                line: row.get(7)?,
                alarm: row.get(8)?,
                text: row.get(9)?,
                body: row.get::<_, Option<String>>(10)?.and_then(|body| RawValue::from_string(body).ok()),
            })
        },
    )?;
    let (mut records, mut bytes) = (Vec::new(), 0);
    for row in rows {
        let found: RecordView = row?;
        bytes += size_of::<RecordView>() + found.text.len();
        bytes += found.body.as_ref().map_or(0, |body| body.get().len());
        records.push(found);
        if bytes > BYTES {
            return Ok(Found { records, is_cut: true });
        }
    }
    let is_cut = records.len() >= filter.limit;
    Ok(Found { records, is_cut })
}
