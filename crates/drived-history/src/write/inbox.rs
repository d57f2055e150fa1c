//! What waits for the writer: [`Inbox`], which takes or refuses at once, whatever the disk does.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicI64, AtomicU64, Ordering},
    },
    time::Duration,
};

use crate::{
    outages::Changes,
    quantity::Set,
    record::{LineFrames, LineMinute, Record, Setting},
    store::Place,
    tracker::Seen,
};

/// Sets of values that wait: of a thousand drives those of eight seconds.
const VALUES: usize = 16_384;
/// Records that wait.
const RECORDS: usize = 2_048;

/// Frames of captures that wait.
const FRAMES: usize = 65_536;

/// What a drive has shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    pub drive: Arc<str>,
    pub set: Set,
    pub seen: Seen,
}

/// What was taken out of the inbox at once.
#[derive(Debug, Default)]
pub struct Batch {
    pub shown: Vec<Shown>,
    pub records: Vec<Record>,
    pub lines: Vec<LineMinute>,
    pub settings: Vec<Setting>,
    /// What captures have heard around what has a freeze-frame.
    pub frames: Vec<LineFrames>,
    /// How far was sent on, by where to.
    pub sent: BTreeMap<String, Place>,
    /// What was not told to somebody, by whom,
    pub outages: BTreeMap<String, Changes>,
    /// and whether it is to be written before values are.
    pub outages_at_once: bool,
    pub lost: Lost,
    /// In which file somebody who reads has found what cannot be right, and what.
    pub damaged: Option<(u64, String)>,
    /// How often somebody has asked for what waits to be written, since the beginning.
    pub asked: u64,
    pub is_end: bool,
    /// It ends by a reload, and the program does not.
    pub goes_on: bool,
}

/// How much could not be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lost {
    /// Times at which a drive was read.
    pub values: u64,
    pub records: u64,
}

impl Lost {
    #[must_use]
    pub const fn is_nothing(&self) -> bool {
        self.values == 0 && self.records == 0
    }

    pub const fn add(&mut self, other: Self) {
        self.values += other.values;
        self.records += other.records;
    }
}

/// A cheap handle.
#[derive(Debug, Clone, Default)]
pub struct Inbox(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    waiting: Mutex<Batch>,
    rings: Condvar,
    /// Which of those who asked have what they asked for.
    written: Mutex<u64>,
    is_written: Condvar,
    /// Up to when what was read is in the file, by the daemon's own clock.
    written_until: AtomicI64,
    /// How many files were put aside.
    aside: AtomicU64,
}

impl Default for Inner {
    fn default() -> Self {
        Self {
            waiting: Mutex::default(),
            rings: Condvar::new(),
            written: Mutex::default(),
            is_written: Condvar::new(),
            written_until: AtomicI64::new(i64::MIN),
            aside: AtomicU64::new(0),
        }
    }
}

/// It was not taken, and is counted as lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full;

impl Inbox {
    /// Takes what a drive has shown.
    ///
    /// # Errors
    /// [`Full`]: what comes next has to begin anew.
    pub fn show(&self, shown: Shown) -> Result<(), Full> {
        let mut waiting = self.lock();
        if waiting.shown.len() >= VALUES {
            waiting.lost.values += 1;
            return Err(Full);
        }
        waiting.shown.push(shown);
        Ok(())
    }

    /// Takes a record, and wakes the writer for it.
    pub fn record(&self, record: Record) {
        let mut waiting = self.lock();
        if waiting.records.len() >= RECORDS {
            waiting.lost.records += 1;
        } else {
            waiting.records.push(record);
            self.0.rings.notify_one();
        }
    }

    /// Takes what was counted of a line within a minute.
    pub fn line(&self, minute: LineMinute) {
        let mut waiting = self.lock();
        if waiting.lines.len() < RECORDS {
            waiting.lines.push(minute);
        }
    }

    /// Takes what a capture has heard of a line.
    pub fn frames(&self, heard: LineFrames) {
        let mut waiting = self.lock();
        let frames: usize = waiting.frames.iter().map(|heard| heard.frames.len()).sum();
        match frames + heard.frames.len() <= FRAMES {
            true => waiting.frames.push(heard),
            false => waiting.lost.records += 1,
        }
    }

