//! The last frames that captures of a line have heard: [`Last`], for whoever asks what was on the line around a moment that is over.

use std::{
    collections::VecDeque,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use tokio::time::Instant;

use super::Captured;

/// So many frames are kept: those of two minutes at 19200 bit/s.
const FRAMES: usize = 16_384;
/// So many bytes of them.
const BYTES: usize = 1 << 20;

/// A frame of a capture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// Its place among all frames of the captures of its line, those too that a capture had no room for: where numbers are missing,
    /// so many frames are.
    pub number: u64,
    /// When its last byte was handed over.
    pub at: Instant,
    /// The frame, as the capture has it.
    pub frame: Captured,
}

/// What is kept of the captures of a line since a moment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LastFrames {
    /// The frames, in the order of their numbers.
    pub frames: Vec<Heard>,
    /// Whether there were others since that moment, for which there was no room any more.
    pub is_cut: bool,
}

/// What a line's captures keep. Written by the thread of a capture, never by the line's task, which only counts.
#[derive(Debug, Default)]
pub(crate) struct Last {
    counted: AtomicU64,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    frames: VecDeque<Heard>,
    bytes: usize,
    /// When the newest was heard that had to give way.
    gave_way: Option<Instant>,
}

impl Last {
    /// The number of the next frame.
    pub(crate) fn count(&self) -> u64 {
        self.counted.fetch_add(1, Ordering::Relaxed)
    }

    pub(crate) fn keep(&self, heard: Heard) {
        let mut kept = self.lock();
        kept.bytes += heard.frame.bytes.len();
        kept.frames.push_back(heard);
        while kept.frames.len() > FRAMES || kept.bytes > BYTES {
            kept.gave_way = kept.drop_first();
        }
    }

    pub(crate) fn since(&self, since: Instant) -> LastFrames {
        let kept = self.lock();
        // The end of one capture and the beginning of the next may cross.
        let mut frames: Vec<Heard> = kept.frames.iter().filter(|heard| heard.at >= since).cloned().collect();
        frames.sort_by_key(|heard| heard.number);
        LastFrames { frames, is_cut: kept.gave_way.is_some_and(|at| at >= since) }
    }

    pub(crate) fn forget(&self, before: Instant) {
        let mut kept = self.lock();
        while kept.frames.front().is_some_and(|heard| heard.at < before) {
            kept.drop_first();
        }
        if kept.frames.is_empty() {
            kept.frames = VecDeque::new();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    /// Drops the oldest, and gives when it was heard.
    fn drop_first(&mut self) -> Option<Instant> {
        let first = self.frames.pop_front()?;
        self.bytes -= first.frame.bytes.len();
        Some(first.at)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use bytes::Bytes;

    use super::{super::Direction, *};

    fn heard(last: &Last, at: Instant, bytes: &'static [u8]) {
        let frame =
            Captured { at: Duration::ZERO, direction: Direction::Sent, bytes: Bytes::from_static(bytes) };
        last.keep(Heard { number: last.count(), at, frame });
    }

    #[test]
    fn a_flood_keeps_the_newest_and_says_that_others_gave_way() {
        let (last, begin) = (Last::default(), Instant::now());
        let at = |number: usize| begin + Duration::from_millis(number as u64);
        for number in 0..FRAMES + 10 {
            heard(&last, at(number), &[1]);
        }
        let all = last.since(begin);
        assert_eq!((all.frames.len(), all.frames[0].number, all.is_cut), (FRAMES, 10, true));
        let some = last.since(at(10));
        assert_eq!((some.frames.len(), some.is_cut), (FRAMES, false), "what gave way was before");
        // By bytes likewise: a thousand of 1024 fill it.
        static LONG: [u8; 1_024] = [0; 1_024];
        for number in 0..2_000 {
            heard(&last, at(FRAMES + 10 + number), &LONG);
        }
        assert_eq!(last.since(begin).frames.len(), BYTES / LONG.len());
        last.forget(at(FRAMES + 10 + 1_999));
        assert_eq!(last.since(begin).frames.len(), 1);
        last.forget(at(FRAMES + 10 + 2_000));
        assert_eq!(last.since(begin), LastFrames { frames: Vec::new(), is_cut: true });
    }
}
