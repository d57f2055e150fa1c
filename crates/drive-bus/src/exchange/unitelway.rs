//! UNI-TELWAY, the master's side: who is polled may speak.
//!
//! ```text
//! data frame : 10 02 address length data BCC      (each 10h of length and data sent twice)
//! poll       : 10 05 address
//! yes, no, nothing to say : 06, 15, 04
//!
//! master : data            poll                     ACK
//! slave  :       ACK             data (or EOT: later)
//! ```
//!
//! One exchange is a request, its acknowledgement, as many polls as the slave needs, the reply and its acknowledgement.
//! The time that a slave may take for all of it is the line's response timeout, learned as in every protocol. Inside it
//! [`UniTelwaySettings`] has the link's own times.
//!
//! # When something is lost
//! - A request that the slave refuses (NAK) was not carried out. It is sent again, [`UniTelwaySettings::repeats`] times.
//! - A request that the slave does not acknowledge may have been carried out. The exchange fails, a write's outcome is
//!   unknown, and whether it is sent again is for the line to decide: an edge never is.
//! - A reply that is damaged is refused and polled for again; nothing is carried out twice by that. A poll that is not
//!   answered at all ends the exchange: the slave may only be late, and would answer a second poll too.
//! - A reply says nothing of the request that it belongs to. So a slave whose last exchange did not end with its reply, or
//!   of which nothing is known yet, is polled before its next request, and what it still holds is taken and dropped; and
//!   after a timeout it gets no request of any kind in the line's late window, the write of a stop excepted.
//!
//! The line has no broadcast here: the card's manual names none for this protocol.
//!
//! # Sources
//! The card's manual (VVDED397054 p. 11–13/35–37) prints the UNI-TE requests and leaves the link to the "UNI-TELWAY
//! reference manual". The frames here are those of public implementations of the slave's side. **Not confirmed on a
//! card**: the network header, what a slave with nothing to say answers (04 and silence are both taken for it), all
//! times, and whether a slave that has not heard our acknowledgement gives its reply up when it gets a new request.

mod frame;
mod network;
mod receive;
mod request;
mod send;
mod settings;
mod stage;

use std::{collections::BTreeSet, mem, sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::{Class, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::Request;

use self::{
    frame::{MAX_FRAME, Receiver},
    network::MAX_MESSAGE,
    request::{encode, is_specific},
    stage::{Current, Next, Stage},
};
pub use self::{
    frame::{data as data_frame, len as frame_len, poll},
    network::NetworkHeader,
    request::UNITE,
    settings::{UniTelwaySettings, overtime},
};
pub(crate) use self::{
    request::code,
    settings::{reply_len, request_len},
};
use super::{Exchange, Step, Stray};
use crate::answer;

/// The machine.
#[derive(Debug)]
pub struct UniTelway {
    settings: UniTelwaySettings,
    serial: SerialSettings,
    turnaround: Duration,
    chunk_gap: Duration,
    /// Slaves that are known to hold no reply.
    empty: BTreeSet<u8>,
    /// Slaves that have said before that they have nothing to say, so that their silence does not mean it.
    outspoken: BTreeSet<u8>,
    /// Those of them that kept silent all the same when they were polled last.
    silent: BTreeSet<u8>,
    current: Option<Current>,
    receiver: Receiver,
    last_byte: Option<Instant>,
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
            empty: BTreeSet::new(),
            outspoken: BTreeSet::new(),
            silent: BTreeSet::new(),
            current: None,
            receiver: Receiver::default(),
            last_byte: None,
            sent: Bytes::new(),
            echoes: false,
            strays: Vec::new(),
        }
    }

    /// Whether something that a slave may send now has begun to come.
    fn is_receiving(&self) -> bool {
        self.receiver.is_open()
            && self.current.as_ref().is_some_and(|current| {
                matches!(current.stage, Stage::Emptying | Stage::Requesting | Stage::Polling)
            })
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
        // What has no form was refused by `carries`.
        let unite = encode(&request, self.settings.category).unwrap_or_default();
        let frame = frame::data(slave, &self.settings.header.message(&unite));
        let reply = self.serial.characters(reply_len(answer::likely_len(&request)));
        let mut current = Current {
            slave,
            request,
            frame,
            stage: Stage::Before(Next::Request),
            due: None,
            patience: Duration::ZERO,
            reply_by: None,
            reply,
            answer: None,
            leftovers: 0,
            refusals: 0,
            damaged: 0,
            misfit: None,
        };
        let is_empty = self.empty.remove(&slave);
        let bytes = current.begin(if is_empty { Next::Request } else { Next::Empty });
        self.current = Some(current);
        self.prepare(&bytes);
        bytes
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        let link_timeout = self.settings.link_timeout;
        let Some(current) = &mut self.current else { return };
        if current.reply_by.is_none() {
            current.patience = answer_by.saturating_duration_since(end);
            current.reply_by = Some(answer_by);
        }
        current.due = Some(match current.stage {
            Stage::Requesting => {
                let reply_by = end + current.patience;
                current.reply_by = Some(reply_by);
                reply_by.min(end + link_timeout + self.serial.characters(1))
            }
            Stage::Emptying | Stage::Polling => end + link_timeout + current.reply,
            Stage::Answering(_) => end + self.turnaround,
            // The echo of an acknowledgement must not be taken for one of the next request.
            Stage::Ending if self.echoes => end + self.chunk_gap,
            Stage::Ending | Stage::Before(_) => end,
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
        if over { self.overdue() } else { Step::More }
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

    fn reset(&mut self) {
        self.current = None;
        self.receiver = Receiver::default();
        self.sent.clear();
        self.empty.clear();
        self.silent.clear();
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        mem::take(&mut self.strays)
    }

    fn confuses_late_answers(&self) -> bool {
        true
    }

    /// Of any reply it is unknown which request it belongs to.
    fn kind_of_answer(&self, _: u8) -> u8 {
        0
    }

    fn echoes(&self) -> bool {
        self.echoes
    }
}
