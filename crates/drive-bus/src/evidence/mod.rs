//! What a line has heard, as facts of frames and bytes with their owner: the one body of evidence from which `scan`, `doctor`, `poll`
//! and `run` judge by the same rules, see [`Finding`].
//!
//! It is kept always and is bounded: the last facts that are not plain answers, and for each slave counts of what came lately.

mod bytes;
mod findings;
mod hearing;
mod judge;
mod lately;

use std::collections::{BTreeMap, VecDeque};

use tokio::time::Instant;

pub use self::findings::{Alike, Certainty, Defect, Finding};
pub(crate) use self::judge::Known;
use self::{
    hearing::{Aside, Hearing},
    lately::Lately,
};
use crate::exchange::Answer;

/// So many facts are kept.
const FACTS: usize = 64;

/// Something that was heard, or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Fact {
    /// When.
    pub at: Instant,
    /// Whose it is: who was asked, or whose address it bears; `None` for bytes of nobody.
    pub slave: Option<u8>,
    /// Over which connection.
    pub over: Over,
    /// What.
    pub what: What,
}

/// A connection of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Over {
    /// Its own.
    First,
    /// The one that stops take besides. Who is silent there may never have been asked: a gateway may serve one only.
    Second,
}

/// What was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum What {
    /// An exception, with its code. A gateway's 0Ah and 0Bh bear the address of the slave that it was asked for.
    Exception(u8),
    /// Nothing to a question.
    Silence,
    /// An answer that is whole but for its first byte: its check proves it.
    WithoutFirstByte,
    /// An answer that is whole but for its last byte.
    WithoutLastByte,
    /// So many bytes to a question that make no answer.
    Damaged(usize),
    /// An answer of so many bytes with one bit wrong.
    OneBitWrong(usize),
    /// So many bytes right behind an answer that is whole.
    Behind(usize),
    /// An answer that came after its question was given up; `with_next`: while the next question to that slave was waited for.
    Late {
        /// Whether it came with the next question.
        with_next: bool,
    },
    /// An answer sooner than the configured speed can carry it.
    Early,
    /// The same answer once more.
    Doubled,
    /// Another answer to the same question.
    Contradicted,
    /// Another master's request.
    OthersRequest,
    /// Any other intact frame that was not asked for.
    OthersAnswer,
    /// An answer with the transaction number 0 to a question that had another.
    NumberZero,
}

/// The evidence of one line.
#[derive(Debug, Default)]
pub(crate) struct Evidence {
    facts: VecDeque<Fact>,
    slaves: BTreeMap<u8, Box<Lately>>,
    /// Requests of another master: how many, the first and the last.
    requests: Option<(u32, Instant, Instant)>,
    number_zero: u32,
    first: Hearing,
    second: Hearing,
    /// Of the exchanges that wait for their slaves.
    aside: BTreeMap<u8, Aside>,
}

/// How an exchange ended, as far as that is evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ended {
    /// With an answer.
    Answered,
    /// With an exception.
    Exception(u8),
    /// With something that is no answer for certain, and was whole.
    Unclear,
    /// In vain.
    InVain,
}

impl Ended {
    /// As this answer says.
    pub(crate) fn with(answer: &Answer) -> Self {
        match answer {
            Ok(_) => Self::Answered,
            Err(code) => Self::Exception(u8::from(*code)),
        }
    }
}

impl Evidence {
    /// The last facts, the oldest first.
    pub(crate) fn facts(&self) -> Vec<Fact> {
        self.facts.iter().copied().collect()
    }

    /// An exchange begins with these bytes, or goes on with them.
    pub(crate) fn sent(&mut self, now: Instant, over: Over, goes_on: bool, bytes: &[u8]) {
        if goes_on {
            return;
        }
        if let Some((slave, count)) = self.hearing(over).sent(bytes) {
            self.slaves.entry(slave).or_default().behind += 1;
            self.keep(now, over, slave, What::Behind(count));
        }
    }

