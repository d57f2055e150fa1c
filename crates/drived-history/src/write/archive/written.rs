//! What waits is written, and waits on where it cannot be.

use rusqlite::{Connection, params};

use super::{
    Archive,
    rows::{begin_segment, insert, insert_line, keep_setting, write_flush},
};
use crate::{
    record::{Moment, Record},
    store::{self, StoreError},
    write::{frames, inbox::Lost},
};

impl Archive {
    /// Writes the records that wait. On an error they wait on.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write_records(&mut self, connection: &mut Connection, now: Moment) -> Result<(), StoreError> {
        let Some(run) = self.run else { return Ok(()) };
        let transaction = connection.transaction()?;
        for record in &self.records {
            insert(&transaction, run, record)?;
            frames::note(&transaction, run, record)?;
        }
        if let Some(since) = self.lost_since {
            insert(&transaction, run, &hole(self.lost, since, now))?;
        }
        transaction.commit()?;
        self.records.clear();
        (self.lost, self.lost_since) = (Lost::default(), None);
        Ok(())
    }

    /// Writes the values that were closed. On an error those that are not written wait on.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write_values(&mut self, connection: &mut Connection) -> Result<(), StoreError> {
        let Some(run) = self.run else { return Ok(()) };
        // What was told as it was read is written when that is: what a kill takes of both belongs together.
        let has_outages = !self.outages.is_empty() && (self.outages_at_once || !self.closed.is_empty());
        while let Some(flush) = self.closed.front_mut() {
            let transaction = connection.transaction()?;
            let segment = match flush.clock.segment {
                Some(segment) => segment,
                None => begin_segment(&transaction, run, flush.clock.began)?,
            };
            write_flush(&transaction, segment, flush)?;
            transaction.commit()?;
            let began = flush.clock.began;
            self.closed.pop_front();
            let of_same = self.closed.iter_mut().map(|flush| &mut flush.clock).chain([&mut self.clock]);
            of_same.filter(|clock| clock.began == began).for_each(|clock| clock.segment = Some(segment));
        }
        if !self.lines.is_empty() {
            let transaction = connection.transaction()?;
            self.lines.iter().try_for_each(|line| insert_line(&transaction, line))?;
            transaction.commit()?;
            self.lines.clear();
        }
        if !self.settings.is_empty() {
            let transaction = connection.transaction()?;
            self.settings.iter().try_for_each(|setting| keep_setting(&transaction, setting))?;
            transaction.commit()?;
            self.settings.clear();
        }
        if !self.captures.is_empty() {
            let transaction = connection.transaction()?;
            self.captures.iter().try_for_each(|kept| kept.write(&transaction, run))?;
            transaction.commit()?;
            self.captures.clear();
        }
        if !self.sent.is_empty() {
            let transaction = connection.transaction()?;
            for (target, place) in &self.sent {
                transaction.execute(
                    "INSERT OR REPLACE INTO sent (target, segment, until_ms) VALUES (?1, ?2, ?3)",
                    params![target, place.segment, place.until_ms],
                )?;
            }
            transaction.commit()?;
            self.sent.clear();
        }
        if has_outages {
            store::write_outages(connection, run, &self.outages)?;
            self.outages.clear();
            self.outages_at_once = false;
        }
        Ok(())
    }
}

/// What could not be kept, as a record.
fn hole(lost: Lost, since: Moment, now: Moment) -> Record {
    let Lost { values, records } = lost;
    let seconds = (now.steady_ms - since.steady_ms).max(0) / 1_000;
    let text = format!(
        "{values} readings and {records} records of the last {seconds} s could not be kept: what happened then is not known from here"
    );
    let body = serde_json::json!({
        "values": values, "records": records, "since_unix_ms": since.wall_ms, "until_unix_ms": now.wall_ms,
    });
    Record { body: Some(body.to_string()), is_alarm: true, ..Record::of_history(now, "hole", text) }
}
