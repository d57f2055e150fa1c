//! What waits to be written: [`Archive`]. It has no clock and no thread of its own; what it cannot write it keeps, within a bound.

mod clock;
mod rows;
mod run;
mod written;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use self::clock::Clock;
use super::{
    age::Lived,
    captures::Kept,
    inbox::{Batch, Lost, Shown},
};
use crate::{
    chunk::Chunk,
    outages::Changes,
    quantity::Set,
    record::{LineMinute, Moment, Record, Setting},
    store::Place,
};

pub use self::run::End;

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
