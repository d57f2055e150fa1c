//! The stream that feeds every face: numbered revisions in a bounded ring. Each is put into bytes once, whoever reads it.
//!
//! Nobody waits for a reader: he takes what is new when he likes, and who comes so late that the ring has gone on is told
//! to begin anew.

use std::{
    collections::VecDeque,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use bytes::Bytes;
use serde::Serialize;
use tokio::{sync::watch, time::Instant};

use drived_words::json::{line, unix};

/// How many revisions are kept.
const KEPT: usize = 4_096;
/// How many bytes they may have together.
const KEPT_BYTES: usize = 8 << 20;

/// How many a reader takes at a time: what one who never reads on keeps from being freed.
const AT_ONCE: usize = 64;

/// What a revision is of, as the event stream names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    Drive,
    Line,
    Command,
    Event,
    Alarm,
    Tick,
}

impl Subject {
    const fn name(self) -> &'static str {
        match self {
            Self::Drive => "drive",
            Self::Line => "line",
            Self::Command => "command",
            Self::Event => "event",
            Self::Alarm => "alarm",
            Self::Tick => "tick",
        }
    }
}

/// The revisions of a plant.
pub struct Revisions {
    ring: Mutex<Ring>,
    last: watch::Sender<u64>,
    /// How far the history has kept them.
    kept: AtomicU64,
}

struct Ring {
    /// The number of the newest.
    last: u64,
    frames: VecDeque<Bytes>,
    bytes: usize,
    /// What a reader has before this number is of other lines, drives or groups.
    anew: u64,
}

/// What a reader gets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Next {
    /// What is new, in order, as server-sent events.
    Frames(Vec<Bytes>),
    /// He is too far behind: this tells him to read the state again.
    Reset(Bytes),
    /// The plant is gone.
    End,
}

impl Revisions {
    /// An empty ring. Numbers go on from the time, so that those of an earlier run of the program are not taken for
    /// numbers of this one.
    pub(crate) fn new() -> Self {
        let last = unix(Instant::now());
        let ring = Ring { last, frames: VecDeque::new(), bytes: 0, anew: last };
        Self { ring: Mutex::new(ring), last: watch::Sender::new(last), kept: AtomicU64::new(last) }
    }

    /// The number of the newest.
    pub fn last(&self) -> u64 {
        *self.last.borrow()
    }

    /// How many read along.
    pub fn readers(&self) -> usize {
        self.last.receiver_count()
    }

    /// Adds a revision, and gives its number.
    pub fn push(&self, subject: Subject, data: &impl Serialize) -> u64 {
        let data = line(data);
        let mut ring = self.ring();
        let last = ring.last + 1;
        ring.add(frame(last, subject.name(), &data).into());
        // Still under the lock, so that readers see the numbers rise.
        self.last.send_replace(last);
        last
    }

    /// Lines, drives or groups are others: every reader is told to read the state again. Who keeps everything has no state to read, and what
    /// happened before is no less true: it stays for him.
    pub fn begin_anew(&self) {
        let mut ring = self.ring();
        // Each number has its place.
        ring.add(Bytes::new());
        ring.anew = ring.last;
        let last = ring.last;
        self.last.send_replace(last);
    }

    /// A reader of what comes after revision `since`; `None`: from now on.
    pub fn reader(&self, since: Option<u64>) -> Reader {
        let last = self.last.subscribe();
        let since = since.unwrap_or(*last.borrow());
        Reader { since, last, is_keeper: false }
    }

    /// The reader that keeps everything: from where it has kept, or from the oldest that is still there; and whether something
    /// between them is gone. What happened before it began to read is told to it too, and nothing twice, also where it is opened anew.
    pub fn keeper(&self) -> (Reader, bool) {
        let ring = self.ring();
        let oldest = ring.last - ring.frames.len() as u64;
        let kept = self.kept.load(Ordering::Relaxed);
        let reader = Reader { since: kept.max(oldest), last: self.last.subscribe(), is_keeper: true };
        (reader, kept < oldest)
    }

