//! The machine, for one exchange after another.

use std::{
    collections::BTreeMap,
    hash::{BuildHasher, RandomState},
    mem,
    time::{Duration, Instant},
};

use bytes::Bytes;

use crate::{
    failure::{Answer, Failure},
    frame::{self, MAX_FRAME, Receiver},
    known::Known,
    network::MAX_MESSAGE,
    request::{Request, RequestError},
    settings::{Speed, UniTelwaySettings, reply_len},
    stage::{Current, Next, Stage},
};

/// What an exchange wants next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// More bytes, or the passing of [`UniTelway::deadline`].
    More,
    /// These bytes sent now; the exchange goes on. [`UniTelway::handle_sent`] **must** follow.
    Send(Bytes),
    /// The line is free for other slaves until this time, when [`UniTelway::resume`] goes on.
    Wait(Instant),
    /// Nothing: it is over.
    Done(Result<Answer, Failure>),
}

/// What came in and was no part of the exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stray {
    /// An intact frame.
    Frame {
        /// Its address.
        slave: u8,
        /// The code of its UNI-TE reply, or the first byte of a network header that is not known.
        function: u8,
    },
    /// Bytes that make no frame.
    Noise(usize),
    /// Our own transmission, given back by the adapter.
    Echo,
}

/// The machine of a line.
#[derive(Debug)]
pub struct UniTelway {
    pub(crate) settings: UniTelwaySettings,
    pub(crate) speed: Speed,
    pub(crate) silence: Duration,
    chunk_gap: Duration,
    pub(crate) known: BTreeMap<u8, Known>,
    pub(crate) current: Option<Current>,
    /// The exchanges that wait for their slaves.
    pub(crate) aside: BTreeMap<u8, Current>,
    /// The number that was mirrored last. Where it begins nobody knows, so that none is taken for an earlier run's.
    pub(crate) marks: u32,
    pub(crate) receiver: Receiver,
    last_byte: Option<Instant>,
    /// How long the slave took for the last answer.
    pub(crate) took: Option<Duration>,
    /// What was sent last and has not come back as an echo.
    pub(crate) sent: Bytes,
    pub(crate) echoes: bool,
    pub(crate) strays: Vec<Stray>,
}

impl UniTelway {
    /// A machine for a line of `baud` bit/s whose adapter makes pauses of at most `chunk_gap` inside a frame.
    #[must_use]
    pub fn new(baud: u32, settings: UniTelwaySettings, chunk_gap: Duration) -> Self {
        let speed = Speed::new(baud);
        Self {
            settings,
            speed,
            silence: speed.bits(settings.silence_bits),
            chunk_gap,
            known: BTreeMap::new(),
            current: None,
            aside: BTreeMap::new(),
            marks: RandomState::new().hash_one(()) as u32,
            receiver: Receiver::default(),
            last_byte: None,
            took: None,
            sent: Bytes::new(),
            echoes: false,
            strays: Vec::new(),
        }
    }

    /// Whether something that a slave may send now has begun to come.
    fn is_receiving(&self) -> bool {
        self.receiver.is_open() && self.current.as_ref().is_some_and(Current::is_listening)
    }

    fn open(&mut self, slave: u8, request: Request, at_once: bool) -> Bytes {
        let unite = request.encode(self.settings.category);
        let is_empty = self.known.entry(slave).or_default().is_empty();
        self.current = Some(Current {
            slave,
            frame: frame::data(slave, &self.settings.header.message(&unite)),
            mark: (!is_empty && !at_once).then(|| self.new_mark(slave)),
            is_proven: is_empty,
            stage: Stage::Before(Next::Ask),
            due: None,
            patience: Duration::ZERO,
            reply_by: None,
            reply: self.speed.characters(reply_len(request.likely_reply())),
            request,
            requested: None,
            polled_after: Duration::ZERO,
            waiting_since: None,
            refusals: 0,
            damaged: 0,
            leftovers: 0,
            unanswered: 0,
            result: None,
            misfit: None,
        });
        self.took = None;
        self.begin(Next::Ask)
    }

    /// Whether a request can be sent to this slave.
    ///
    /// # Errors
    /// [`RequestError`] when it has no form on this line.
    pub fn check(&self, slave: u8, request: &Request) -> Result<(), RequestError> {
        if slave == 0 {
            return Err(RequestError::Broadcast);
        }
        let unite = request.encode(self.settings.category);
        if self.settings.header.message(&unite).len() > MAX_MESSAGE {
            return Err(RequestError::TooLong(unite.len()));
        }
        Ok(())
    }

