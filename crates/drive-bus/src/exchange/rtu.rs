//! Modbus RTU: address, PDU, CRC.
//!
//! An answer is delimited by the length that its first bytes tell and by its CRC. Time only resynchronises: after a
//! pause longer than the adapter makes inside a frame, what is there is judged and dropped. A strict limit of 1.5
//! characters inside a frame would reject good frames behind USB adapters, which deliver in chunks.

mod frame;
mod receive;

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::serial::SerialSettings;
use tokio::time::Instant;
use tokio_modbus::Request;

pub(crate) use self::frame::{MAX_FRAME, OVERHEAD, is_frame_but_for_one_bit};
pub use self::frame::{frame, is_frame};

use super::{
    Failure, Frame, Machine, Step, Stray,
    echo::{Echo, EchoState},
    pace::Pace,
};

/// What may come in during one exchange before it is given up, for somebody never stops talking: an echo, a stray, the
/// answer, and one frame more.
const MAX_RECEIVED: usize = 4 * MAX_FRAME;

/// How long an exchange may go on after the time of its answer is over, because something is still coming in.
#[must_use]
pub fn overtime(serial: SerialSettings, chunk_gap: Duration) -> Duration {
    serial.characters(MAX_FRAME) + chunk_gap.max(serial.t3_5())
}

/// The machine.
#[derive(Debug)]
pub struct Rtu {
    chunk_gap: Duration,
    t3_5: Duration,
    /// How long an answer that has begun may go on after its time is over.
    longest: Duration,
    pace: Pace,
    echo: EchoState,
    configured: Echo,
    current: Option<Current>,
    /// What opened the exchange.
    sent: Vec<u8>,
    /// What has come and is not yet part of anything.
    received: Vec<u8>,
    /// How many of them came before the slave can have heard the request.
    early: usize,
    last_byte: Option<Instant>,
    strays: Vec<Stray>,
    /// The answer that came last.
    taken: Option<Frame>,
}

#[derive(Debug)]
struct Current {
    slave: u8,
    request: Arc<Request<'static>>,
    answer_by: Option<Instant>,
    /// The echo of this request has been taken away.
    echo_taken: bool,
    /// Bytes received since the request.
    received: usize,
    /// An intact frame came that did not fit.
    misfit: Option<String>,
    /// What is there ends in a CRC that fits, and the function has no length of its own: silence ends it.
    ends_with_silence: bool,
}

impl Rtu {
    /// A machine for an adapter that makes pauses of at most `chunk_gap` inside a frame.
    #[must_use]
    pub fn new(serial: SerialSettings, chunk_gap: Duration, echo: Echo) -> Self {
        let t3_5 = serial.t3_5();
        Self {
            chunk_gap: chunk_gap.max(t3_5),
            t3_5,
            longest: overtime(serial, chunk_gap),
            pace: Pace::new(serial),
            echo: echo.into(),
            configured: echo,
            current: None,
            sent: Vec::with_capacity(MAX_FRAME),
            received: Vec::with_capacity(MAX_FRAME),
            early: 0,
            last_byte: None,
            strays: Vec::new(),
            taken: None,
        }
    }

    /// Nothing is awaited: what ends in a whole frame is judged at once.
    fn judge_strays(&mut self) {
        let is_whole = |offset: usize| self.received.get(offset..).is_some_and(is_frame);
        if self.received.len() > MAX_FRAME || (0..self.received.len()).any(is_whole) {
            self.judge(self.received.len());
        }
    }

    /// The time for the answer is over.
    fn fail(&mut self) -> Step {
        let Some(current) = self.current.take() else { return Step::More };
        let failure = current.misfit.map_or(Failure::Timeout, Failure::Mismatch);
        // An adapter that echoes would have echoed: silence is an answer to that question.
        if self.echo == EchoState::Unknown && failure == Failure::Timeout && current.received == 0 {
            self.echo = EchoState::Absent;
        }
        Step::Done(Err(failure))
    }
}

impl Machine for Rtu {
    fn set_far_end_paces(&mut self, paces: bool) {
        self.pace.set_far_end_paces(paces);
    }

    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        self.judge(self.received.len());
        self.pace.forget();
        let sent = frame(slave, pdu);
        self.sent.clear();
        self.sent.extend_from_slice(&sent);
        self.current = Some(Current {
            slave,
            request,
            answer_by: None,
            echo_taken: false,
            received: 0,
            misfit: None,
            ends_with_silence: false,
        });
        sent
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        self.pace.sent(end, self.sent.len());
        if let Some(current) = &mut self.current {
            current.answer_by = Some(answer_by);
        }
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.last_byte = Some(now);
        self.received.extend_from_slice(bytes);
        if self.pace.is_early(now, 0) {
            self.early = self.received.len();
        }
        match &mut self.current {
            Some(current) => {
                current.received += bytes.len();
                let babble = current.received > MAX_RECEIVED;
                let step = self.examine(now);
                if babble && step == Step::More {
                    self.judge(self.received.len());
                    self.current = None;
                    return Step::Done(Err(Failure::Damaged("more bytes than a frame has")));
                }
                step
            }
            None => {
                self.judge_strays();
                Step::More
            }
        }
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Step::More;
        }
        if !self.received.is_empty() {
            return self.handle_pause(now);
        }
        self.fail()
    }

    fn deadline(&self) -> Option<Instant> {
        let current = self.current.as_ref();
        match self.last_byte {
            Some(last) if !self.received.is_empty() => {
                let silence = current.is_some_and(|current| current.ends_with_silence);
                let pause = last + if silence { self.t3_5 } else { self.chunk_gap };
                let limit = current.and_then(|current| current.answer_by).map(|by| by + self.longest);
                Some(limit.map_or(pause, |limit| limit.min(pause)))
            }
            _ => current?.answer_by,
        }
    }

    fn abandon(&mut self) {
        self.current = None;
        // A late answer of another slave may have come meanwhile, which needs its pause from then on.
        self.judge_strays();
    }

    fn reset(&mut self) {
        self.current = None;
        self.received.clear();
        self.early = 0;
        // The port may be another adapter now; one that was seen to echo is trusted to do it again, which is the safe
        // side.
        if self.echo == EchoState::Absent {
            self.echo = self.configured.into();
        }
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        std::mem::take(&mut self.strays)
    }

    fn taken(&self) -> Option<Frame> {
        self.taken
    }

    fn echo_is_unknown(&self) -> bool {
        self.echo == EchoState::Unknown
    }

    fn echoes(&self) -> bool {
        self.echo == EchoState::Present
    }
}
