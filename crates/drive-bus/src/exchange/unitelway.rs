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
mod request;

use std::{collections::BTreeSet, mem, sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::{Class, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request};

pub(crate) use self::request::code;
use self::{
    frame::{ACK, EOT, Heard, MAX_FRAME, NAK, Receiver},
    request::{decode, encode, is_specific},
};
pub use self::{
    frame::{data as data_frame, len as frame_len, poll},
    request::UNITE,
};
use super::{Answer, Exchange, Failure, Step, Stray};
use crate::answer;

/// First byte of a message: UNI-TE follows at once.
const SIMPLIFIED: u8 = 0x00;
/// First byte of a message: five bytes of address and then UNI-TE follow.
const STANDARD: u8 = 0x20;
const STANDARD_LEN: usize = 6;
/// First byte of a message that the network could not deliver.
const UNDELIVERABLE: u8 = 0x22;
/// The longest message.
const MAX_MESSAGE: usize = 255;
/// Characters of a poll.
const POLL_LEN: usize = 3;
/// How many leftovers of a slave are taken before its next request.
const LEFTOVERS: u32 = 2;
/// The highest category of a request.
const CATEGORIES: u8 = 7;

/// What stands in front of each UNI-TE request: whom on the network it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NetworkHeader {
    /// One byte 00h.
    Simplified,
    /// 20h and five bytes.
    Standard {
        /// Network.
        network: u8,
        /// Station.
        station: u8,
        /// Gate.
        gate: u8,
        /// The two bytes after the gate.
        extensions: [u8; 2],
    },
}

impl Default for NetworkHeader {
    /// `20 00 FE 00 00 00`.
    fn default() -> Self {
        Self::Standard { network: 0, station: 0xFE, gate: 0, extensions: [0, 0] }
    }
}

/// What a UNI-TELWAY line can be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UniTelwaySettings {
    /// The network header. Which form the card VW3-A58303 needs is not printed.
    pub header: NetworkHeader,
    /// The category in each request, 0 to 7. The manual's sample has 7 (p. 12/36).
    pub category: u8,
    /// The silence before each of our transmissions inside an exchange, in bits.
    pub turnaround_bits: u32,
    /// How long a slave may take to begin its acknowledgement, or what it answers to a poll.
    pub link_timeout: Duration,
    /// From "nothing to say" to the next poll for the same reply.
    pub poll_pause: Duration,
    /// How often a refused request is sent again, and a damaged reply refused.
    pub repeats: u32,
}

impl Default for UniTelwaySettings {
    /// The standard header, category 7, 10 bits, 100 ms, 5 ms, 1.
    fn default() -> Self {
        Self {
            header: NetworkHeader::default(),
            category: CATEGORIES,
            turnaround_bits: 10,
            link_timeout: Duration::from_millis(100),
            poll_pause: Duration::from_millis(5),
            repeats: 1,
        }
    }
}

impl UniTelwaySettings {
    /// Whether the category is one.
    pub(crate) const fn is_category(&self) -> bool {
        self.category <= CATEGORIES
    }

    fn message(&self, unite: &[u8]) -> Vec<u8> {
        match self.header {
            NetworkHeader::Simplified => [&[SIMPLIFIED], unite].concat(),
            NetworkHeader::Standard { network, station, gate, extensions: [first, second] } => {
                [&[STANDARD, network, station, gate, first, second], unite].concat()
            }
        }
    }
}

/// How long an exchange may go on beyond its request and the time of its reply, when everything goes wrong that the
/// settings still put up with. Request and replies have so many characters at the most.
#[must_use]
pub fn overtime(
    serial: SerialSettings,
    settings: UniTelwaySettings,
    chunk_gap: Duration,
    request: usize,
    reply: usize,
) -> Duration {
    let said = |characters| serial.bits(settings.turnaround_bits) + serial.characters(characters);
    // A request that is refused; a poll with a damaged reply or a leftover, and our word to it.
    let refused = said(request) + settings.link_timeout + serial.characters(1);
    let polled = said(POLL_LEN) + settings.link_timeout + serial.characters(reply) + chunk_gap + said(1);
    let polls = settings.repeats.saturating_add(LEFTOVERS).saturating_add(1);
    refused.saturating_mul(settings.repeats) + polled.saturating_mul(polls)
}

/// How many characters the data frame has that carries a Modbus PDU of this length, without doubled bytes.
pub(crate) const fn request_len(pdu: usize) -> usize {
    frame_len(pdu + STANDARD_LEN + 4)
}

/// How many characters come and go from the end of a request to the end of its exchange: two acknowledgements, a poll and
/// the reply.
pub(crate) const fn reply_len(pdu: usize) -> usize {
    2 + POLL_LEN + frame_len(pdu + STANDARD_LEN)
}

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

