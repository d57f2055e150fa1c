//! What was received: the answer, our own echo, and everything else.

use bytes::Bytes;
use tokio::time::Instant;

use super::{
    Current, Rtu,
    frame::{OVERHEAD, crc_fits, is_frame, shortest_frame},
};
use crate::{
    answer::{self, Extent},
    exchange::{
        Failure, Step, Stray,
        echo::{EchoState, MAYBE_ECHO},
    },
};

/// What stands at one place of what was received.
enum Found {
    /// The expected frame, this long.
    Frame(usize),
    /// It may still become the expected frame.
    Beginning,
    Nothing,
}

impl Rtu {
    /// Looks at what was received, after more of it came.
    pub(super) fn examine(&mut self) -> Step {
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
            self.judge(offset);
            if let Some(step) = self.accept(len) {
                return step;
            }
        }
    }

    /// What was received begins with a frame of this length that has the form of the answer.
    fn accept(&mut self, len: usize) -> Option<Step> {
        let current = self.current.as_mut()?;
        // An echo would have come first. Where something came first and was not understood, that may have been it.
        let came_first = current.received == self.received.len();
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
                if self.echo == EchoState::Unknown && came_first && !equals {
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
    pub(super) fn judge(&mut self, len: usize) -> bool {
        if len == 0 {
            return false;
        }
        let dropped: Vec<u8> = self.received.drain(..len.min(self.received.len())).collect();
        let mut rest = dropped.as_slice();
        let mut garbled = 0;
        while let [slave, function, ..] = *rest {
            match shortest_frame(rest) {
                // The echo of a request that was given up while it was sent is no late answer.
                Some(len) if self.echo != EchoState::Absent && rest.get(..len) == Some(&self.sent) => {
                    self.strays.push(Stray::Echo);
                    rest = rest.get(len..).unwrap_or_default();
                }
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
    pub(super) fn handle_pause(&mut self, now: Instant) -> Step {
        if let Some(current) = self.current.as_ref().filter(|current| current.ends_with_silence) {
            let whole = (0..self.received.len()).find(|&offset| {
                self.received
                    .get(offset..)
                    .is_some_and(|tail| tail.first() == Some(&current.slave) && is_frame(tail))
            });
            if let Some(offset) = whole {
                self.judge(offset);
                if let Some(step) = self.accept(self.received.len()) {
                    return step;
                }
            }
        }
        let resembled = self.current.as_ref().is_some_and(|current| current.resembles(&self.received));
        let garbled = self.judge(self.received.len());
        let Some(current) = &mut self.current else { return Step::More };
        if garbled && resembled {
            if self.echo == EchoState::Absent || current.echo_taken {
                self.current = None;
                return Step::Done(Err(Failure::Damaged("CRC")));
            }
            // To ask again behind an echo that was damaged would leave the answer to this request for the next one.
            current.misfit.get_or_insert_with(|| MAYBE_ECHO.to_owned());
        }
        if current.answer_by.is_some_and(|by| now >= by) { self.fail() } else { Step::More }
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
