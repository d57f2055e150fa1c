//! UNI-TELWAY, the master's side: who is polled may speak.
//!
//! ```text
//! data frame : 10 02 address length data BCC      (each 10h of length and data sent twice)
//! poll       : 10 05 address
//! yes, no, nothing to say : 06, 15, 04
//!
//! master : data            poll                     ACK       poll
//! slave  :       ACK             data (or EOT: later)              EOT
//! ```
//!
//! One exchange is a request, its acknowledgement, as many polls as the slave needs, the reply and its acknowledgement,
//! and one more poll. The time that a slave may take for its reply is the line's response timeout, learned as in every
//! protocol. Inside it [`UniTelwaySettings`] has the link's own times.
//!
//! # Which request a reply belongs to
//! A reply says nothing of it. Slaves do different things with a reply whose acknowledgement they have not heard: they
//! send it again at the next poll, keep it and answer later requests behind it, refuse any request until it is taken,
//! or forget it. So a request is sent only to a slave that holds nothing:
//! - It has answered the last poll of its last exchange by EOT, and every reply that it owed has come.
//! - Else it is asked first to mirror a number of ours (request FAh). What comes before that number is dropped; behind
//!   it, nothing older can come, because a slave answers in the order in which it was asked. One that refuses to mirror
//!   has to have nothing more to say.
//! - The first write of a stop waits for neither. Where it is not known what the slave holds, no confirmation of it is
//!   taken: its outcome is unknown, and the line sends it again behind a number that was mirrored.
//!
//! # When something is lost, and when a slave is slow
//! - EOT and silence both mean "not yet" to a poll for a reply: the slave is polled again until its time is over, and
//!   the line serves others between the polls.
//! - A request that the slave refuses (NAK) was not carried out. What the slave may hold is taken, the request is sent
//!   again at once, then after pauses in which others are served, for [`UniTelwaySettings::busy_timeout`].
//! - A request that the slave does not acknowledge may have been carried out. The exchange fails, a write's outcome is
//!   unknown, and whether it is sent again is for the line to decide: an edge never is.
//! - A reply that is damaged is refused and polled for again; nothing is carried out twice by that.
//!
//! The line has no broadcast here: the card's manual names none for this protocol.
//!
//! # What remains
//! A slave that can neither mirror nor say EOT is asked as soon as it has been silent once: a reply of its that comes
//! later than the line's late window and has the shape of a later one is taken for it.
//!
//! # Sources
//! The card's manual (VVDED397054 p. 11–13/35–37) prints the UNI-TE requests and leaves the link to the "UNI-TELWAY
//! reference manual". The frames here are those of public implementations of the slave's side. **Not confirmed on a
//! card**: the network header, what a slave with nothing to say answers, all times, and what becomes of a reply whose
//! acknowledgement the slave has not heard.

mod frame;
mod known;
mod network;
mod receive;
mod request;
mod send;
mod settings;
mod stage;

use std::{
    collections::BTreeMap,
    hash::{BuildHasher, RandomState},
    mem,
    sync::Arc,
    time::Duration,
};

