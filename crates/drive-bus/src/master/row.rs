//! Whether a row of reads whose answers look alike is in step with them.
//!
//! An answer that comes twice is taken for that to the next question of its shape, whose own is taken for that to the one
//! behind it, and so on. The first that is wrong says, word for word, what another question was answered just before. So
//! what a read says is told at once where it said so before, or where no other has said it lately; else it is asked once
//! more before anybody is told. Behind one that says what it said before, and what another has said too, whether the row is
//! in step is not known: what is new there is asked once more as well. What is asked for the first time is told at once: a
//! parameter is read once, and most of them say 0.

use tokio::time::Instant;

use super::doubt::LONGEST_DOUBLE;
use crate::{exchange::Frame, shape::Shape};

/// How many questions are remembered by what they said: more than a family has in rotation.
const MOST: usize = 64;

/// How often one read is asked more than once because of what it said. Twice as a rule; what says three times what others have
/// said, and each time something else, is told by nobody.
pub(super) const MOST_TIMES: u32 = 3;

/// What the reads of one slave have said.
#[derive(Debug, Default)]
pub(super) struct Row {
    said: Vec<Said>,
    /// Whether the row is in step is not known.
    uncertain: Option<Uncertain>,
    /// The same, and one behind it has said two things when it was asked twice.
    suspected: Option<Uncertain>,
}

/// What one question was answered last.
#[derive(Debug, Clone, Copy)]
struct Said {
    /// A check over it.
    question: u16,
    frame: Frame,
    at: Instant,
}

/// Answers of this shape may each be that to the question before.
#[derive(Debug, Clone, Copy)]
struct Uncertain {
    shape: Shape,
    /// When the last of them was asked for that was told.
    asked_at: Instant,
    until: Instant,
}

/// A read, what came to it, and what had come when it was asked just before, where that was told nobody.
#[derive(Debug, Clone, Copy)]
pub(super) struct Come {
    /// A check over what was asked.
    pub(super) question: u16,
    pub(super) asked_at: Instant,
    pub(super) frame: Frame,
    pub(super) before: Option<Frame>,
}

impl Come {
    /// Whether it has said two things: one may be another's, so that one of its own is still to come. Of another shape that would
    /// have come first.
    pub(super) fn contradicts_itself(&self) -> bool {
        self.before.is_some_and(|before| before.shape == self.frame.shape && before != self.frame)
    }
}

impl Row {
    /// Whether what came may be the answer to another question.
    pub(super) fn is_doubtful(&self, now: Instant, come: Come) -> bool {
        let Come { question, frame, before, .. } = come;
        if before.is_some() && !come.contradicts_itself() {
            return false;
        }
        // What was never asked before has nothing that it could have changed from.
        let own = self.said.iter().find(|said| said.question == question && said.frame.shape == frame.shape);
        if own.is_none_or(|own| own.frame == frame) {
            return false;
        }
        let is_uncertain = before.is_none()
            && self
                .uncertain
                .is_some_and(|uncertain| uncertain.shape == frame.shape && now <= uncertain.until);
        is_uncertain || self.is_anothers(come, now.checked_sub(LONGEST_DOUBLE))
    }

    /// This is told.
    pub(super) fn told(&mut self, now: Instant, come: Come) {
        let Come { question, asked_at, frame, before } = come;
        let own =
            self.said.iter().position(|said| said.question == question && said.frame.shape == frame.shape);
        let asked_before = own.and_then(|own| self.said.get(own)).map(|own| own.at);
        if before.is_some() {
            self.suspected = self.uncertain.take().filter(|_| come.contradicts_itself());
        } else if self.is_anothers(come, now.checked_sub(LONGEST_DOUBLE).max(asked_before)) {
            self.uncertain = Some(Uncertain { shape: frame.shape, asked_at, until: now + LONGEST_DOUBLE });
        } else {
            self.uncertain.take_if(|uncertain| uncertain.shape != frame.shape);
        }
        let said = Said { question, frame, at: now };
        let oldest = || (0..self.said.len()).min_by_key(|index| self.said.get(*index).map(|said| said.at));
        let place = own.or_else(|| oldest().filter(|_| self.said.len() >= MOST));
        match place.and_then(|place| self.said.get_mut(place)) {
            Some(place) => *place = said,
            None => self.said.push(said),
        }
    }

    /// Something of another shape was answered: what was still to come has come before that.
    pub(super) const fn is_in_step(&mut self) {
        self.uncertain = None;
    }

    /// A frame of this shape came that was no answer to what was asked. Gives when what is withdrawn by that was asked for.
    pub(super) fn heard(&mut self, now: Instant, shape: Shape) -> Option<Instant> {
        let suspected = self.suspected.take_if(|suspected| suspected.shape == shape)?;
        (now <= suspected.until).then_some(suspected.asked_at)
    }

    /// Whether another question was answered the same since then.
    fn is_anothers(&self, come: Come, since: Option<Instant>) -> bool {
        { self.said.iter() }.any(|said| {
            said.question != come.question
                && said.frame == come.frame
                && since.is_none_or(|since| said.at >= since)
        })
    }
}