    /// Takes a setting that was read.
    pub fn setting(&self, setting: Setting) {
        let mut waiting = self.lock();
        match waiting.settings.len() < RECORDS {
            true => waiting.settings.push(setting),
            false => waiting.lost.records += 1,
        }
    }

    /// Takes how far was sent on.
    pub fn sent(&self, target: String, place: Place) {
        self.lock().sent.insert(target, place);
    }

    /// Takes what has become of the outages of somebody. What is not urgent is written with the next values: it speaks of those.
    pub fn outages(&self, whom: &str, changes: Changes, is_urgent: bool) {
        let mut waiting = self.lock();
        waiting.outages.entry(whom.to_owned()).or_default().extend(changes);
        waiting.outages_at_once |= is_urgent;
    }

    /// Up to when what was read is in the file, by the daemon's own clock; `None`: this run does not stand there yet.
    #[must_use]
    pub fn written_until(&self) -> Option<i64> {
        Some(self.0.written_until.load(Ordering::Acquire)).filter(|at| *at > i64::MIN)
    }

    /// What was read up to a moment is in the file.
    pub fn has_written_until(&self, at_ms: i64) {
        self.0.written_until.store(at_ms, Ordering::Release);
    }

    /// Has written what waits, and waits for that, at the most for this long: values wait for up to a minute, and who asks is not to.
    pub fn have_written(&self, patience: Duration) {
        let mut waiting = self.lock();
        waiting.asked += 1;
        let asked = waiting.asked;
        self.0.rings.notify_one();
        drop(waiting);
        let written = self.0.written.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.0.is_written.wait_timeout_while(written, patience, |written| *written < asked));
    }

    /// What was asked for up to here is written, or cannot be now.
    pub fn written(&self, asked: u64) {
        *self.0.written.lock().unwrap_or_else(PoisonError::into_inner) = asked;
        self.0.is_written.notify_all();
    }

    /// Which file is written: another one behind each that was put aside.
    #[must_use]
    pub fn file(&self) -> u64 {
        self.0.aside.load(Ordering::Acquire)
    }

    /// The file has another name, and the next one is begun.
    pub fn has_put_aside(&self) {
        self.0.aside.fetch_add(1, Ordering::AcqRel);
    }

    /// Takes that a file was found damaged by somebody who read it, as it was called before he opened it.
    pub fn is_damaged(&self, file: u64, why: String) {
        self.lock().damaged = Some((file, why));
        self.0.rings.notify_one();
    }

    /// Nothing comes any more.
    pub fn end(&self) {
        self.lock().is_end = true;
        self.0.rings.notify_one();
    }

    /// Nothing comes any more by this way, and the program goes on: a reload closes the history, or opens it anew.
    pub fn close(&self) {
        self.lock().goes_on = true;
        self.end();
    }

    /// What has come, after `patience` or as soon as a record is there.
    #[must_use]
    pub fn take(&self, patience: Duration) -> Batch {
        let is_quiet =
            |waiting: &mut Batch| waiting.records.is_empty() && waiting.damaged.is_none() && !waiting.is_end;
        let waited = self.0.rings.wait_timeout_while(self.lock(), patience, is_quiet);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let Batch { is_end, goes_on, asked, .. } = *waiting;
        std::mem::replace(&mut *waiting, Batch { is_end, goes_on, asked, ..Batch::default() })
    }

    /// Lets what comes wait together for this long, unless nothing comes any more.
    pub fn gather(&self, time: Duration) {
        let waited = self.0.rings.wait_timeout_while(self.lock(), time, |waiting| !waiting.is_end);
        drop(waited);
    }

    fn lock(&self) -> MutexGuard<'_, Batch> {
        self.0.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_has_no_room_for_is_counted_and_nobody_waits() {
        let inbox = Inbox::default();
        let seen = Seen { at: 0, is_after_gap: true, changed: Vec::new() };
        let shown = Shown { drive: "pump".into(), set: Set::Status, seen };
        for _ in 0..VALUES {
            assert_eq!(inbox.show(shown.clone()), Ok(()));
        }
        assert_eq!(inbox.show(shown.clone()), Err(Full));
        let batch = inbox.take(Duration::ZERO);
        assert_eq!((batch.shown.len(), batch.lost), (VALUES, Lost { values: 1, records: 0 }));
        assert_eq!(inbox.show(shown), Ok(()));
        assert!(inbox.take(Duration::ZERO).lost.is_nothing(), "it is told once");
    }
}