use bytes::Bytes;
use drive_core::{Class, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::Request;

use self::{
    frame::{MAX_FRAME, Receiver},
    known::Known,
    network::MAX_MESSAGE,
    request::{encode, is_specific},
    stage::{Current, Next, Stage},
};
pub use self::{
    frame::{data as data_frame, len as frame_len, poll},
    network::NetworkHeader,
    request::UNITE,
    settings::{UniTelwaySettings, longest},
};
pub(crate) use self::{
    request::code,
    settings::{reply_len, request_len},
};
use super::{Exchange, Step, Stray};
use crate::{answer, shape::Shape};

/// The machine.
#[derive(Debug)]
pub struct UniTelway {
    settings: UniTelwaySettings,
    serial: SerialSettings,
    turnaround: Duration,
    chunk_gap: Duration,
    known: BTreeMap<u8, Known>,
    current: Option<Current>,
    /// The exchanges that wait for their slaves.
    aside: BTreeMap<u8, Current>,
    /// The number that was mirrored last. Where it begins nobody knows, so that none is taken for an earlier run's.
    marks: u32,
    receiver: Receiver,
    last_byte: Option<Instant>,
    /// How long the slave took for the last answer.
    took: Option<Duration>,
    /// What was sent last and has not come back as an echo.
    sent: Bytes,
    echoes: bool,
    strays: Vec<Stray>,
}

impl UniTelway {
    /// A machine for an adapter that makes pauses of at most `chunk_gap` inside a frame.
    #[must_use]
    pub fn new(serial: SerialSettings, settings: UniTelwaySettings, chunk_gap: Duration) -> Self {
        Self {
            settings,
            serial,
            turnaround: serial.bits(settings.turnaround_bits),
            chunk_gap: chunk_gap.max(serial.t3_5()),
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

    fn open(&mut self, slave: u8, request: Arc<Request<'static>>, at_once: bool) -> Bytes {
        // What has no form was refused by `carries`.
        let unite = encode(&request, self.settings.category).unwrap_or_default();
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
            reply: self.serial.characters(reply_len(answer::likely_len(&request))),
            request,
            requested: None,
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
}

impl Exchange for UniTelway {
    fn carries(&self, slave: u8, request: &Request<'_>, class: Class) -> Result<(), String> {
        if slave == 0 {
            return Err("UNI-TELWAY has no broadcast here".to_owned());
        }
        if is_specific(request) && class < Class::Command {
            return Err(format!("request F2h commands the drive, which class {class} may not"));
        }
        let unite = encode(request, self.settings.category)?;
        if self.settings.header.message(&unite).len() > MAX_MESSAGE {
            return Err(format!("a request of {} bytes is longer than a frame", unite.len()));
        }
        Ok(())
    }

    fn is_write(&self, request: &Request<'_>) -> bool {
        request::is_write(request).unwrap_or_else(|| crate::pdu::is_write(request))
    }

    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, _: &Bytes) -> Bytes {
        self.open(slave, request, false)
    }

    fn start_at_once(&mut self, slave: u8, request: Arc<Request<'static>>, _: &Bytes) -> Bytes {
        self.open(slave, request, true)
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
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
                reply_by.min(end + link_timeout + self.serial.characters(1))
            }
            Stage::Polling(_) => end + link_timeout + current.reply,
            // The echo of an acknowledgement must not be taken for one of the next request.
            Stage::Answering(_) if self.echoes => end + self.chunk_gap,
            Stage::Answering(_) | Stage::Before(_) => end,
        });
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.last_byte = Some(now);
        self.receiver.push(bytes);
        let mut step = Step::More;
        while let Some(heard) = self.receiver.next() {
            let next = self.hear(now, heard);
            step = if step == Step::More { next } else { step };
        }
        step
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
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

    fn deadline(&self) -> Option<Instant> {
        let due = self.current.as_ref()?.due?;
        match self.last_byte {
            Some(last) if self.is_receiving() => {
                let limit = due + self.serial.characters(MAX_FRAME) + self.chunk_gap;
                Some((last + self.chunk_gap).min(limit))
            }
            _ => Some(due),
        }
    }

    fn abandon(&mut self) {
        self.current = None;
    }

    fn frees_the_line(&self) -> bool {
        true
    }

    fn resume(&mut self, slave: u8) -> Option<Bytes> {
        let current = self.aside.remove(&slave)?;
        let Stage::Before(next) = current.stage else { return None };
        self.current = Some(current);
        Some(self.begin(next))
    }

    fn forsake(&mut self, slave: u8) {
        self.aside.remove(&slave);
    }

    fn reset(&mut self) {
        self.current = None;
        self.aside.clear();
        self.receiver = Receiver::default();
        self.sent.clear();
        self.known.clear();
    }

    fn took(&self) -> Option<Duration> {
        self.took
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        mem::take(&mut self.strays)
    }

    fn confuses_late_answers(&self) -> bool {
        true
    }

    /// Of any reply it is unknown which request it belongs to.
    fn shape(&self, _: &[u8]) -> Shape {
        Shape::ANY
    }

    fn echoes(&self) -> bool {
        self.echoes
    }
}
