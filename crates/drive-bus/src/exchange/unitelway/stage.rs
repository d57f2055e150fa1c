//! The exchange that is under way, and how far it is.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::time::Instant;
use tokio_modbus::Request;

use crate::exchange::{Answer, Failure};

/// One exchange.
#[derive(Debug)]
pub(super) struct Current {
    pub(super) slave: u8,
    pub(super) request: Arc<Request<'static>>,
    /// The data frame of the request.
    pub(super) frame: Bytes,
    /// The mark whose return is awaited before the request is sent.
    pub(super) mark: Option<Mark>,
    /// Whether a reply can only be the request's.
    pub(super) is_proven: bool,
    pub(super) stage: Stage,
    /// When this stage ends by itself. `None`: what it began with has not been written yet.
    pub(super) due: Option<Instant>,
    /// How long a reply may take from the end of its request, and until when that is.
    pub(super) patience: Duration,
    pub(super) reply_by: Option<Instant>,
    /// The time that the characters of a reply take.
    pub(super) reply: Duration,
    /// End of the request on the line.
    pub(super) requested: Option<Instant>,
    /// Since when the slave keeps us waiting, for its reply or until it takes the request.
    pub(super) waiting_since: Option<Instant>,
    /// How often the slave has refused the request since then.
    pub(super) refusals: u32,
    /// Damaged replies that were refused, and replies that were not the request's.
    pub(super) damaged: u32,
    pub(super) leftovers: u32,
    /// Polls that were not answered, so that an answer may belong to an earlier one.
    pub(super) unanswered: u32,
    /// What it ends with once the slave has been told that its reply has come.
    pub(super) result: Option<Result<Answer, Failure>>,
    /// A reply came that did not fit.
    pub(super) misfit: Option<String>,
}

/// A number of ours that the slave is asked to mirror.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Mark {
    /// Its data frame.
    pub(super) frame: Bytes,
    /// The UNI-TE reply that brings it back.
    pub(super) reply: [u8; 5],
    /// The slave has refused something, which may have been this.
    pub(super) refused: bool,
}

/// What was sent last, and what may come now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    /// The silence before this is sent.
    Before(Next),
    /// The mark or the request: its acknowledgement may come.
    Asking,
    /// A poll, for this.
    Polling(Wanted),
    /// Our acknowledgement or refusal of something, before this.
    Answering(Then),
}

/// What is sent next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// The mark or the request.
    Ask,
    Poll(Wanted),
    /// One of the two signals.
    Signal(u8, Then),
}

/// What a poll is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The reply to the mark or to the request.
    Reply,
    /// What the slave may hold, because it refuses to be asked.
    Room,
    /// Nothing: that the slave has heard us take its reply.
    Nothing,
}

/// What follows our answer to a data frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Then {
    Ask,
    Poll(Wanted),
    /// The last poll, where it is worth it, and the end.
    Close,
}

impl Current {
    pub(super) fn is_late(&self, now: Instant) -> bool {
        self.reply_by.is_some_and(|by| now >= by)
    }

    /// Whether something that the slave may send now is awaited.
    pub(super) const fn is_listening(&self) -> bool {
        matches!(self.stage, Stage::Asking | Stage::Polling(_))
    }
}
