//! The last exchanges of a line, kept where somebody has asked for them.

use std::{collections::VecDeque, mem, time::Duration};

use tokio::time::Instant;

use crate::exchange::{Brought, Failure};

/// The most bytes that are kept of a request or of what was heard: the longest Modbus ASCII frame. More is a babbler's.
const LONGEST: usize = 513;

/// One exchange as it was on the line.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Exchange {
    /// Whom it was with; 0: a broadcast.
    pub slave: u8,
    /// When the request was given to the port.
    pub began: Instant,
    /// From then until it ended: with the last byte of the answer, or when its time was over.
    pub took: Duration,
    /// What was sent, its check included; where a protocol answers the answer, that too.
    pub request: Box<[u8]>,
    /// What was heard meanwhile: the answer with its check, and whatever came with it, such as an adapter's echo.
    pub answer: Box<[u8]>,
    /// The longest time from one piece of what was heard to the next, with nothing sent between the two. From an adapter's echo to the answer
    /// is none: that is the slave's.
    pub pause: Duration,
    /// How it ended.
    pub ending: Ending,
}

/// How an exchange ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Ending {
    /// With an answer.
    Answered,
    /// With the slave's exception.
    Exception,
    /// Without an answer in time.
    NoAnswer,
    /// With a damaged answer.
    Damaged,
    /// With an answer that does not fit the request.
    Mismatch,
    /// With an answer that may be that to an earlier request.
    Doubted,
    /// The slave has refused it for as long as its line repeats it (UNI-TELWAY's NAK).
    Busy,
    /// Nobody answers it: a broadcast.
    Unanswered,
    /// It goes on later, as an exchange of its own here: the slave is not ready (UNI-TELWAY).
    PutAside,
    /// A probe that made way for a Stop.
    GivenUp,
    /// The port was lost meanwhile.
    LineLost,
}

impl Ending {
    pub(crate) const fn of(result: &Brought) -> Self {
        match result {
            Ok(Ok(_)) => Self::Answered,
            Ok(Err(_)) => Self::Exception,
            Err(Failure::Timeout | Failure::Nobody) => Self::NoAnswer,
            Err(Failure::Damaged(_)) => Self::Damaged,
            Err(Failure::Mismatch(_)) => Self::Mismatch,
            Err(Failure::Refused(_)) => Self::Busy,
            Err(Failure::Doubted(_)) => Self::Doubted,
        }
    }
}

/// The last exchanges, and the bytes of the one that is under way.
#[derive(Debug, Default)]
pub(crate) struct Record {
    /// So many are kept; 0: nobody has asked for them.
    limit: usize,
    exchanges: VecDeque<Exchange>,
    request: Vec<u8>,
    answer: Vec<u8>,
    /// When the last piece of the answer was heard, and the longest time between two.
    heard: Option<Instant>,
    pause: Duration,
}

impl Record {
    /// Keeps so many from now on.
    pub(crate) fn keep(&mut self, limit: usize) {
        self.limit = limit;
        self.exchanges.drain(..self.exchanges.len().saturating_sub(limit));
    }

    /// The oldest first.
    pub(crate) fn exchanges(&self) -> Vec<Exchange> {
        self.exchanges.iter().cloned().collect()
    }

    pub(crate) fn sent(&mut self, bytes: &[u8]) {
        if self.limit > 0 {
            add(&mut self.request, bytes);
            // What comes next takes the slave's time.
            self.heard = None;
        }
    }

    pub(crate) fn heard(&mut self, now: Instant, bytes: &[u8]) {
        if self.limit > 0 {
            let last = self.heard.replace(now);
            // Behind an adapter's echo the slave has its time.
            if let Some(last) = last.filter(|_| self.answer != self.request) {
                self.pause = self.pause.max(now.saturating_duration_since(last));
            }
            add(&mut self.answer, bytes);
        }
    }

    pub(crate) fn ended(&mut self, now: Instant, slave: u8, began: Instant, ending: Ending) {
        if self.limit == 0 {
            return;
        }
        let [request, answer]: [Box<[u8]>; 2] =
            [&mut self.request, &mut self.answer].map(|bytes| mem::take(bytes).into());
        self.heard = None;
        let pause = mem::take(&mut self.pause);
        if request.is_empty() {
            // It began before anybody asked for them.
            return;
        }
        let took = now.saturating_duration_since(began);
        if self.exchanges.len() >= self.limit {
            self.exchanges.pop_front();
        }
        self.exchanges.push_back(Exchange { slave, began, took, request, answer, pause, ending });
    }
}

fn add(kept: &mut Vec<u8>, bytes: &[u8]) {
    let room = LONGEST.saturating_sub(kept.len()).min(bytes.len());
    kept.extend_from_slice(bytes.get(..room).unwrap_or_default());
}
