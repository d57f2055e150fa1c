//! A run of the daemon in the file: how it begins, how the one before it ended, and how it ends itself.

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{Archive, rows::insert};
use crate::{
    record::{Moment, Record},
    store::StoreError,
    write::age,
};

/// How a run ends in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The program ends.
    Ended,
    /// A reload closes the history, and the program goes on.
    Closed,
}

impl End {
    /// In one word, and in a sentence.
    const fn told(self) -> (&'static str, &'static str) {
        match self {
            Self::Ended => ("ended", "the daemon ended as it should"),
            Self::Closed => ("history_closed", "the history was closed by a reload; the daemon goes on"),
        }
    }
}

impl Archive {
    /// Begins a run in the file, and tells how the one before ended.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn begin_run(&mut self, connection: &mut Connection, program: &str) -> Result<(), StoreError> {
        let began = self.clock.began;
        let transaction = connection.transaction()?;
        let before: Option<(i64, Option<i64>)> = transaction
            .query_row("SELECT id, ended_ms FROM run ORDER BY id DESC LIMIT 1", [], |row| {
                Ok((row.get(0)?, row.get(1)?))
            })
            .optional()?;
        let lived = age::lived(&transaction)?;
        transaction.execute(
            "INSERT INTO run (began_ms, program, lived_ms) VALUES (?1, ?2, ?3)",
            params![began.wall_ms, program, lived],
        )?;
        let run = transaction.last_insert_rowid();
        let was_closed = match before {
            Some((before, _)) => is_closed(&transaction, before)?,
            None => false,
        };
        let (what, text) = match (before, self.is_anew) {
            (None, _) => ("began", "the history begins: nothing is known of before"),
            (Some((_, Some(_))), true) => {
                ("history_opened", "the history was opened anew by a reload; the daemon goes on")
            }
            (Some((_, None)), true) => (
                "history_opened",
                "the history was opened anew by a reload; the run before ended in it without a word",
            ),
            (Some((_, Some(_))), false) if was_closed => {
                ("began", "the daemon began; a reload had closed the history before")
            }
            (Some((_, Some(_))), false) => {
                ("began", "the daemon began; the run before had ended as it should")
            }
            (Some((_, None)), false) => (
                "began_after_kill",
                "the daemon began; the run before ended without a word: it was killed, power was cut, or its end could not be written",
            ),
        };
        let mut began_record = Record::of_history(began, what, text);
        if let Some((_, None)) = before {
            let last = last_known(&transaction)?;
            began_record.body = Some(serde_json::json!({ "last_known_unix_ms": last }).to_string());
        }
        insert(&transaction, run, &began_record)?;
        transaction.commit()?;
        (self.run, self.lived_before_ms) = (Some(run), lived - began.steady_ms);
        Ok(())
    }

    /// Ends the run in the file: everything is written.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn end_run(&mut self, connection: &mut Connection, now: Moment) -> Result<(), StoreError> {
        self.end_run_by(End::Ended, connection, now)
    }

    /// The same, by whichever end.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn end_run_by(
        &mut self,
        end: End,
        connection: &mut Connection,
        now: Moment,
    ) -> Result<(), StoreError> {
        self.close(now);
        self.outages_at_once = true;
        let (what, text) = end.told();
        self.record(Record::of_history(now, what, text));
        self.write_values(connection)?;
        self.write_records(connection, now)?;
        if let Some(run) = self.run {
            connection.execute("UPDATE run SET ended_ms = ?2 WHERE id = ?1", params![run, now.wall_ms])?;
            age::mark(connection, self.lived(now), 0)?;
        }
        Ok(())
    }
}

/// Whether a run ended by a reload that closed the history.
fn is_closed(transaction: &Transaction<'_>, run: i64) -> rusqlite::Result<bool> {
    let last: Option<String> = transaction
        .query_row("SELECT what FROM record WHERE run = ?1 ORDER BY id DESC LIMIT 1", [run], |row| row.get(0))
        .optional()?;
    Ok(last.as_deref() == Some(End::Closed.told().0))
}

/// The last moment of which the file knows something.
fn last_known(transaction: &Transaction<'_>) -> rusqlite::Result<Option<i64>> {
    transaction.query_row(
        "SELECT max(at) FROM (SELECT max(end_ms) AS at FROM flush UNION ALL SELECT max(wall_ms) FROM record)",
        [],
        |row| row.get(0),
    )
}
