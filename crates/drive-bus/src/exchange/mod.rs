//! Exchanges: one request and its answer, as bytes. Pure: time is an argument, bytes go in and come out.
//!
//! A protocol of the line is an implementation of [`Machine`]. Families never see which one it is.

#[cfg(feature = "ascii")]
pub mod ascii;
pub(crate) mod echo;
#[cfg(feature = "tcp")]
pub mod mbap;
mod pace;
pub mod rtu;
#[cfg(feature = "unitelway")]
pub mod unitelway;

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use crc::{CRC_16_MODBUS, Crc};
use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request, Response};

use crate::{pdu, shape::Shape};

const CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);

/// Exception 0Bh, gateway target device failed to respond (Modbus Application Protocol V1.1b3, section 7).
pub(crate) const NOBODY_ANSWERED: u8 = 0x0B;

/// Why none of two answers is believed that differ and come together: which of them is the right one nothing tells.
pub(crate) const DIFFER: &str = "two answers that differ";

/// What a slave said: data, or its refusal.
pub type Answer = Result<Response, ExceptionCode>;

/// What an exchange brought: an answer, or why none.
pub type Brought = Result<Answer, Failure>;

/// What an exchange wants next.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// More bytes, or the passing of [`Machine::deadline`].
    More,
    /// These bytes sent now; the exchange goes on. [`Machine::handle_sent`] **must** follow.
    Send(Bytes),
    /// The line is free for other slaves until this time, when [`Machine::resume`] goes on.
    Wait(Instant),
    /// Nothing: it is over.
    Done(Brought),
}

/// Why an exchange brought no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Failure {
    /// No answer came in time. It may still come.
    Timeout,
    /// A gateway has waited for the slave, and says that it did not answer.
    Nobody,
    /// What came looks like the answer and is not whole.
    Damaged(&'static str),
    /// No answer came in time, but an intact frame of the slave that does not fit the request. The answer may still come.
    Mismatch(String),
    /// The slave has refused the frame for as long as it was repeated, so that nothing of it was carried out.
    Refused(&'static str),
    /// An answer came that may belong to an earlier request.
    Doubted(&'static str),
}

/// What an intact frame is told by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Frame {
    /// What it answers.
    pub shape: Shape,
    /// A check over all of it.
    pub check: u16,
}

impl Frame {
    /// The frame with this PDU.
    #[must_use]
    pub fn of(pdu: &[u8]) -> Self {
        Self { shape: Shape::heard(pdu), check: CHECK.checksum(pdu) }
    }
}

/// What came in and was no part of the exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stray {
    /// An intact frame: another slave's, another master's, or a late answer.
    Frame {
        /// Its address.
        slave: u8,
        /// Its function code.
        function: u8,
        /// The shape of the answer that it is, or that will follow it, and what it says.
        frame: Frame,
        /// Another master's request.
        is_request: bool,
        /// Its transaction number, where the protocol has one.
        number: Option<u16>,
        /// A gateway says that nobody has answered it (exception 0Bh).
        nobody: bool,
    },
    /// An intact frame with the form of the answer, and sooner than a line can carry the request and it.
    Early {
        /// Its address.
        slave: u8,
        /// Its shape, and what it says.
        frame: Frame,
    },
    /// Bytes that make no frame.
    Noise(usize),
    /// Our own request, given back by the adapter.
    Echo,
}

impl Stray {
    /// An intact frame with this PDU.
    pub(crate) fn frame(slave: u8, pdu: &[u8]) -> Self {
        let function = pdu.first().copied().unwrap_or_default();
        let frame = Frame::of(pdu);
        let nobody = function & 0x80 != 0 && pdu.get(1) == Some(&NOBODY_ANSWERED);
        Self::Frame { slave, function, frame, is_request: Shape::is_request(pdu), number: None, nobody }
    }
}

/// The machine of one protocol, used for one exchange after another.
pub trait Machine: Send {
    /// Whether the protocol has a form for this request to this slave, and whether the class may carry it.
    ///
    /// # Errors
    /// Why it has none, in words. The request is then never started.
    fn carries(&self, slave: u8, request: &Request<'_>, class: Class) -> Result<(), String> {
        let _ = (slave, request, class);
        Ok(())
    }

    /// Whether the request may change something in the slave, so that it is not repeated as a read is.
    fn is_write(&self, request: &Request<'_>) -> bool {
        pdu::is_write(request)
    }

    /// Whether the confirmation of an earlier write may still come when another one is sent, and be taken for its own where it names no
    /// value.
    fn confirms_late(&self) -> bool {
        true
    }

    /// Whether the far end takes the time that characters take on the line, so that what comes sooner is no answer.
    fn set_far_end_paces(&mut self, paces: bool) {
        let _ = paces;
    }

    /// Begins an exchange and gives the bytes that open it. `pdu` is the request, encoded.
    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes;

    /// The same for the first write of a stop: nothing that makes sure of its answer goes first.
    fn start_at_once(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        self.start(slave, request, pdu)
    }

    /// Whether a slave that is not ready is put aside.
    fn frees_the_line(&self) -> bool {
        false
    }

    /// Goes on with the exchange with this slave that [`Step::Wait`] has put aside, and gives the bytes to be sent; as after
    /// [`start`](Self::start).
    fn resume(&mut self, slave: u8) -> Option<Bytes> {
        let _ = slave;
        None
    }

    /// Gives up the exchange with this slave that was put aside.
    fn forsake(&mut self, slave: u8) {
        let _ = slave;
    }

    /// How long the slave took for the answer that came last, where that is not the time since the request without the
    /// characters.
    fn took(&self) -> Option<Duration> {
        None
    }

    /// The bytes that [`start`](Self::start) or [`Step::Send`] gave have been written; their last bit ends at `end` at
    /// the earliest. The first character of the answer, and as many more as the answer likely has, are due at `answer_by`,
    /// counted from the end of what opened the exchange.
    fn handle_sent(&mut self, end: Instant, answer_by: Instant);

    /// Bytes came in at `now`. Bytes that come when no exchange is under way are strays.
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step;

    /// The [`deadline`](Self::deadline) has passed.
    fn handle_timeout(&mut self, now: Instant) -> Step;

    /// When [`handle_timeout`](Self::handle_timeout) is to be called, unless bytes come before.
    fn deadline(&self) -> Option<Instant>;

    /// Gives up the exchange that is under way. What still comes is stray.
    fn abandon(&mut self);

    /// Forgets everything: the stream is another one now.
    fn reset(&mut self);

    /// What came in that was no part of an exchange, since the last call.
    fn take_strays(&mut self) -> Vec<Stray>;

    /// Whether a late answer can be taken for the answer to a later request, so that a slave must be left alone after a
    /// timeout: where the protocol has no numbers.
    fn confuses_late_answers(&self) -> bool {
        true
    }

    /// The shape of the answer to a request with this PDU. Requests whose answers have one shape wait for each other's
    /// late answers.
    fn shape(&self, pdu: &[u8]) -> Shape {
        Shape::of_answer_to(pdu)
    }

    /// What the answer that was taken last said, where a later frame can be another answer to the same question.
    fn taken(&self) -> Option<Frame> {
        None
    }

    /// The transaction number of the exchange that began last, where the protocol has one.
    fn number(&self) -> Option<u16> {
        None
    }

    /// Whether it is unknown if the adapter echoes, so that an answer that equals its request proves nothing yet.
    fn echo_is_unknown(&self) -> bool {
        false
    }

    /// Whether the adapter echoes, as far as is known.
    fn echoes(&self) -> bool {
        false
    }
}
