//! What a line has heard, as facts of frames and bytes with their owner: the one body of evidence from which `scan`, `doctor`, `poll`
//! and `run` judge by the same rules, see [`Finding`].
//!
//! It is kept always and is bounded: the last facts that are not plain answers, and for each slave counts of what came lately.

mod bytes;
mod findings;
mod judge;

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use tokio::time::Instant;

use self::bytes::Came;
pub use self::findings::{Certainty, Defect, Finding};
pub(crate) use self::judge::Known;

/// So many facts are kept.
const FACTS: usize = 64;

/// What came lately: with so many questions to one slave everything that was counted for it counts half.
const LATELY: u32 = 1_000;

/// The most bytes of one exchange that are kept: the longest frame of Modbus RTU behind the longest echo.
const LONGEST: usize = 520;

/// Bytes that come so soon behind an answer belong to it.
const BEHIND: Duration = Duration::from_millis(20);

/// Something that was heard, or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fact {
    /// When.
    pub at: Instant,
    /// Whose it is: who was asked, or whose address it bears; `None` for bytes of nobody.
    pub slave: Option<u8>,
    /// What.
    pub what: What,
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
    /// Pieces that are nothing but a character that acknowledges (UNI-TELWAY).
    acknowledged: u32,
    /// What came to the question that is under way came too soon.
    early: bool,
    sent: Vec<u8>,
    heard: Vec<u8>,
    /// Whose exchange ended last, and when, until what comes behind it is judged.
    last: Option<(u8, Instant)>,
    behind: Vec<u8>,
}

/// What came lately of one slave.
#[derive(Debug, Clone, Default)]
struct Lately {
    questions: u32,
    whole: u32,
    /// Each code, and how often: the first few that there are.
    exceptions: Vec<(u8, u32)>,
    silent: u32,
    without_first: u32,
    without_last: u32,
    damaged: u32,
    /// Of those, as long as an answer.
    damaged_long: u32,
    behind: u32,
    late: u32,
    late_with_next: u32,
    early: u32,
    doubled: u32,
    contradicted: u32,
    /// How often it was silent since its last answer, and when that was.
    silent_since: Option<(u32, Instant)>,
}

/// The most exceptions that one slave is kept apart for.
const CODES: usize = 8;

impl Lately {
    fn counts(&mut self) -> [&mut u32; 12] {
        let Self {
            questions,
            whole,
            silent,
            without_first,
            without_last,
            damaged,
            damaged_long,
            behind,
            late,
            late_with_next,
            early,
            doubled,
            ..
        } = self;
        [
            questions,
            whole,
            silent,
            without_first,
            without_last,
            damaged,
            damaged_long,
            behind,
            late,
            late_with_next,
            early,
            doubled,
        ]
    }

    /// One question more.
    fn asked(&mut self) {
        self.questions += 1;
        if self.questions > LATELY {
            self.contradicted /= 2;
            self.exceptions.iter_mut().for_each(|(_, count)| *count /= 2);
            self.counts().into_iter().for_each(|count| *count /= 2);
        }
    }

    fn refused(&mut self, code: u8) {
        if let Some((_, count)) = self.exceptions.iter_mut().find(|(known, _)| *known == code) {
            *count += 1;
        } else if self.exceptions.len() < CODES {
            self.exceptions.push((code, 1));
        }
    }

    fn answered(&mut self, now: Instant) {
        self.silent_since = Some((0, now));
    }
}

/// How an exchange ended, as far as that is evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ended {
    /// With an answer of so many bytes of PDU.
    Answered(usize),
    /// With an exception.
    Exception(u8),
    /// With something that is no answer for certain, and was whole.
    Unclear,
    /// In vain.
    InVain,
}

impl Evidence {
    /// The last facts, the oldest first.
    pub(crate) fn facts(&self) -> Vec<Fact> {
        self.facts.iter().copied().collect()
    }

    /// An exchange begins with these bytes, or goes on with them.
    pub(crate) fn sent(&mut self, now: Instant, goes_on: bool, bytes: &[u8]) {
        if goes_on {
            return;
        }
        self.judge_behind(now);
        self.early = false;
        self.sent.clear();
        self.heard.clear();
        add(&mut self.sent, bytes);
    }