    /// Bytes came; `under_way`: while an exchange was.
    pub(crate) fn heard(&mut self, now: Instant, over: Over, under_way: bool, bytes: &[u8]) {
        self.hearing(over).heard(now, under_way, bytes);
        if !under_way
            && bytes == [ACK]
            && let Some(slave) = self.hearing(over).in_vain
        {
            self.slaves.entry(slave).or_default().acknowledged += 1;
        }
    }

    /// An exchange with this slave waits while others are served.
    pub(crate) fn put_aside(&mut self, slave: u8) {
        let aside = self.first.put_aside();
        self.aside.insert(slave, aside);
    }

    /// It goes on.
    pub(crate) fn resume(&mut self, slave: u8) {
        if let Some(aside) = self.aside.remove(&slave) {
            self.first.resume(aside);
        }
    }

    /// It is given up; of none: all are.
    pub(crate) fn forsake(&mut self, slave: Option<u8>) {
        match slave {
            Some(slave) => _ = self.aside.remove(&slave),
            None => self.aside.clear(),
        }
    }

    /// An exchange ended. `expected`: the bytes of PDU that its answer has. Gives what came instead of the answer, in words.
    pub(crate) fn ended(
        &mut self,
        now: Instant,
        (over, slave): (Over, u8),
        is_rtu: bool,
        ended: Ended,
        expected: usize,
    ) -> Option<String> {
        let hearing = self.hearing(over);
        let (came, question) = hearing.take();
        let is_early = std::mem::take(&mut hearing.early);
        hearing.in_vain = Some(slave).filter(|_| ended == Ended::InVain);
        if is_rtu && ended == Ended::Answered {
            hearing.answered(now, slave, &came, expected);
        }
        let instead = (is_rtu && ended == Ended::InVain)
            .then(|| bytes::told(&came, slave, expected, is_early))
            .flatten();
        let fact = if ended == Ended::InVain && over == Over::Second {
            Some(What::Silence).filter(|_| came.is_empty())
        } else {
            let lately = self.slaves.entry(slave).or_default();
            lately.asked();
            match ended {
                Ended::Answered => {
                    lately.whole += 1;
                    lately.answered(now);
                    lately.came_whole(question.key);
                    None
                }
                Ended::Exception(code) => {
                    lately.refused(code);
                    lately.answered(now);
                    lately.came_whole(question.key);
                    Some(What::Exception(code))
                }
                Ended::Unclear => {
                    lately.answered(now);
                    lately.another_came_whole();
                    None
                }
                Ended::InVain => lately.in_vain(question, &came, (slave, expected), is_rtu),
            }
        };
        if let Some(what) = fact {
            self.keep(now, over, slave, what);
        }
        self.hearing(over).give_back(came);
        instead
    }

    /// An intact frame that was not asked for, or not now.
    pub(crate) fn stray(&mut self, now: Instant, over: Over, slave: u8, what: What) {
        self.hearing(over).early |= what == What::Early;
        match what {
            What::OthersRequest => {
                let (count, first) = self.requests.map_or((0, now), |(count, first, _)| (count, first));
                self.requests = Some((count.saturating_add(1), first, now));
            }
            What::NumberZero => self.number_zero = self.number_zero.saturating_add(1),
            _ => {
                // Nobody whom we have not asked is kept: there are 255 addresses, and noise has them all.
                let Some(lately) = self.slaves.get_mut(&slave) else { return };
                match what {
                    What::Late { with_next } => {
                        lately.late += 1;
                        lately.late_with_next += u32::from(with_next);
                    }
                    What::Early => lately.early += 1,
                    What::Doubled => lately.doubled += 1,
                    What::Contradicted => lately.contradicted += 1,
                    _ => {}
                }
            }
        }
        self.keep(now, over, slave, what);
    }

    fn hearing(&mut self, over: Over) -> &mut Hearing {
        match over {
            Over::First => &mut self.first,
            Over::Second => &mut self.second,
        }
    }

    fn keep(&mut self, at: Instant, over: Over, slave: u8, what: What) {
        if self.facts.len() >= FACTS {
            self.facts.pop_front();
        }
        self.facts.push_back(Fact { at, slave: Some(slave), over, what });
    }
}

/// UNI-TELWAY's acknowledgement.
const ACK: u8 = 0x06;
