//! The exchange that is under way, and how far it is.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::frame::poll;
use crate::exchange::Answer;

/// One exchange.
#[derive(Debug)]
pub(super) struct Current {
    pub(super) slave: u8,
    pub(super) request: Arc<Request<'static>>,
    /// The data frame of the request.
    pub(super) frame: Bytes,
    pub(super) stage: Stage,
    /// When this stage ends by itself. `None`: what it began with has not been written yet.
    pub(super) due: Option<Instant>,
    /// How long the reply may take from the end of the request, and until when that is.
    pub(super) patience: Duration,
    pub(super) reply_by: Option<Instant>,
    /// The time that the characters of a reply take.
    pub(super) reply: Duration,
    pub(super) answer: Option<Answer>,
    pub(super) leftovers: u32,
    pub(super) refusals: u32,
    pub(super) damaged: u32,
    /// A reply came that did not fit.
    pub(super) misfit: Option<String>,
}

/// What was sent last, and what may come now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    /// The silence before this is sent.
    Before(Next),
    /// The poll for what the slave still holds.
    Emptying,
    /// The request: its acknowledgement may come.
    Requesting,
    /// The poll: the reply may come.
    Polling,
    /// Our acknowledgement or refusal of something, before this.
    Answering(Next),
    /// Our acknowledgement of the reply.
    Ending,
}

/// What is sent next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    Empty,
    Request,
    Poll,
}

impl Current {
    pub(super) fn is_late(&self, now: Instant) -> bool {
        self.reply_by.is_some_and(|by| now >= by)
    }

    pub(super) fn pause(&mut self, until: Instant, next: Next) {
        self.stage = Stage::Before(next);
        self.due = Some(until);
    }

    /// The bytes of a stage, which begins with them.
    pub(super) fn begin(&mut self, next: Next) -> Bytes {
        let (stage, bytes) = match next {
            Next::Empty => (Stage::Emptying, poll(self.slave)),
            Next::Request => (Stage::Requesting, self.frame.clone()),
            Next::Poll => (Stage::Polling, poll(self.slave)),
        };
        self.stage = stage;
        bytes
    }
}
