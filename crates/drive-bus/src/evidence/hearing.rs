//! What comes over one connection between a question and the next.

use std::time::Duration;

use tokio::time::Instant;

use super::bytes;

/// The most bytes of one exchange that are kept: the longest frame of Modbus RTU behind the longest echo.
const LONGEST: usize = 520;

/// Bytes that come so soon behind an answer belong to it.
const BEHIND: Duration = Duration::from_millis(20);

/// How much of a request says what is asked: address, function and register of Modbus RTU, or the same in ASCII. How many words
/// that are may change.
const QUESTION: usize = 4;
const QUESTION_ASCII: usize = 9;

/// What was sent and heard over one connection.
#[derive(Debug, Default)]
pub(super) struct Hearing {
    /// What came to the question that is under way came too soon.
    pub(super) early: bool,
    sent: Vec<u8>,
    heard: Vec<u8>,
    /// The exchange that was put aside goes on.
    goes_on: bool,
    /// Whose exchange was answered last, and when, until what comes behind it is judged.
    last: Option<(u8, Instant)>,
    behind: Vec<u8>,
    /// Whose question was given up last.
    pub(super) in_vain: Option<u8>,
}

impl Hearing {
    /// An exchange begins with these bytes. What came behind the last answer, and whose that was, if anything did that belongs
    /// to nothing.
    pub(super) fn sent(&mut self, bytes: &[u8]) -> Option<(u8, usize)> {
        let behind = self.judge_behind();
        if !std::mem::take(&mut self.goes_on) {
            self.early = false;
            self.sent.clear();
            self.heard.clear();
            add(&mut self.sent, bytes);
        }
        behind
    }

    /// Bytes came; `under_way`: while an exchange was.
    pub(super) fn heard(&mut self, now: Instant, under_way: bool, bytes: &[u8]) {
        if under_way {
            add(&mut self.heard, bytes);
        } else if self.last.is_some_and(|(_, at)| now <= at + BEHIND) {
            add(&mut self.behind, bytes);
        }
    }

    /// The exchange is over. Gives what came, without the echo, and what was asked.
    pub(super) fn take(&mut self) -> (Vec<u8>, Question) {
        self.behind.clear();
        self.last = None;
        let mut heard = std::mem::take(&mut self.heard);
        if self.sent.len() > 1 && heard.len() > self.sent.len() && heard.starts_with(&self.sent) {
            heard.drain(..self.sent.len());
        }
        let begins = self.sent.first().copied().unwrap_or_default();
        let len = if begins == b':' { QUESTION_ASCII } else { QUESTION };
        let key = self.sent.iter().take(len).fold(0, |sum: u64, byte| sum << 7 ^ u64::from(*byte));
        (heard, Question { begins, key })
    }

    /// It was answered by these bytes, with so many of PDU, over Modbus RTU.
    pub(super) fn answered(&mut self, now: Instant, slave: u8, came: &[u8], len: usize) {
        self.last = Some((slave, now));
        add(&mut self.behind, bytes::behind(came, slave, len));
    }

    /// The room of what came, for the next.
    pub(super) fn give_back(&mut self, mut heard: Vec<u8>) {
        heard.clear();
        self.heard = heard;
    }

    /// The exchange is put aside.
    pub(super) fn put_aside(&mut self) -> Aside {
        Aside { sent: std::mem::take(&mut self.sent), heard: std::mem::take(&mut self.heard) }
    }

    /// It goes on.
    pub(super) fn resume(&mut self, aside: Aside) {
        self.sent = aside.sent;
        self.heard = aside.heard;
        self.goes_on = true;
    }

    /// What came behind the last answer has come.
    fn judge_behind(&mut self) -> Option<(u8, usize)> {
        let (slave, _) = self.last.take()?;
        let found =
            (!self.behind.is_empty() && !bytes::is_whole(&self.behind)).then_some((slave, self.behind.len()));
        self.behind.clear();
        found
    }
}

/// What is asked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    /// The byte with which it begins, as its answer does.
    pub(super) begins: u8,
    /// Function and register, however many.
    pub(super) key: u64,
}

/// What was sent and heard of an exchange that waits for its slave.
#[derive(Debug)]
pub(super) struct Aside {
    sent: Vec<u8>,
    heard: Vec<u8>,
}

fn add(kept: &mut Vec<u8>, bytes: &[u8]) {
    let room = LONGEST.saturating_sub(kept.len()).min(bytes.len());
    kept.extend_from_slice(bytes.get(..room).unwrap_or_default());
}
