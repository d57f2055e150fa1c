//! Modbus RTU: address, PDU, CRC.
//!
//! An answer is delimited by the length that its first bytes tell and by its CRC. Time only resynchronises: after a
//! pause longer than the adapter makes inside a frame, what is there is judged and dropped. A strict limit of 1.5
//! characters inside a frame would reject good frames behind USB adapters, which deliver in chunks.

use std::{sync::Arc, time::Duration};

use bytes::{BufMut, Bytes, BytesMut};
use crc::{CRC_16_MODBUS, Crc, Table};
use drive_core::serial::SerialSettings;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Exchange, Failure, Step, Stray, echo::EchoState};
use crate::{
    answer::{self, Extent},
    config::Echo,
    pdu::MAX_PDU,
};

static CRC: Crc<u16, Table<16>> = Crc::<u16, Table<16>>::new(&CRC_16_MODBUS);

/// Address and CRC around a PDU.
const OVERHEAD: usize = 3;

/// The longest frame.
const MAX_FRAME: usize = MAX_PDU + OVERHEAD;

/// What may come in during one exchange before it is given up: somebody who never stops talking.
const MAX_RECEIVED: usize = 4 * MAX_FRAME;

/// The frame of a PDU.
#[must_use]
pub fn frame(slave: u8, pdu: &[u8]) -> Bytes {
    let mut frame = BytesMut::with_capacity(pdu.len() + OVERHEAD);
    frame.put_u8(slave);
    frame.put_slice(pdu);
    let crc = CRC.checksum(&frame);
    frame.put_u16_le(crc);
    frame.freeze()
}

/// Whether these bytes are a whole frame with its CRC.
#[must_use]
pub fn is_frame(bytes: &[u8]) -> bool {
    bytes.len() > OVERHEAD && bytes.len() <= MAX_FRAME && crc_fits(bytes)
}

fn crc_fits(bytes: &[u8]) -> bool {
    bytes
        .split_last_chunk::<2>()
        .is_some_and(|(content, crc)| CRC.checksum(content) == u16::from_le_bytes(*crc))
}

/// How long the shortest frame is that these bytes begin with.
fn shortest_frame(bytes: &[u8]) -> Option<usize> {
    let mut digest = CRC.digest();
    for (index, byte) in bytes.iter().take(MAX_FRAME).enumerate() {
        digest.update(&[*byte]);
        // The CRC of a frame with its own CRC behind it is 0.
        if index >= OVERHEAD && digest.clone().finalize() == 0 {
            return Some(index + 1);
        }
    }
    None
}

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
    echo: EchoState,
    configured: Echo,
    current: Option<Current>,
    /// What opened the exchange.
    sent: Vec<u8>,
    /// What has come and is not yet part of anything.
    received: Vec<u8>,
    last_byte: Option<Instant>,
    strays: Vec<Stray>,
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

