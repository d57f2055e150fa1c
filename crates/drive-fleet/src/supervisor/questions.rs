//! Questions: what somebody wants read or written beside orders, in class Background, on the drive's turn.

use std::{collections::VecDeque, mem};

use super::{CallId, Job, Output, Supervisor, permission::QUEUE};
use crate::{cause::Act, outcome::Refused, snapshot::Link};
use drive_core::{Error, Exchange, Faults, PortError, Result, Row, SlaveAddress, Written};

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Question {
    /// The present faults and the history.
    Faults,
    /// The word of a row.
    Read(&'static Row),
    /// Write a word to a row, unless it holds it.
    Write(&'static Row, u16),
}

impl Question {
    /// What is told of it when nobody has said what became of it: a write may have been sent.
    pub(crate) fn abandoned(&self, slave: SlaveAddress) -> Refused {
        let Self::Write(row, _) = self else { return Refused::ShutDown };
        let exchange = Exchange { function: 6, register: Some(row.address) };
        let problem =
            PortError::OutcomeUnknown("its drive was lost or taken out meanwhile, or the fleet has ended");
        Refused::Drive(Error::Port { slave, exchange, problem })
    }
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Told {
    Faults(Faults),
    Word(u16),
    Written(Written),
}

/// Somebody's question.
#[derive(Debug, Clone)]
pub(super) struct Asked {
    id: CallId,
    question: Question,
    pub(super) by: Act,
    /// It is on its way to the drive, or was once.
    begun: bool,
}

/// The questions that wait, the first perhaps in flight.
pub(super) type Questions = VecDeque<Asked>;

impl Supervisor {
    /// Somebody asks. One that is dropped for something more urgent is asked again: a write looks first at what is there.
    pub(crate) fn handle_question(&mut self, id: CallId, name: &str, question: Question) {
        match self.refuse_question(name, question) {
            Some(refused) => self.outputs.push_back(Output::Told(id, Err(refused))),
            None => self.questions.push_back(Asked { id, question, by: Act::of(name), begun: false }),
        }
    }

    fn refuse_question(&self, name: &str, question: Question) -> Option<Refused> {
        if let Question::Write(..) = question {
            if !self.settings.control {
                return Some(Refused::ReadOnly);
            }
            if !self.settings.commanders.allow(name) {
                return Some(Refused::Commander(name.to_owned()));
            }
            if let Some(stranger) = self.checks.stranger() {
                return Some(stranger);
            }
        }
        if self.is_exiting() {
            return Some(self.gone());
        }
        if self.link != Link::Connected {
            return Some(Refused::NotConnected);
        }
        (self.questions.len() >= QUEUE).then_some(Refused::QueueFull)
    }

    /// Askers do not wait any more. What is in flight is finished.
    pub(crate) fn forget_questions(&mut self, gone: impl Fn(CallId) -> bool) {
        let mut in_flight = matches!(self.in_flight, Some(Job::Ask(_)));
        self.questions.retain(|asked| std::mem::take(&mut in_flight) || !gone(asked.id));
    }

    pub(super) fn question_job(&self) -> Option<Job> {
        self.questions.front().map(|asked| Job::Ask(asked.question))
    }

    /// The first of them is on its way.
    pub(super) fn begin_question(&mut self) {
        if let Some(asked) = self.questions.front_mut() {
            asked.begun = true;
        }
    }

    pub(super) fn handle_told(&mut self, told: Result<Told>) {
        if let Some(Asked { id, .. }) = self.questions.pop_front() {
            self.outputs.push_back(Output::Told(id, told.map_err(Refused::from)));
        }
    }

    /// What was found to be another drive than is meant is not written.
    pub(super) fn end_writes(&mut self) {
        let Some(stranger) = self.checks.stranger() else { return };
        let is_write = |asked: &Asked| matches!(asked.question, Question::Write(..));
        let (writes, rest): (Questions, Questions) =
            mem::take(&mut self.questions).into_iter().partition(is_write);
        self.questions = rest;
        self.end(writes, &stranger);
    }

    /// Nobody can be asked any more.
    pub(super) fn end_questions(&mut self, refused: &Refused) {
        let all = mem::take(&mut self.questions);
        self.end(all, refused);
    }

    /// Of a write that is on its way nobody knows what becomes of it.
    fn end(&mut self, asked: Questions, refused: &Refused) {
        self.outputs.extend(asked.into_iter().map(|Asked { id, question, begun, .. }| match question {
            Question::Write(..) if begun => Output::Untold(id),
            _ => Output::Told(id, Err(refused.clone())),
        }));
    }
}