    /// Begins an exchange and gives the bytes that open it. The request **must** have passed [`check`](Self::check).
    pub fn start(&mut self, slave: u8, request: Request) -> Bytes {
        self.open(slave, request, false)
    }

    /// The same for the first write of a stop: nothing that makes sure of its answer goes first.
    pub fn start_at_once(&mut self, slave: u8, request: Request) -> Bytes {
        self.open(slave, request, true)
    }

    /// The bytes that were given last have been written; their last bit ends at `end` at the earliest. The reply is due
    /// at `answer_by`, counted from the end of what opened the exchange.
    pub fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        let link_timeout = self.settings.link_timeout;
        let Some(current) = &mut self.current else { return };
        if current.reply_by.is_none() {
            current.patience = answer_by.saturating_duration_since(end);
            current.reply_by = Some(answer_by);
        }
        current.due = Some(match current.stage {
            Stage::Asking => {
                let reply_by = end + current.patience;
                current.reply_by = Some(reply_by);
                current.requested = Some(end);
                reply_by.min(end + link_timeout + self.speed.characters(1))
            }
            Stage::Polling(_) => {
                let asked = current.requested.unwrap_or(end);
                current.polled_after = end.saturating_duration_since(asked);
                end + link_timeout + current.reply
            }
            // The echo of an acknowledgement must not be taken for one of the next request.
            Stage::Answering(_) if self.echoes => end + self.chunk_gap,
            Stage::Answering(_) | Stage::Before(_) => end,
        });
    }

    /// Bytes came in at `now`. Those that come when no exchange is under way are strays.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.last_byte = Some(now);
        self.receiver.push(bytes);
        let mut step = Step::More;
        while let Some(heard) = self.receiver.next() {
            let next = self.hear(now, heard);
            step = if step == Step::More { next } else { step };
        }
        step
    }

    /// The [`deadline`](Self::deadline) has passed.
    pub fn handle_timeout(&mut self, now: Instant) -> Step {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Step::More;
        }
        while self.is_receiving() {
            let Some(given_up) = self.receiver.give_up() else { break };
            let step = self.hear(now, given_up);
            if step != Step::More {
                return step;
            }
            while let Some(heard) = self.receiver.next() {
                let step = self.hear(now, heard);
                if step != Step::More {
                    return step;
                }
            }
        }
        let over = self.current.as_ref().and_then(|current| current.due).is_some_and(|due| now >= due);
        if over { self.overdue(now) } else { Step::More }
    }

    /// When [`handle_timeout`](Self::handle_timeout) is to be called, unless bytes come before.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let due = self.current.as_ref()?.due?;
        match self.last_byte {
            Some(last) if self.is_receiving() => {
                let limit = due + self.speed.characters(MAX_FRAME) + self.chunk_gap;
                Some((last + self.chunk_gap).min(limit))
            }
            _ => Some(due),
        }
    }

    /// Gives up the exchange that is under way. What still comes is stray.
    pub fn abandon(&mut self) {
        self.current = None;
    }

    /// Goes on with the exchange with this slave that [`Step::Wait`] has put aside, and gives the bytes to be sent.
    pub fn resume(&mut self, slave: u8) -> Option<Bytes> {
        let current = self.aside.remove(&slave)?;
        let Stage::Before(next) = current.stage else { return None };
        self.current = Some(current);
        Some(self.begin(next))
    }

    /// Gives up the exchange with this slave that was put aside.
    pub fn forsake(&mut self, slave: u8) {
        self.aside.remove(&slave);
    }

    /// Forgets everything: the port is another one now.
    pub fn reset(&mut self) {
        self.current = None;
        self.aside.clear();
        self.receiver = Receiver::default();
        self.sent.clear();
        self.known.clear();
    }

    /// How long the slave took for the answer that came last.
    #[must_use]
    pub const fn took(&self) -> Option<Duration> {
        self.took
    }

    /// What came in that was no part of an exchange, since the last call.
    pub fn take_strays(&mut self) -> Vec<Stray> {
        mem::take(&mut self.strays)
    }

    /// Whether the adapter echoes, as far as is known.
    #[must_use]
    pub const fn echoes(&self) -> bool {
        self.echoes
    }
}
