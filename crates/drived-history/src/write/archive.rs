//! What waits to be written: [`Archive`]. It has no clock and no thread of its own; what it cannot write it keeps, within a bound.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{
    age::{self, Lived},
    captures::Kept,
    frames,
    inbox::{Batch, Lost, Shown},
};
use crate::{
    chunk::{Chunk, WHOLE},
    outages::Changes,
    quantity::Set,
    read::SOURCE_BITS,
    record::{LineMinute, Moment, Record, Setting},
    store::{self, Place, StoreError},
};

/// Values are written after this time; a kill or a power cut loses no more.
pub const FLUSHED_EVERY_MS: i64 = 60_000;
/// So many points are written before that.
const FLUSHED_AT: usize = 100_000;
/// So many points wait at the most while they cannot be written: 6 MiB.
const POINTS: usize = 250_000;
/// So many records do.
const RECORDS: usize = 8_192;
/// So many bytes of what captures have heard do.
const CAPTURES: usize = 4 << 20;
/// A clock that has moved by less than this since was regulated, and no step is told.
const STEP_MS: i64 = 1_000;
/// By so much the wall's clock may drift away before times are counted by it anew.
const DRIFT_MS: i64 = 250;

/// How the daemon's own clock stood to the wall's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Clock {
    began: Moment,
    /// Its number in the file, once it is there.
    segment: Option<i64>,
}

impl Clock {
    const fn ahead_ms(self) -> i64 {
        self.began.wall_ms - self.began.steady_ms
    }
}

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

/// What was shown between two flushes.
#[derive(Debug)]
struct Flush {
    clock: Clock,
    chunks: Vec<((Arc<str>, Set), Chunk)>,
    points: usize,
}

/// What waits to be written.
#[derive(Debug)]
pub struct Archive {
    clock: Clock,
    run: Option<i64>,
    open: BTreeMap<(Arc<str>, Set), Chunk>,
    open_points: usize,
    closed: VecDeque<Flush>,
    records: VecDeque<Record>,
    lines: Vec<LineMinute>,
    settings: Vec<Setting>,
    /// What captures have heard, packed.
    captures: Vec<Kept>,
    sent: BTreeMap<String, Place>,
    outages: BTreeMap<String, Changes>,
    outages_at_once: bool,
    /// For how long daemons had run with this file before this run began.
    lived_before_ms: i64,
    flushed_at: i64,
    lost: Lost,
    lost_since: Option<Moment>,
    /// Its run is no beginning of the program: a reload has opened the history anew.
    pub is_anew: bool,
}

impl Archive {
    /// Nothing yet.
    #[must_use]
    pub fn begin(now: Moment) -> Self {
        Self {
            clock: Clock { began: now, segment: None },
            run: None,
            open: BTreeMap::new(),
            open_points: 0,
            closed: VecDeque::new(),
            records: VecDeque::new(),
            lines: Vec::new(),
            settings: Vec::new(),
            captures: Vec::new(),
            sent: BTreeMap::new(),
            outages: BTreeMap::new(),
            outages_at_once: false,
            lived_before_ms: 0,
            flushed_at: now.steady_ms,
            lost: Lost::default(),
            lost_since: None,
            is_anew: false,
        }
    }

    /// Takes what has come.
    pub fn take(&mut self, batch: Batch, now: Moment) {
        for shown in batch.shown {
            self.show(shown);
        }
        self.records.extend(batch.records);
        self.lines.extend(batch.lines);
        self.lose(batch.lost, now);
        if self.records.len() > RECORDS {
            let records = self.records.len() - RECORDS;
            self.records.drain(..records);
            self.lose(Lost { records: records as u64, values: 0 }, now);
        }
        self.lines.truncate(RECORDS);
        self.settings.extend(batch.settings);
        self.settings.truncate(RECORDS);
        for heard in batch.frames {
            let kept = Kept::of(&heard);
            let waiting: usize = self.captures.iter().map(Kept::bytes).sum();
            match waiting + kept.bytes() <= CAPTURES {
                true => self.captures.push(kept),
                false => self.lose(Lost { records: 1, values: 0 }, now),
            }
        }
        self.sent.extend(batch.sent);
        for (whom, changes) in batch.outages {
            self.outages.entry(whom).or_default().extend(changes);
        }
        self.outages_at_once |= batch.outages_at_once;
    }

    /// For how long daemons have run with this file, this one among them.
    #[must_use]
    pub const fn lived(&self, now: Moment) -> Lived {
        Lived { lived_ms: self.lived_before_ms + now.steady_ms, wall_ms: now.wall_ms }
    }