    /// Bytes came; `under_way`: while an exchange was.
    pub(crate) fn heard(&mut self, now: Instant, under_way: bool, bytes: &[u8]) {
        self.acknowledged = self.acknowledged.saturating_add(u32::from(bytes == [ACK]));
        if under_way {
            add(&mut self.heard, bytes);
        } else if self.last.is_some_and(|(_, at)| now <= at + BEHIND) {
            add(&mut self.behind, bytes);
        }
    }

    /// An exchange ended. `expected`: the bytes of PDU that its answer has. Gives what came instead of the answer, in words.
    pub(crate) fn ended(
        &mut self,
        now: Instant,
        slave: u8,
        is_rtu: bool,
        ended: Ended,
        expected: usize,
    ) -> Option<String> {
        self.behind.clear();
        self.last = None;
        let heard = std::mem::take(&mut self.heard);
        let echoed = self.sent.len() > 1 && heard.len() > self.sent.len();
        let came = heard.strip_prefix(&self.sent[..]).filter(|_| echoed).unwrap_or(&heard);
        let is_early = std::mem::take(&mut self.early);
        let instead = (is_rtu && ended == Ended::InVain)
            .then(|| bytes::told(came, slave, expected, is_early))
            .flatten();
        let lately = self.slaves.entry(slave).or_default();
        lately.asked();
        let fact = match ended {
            Ended::Answered(len) => {
                lately.whole += 1;
                lately.answered(now);
                self.last = is_rtu.then_some((slave, now));
                if is_rtu {
                    add(&mut self.behind, bytes::behind(came, slave, len));
                }
                None
            }
            Ended::Exception(code) => {
                lately.refused(code);
                lately.answered(now);
                Some(What::Exception(code))
            }
            Ended::InVain if came.is_empty() => {
                lately.silent += 1;
                if let Some((times, _)) = &mut lately.silent_since {
                    *times = times.saturating_add(1);
                }
                Some(What::Silence)
            }
            Ended::Unclear => {
                lately.answered(now);
                None
            }
            Ended::InVain => {
                let count = came.len();
                let came = if is_rtu { bytes::what_came(came, slave, expected) } else { Came::Other };
                match came {
                    Came::WithoutFirst => {
                        lately.without_first += 1;
                        Some(What::WithoutFirstByte)
                    }
                    Came::WithoutLast => {
                        lately.without_last += 1;
                        Some(What::WithoutLastByte)
                    }
                    Came::TwoThatDiffer => {
                        lately.contradicted += 1;
                        Some(What::Contradicted)
                    }
                    // What is whole is told as what it is: late, another's.
                    Came::Frames => None,
                    Came::Other => {
                        lately.damaged += 1;
                        lately.damaged_long += u32::from(count > expected);
                        Some(What::Damaged(count))
                    }
                }
            }
        };
        if let Some(what) = fact {
            self.keep(now, Some(slave), what);
        }
        self.heard = heard;
        self.heard.clear();
        instead
    }

    /// What came behind the last answer has come.
    fn judge_behind(&mut self, now: Instant) {
        let Some((slave, _)) = self.last.take() else { return };
        let behind = std::mem::take(&mut self.behind);
        if !behind.is_empty() && !bytes::is_whole(&behind) {
            self.slaves.entry(slave).or_default().behind += 1;
            self.keep(now, Some(slave), What::Behind(behind.len()));
        }
        self.behind = behind;
        self.behind.clear();
    }

    /// An intact frame that was not asked for, or not now.
    pub(crate) fn stray(&mut self, now: Instant, slave: u8, what: What) {
        self.early |= what == What::Early;
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
        self.keep(now, Some(slave), what);
    }

    fn keep(&mut self, at: Instant, slave: Option<u8>, what: What) {
        if self.facts.len() >= FACTS {
            self.facts.pop_front();
        }
        self.facts.push_back(Fact { at, slave, what });
    }
}

/// UNI-TELWAY's acknowledgement.
const ACK: u8 = 0x06;

fn add(kept: &mut Vec<u8>, bytes: &[u8]) {
    let room = LONGEST.saturating_sub(kept.len()).min(bytes.len());
    kept.extend_from_slice(bytes.get(..room).unwrap_or_default());
}
