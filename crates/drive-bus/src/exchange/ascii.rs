//! Modbus ASCII: `:`, hexadecimal pairs, LRC, CR, LF (MODBUS over Serial Line V1.02 p. 16–18; VVDED397054 p. 23/47).
//!
//! - `:` begins a frame wherever it stands, also inside another one, which was damaged then.
//! - Digits are 0 to 9 and A to F. The specification has no lower-case ones: a frame with them is damaged, as one with
//!   any other character is.
//! - Characters may follow each other after up to a second ([`AsciiSettings::character_gap`]); after more the frame has
//!   broken off.
//! - After CR whatever comes ends the frame, unless it is a `:`. Which character a slave ends its answers with is its own
//!   affair, the LRC tells whether they are whole; which one **it** waits for is ours to know: function 08/03 changes it
//!   in one slave, and each slave is asked with its own. A slave that has forgotten it (power cycle, restart) hears
//!   nothing any more, so that from the second unanswered request on the line tries the former one in turn.
//! - The LRC is a sum of eight bits. Two damaged digits can cancel each other out in it; a format with parity finds them.

mod delimiter;
mod frame;

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::{Class, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::Request;

pub(crate) use frame::{BEGIN, Heard, Receiver};
pub use frame::{frame, len};

use self::{
    delimiter::{Delimiters, new_delimiter},
    frame::{LINE_FEED, MAX_FRAME},
};
use super::{
    DIFFER, Failure, Frame, Machine, Step, Stray,
    echo::{Echo, EchoState, MAYBE_ECHO},
    pace::Pace,
};
use crate::answer;

/// What may come in during one exchange before it is given up, as in RTU.
const MAX_RECEIVED: usize = 4 * MAX_FRAME;

/// What a line in Modbus ASCII can be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct AsciiSettings {
    /// The longest pause between two characters of a frame (p. 17: 1 s, and 4 to 5 s over wide-area networks).
    pub character_gap: Duration,
    /// The last character of a frame, after CR, for slaves that were not told another one by function 08/03.
    pub delimiter: u8,
}

impl Default for AsciiSettings {
    /// 1 s, line feed.
    fn default() -> Self {
        Self { character_gap: Duration::from_secs(1), delimiter: LINE_FEED }
    }
}

/// How long an exchange may go on after the time of its answer is over, because something is still coming in.
#[must_use]
pub fn overtime(serial: SerialSettings, settings: AsciiSettings) -> Duration {
    serial.characters(MAX_FRAME) + settings.character_gap
}

/// The machine.
#[derive(Debug)]
pub struct Ascii {
    character_gap: Duration,
    /// How long an answer that has begun may go on after its time is over.
    longest: Duration,
    echo: EchoState,
    configured: Echo,
    delimiters: Delimiters,
    pace: Pace,
    current: Option<Current>,
    /// What opened the last exchange: slave and PDU.
    sent: (u8, Bytes),
    receiver: Receiver,
    last_character: Option<Instant>,
    strays: Vec<Stray>,
    /// The answer that came last.
    taken: Option<Frame>,
    /// What it answers, and what it says, while what came together with it is looked at.
    answered: Option<Answered>,
}

/// A question and its answer.
#[derive(Debug)]
struct Answered {
    slave: u8,
    request: Arc<Request<'static>>,
    pdu: Bytes,
}

impl Answered {
    /// Whether a frame answers the same question otherwise, so that none can be told to be the right one.
    fn is_contradicted(&self, heard: &Heard) -> bool {
        let Heard::Frame { slave, pdu } = heard else { return false };
        *slave == self.slave && *pdu != self.pdu && answer::check(&self.request, pdu.clone()).is_ok()
    }
}

#[derive(Debug)]
struct Current {
    slave: u8,
    request: Arc<Request<'static>>,
    answer_by: Option<Instant>,
    /// The echo of this request has been taken away.
    echo_taken: bool,
    /// Something came that was not understood. It may have been the echo.
    disturbed: bool,
    /// Characters received since the request.
    received: usize,
    /// An intact frame came that did not fit.
    misfit: Option<String>,
}