#[derive(Debug)]
struct Current {
    slave: u8,
    request: Arc<Request<'static>>,
    /// The data frame of the request.
    frame: Bytes,
    stage: Stage,
    /// When this stage ends by itself. `None`: what it began with has not been written yet.
    due: Option<Instant>,
    /// How long the reply may take from the end of the request, and until when that is.
    patience: Duration,
    reply_by: Option<Instant>,
    /// The time that the characters of a reply take.
    reply: Duration,
    answer: Option<Answer>,
    leftovers: u32,
    refusals: u32,
    damaged: u32,
    /// A reply came that did not fit.
    misfit: Option<String>,
}

/// What was sent last, and what may come now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    Empty,
    Request,
    Poll,
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

    fn hear(&mut self, now: Instant, heard: Heard) -> Step {
        match heard {
            Heard::Signal { byte, alone } => self.signal(now, byte, alone),
            Heard::Poll(address) => {
                // Another master's poll is no frame of the slave that it names.
                if self.is_echo(&poll(address)) { Step::More } else { self.noise(POLL_LEN) }
            }
            Heard::Data { address, message } => {
                if self.is_echo(&frame::data(address, &message)) {
                    return Step::More;
                }
                self.data(now, address, &message)
            }
            Heard::Damaged(len) => self.damaged(len),
            Heard::Noise(len) => self.noise(len),
        }
    }

    /// Takes our own transmission away where the adapter gives it back. Slaves send nothing that it could be.
    fn is_echo(&mut self, bytes: &[u8]) -> bool {
        if self.sent.is_empty() || *self.sent != *bytes {
            return false;
        }
        self.sent.clear();
        self.receiver.discount();
        self.echoes = true;
        self.strays.push(Stray::Echo);
        true
    }

    fn signal(&mut self, now: Instant, byte: u8, alone: bool) -> Step {
        // A single character proves no echo, it is only taken away where there is one.
        if self.echoes && self.is_echo(&[byte]) {
            let is_last = self.current.as_ref().is_some_and(|current| current.stage == Stage::Ending);
            return if is_last { self.overdue() } else { Step::More };
        }
        let (turnaround, pause) = (self.turnaround, self.settings.poll_pause.max(self.turnaround));
        let repeats = self.settings.repeats;
        let Some(current) = &mut self.current else { return self.noise(1) };
        match (&current.stage, byte) {
            (Stage::Requesting, ACK) => current.pause(now + turnaround, Next::Poll),
            // What stands among other bytes is no refusal: the slave may have taken the request.
            (Stage::Requesting, NAK) if alone && current.refusals < repeats => {
                current.refusals += 1;
                current.pause(now + turnaround, Next::Request);
            }
            (Stage::Requesting, NAK) if alone => {
                self.empty.insert(current.slave);
                return self.end(Err(Failure::Refused("the slave refuses the frame (NAK)")));
            }
            (Stage::Emptying, EOT) if alone => {
                self.silent.remove(&current.slave);
                self.outspoken.insert(current.slave);
                current.pause(now + turnaround, Next::Request);
            }
            (Stage::Polling, EOT) if alone && !current.is_late(now) => {
                current.pause(now + pause, Next::Poll);
            }
            (Stage::Polling, EOT) if alone => return self.fail(),
            _ => return self.noise(1),
        }
        Step::More
    }

    /// A data frame whose BCC fits.
    fn data(&mut self, now: Instant, address: u8, message: &Bytes) -> Step {
        let unite = split_header(message);
        let function = match &unite {
            Some(Ok(unite)) => unite.first().copied().unwrap_or_default(),
            _ => message.first().copied().unwrap_or_default(),
        };
        let stray = Stray::Frame { slave: address, function };
        let Some(current) = self.current.as_mut().filter(|current| current.slave == address) else {
            self.strays.push(stray);
            return Step::More;
        };
        match current.stage {
            Stage::Emptying => {
                self.strays.push(stray);
                self.respond(ACK)
            }
            Stage::Polling => {
                let answer = match unite {
                    Some(Ok(unite)) => decode(&current.request, &unite),
                    Some(Err(exception)) => Ok(Err(exception)),
                    None => Err(format!("the network header {function:02X}h")),
                };
                match answer {
                    Ok(answer) => {
                        self.silent.remove(&current.slave);
                        current.stage = Stage::Ending;
                        current.answer = Some(answer);
                        self.send(Bytes::from_static(&[ACK]))
                    }
                    Err(why) => {
                        let is_late = current.is_late(now);
                        current.misfit = Some(why);
                        self.strays.push(stray);
                        if is_late { self.fail() } else { self.respond(ACK) }
                    }
                }
            }
            _ => {
                self.strays.push(stray);
                Step::More
            }
        }
    }

    fn damaged(&mut self, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        let repeats = self.settings.repeats;
        match &mut self.current {
            Some(current) if current.stage == Stage::Polling => {
                if current.damaged >= repeats {
                    return self.end(Err(Failure::Damaged("BCC")));
                }
                current.damaged += 1;
                self.respond(NAK)
            }
            Some(Current { stage: Stage::Emptying, .. }) => self.respond(NAK),
            _ => Step::More,
        }
    }

    /// Answers a data frame, before the next poll.
    fn respond(&mut self, signal: u8) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        let next = match current.stage {
            Stage::Emptying => {
                current.leftovers += 1;
                if current.leftovers < LEFTOVERS { Next::Empty } else { Next::Request }
            }
            _ => Next::Poll,
        };
        current.stage = Stage::Answering(next);
        self.send(Bytes::copy_from_slice(&[signal]))
    }

    fn send(&mut self, bytes: Bytes) -> Step {
        self.prepare(&bytes);
        Step::Send(bytes)
    }

    /// These bytes are sent next: what comes after them is heard anew.
    fn prepare(&mut self, bytes: &Bytes) {
        if let Some(current) = &mut self.current {
            current.due = None;
        }
        self.sent = bytes.clone();
        let unfinished = self.receiver.begin();
        if unfinished > 0 {
            self.strays.push(Stray::Noise(unfinished));
        }
    }

    fn send_next(&mut self, next: Next) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        let bytes = current.begin(next);
        if next == Next::Request {
            self.empty.remove(&current.slave);
        }
        self.send(bytes)
    }

    fn noise(&mut self, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        Step::More
    }

    /// The time of a stage is over.
    fn overdue(&mut self) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        match current.stage {
            Stage::Before(next) | Stage::Answering(next) => self.send_next(next),
            // It may be late, with a reply that would then be taken for the next one. Not twice: a stop must go out.
            Stage::Emptying
                if self.outspoken.contains(&current.slave) && self.silent.insert(current.slave) =>
            {
                self.fail()
            }
            // A slave that never says anything to such a poll has nothing to say, or is not there: the request will
            // show it.
            Stage::Emptying => self.send_next(Next::Request),
            // Polled again, it might answer twice, and the second answer be taken for a later request's.
            Stage::Requesting | Stage::Polling => self.fail(),
            Stage::Ending => {
                // One that was taken for an echo once may have been none.
                self.echoes &= self.sent.is_empty();
                match current.answer.take() {
                    Some(answer) => {
                        self.empty.insert(current.slave);
                        self.end(Ok(answer))
                    }
                    None => self.fail(),
                }
            }
        }
    }

    fn fail(&mut self) -> Step {
        let misfit = self.current.as_mut().and_then(|current| current.misfit.take());
        self.end(Err(misfit.map_or(Failure::Timeout, Failure::Mismatch)))
    }

    fn end(&mut self, result: Result<Answer, Failure>) -> Step {
        self.current = None;
        Step::Done(result)
    }

    /// Whether something that a slave may send now has begun to come.
    fn is_receiving(&self) -> bool {
        self.receiver.is_open()
            && self.current.as_ref().is_some_and(|current| {
                matches!(current.stage, Stage::Emptying | Stage::Requesting | Stage::Polling)
            })
    }
}

