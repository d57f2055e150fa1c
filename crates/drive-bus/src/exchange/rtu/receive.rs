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
        DIFFER, Failure, Frame, Step, Stray,
        echo::{Echo, EchoState, MAYBE_ECHO},
    },
    shape::Shape,
};

/// How many bits of an echo may change before it is no echo any more: a damaged byte. Two frames that have nothing to do with
/// each other differ in half of their bits.
const FEW_BITS: u32 = 8;

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
    pub(super) fn examine(&mut self, now: Instant) -> Step {
        loop {
            if self.take_echo(now) {
                continue;
            }
            let Some(current) = &mut self.current else { return Step::More };
            current.ends_with_silence = false;
            let found = (self.early..self.received.len()).find_map(|offset| {
                match look(current, self.received.get(offset..).unwrap_or_default()) {
                    Found::Frame(len) => Some((offset, len)),
                    Found::Beginning | Found::Nothing => None,
                }
            });
            let Some((offset, len)) = found else { return Step::More };
            self.judge(offset);
            if let Some(step) = self.accept(now, len) {
                return step;
            }
        }
    }

    /// What was received begins with a frame of this length that has the form of the answer.
    fn accept(&mut self, now: Instant, len: usize) -> Option<Step> {
        let is_early = crate::mutant!("early-answer-believed", self.pace.is_early(now, len), false);
        let current = self.current.as_mut()?;
        // An echo would have come first. Where something came first and was not understood, that may have been it.
        let came_first = current.received == self.received.len();
        let equals = self.received.get(..len)? == self.sent;
        let pdu = Bytes::copy_from_slice(self.received.get(1..len.saturating_sub(2))?);
        self.drop_first(len);
        let current = self.current.as_mut()?;
        if equals && !current.echo_taken && (is_early || self.echo == EchoState::Present) {
            current.echo_taken = true;
            self.strays.push(Stray::Echo);
            return None;
        }
        if is_early {
            self.strays.push(Stray::Early { slave: current.slave, frame: Frame::of(&pdu) });
            return None;
        }
        if equals && self.echo == EchoState::Unknown && current.slave != 0 {
            current.misfit = Some("an echo could not be told from it".to_owned());
            return None;
        }
        match answer::check(&current.request, pdu.clone()) {
            Ok(answer) => {
                self.taken = Some(Frame::of(&pdu));
                if crate::mutant!("two-answers-believed", self.another_follows(&pdu), false) {
                    self.judge(self.received.len());
                    self.current = None;
                    return Some(Step::Done(Err(Failure::Mismatch(DIFFER.to_owned()))));
                }
                if came_first && !equals && self.may_be_silent() {
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

    /// Whether an answer without an echo before it tells that the adapter does not echo. One that has echoed once may do it
    /// again; where time tells an echo from an answer that does no harm.
    fn may_be_silent(&self) -> bool {
        self.echo == EchoState::Unknown || self.pace.proves() && self.configured != Echo::On
    }

    /// Whether an answer that says something else came together with this one, so that none can be told to be the right one.
    fn another_follows(&mut self, pdu: &[u8]) -> bool {
        let Some(current) = &mut self.current else { return false };
        (0..self.received.len()).any(|offset| {
            let rest = self.received.get(offset..).unwrap_or_default();
            matches!(look(current, rest), Found::Frame(len) if rest.get(1..len - 2) != Some(pdu))
        })
    }

    /// Forgets the first `len` bytes of what was received.
    fn drop_first(&mut self, len: usize) -> Vec<u8> {
        let len = len.min(self.received.len());
        self.early = self.early.saturating_sub(len);
        self.received.drain(..len).collect()
    }

    /// Takes our own request away where it stands at the beginning of what was received. True: look again.
    fn take_echo(&mut self, now: Instant) -> bool {
        // An adapter that is known to be silent may echo all the same, but in its time: later it is another master that
        // asks for the same.
        let in_time =
            !self.pace.proves() || self.echo != EchoState::Absent || self.pace.is_early(now, self.sent.len());
        let Some(current) = &mut self.current else { return false };
        if current.echo_taken || !in_time || !self.received.starts_with(&self.sent) {
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
        self.drop_first(self.sent.len());
        self.strays.push(Stray::Echo);
        true
    }

    /// Drops the first `len` bytes of what was received and says what they were. True: some were garbled.
    pub(super) fn judge(&mut self, len: usize) -> bool {
        if len == 0 {
            return false;
        }
        let early = self.early;
        let dropped = self.drop_first(len);
        let mut rest = dropped.as_slice();
        let mut garbled = 0;
        while let [slave, _, ..] = *rest {
            match shortest_frame(rest) {
                // The echo of a request that was given up while it was sent is no late answer.
                Some(len) if self.echo != EchoState::Absent && rest.get(..len) == Some(&self.sent) => {
                    self.strays.push(Stray::Echo);
                    rest = rest.get(len..).unwrap_or_default();
                }
                Some(len) => {
                    let pdu = rest.get(1..len - 2).unwrap_or_default();
                    let is_early = dropped.len() - rest.len() < early;
                    match self.current.as_mut().filter(|current| current.slave == slave) {
                        Some(_) if is_early && !Shape::is_request(pdu) => {
                            self.strays.push(Stray::Early { slave, frame: Frame::of(pdu) });
                        }
                        ours => {
                            if let Some(current) = ours {
                                current
                                    .misfit
                                    .get_or_insert_with(|| "an answer to another request".to_owned());
                            }
                            self.strays.push(Stray::frame(slave, pdu));
                        }
                    }
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
                if let Some(step) = self.accept(now, self.received.len()) {
                    return step;
                }
            }
        }
        let answer = self.received.get(self.early..).unwrap_or_default();
        let is_early = self.last_byte.is_some_and(|last| self.pace.is_early(last, answer.len()));
        let resembled = !is_early && self.current.as_ref().is_some_and(|current| current.resembles(answer));
        // An answer that equals its request looks like its echo, damaged, where time does not tell them apart.
        let may_be_echo = self.current.as_ref().is_some_and(|current| {
            let told_by_time = self.pace.proves() && answer::equals_its_request(&current.request);
            !current.echo_taken
                && (self.echo != EchoState::Absent && resembled
                    || is_like(&self.sent, &self.received) && !(told_by_time && resembled))
        });
        let garbled = self.judge(self.received.len());
        let Some(current) = &mut self.current else { return Step::More };
        if garbled && may_be_echo {
            // To ask again behind an echo that was damaged would leave the answer to this request for the next one.
            current.misfit.get_or_insert_with(|| MAYBE_ECHO.to_owned());
        } else if garbled && resembled {
            self.current = None;
            return Step::Done(Err(Failure::Damaged("CRC")));
        }
        if current.answer_by.is_some_and(|by| now >= by) { self.fail() } else { Step::More }
    }
}

impl Current {
    /// Whether these bytes are this exchange's answer, damaged: they begin as it does. Anything else may be somebody
    /// else's damaged frame, with the answer still to come; to ask again then would leave one answer too many.
    fn resembles(&self, bytes: &[u8]) -> bool {
        let Some((&slave, pdu)) = bytes.split_first() else { return false };
        slave == self.slave && pdu.len() > 1 && !matches!(answer::extent(&self.request, pdu), Extent::Never)
    }
}

/// Whether `bytes` are what was sent with a few bits changed, or a part of it.
fn is_like(sent: &[u8], bytes: &[u8]) -> bool {
    let differ: u32 = sent.iter().zip(bytes).map(|(sent, got)| (sent ^ got).count_ones()).sum();
    bytes.len() <= sent.len() && differ <= FEW_BITS
}

/// What stands at the beginning of `bytes`.
fn look(current: &mut Current, bytes: &[u8]) -> Found {
    let Some((&slave, pdu)) = bytes.split_first() else { return Found::Nothing };
    if crate::mutant!("another-slaves-answer", slave != current.slave, false) {
        return Found::Nothing;
    }
    let whole = |len: usize| {
        let frame = bytes.get(..len + OVERHEAD)?;
        Some(crate::mutant!("crc-unchecked", crc_fits(frame), true))
    };
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
