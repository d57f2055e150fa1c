//! What came lately of one slave.

use tokio::time::Instant;

use super::{
    What,
    bytes::{self, Came},
    hearing::Question,
};

/// What came lately: with so many questions to one slave everything that was counted for it counts half.
const LATELY: u32 = 1_000;

/// An answer that is damaged has within so many bytes what it begins with: noise has not.
const BEGINS: usize = 3;

/// So many questions are kept whose answers are damaged.
const STUCK: usize = 4;

/// What came lately of one slave.
#[derive(Debug, Clone, Default)]
pub(super) struct Lately {
    pub(super) questions: u32,
    pub(super) whole: u32,
    /// Each code, and how often: the first few that there are.
    pub(super) exceptions: Vec<(u8, u32)>,
    pub(super) silent: u32,
    pub(super) without_first: u32,
    pub(super) without_last: u32,
    pub(super) damaged: u32,
    /// Of those, as long as an answer.
    pub(super) damaged_long: u32,
    /// Of those, with the byte with which an answer begins.
    pub(super) damaged_begun: u32,
    pub(super) behind: u32,
    pub(super) late: u32,
    pub(super) late_with_next: u32,
    pub(super) early: u32,
    pub(super) doubled: u32,
    pub(super) contradicted: u32,
    /// Acknowledgements that came after their question was given up (UNI-TELWAY).
    pub(super) acknowledged: u32,
    /// Questions whose answers were damaged whenever they were asked.
    pub(super) stuck: Vec<Stuck>,
    /// How often it was silent since its last answer, and when that was.
    pub(super) silent_since: Option<(u32, Instant)>,
}

/// The most exceptions that one slave is kept apart for.
const CODES: usize = 8;

impl Lately {
    fn counts(&mut self) -> [&mut u32; 15] {
        [
            &mut self.questions,
            &mut self.whole,
            &mut self.silent,
            &mut self.without_first,
            &mut self.without_last,
            &mut self.damaged,
            &mut self.damaged_long,
            &mut self.damaged_begun,
            &mut self.behind,
            &mut self.late,
            &mut self.late_with_next,
            &mut self.early,
            &mut self.doubled,
            &mut self.contradicted,
            &mut self.acknowledged,
        ]
    }

    /// One question more.
    pub(super) fn asked(&mut self) {
        self.questions += 1;
        if self.questions > LATELY {
            self.exceptions.iter_mut().for_each(|(_, count)| *count /= 2);
            self.counts().into_iter().for_each(|count| *count /= 2);
            self.stuck.iter_mut().for_each(|stuck| stuck.damaged /= 2);
        }
    }

    pub(super) fn refused(&mut self, code: u8) {
        if let Some((_, count)) = self.exceptions.iter_mut().find(|(known, _)| *known == code) {
            *count += 1;
        } else if self.exceptions.len() < CODES {
            self.exceptions.push((code, 1));
        }
    }

    pub(super) fn answered(&mut self, now: Instant) {
        self.silent_since = Some((0, now));
    }

    /// This question was given up, and this has come to it, where so many bytes of PDU were expected of this slave.
    pub(super) fn in_vain(
        &mut self,
        question: Question,
        came: &[u8],
        (slave, expected): (u8, usize),
        is_rtu: bool,
    ) -> Option<What> {
        if came.is_empty() {
            self.silent += 1;
            if let Some((times, _)) = &mut self.silent_since {
                *times = times.saturating_add(1);
            }
            return Some(What::Silence);
        }
        let count = came.len();
        match if is_rtu { bytes::what_came(came, slave, expected) } else { Came::Other } {
            Came::WithoutFirst => {
                self.without_first += 1;
                Some(What::WithoutFirstByte)
            }
            Came::WithoutLast => {
                self.without_last += 1;
                Some(What::WithoutLastByte)
            }
            Came::TwoThatDiffer => {
                self.contradicted += 1;
                Some(What::Contradicted)
            }
            // What is whole is told as what it is: late, another's.
            Came::Frames => None,
            Came::ButForOneBit => {
                self.damaged += 1;
                Some(What::OneBitWrong(count))
            }
            Came::Other => {
                self.damaged += 1;
                let is_long = count > expected;
                self.damaged_long += u32::from(is_long);
                if is_long && came.iter().take(BEGINS).any(|byte| *byte == question.begins) {
                    self.damaged_begun += 1;
                    self.came_damaged(question.key);
                }
                Some(What::Damaged(count))
            }
        }
    }

    /// This question has an answer that is whole. Where it had none before, chance has damaged that, and others.
    pub(super) fn came_whole(&mut self, question: u64) {
        if self.stuck.iter().any(|stuck| stuck.question == question) {
            self.stuck.clear();
        }
        self.another_came_whole();
    }

    /// An answer is whole, to whatever question.
    pub(super) fn another_came_whole(&mut self) {
        self.stuck.iter_mut().for_each(|stuck| stuck.others = stuck.others.saturating_add(1));
    }

    /// The answer to this question is damaged.
    fn came_damaged(&mut self, question: u64) {
        if let Some(stuck) = self.stuck.iter_mut().find(|stuck| stuck.question == question) {
            stuck.damaged = stuck.damaged.saturating_add(1);
        } else if self.stuck.len() < STUCK {
            self.stuck.push(Stuck { question, damaged: 1, others: 0 });
        }
    }
}

/// A question whose answers were damaged whenever it was asked, while others had whole ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stuck {
    question: u64,
    pub(super) damaged: u32,
    /// Whole answers to other questions since.
    pub(super) others: u32,
}