impl Current {
    fn is_late(&self, now: Instant) -> bool {
        self.reply_by.is_some_and(|by| now >= by)
    }

    fn pause(&mut self, until: Instant, next: Next) {
        self.stage = Stage::Before(next);
        self.due = Some(until);
    }

    /// The bytes of a stage, which begins with them.
    fn begin(&mut self, next: Next) -> Bytes {
        let (stage, bytes) = match next {
            Next::Empty => (Stage::Emptying, poll(self.slave)),
            Next::Request => (Stage::Requesting, self.frame.clone()),
            Next::Poll => (Stage::Polling, poll(self.slave)),
        };
        self.stage = stage;
        bytes
    }
}

/// The UNI-TE part of a message, or what the network has to say instead; `None` for an unknown header.
fn split_header(message: &Bytes) -> Option<Result<Bytes, ExceptionCode>> {
    match *message.first()? {
        SIMPLIFIED => Some(Ok(message.slice(1..))),
        STANDARD if message.len() >= STANDARD_LEN => Some(Ok(message.slice(STANDARD_LEN..))),
        UNDELIVERABLE => Some(Err(ExceptionCode::GatewayPathUnavailable)),
        _ => None,
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
        if self.settings.message(&unite).len() > MAX_MESSAGE {
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
        let frame = frame::data(slave, &self.settings.message(&unite));
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