/// What stands at one place of what was received.
enum Found {
    /// The expected frame, this long.
    Frame(usize),
    /// It may still become the expected frame.
    Beginning,
    Nothing,
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
            echo: echo.into(),
            configured: echo,
            current: None,
            sent: Vec::with_capacity(MAX_FRAME),
            received: Vec::with_capacity(MAX_FRAME),
            last_byte: None,
            strays: Vec::new(),
        }
    }

    /// Looks at what was received, after more of it came.
    fn examine(&mut self) -> Step {
        loop {
            if self.take_echo() {
                continue;
            }
            let Some(current) = &mut self.current else { return Step::More };
            current.ends_with_silence = false;
            let found = (0..self.received.len()).find_map(|offset| {
                match look(current, self.received.get(offset..).unwrap_or_default()) {
                    Found::Frame(len) => Some((offset, len)),
                    Found::Beginning | Found::Nothing => None,
                }
            });
            let Some((offset, len)) = found else { return Step::More };
            let from_the_start = offset == 0;
            self.judge(offset);
            if let Some(step) = self.accept(len, from_the_start) {
                return step;
            }
        }
    }

    /// What was received begins with a frame of this length that has the form of the answer.
    fn accept(&mut self, len: usize, from_the_start: bool) -> Option<Step> {
        let current = self.current.as_mut()?;
        let frame = self.received.get(..len)?;
        let equals = *frame == self.sent;
        let pdu = Bytes::copy_from_slice(frame.get(1..len.saturating_sub(2))?);
        self.received.drain(..len);
        if equals && self.echo == EchoState::Present && !current.echo_taken {
            current.echo_taken = true;
            self.strays.push(Stray::Echo);
            return None;
        }
        if equals && self.echo == EchoState::Unknown && current.slave != 0 {
            current.misfit = Some("an echo could not be told from it".to_owned());
            return None;
        }
        match answer::check(&current.request, pdu) {
            Ok(answer) => {
                if self.echo == EchoState::Unknown && from_the_start && !equals {
                    self.echo = EchoState::Absent;
                }
                self.judge(self.received.len());
                self.current = None;
                Some(Step::Done(Ok(answer)))
            }
            Err(why) => {
                current.misfit = Some(why);
                None
            }
        }
    }

    /// Takes our own request away where it stands at the beginning of what was received. True: look again.
    fn take_echo(&mut self) -> bool {
        let Some(current) = &mut self.current else { return false };
        if current.echo_taken || !self.received.starts_with(&self.sent) {
            return false;
        }
        // Of a request that its answer may equal, only an adapter that is known to echo gives an echo. Nobody answers a
        // broadcast, so that what equals it is one.
        let sure = self.echo == EchoState::Present || current.slave == 0;
        let may_be_answer = answer::equals_its_request(&current.request)
            || matches!(look(current, &self.received), Found::Frame(_));
        if !sure && may_be_answer {
            return false;
        }
        current.echo_taken = true;
        self.echo = EchoState::Present;
        self.received.drain(..self.sent.len());
        self.strays.push(Stray::Echo);
        true
    }

    /// Drops the first `len` bytes of what was received and says what they were. True: some were garbled.
    fn judge(&mut self, len: usize) -> bool {
        if len == 0 {
            return false;
        }
        let dropped: Vec<u8> = self.received.drain(..len.min(self.received.len())).collect();
        let mut rest = dropped.as_slice();
        let mut garbled = 0;
        while let [slave, function, ..] = *rest {
            match shortest_frame(rest) {
                Some(len) => {
                    let ours = self.current.as_mut().filter(|current| current.slave == slave);
                    if let Some(current) = ours {
                        current.misfit.get_or_insert_with(|| "an answer to another request".to_owned());
                    }
                    self.strays.push(Stray::Frame { slave, function });
                    rest = rest.get(len..).unwrap_or_default();
                }
                None => {
                    garbled += 1;
                    rest = rest.get(1..).unwrap_or_default();
                }
            }
        }
        garbled += rest.len();
        if garbled > 0 {
            self.strays.push(Stray::Noise(garbled));
        }
        garbled > 0
    }

    /// A pause inside what was received: it is as whole as it will be.
    fn handle_pause(&mut self, now: Instant) -> Step {
        if let Some(current) = self.current.as_ref().filter(|current| current.ends_with_silence) {
            let whole = (0..self.received.len()).find(|&offset| {
                self.received
                    .get(offset..)
                    .is_some_and(|tail| tail.first() == Some(&current.slave) && is_frame(tail))
            });
            if let Some(offset) = whole {
                self.judge(offset);
                if let Some(step) = self.accept(self.received.len(), offset == 0) {
                    return step;
                }
            }
        }
        let resembled = self.current.as_ref().is_some_and(|current| current.resembles(&self.received));
        let garbled = self.judge(self.received.len());
        let Some(current) = &self.current else { return Step::More };
        if garbled && resembled {
            self.current = None;
            return Step::Done(Err(Failure::Damaged("CRC")));
        }
        if current.answer_by.is_some_and(|by| now >= by) { self.fail() } else { Step::More }
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

impl Current {
    /// Whether these bytes are this exchange's answer, damaged: they begin as it does. Anything else may be somebody
    /// else's damaged frame, with the answer still to come; to ask again then would leave one answer too many.
    fn resembles(&self, bytes: &[u8]) -> bool {
        matches!(*bytes, [slave, function, ..]
            if slave == self.slave && function & 0x7F == self.request.function_code().value())
    }
}

/// What stands at the beginning of `bytes`.
fn look(current: &mut Current, bytes: &[u8]) -> Found {
    let Some((&slave, pdu)) = bytes.split_first() else { return Found::Nothing };
    if slave != current.slave {
        return Found::Nothing;
    }
    let whole = |len: usize| bytes.get(..len + OVERHEAD).map(crc_fits);
    match answer::extent(&current.request, pdu) {
        Extent::AtLeast(_) => Found::Beginning,
        Extent::Exactly(len) => match whole(len) {
            Some(true) => Found::Frame(len + OVERHEAD),
            Some(false) => Found::Nothing,
            None => Found::Beginning,
        },
        Extent::Either(short, long) => match (whole(short), whole(long)) {
            (Some(true), _) => Found::Frame(short + OVERHEAD),
            (_, Some(true)) => Found::Frame(long + OVERHEAD),
            (_, Some(false)) => Found::Nothing,
            _ => Found::Beginning,
        },
        Extent::From(_) => {
            current.ends_with_silence |= is_frame(bytes);
            Found::Beginning
        }
        Extent::Never => Found::Nothing,
    }
}

impl Exchange for Rtu {
    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        self.judge(self.received.len());
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

    fn handle_sent(&mut self, _: Instant, answer_by: Instant) {
        if let Some(current) = &mut self.current {
            current.answer_by = Some(answer_by);
        }
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.last_byte = Some(now);
        self.received.extend_from_slice(bytes);
        match &mut self.current {
            Some(current) => {
                current.received += bytes.len();
                let babble = current.received > MAX_RECEIVED;
                let step = self.examine();
                if babble && step == Step::More {
                    self.judge(self.received.len());
                    self.current = None;
                    return Step::Done(Err(Failure::Damaged("more bytes than a frame has")));
                }
                step
            }
            None => {
                if self.received.len() > MAX_FRAME {
                    self.judge(self.received.len());
                }
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
    }

    fn reset(&mut self) {
        self.current = None;
        self.received.clear();
        // The port may be another adapter now; one that was seen to echo is trusted to do it again, which is the safe
        // side.
        if self.echo == EchoState::Absent {
            self.echo = self.configured.into();
        }
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        std::mem::take(&mut self.strays)
    }

    fn confuses_late_answers(&self) -> bool {
        true
    }

    fn echo_is_unknown(&self) -> bool {
        self.echo == EchoState::Unknown
    }

    fn echoes(&self) -> bool {
        self.echo == EchoState::Present
    }
}