    /// Everything up to where this reader has come is kept.
    pub fn is_kept(&self, keeper: &Reader) {
        self.kept.store(keeper.since, Ordering::Relaxed);
    }

    /// What is new for a reader, when there is something.
    ///
    /// # Cancellation
    /// Safe to drop: nothing is lost.
    pub async fn next(&self, reader: &mut Reader) -> Next {
        loop {
            reader.last.mark_unchanged();
            match self.ring().after(reader) {
                Some((_, frames)) if frames.is_empty() => {}
                Some((last, frames)) => {
                    reader.since = last;
                    return Next::Frames(frames);
                }
                None => {
                    reader.since = self.last();
                    let data = format!("{{\"revision\":{}}}", reader.since);
                    return Next::Reset(frame(reader.since, "reset", &data).into());
                }
            }
            if reader.last.changed().await.is_err() {
                return Next::End;
            }
        }
    }

    fn ring(&self) -> MutexGuard<'_, Ring> {
        self.ring.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Ring {
    /// Adds a frame of the next number.
    fn add(&mut self, frame: Bytes) {
        self.last += 1;
        self.bytes += frame.len();
        self.frames.push_back(frame);
        while self.frames.len() > KEPT || self.bytes > KEPT_BYTES {
            let Some(oldest) = self.frames.pop_front() else { break };
            self.bytes -= oldest.len();
        }
    }

    /// The next frames for a reader, and the number of the last of them; `None` when some of them are gone, are of other lines, drives or
    /// groups than he has read, or he is none of this ring.
    fn after(&self, Reader { since, is_keeper, .. }: &Reader) -> Option<(u64, Vec<Bytes>)> {
        let since = *since;
        if since < self.anew && !is_keeper {
            return None;
        }
        let count = usize::try_from(self.last.checked_sub(since)?).ok()?;
        let first = self.frames.len().checked_sub(count)?;
        let taken: Vec<Bytes> = self.frames.iter().skip(first).take(AT_ONCE).cloned().collect();
        Some((since + taken.len() as u64, taken))
    }
}

fn frame(number: u64, name: &str, data: &str) -> String {
    format!("id: {number}\nevent: {name}\ndata: {data}\n\n")
}

/// The number of a frame and its data, if it is of this subject.
pub fn data_of(frame: &[u8], subject: Subject) -> Option<(u64, &[u8])> {
    let mut lines = frame.split(|byte| *byte == b'\n');
    let mut field = |name: &str| lines.next()?.strip_prefix(name.as_bytes());
    let number = std::str::from_utf8(field("id: ")?).ok()?.parse().ok()?;
    let is_it = field("event: ")? == subject.name().as_bytes();
    let data = field("data: ")?;
    is_it.then_some((number, data))
}

/// How far somebody has read.
#[derive(Debug)]
pub struct Reader {
    since: u64,
    last: watch::Receiver<u64>,
    is_keeper: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_reader_gets_every_revision_once_and_in_order() {
        let revisions = Revisions::new();
        let first = revisions.last();
        let mut reader = revisions.reader(None);
        for number in 0..3 {
            revisions.push(Subject::Event, &number);
        }
        let Next::Frames(frames) = revisions.next(&mut reader).await else { panic!("frames") };
        let expected = |number: u64| format!("id: {}\nevent: event\ndata: {number}\n\n", first + number + 1);
        assert_eq!(frames, [expected(0), expected(1), expected(2)]);
        revisions.push(Subject::Tick, &3);
        let Next::Frames(frames) = revisions.next(&mut reader).await else { panic!("frames") };
        assert_eq!(frames.len(), 1);
        let Next::Frames(frames) = revisions.next(&mut revisions.reader(Some(first + 2))).await else {
            panic!("frames")
        };
        assert_eq!(frames.len(), 2, "a reader that comes again goes on where it was");
        assert_eq!(data_of(&frames[0], Subject::Event), Some((first + 3, &b"2"[..])));
        assert_eq!(data_of(&frames[1], Subject::Event), None, "it is a tick");
    }

