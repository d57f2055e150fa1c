//! The exchange that is under way, and how far it is.

use std::time::{Duration, Instant};

use bytes::Bytes;

use crate::{
    failure::{Answer, Failure},
    request::Request,
};

/// One exchange.
#[derive(Debug)]
pub(crate) struct Current {
    pub(crate) slave: u8,
    pub(crate) request: Request,
    /// The data frame of the request.
    pub(crate) frame: Bytes,
    /// The mark whose return is awaited before the request is sent.
    pub(crate) mark: Option<Mark>,
    /// Whether a reply can only be the request's.
    pub(crate) is_proven: bool,
    pub(crate) stage: Stage,
    /// When this stage ends by itself. `None`: what it began with has not been written yet.
    pub(crate) due: Option<Instant>,
    /// How long a reply may take from the end of its request, and until when that is.
    pub(crate) patience: Duration,
    pub(crate) reply_by: Option<Instant>,
    /// The time that the characters of a reply take.
    pub(crate) reply: Duration,
    /// End of the request on the line.
    pub(crate) requested: Option<Instant>,
    /// When the last poll was sent, from the end of the mark or the request.
    pub(crate) polled_after: Duration,
    /// Since when the slave keeps us waiting, for its reply or until it takes the request.
    pub(crate) waiting_since: Option<Instant>,
    /// How often the slave has refused the request since then.
    pub(crate) refusals: u32,
    /// Damaged replies that were refused, and replies that were not the request's.
    pub(crate) damaged: u32,
    pub(crate) leftovers: u32,
    /// Polls that were not answered, so that an answer may belong to an earlier one.
    pub(crate) unanswered: u32,
    /// What it ends with once the slave has been told that its reply has come.
    pub(crate) result: Option<Result<Answer, Failure>>,
    /// A reply came that did not fit.
    pub(crate) misfit: Option<String>,
}

/// A number of ours that the slave is asked to mirror.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mark {
    /// Its data frame.
    pub(crate) frame: Bytes,
    /// The UNI-TE reply that brings it back.
    pub(crate) reply: [u8; 5],
    /// The slave has refused something, which may have been this.
    pub(crate) refused: bool,
}

/// What was sent last, and what may come now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
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
pub(crate) enum Next {
    /// The mark or the request.
    Ask,
    Poll(Wanted),
    /// One of the two signals.
    Signal(u8, Then),
}

/// What a poll is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The reply to the mark or to the request.
    Reply,
    /// What the slave may hold, because it refuses to be asked.
    Room,
    /// Nothing: that the slave has heard us take its reply.
    Nothing,
}

/// What follows our answer to a data frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Then {
    Ask,
    Poll(Wanted),
    /// The last poll, where it is worth it, and the end.
    Close,
}

impl Current {
    pub(crate) fn is_late(&self, now: Instant) -> bool {
        self.reply_by.is_some_and(|by| now >= by)
    }

    /// Whether something that the slave may send now is awaited.
    pub(crate) const fn is_listening(&self) -> bool {
        matches!(self.stage, Stage::Asking | Stage::Polling(_))
    }
}