impl Ascii {
    /// A machine for a line with these settings.
    #[must_use]
    pub fn new(serial: SerialSettings, settings: AsciiSettings, echo: Echo) -> Self {
        // Time proves nothing until whoever has the port says so.
        let mut pace = Pace::new(serial);
        pace.set_far_end_paces(false);
        Self {
            character_gap: settings.character_gap,
            longest: overtime(serial, settings),
            echo: echo.into(),
            configured: echo,
            delimiters: Delimiters::new(settings.delimiter),
            pace,
            current: None,
            sent: (0, Bytes::new()),
            receiver: Receiver::default(),
            last_character: None,
            strays: Vec::new(),
            taken: None,
            answered: None,
        }
    }

    /// A frame whose LRC fits.
    fn heard(&mut self, now: Instant, slave: u8, pdu: Bytes) -> Step {
        let is_early = self.pace.is_early(now, len(pdu.len()));
        let stray = Stray::frame(slave, &pdu);
        let equals = slave == self.sent.0 && pdu == self.sent.1;
        let Some(current) = self.current.as_mut().filter(|current| current.slave == slave) else {
            // The echo of a request that was given up while it was sent is no late answer.
            let echo = equals && self.echo != EchoState::Absent;
            self.strays.push(if echo { Stray::Echo } else { stray });
            return Step::More;
        };
        if equals && !current.echo_taken {
            // Nobody answers a broadcast, so that what equals it is an echo.
            let sure = self.echo == EchoState::Present || slave == 0;
            if sure || !answer::equals_its_request(&current.request) {
                current.echo_taken = true;
                self.echo = EchoState::Present;
                self.strays.push(Stray::Echo);
                return Step::More;
            }
            // No answer comes so soon. One that is known to be silent may echo all the same.
            if is_early {
                current.echo_taken = true;
                if self.echo == EchoState::Unknown {
                    self.echo = EchoState::Present;
                }
                self.strays.push(Stray::Echo);
                return Step::More;
            }
            if self.echo == EchoState::Unknown {
                current.misfit = Some("an echo could not be told from it".to_owned());
                return Step::More;
            }
        }
        let frame = Frame::of(&pdu);
        if is_early {
            self.strays.push(Stray::Early { slave, frame });
            return Step::More;
        }
        match answer::check(&current.request, pdu.clone()) {
            Ok(answer) => {
                self.taken = Some(frame);
                self.answered = Some(Answered { slave, request: Arc::clone(&current.request), pdu });
                if self.echo == EchoState::Unknown && !current.disturbed {
                    self.echo = EchoState::Absent;
                }
                self.delimiters.answered(slave, &current.request, answer.is_ok());
                self.current = None;
                Step::Done(Ok(answer))
            }
            Err(why) => {
                current.misfit = Some(why);
                self.strays.push(stray);
                Step::More
            }
        }
    }

    /// Something that began as a frame and is none. Where it begins as the answer does, it is the answer, damaged;
    /// anything else may be somebody else's, with the answer still to come. What comes sooner than the line can carry an answer is an
    /// echo at the most: who asks again behind that speaks into the answer.
    fn garbled(&mut self, now: Instant, head: Option<(u8, u8)>, len: usize, why: &'static str) -> Step {
        let is_early = self.pace.is_early(now, len);
        self.strays.push(Stray::Noise(len));
        let Some(current) = &mut self.current else { return Step::More };
        current.disturbed = true;
        let resembles = head.is_some_and(|(slave, function)| {
            slave == current.slave && function & 0x7F == current.request.function_code().value()
        });
        if !resembles || crate::mutant!("damaged-echo-is-the-answer", is_early, false) {
            return Step::More;
        }
        if self.echo != EchoState::Absent && !current.echo_taken {
            // To ask again behind an echo that was damaged would leave the answer to this request for the next one.
            current.misfit.get_or_insert_with(|| MAYBE_ECHO.to_owned());
            return Step::More;
        }
        self.current = None;
        Step::Done(Err(Failure::Damaged(why)))
    }