    #[tokio::test(start_paused = true)]
    async fn a_reader_that_is_too_far_behind_or_from_another_run_is_told_to_begin_anew() {
        let revisions = Revisions::new();
        let (mut slow, before) = (revisions.reader(None), revisions.last() - 1);
        for number in 0..=KEPT {
            revisions.push(Subject::Event, &number);
        }
        assert!(matches!(revisions.next(&mut slow).await, Next::Reset(_)));
        assert!(matches!(revisions.next(&mut revisions.reader(Some(before))).await, Next::Reset(_)));
        let future = revisions.last() + 1;
        assert!(matches!(revisions.next(&mut revisions.reader(Some(future))).await, Next::Reset(_)));
        let ring = revisions.ring();
        assert_eq!(ring.frames.len(), KEPT);
        assert_eq!(ring.bytes, ring.frames.iter().map(Bytes::len).sum::<usize>());
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_keeps_everything_gets_what_came_before_it_once_also_when_it_is_opened_anew() {
        let revisions = Revisions::new();
        revisions.push(Subject::Event, &1);
        let (mut keeper, is_gone) = revisions.keeper();
        assert!(!is_gone);
        revisions.push(Subject::Event, &2);
        let Next::Frames(frames) = revisions.next(&mut keeper).await else { panic!("frames") };
        assert_eq!(frames.len(), 2);
        revisions.is_kept(&keeper);
        revisions.push(Subject::Event, &3);
        let (mut anew, is_gone) = revisions.keeper();
        let Next::Frames(frames) = revisions.next(&mut anew).await else { panic!("frames") };
        assert_eq!((frames.len(), is_gone), (1, false));
        for number in 0..=KEPT {
            revisions.push(Subject::Event, &number);
        }
        let (mut late, is_gone) = revisions.keeper();
        assert!(is_gone, "that something is missing is known");
        let Next::Frames(_) = revisions.next(&mut late).await else {
            panic!("what is gone is gone, and the rest is told")
        };
    }

    #[tokio::test(start_paused = true)]
    async fn whoever_keeps_everything_keeps_also_what_was_told_before_a_reload_began_anew() {
        let revisions = Revisions::new();
        let mut reader = revisions.reader(None);
        let (mut keeper, _) = revisions.keeper();
        revisions.push(Subject::Event, &1);
        revisions.begin_anew();
        let since = revisions.last();
        revisions.push(Subject::Event, &2);
        assert!(matches!(revisions.next(&mut reader).await, Next::Reset(_)));
        assert!(matches!(revisions.next(&mut revisions.reader(Some(since - 1))).await, Next::Reset(_)));
        let Next::Frames(frames) = revisions.next(&mut revisions.reader(Some(since))).await else {
            panic!("frames")
        };
        assert_eq!(frames.len(), 1, "who has read the state behind it goes on");
        let events = |frames: &[Bytes]| {
            let data = frames.iter().filter_map(|frame| data_of(frame, Subject::Event));
            data.map(|(_, data)| data.to_vec()).collect::<Vec<_>>()
        };
        let Next::Frames(frames) = revisions.next(&mut keeper).await else { panic!("frames") };
        assert_eq!(events(&frames), [b"1", b"2"]);
        // One that is opened anew by the reload has them too.
        let (mut anew, is_gone) = revisions.keeper();
        let Next::Frames(frames) = revisions.next(&mut anew).await else { panic!("frames") };
        assert_eq!((events(&frames).len(), is_gone), (2, false));
    }

    #[tokio::test(start_paused = true)]
    async fn large_revisions_do_not_make_the_ring_larger_than_its_bytes() {
        let revisions = Revisions::new();
        let large = "x".repeat(KEPT_BYTES / 4);
        for _ in 0..10 {
            revisions.push(Subject::Event, &large);
        }
        assert!(revisions.ring().bytes <= KEPT_BYTES);
    }
}