    /// The run in the file, once it is there.
    #[must_use]
    pub const fn run(&self) -> Option<i64> {
        self.run
    }

    /// Takes a record.
    pub fn record(&mut self, record: Record) {
        self.records.push_back(record);
    }

    fn show(&mut self, Shown { drive, set, seen }: Shown) {
        let chunk = self.open.entry((drive, set)).or_insert_with(|| Chunk::begin(seen.at));
        self.open_points += chunk.see(&seen);
    }

    fn lose(&mut self, lost: Lost, now: Moment) {
        if !lost.is_nothing() {
            self.lost.add(lost);
            self.lost_since.get_or_insert(now);
        }
    }

    /// How much could not be kept and is not told in the file yet.
    #[must_use]
    pub const fn lost(&self) -> Lost {
        self.lost
    }

    /// Looks at the clocks: where the wall's was set, what is shown from now on counts by it as it is now, and it is told.
    pub fn look_at_clock(&mut self, now: Moment) {
        let moved = now.wall_ms - now.steady_ms - self.clock.ahead_ms();
        if moved.abs() < DRIFT_MS {
            return;
        }
        self.close(now);
        self.clock = Clock { began: now, segment: None };
        if moved.abs() >= STEP_MS {
            let way = if moved > 0 { "forward" } else { "back" };
            let text = format!(
                "the clock was set {way} by {:.1} s: the order of what is told here is that of the daemon's own clock",
                moved.abs() as f64 / 1_000.0
            );
            let was = now.wall_ms - moved;
            let body = serde_json::json!({ "from_unix_ms": was, "to_unix_ms": now.wall_ms });
            let body = Some(body.to_string());
            self.record(Record { body, ..Record::of_history(now, "clock_stepped", text) });
        }
    }

    /// Whether values are to be written now.
    #[must_use]
    pub fn is_due(&self, now: Moment) -> bool {
        now.steady_ms - self.flushed_at >= FLUSHED_EVERY_MS || self.open_points >= FLUSHED_AT
    }

    /// When what was shown was closed last: once it is written, everything up to then is.
    #[must_use]
    pub const fn flushed_at(&self) -> i64 {
        self.flushed_at
    }

    /// Whether something waits that is not to wait.
    #[must_use]
    pub fn has_records(&self) -> bool {
        !self.records.is_empty() || self.lost_since.is_some()
    }

    /// Ends what was shown so far, so that it is written next.
    pub fn close(&mut self, now: Moment) {
        self.flushed_at = now.steady_ms;
        let mut chunks = Vec::new();
        // One of which nothing was seen goes on as it is.
        for (key, chunk) in self.open.iter_mut().filter(|(_, chunk)| chunk.is_new) {
            let next = chunk.next();
            chunks.push((key.clone(), std::mem::replace(chunk, next)));
        }
        let points = std::mem::take(&mut self.open_points);
        if !chunks.is_empty() {
            self.closed.push_back(Flush { clock: self.clock, chunks, points });
        }
        while self.closed.len() > 1 && self.closed.iter().map(|flush| flush.points).sum::<usize>() > POINTS {
            let dropped = self.closed.pop_front();
            let values = dropped.map_or(0, |flush| flush.points as u64);
            self.lose(Lost { values, records: 0 }, now);
        }
    }

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

    /// Another file is begun in the place of a damaged one: nothing of this run is in it.
    pub fn begin_file(&mut self, now: Moment) {
        self.run = None;
        self.clock = Clock { began: now, segment: None };
        self.closed.iter_mut().for_each(|flush| flush.clock.segment = None);
    }

    #[cfg(test)]
    pub(crate) fn points(&self) -> usize {
        self.open_points + self.closed.iter().map(|flush| flush.points).sum::<usize>()
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

fn begin_segment(transaction: &Transaction<'_>, run: i64, began: Moment) -> rusqlite::Result<i64> {
    transaction.execute(
        "INSERT INTO segment (run, steady_ms, wall_ms) VALUES (?1, ?2, ?3)",
        params![run, began.steady_ms, began.wall_ms],
    )?;
    Ok(transaction.last_insert_rowid())
}

fn write_flush(transaction: &Transaction<'_>, segment: i64, flush: &Flush) -> rusqlite::Result<()> {
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

fn insert(transaction: &Transaction<'_>, run: i64, record: &Record) -> rusqlite::Result<()> {
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

fn insert_line(transaction: &Transaction<'_>, minute: &LineMinute) -> rusqlite::Result<()> {
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
fn keep_setting(transaction: &Transaction<'_>, setting: &Setting) -> rusqlite::Result<()> {
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
