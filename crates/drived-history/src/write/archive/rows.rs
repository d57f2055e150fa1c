//! Each thing that is written, as the rows that it is in the file.

use rusqlite::{OptionalExtension as _, Transaction, params};

use super::Flush;
use crate::{
    chunk::WHOLE,
    quantity::Set,
    read::SOURCE_BITS,
    record::{LineMinute, Moment, Record, Setting},
};

pub(super) fn begin_segment(transaction: &Transaction<'_>, run: i64, began: Moment) -> rusqlite::Result<i64> {
    transaction.execute(
        "INSERT INTO segment (run, steady_ms, wall_ms) VALUES (?1, ?2, ?3)",
        params![run, began.steady_ms, began.wall_ms],
    )?;
    Ok(transaction.last_insert_rowid())
}

pub(super) fn write_flush(
    transaction: &Transaction<'_>,
    segment: i64,
    flush: &Flush,
) -> rusqlite::Result<()> {
    let ahead = flush.clock.ahead_ms();
    let starts = flush.chunks.iter().map(|(_, chunk)| chunk.start).min().unwrap_or_default();
    let ends = flush.chunks.iter().map(|(_, chunk)| chunk.end).max().unwrap_or_default();
    transaction.execute(
        "INSERT INTO flush (segment, start_ms, end_ms) VALUES (?1, ?2, ?3)",
        params![segment, starts + ahead, ends + ahead],
    )?;
    let number = transaction.last_insert_rowid();
    let mut insert = transaction
        .prepare_cached("INSERT INTO chunk (id, start_ms, end_ms, data, form) VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for ((drive, set), chunk) in &flush.chunks {
        let source = source(transaction, drive, *set)?;
        let id = (number << SOURCE_BITS) | source;
        insert.execute(params![id, chunk.start + ahead, chunk.end + ahead, chunk.packed(), WHOLE])?;
    }
    Ok(())
}

/// The number of a set of a drive; it gets one with its first value.
fn source(transaction: &Transaction<'_>, drive: &str, set: Set) -> rusqlite::Result<i64> {
    let mut find = transaction.prepare_cached("SELECT id FROM source WHERE drive = ?1 AND part = ?2")?;
    let known = find.query_row(params![drive, set.name()], |row| row.get(0)).optional()?;
    if let Some(id) = known {
        return Ok(id);
    }
    transaction.execute("INSERT INTO source (drive, part) VALUES (?1, ?2)", params![drive, set.name()])?;
    Ok(transaction.last_insert_rowid())
}

pub(super) fn insert(transaction: &Transaction<'_>, run: i64, record: &Record) -> rusqlite::Result<()> {
    let mut insert = transaction.prepare_cached(
        "INSERT INTO record (run, steady_ms, wall_ms, kind, what, drive, line, alarm, text, body, act)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)
         ON CONFLICT (act) DO UPDATE SET what = excluded.what, alarm = excluded.alarm, text = excluded.text, body = excluded.body",
    )?;
    let act = record.act.as_ref().map(|act| format!("{run}:{act}"));
    insert.execute(params![
        run,
        record.at.steady_ms,
        record.at.wall_ms,
        record.kind.name(),
        record.what,
        record.drive,
        record.line,
        record.is_alarm,
        record.text,
        record.body,
        act,
    ])?;
    Ok(())
}

pub(super) fn insert_line(transaction: &Transaction<'_>, minute: &LineMinute) -> rusqlite::Result<()> {
    let number = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
    let mut insert = transaction.prepare_cached(
        "INSERT OR REPLACE INTO line_minute
            (wall_ms, line, sent, answered, damaged, missing, busy_permille, is_open, foreigners, silences, silence_us)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)",
    )?;
    insert.execute(params![
        minute.wall_ms,
        &*minute.line,
        number(minute.sent),
        number(minute.answered),
        number(minute.damaged),
        number(minute.missing),
        number(minute.busy_permille),
        minute.is_open,
        number(minute.foreign),
        number(minute.silences),
        minute.silence_us.map(number),
    ])?;
    Ok(())
}

/// A setting that is read again as it was read last is not kept again: only that it was.
pub(super) fn keep_setting(transaction: &Transaction<'_>, setting: &Setting) -> rusqlite::Result<()> {
    let Setting { wall_ms, read } = setting;
    let mut find = transaction.prepare_cached(
        "SELECT id, word FROM parameter WHERE drive = ?1 AND address = ?2 ORDER BY id DESC LIMIT 1",
    )?;
    let last: Option<(i64, u16)> = find
        .query_row(params![&*read.drive, read.address], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()?;
    match last.filter(|(_, word)| *word == read.word) {
        Some((id, _)) => transaction
            .prepare_cached("UPDATE parameter SET last_ms = ?2, times = times + 1 WHERE id = ?1")?
            .execute(params![id, wall_ms])?,
        None => transaction
            .prepare_cached(
                "INSERT INTO parameter (drive, address, code, word, text, first_ms, last_ms, times)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?6, 1)",
            )?
            .execute(params![&*read.drive, read.address, read.code, read.word, read.text, wall_ms])?,
    };
    Ok(())
}
