//! What captures have heard around what has a freeze-frame, as the file keeps it.

use drive_bus::capture::Writer;
use rusqlite::{Connection, Transaction, params};

use crate::{
    column::deflated,
    read::{AFTER_MS, BEFORE_MS},
    record::LineFrames,
    store::StoreError,
};

/// Some of it, packed: each a capture by itself.
#[derive(Debug)]
pub(super) struct Kept {
    line: String,
    first_ms: i64,
    last_ms: i64,
    frames: usize,
    left_out: i64,
    is_cut: bool,
    data: Vec<u8>,
}

impl Kept {
    pub(super) fn of(heard: &LineFrames) -> Self {
        let mut file = Vec::new();
        // Into memory: it does not fail.
        let written = Writer::new(&mut file, heard.dissector)
            .and_then(|mut writer| heard.frames.iter().try_for_each(|frame| writer.write(frame)));
        debug_assert!(written.is_ok(), "{written:?}");
        Self {
            line: heard.line.to_string(),
            first_ms: heard.first_ms,
            last_ms: heard.last_ms,
            frames: heard.frames.len(),
            left_out: i64::try_from(heard.left_out).unwrap_or(i64::MAX),
            is_cut: heard.is_cut,
            data: deflated(&file),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.data.len()
    }

    pub(super) fn write(&self, transaction: &Transaction<'_>, run: i64) -> rusqlite::Result<()> {
        let mut insert = transaction.prepare_cached(
            "INSERT INTO captured (run, line, first_ms, last_ms, frames, left_out, is_cut, data)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
        )?;
        insert.execute(params![
            run,
            self.line,
            self.first_ms,
            self.last_ms,
            i64::try_from(self.frames).unwrap_or(i64::MAX),
            self.left_out,
            self.is_cut,
            self.data,
        ])?;
        Ok(())
    }
}

/// Takes away what no freeze-frame has any more.
///
/// # Errors
/// It cannot be written.
pub(super) fn trim(connection: &Connection) -> Result<(), StoreError> {
    connection.execute(
        "DELETE FROM captured WHERE NOT EXISTS (
            SELECT 1 FROM frame WHERE frame.run = captured.run AND frame.line = captured.line
                AND frame.steady_ms BETWEEN captured.first_ms - ?1 AND captured.last_ms + ?2)",
        [AFTER_MS, BEFORE_MS],
    )?;
    Ok(())
}