    /// Characters outside any frame.
    fn count_noise(&mut self) {
        let noise = self.receiver.take_noise();
        if noise > 0 {
            self.strays.push(Stray::Noise(noise));
            if let Some(current) = &mut self.current {
                current.disturbed = true;
            }
        }
    }

    fn act(&mut self, now: Instant, heard: Heard) -> Step {
        match heard {
            Heard::Frame { slave, pdu } => self.heard(now, slave, pdu),
            Heard::Garbled { head, len, why } => self.garbled(now, head, len, why),
        }
    }

    /// The time for the answer is over.
    fn fail(&mut self) -> Step {
        let Some(current) = self.current.take() else { return Step::More };
        let failure = current.misfit.map_or(Failure::Timeout, Failure::Mismatch);
        if failure == Failure::Timeout {
            // An adapter that echoes would have echoed: silence is an answer to that question.
            if self.echo == EchoState::Unknown && current.received == 0 {
                self.echo = EchoState::Absent;
            }
            self.delimiters.unanswered(current.slave, &current.request);
        }
        Step::Done(Err(failure))
    }
}

impl Machine for Ascii {
    fn carries(&self, _: u8, request: &Request<'_>, _: Class) -> Result<(), String> {
        match new_delimiter(request) {
            Some(BEGIN) => Err("a frame that ends with \":\" has no end".to_owned()),
            Some(new) if !new.is_ascii() => Err(format!("{new:02X}h is not an ASCII character")),
            _ => Ok(()),
        }
    }

    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        if let Some(Heard::Garbled { len, .. }) = self.receiver.give_up() {
            self.strays.push(Stray::Noise(len));
        }
        self.pace.forget();
        self.sent = (slave, pdu.clone());
        self.current = Some(Current {
            slave,
            request,
            answer_by: None,
            echo_taken: false,
            disturbed: false,
            received: 0,
            misfit: None,
        });
        frame(slave, pdu, self.delimiters.of(slave))
    }

    fn set_far_end_paces(&mut self, paces: bool) {
        self.pace.set_far_end_paces(paces);
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        self.pace.sent(end, len(self.sent.1.len()));
        if let Some(current) = &mut self.current {
            current.answer_by = Some(answer_by);
        }
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        self.last_character = Some(now);
        let mut step = Step::More;
        self.answered = None;
        for &character in bytes {
            if let Some(heard) = self.receiver.hear(character) {
                self.count_noise();
                if self.answered.as_ref().is_some_and(|answered| answered.is_contradicted(&heard)) {
                    step = Step::Done(Err(Failure::Mismatch(DIFFER.to_owned())));
                }
                // After the answer nothing more is expected: what follows it is stray.
                let next = self.act(now, heard);
                step = if step == Step::More { next } else { step };
            }
        }
        self.count_noise();
        if let Some(current) = &mut self.current {
            current.received += bytes.len();
            if current.received > MAX_RECEIVED {
                self.current = None;
                return Step::Done(Err(Failure::Damaged("more characters than a frame has")));
            }
        }
        step
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Step::More;
        }
        if let Some(broken_off) = self.receiver.give_up() {
            let step = self.act(now, broken_off);
            if step != Step::More {
                return step;
            }
        }
        let over = self.current.as_ref().and_then(|current| current.answer_by).is_some_and(|by| now >= by);
        if over { self.fail() } else { Step::More }
    }

    fn deadline(&self) -> Option<Instant> {
        let answer_by = self.current.as_ref().and_then(|current| current.answer_by);
        match self.last_character {
            Some(last) if self.receiver.is_open() => {
                let pause = last + self.character_gap;
                Some(answer_by.map_or(pause, |by| pause.min(by + self.longest)))
            }
            _ => answer_by,
        }
    }

    fn abandon(&mut self) {
        self.current = None;
    }

    fn reset(&mut self) {
        self.current = None;
        self.receiver = Receiver::default();
        // As in RTU: one that was seen to echo is trusted to do it again.
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
