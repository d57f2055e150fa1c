//! Modbus RTU. A frame has the length that its function gives a request or an answer, and a CRC that fits; a function
//! without a known length ends with a silence, or where a frame of a known one begins.

use std::time::Duration;

use super::{Found, Noise, Split, frame};
use crate::{
    answer::{Extent, extent_of_request, extent_unasked},
    capture::Dissector,
    content::{Content, NoFrame},
    exchange::rtu::{MAX_FRAME, OVERHEAD, is_frame},
    listen::timed::Timed,
    pdu::MAX_PDU,
};

/// The last address that a slave can have.
const LAST: u8 = 247;
const CRC: NoFrame = NoFrame("no frame of Modbus RTU: length or CRC do not fit");

#[derive(Debug)]
pub(super) struct Rtu {
    t3_5: Duration,
    chunk_gap: Duration,
    received: Timed,
    noise: Noise,
    /// What is there goes on no more.
    is_over: bool,
}

/// What stands at the beginning of some bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    Frame(usize),
    /// It may become a frame.
    Beginning,
    /// It may become one of a function without a known length.
    Open,
    Nothing,
}

impl Rtu {
    pub(super) fn new(t3_5: Duration, chunk_gap: Duration) -> Self {
        Self { t3_5, chunk_gap, received: Timed::default(), noise: Noise::default(), is_over: false }
    }

    /// Takes a frame of so many bytes, behind whatever made none before it.
    fn take_frame(&mut self, len: usize) -> Option<Found> {
        if let Some(noise) = self.noise.take() {
            return Some(noise);
        }
        let content = Content::of(Dissector::Rtu, self.received.bytes().get(..len)?).ok()?;
        frame(&mut self.received, len, content)
    }

    fn drop_one(&mut self) -> Option<Found> {
        let dropped = self.received.take(1);
        self.noise.add(dropped, CRC);
        (self.noise.len() >= MAX_FRAME).then(|| self.noise.take()).flatten()
    }

    /// Where a frame of a known length stands behind what has no known length.
    fn next_known(&self) -> Option<usize> {
        let bytes = self.received.bytes();
        (1..bytes.len()).find(|&offset| matches!(look(tail(bytes, offset)), Look::Frame(_)))
    }
}

impl Split for Rtu {
    fn push(&mut self, now: Duration, bytes: &[u8]) {
        self.received.push(now, bytes);
        self.is_over = false;
    }

    fn next(&mut self) -> Option<Found> {
        loop {
            let bytes = self.received.bytes();
            if bytes.is_empty() {
                return if self.is_over { self.noise.take() } else { None };
            }
            let whole = bytes.len();
            let found = match look(bytes) {
                Look::Frame(len) => return self.take_frame(len),
                // What a vendor has lengthened, or a request whose counts are wrong.
                look if (self.is_over || look == Look::Nothing) && may_be_frame(bytes) => {
                    return self.take_frame(whole);
                }
                Look::Nothing => self.drop_one(),
                Look::Beginning | Look::Open if self.is_over => self.drop_one(),
                Look::Beginning => return None,
                Look::Open => match self.next_known() {
                    Some(offset) if is_frame(bytes.get(..offset).unwrap_or_default()) => {
                        return self.take_frame(offset);
                    }
                    Some(_) => self.drop_one(),
                    None if whole > MAX_FRAME => self.drop_one(),
                    None => return None,
                },
            };
            if found.is_some() {
                return found;
            }
        }
    }

    fn deadline(&self) -> Option<Duration> {
        if self.is_over || self.received.is_empty() && self.noise.len() == 0 {
            return None;
        }
        // A frame without a known length that is whole as it stands needs no longer pause than the line's own.
        let bytes = self.received.bytes();
        let is_whole = look(bytes) == Look::Open && may_be_frame(bytes);
        let last = self.received.last().or(self.noise.last());
        last.map(|last| last + if is_whole { self.t3_5 } else { self.chunk_gap })
    }

    fn give_up(&mut self) {
        self.is_over = true;
    }
}

fn tail(bytes: &[u8], from: usize) -> &[u8] {
    bytes.get(from..).unwrap_or_default()
}

/// Whether a frame of any function can have these bytes.
fn may_be_frame(bytes: &[u8]) -> bool {
    matches!(bytes, [slave, function, ..] if *slave <= LAST && *function > 0) && is_frame(bytes)
}

fn look(bytes: &[u8]) -> Look {
    let (slave, pdu) = match bytes {
        [] => return Look::Beginning,
        [slave, pdu @ ..] => (*slave, pdu),
    };
    if slave > LAST {
        return Look::Nothing;
    }
    let mut least = Look::Nothing;
    for extent in [extent_of_request(pdu), extent_unasked(pdu)] {
        let lengths = match extent {
            Extent::Exactly(len) => [len, len],
            Extent::Either(short, long) => [short, long],
            Extent::AtLeast(len) if len <= MAX_PDU => {
                least = Look::Beginning;
                continue;
            }
            Extent::From(_) if least == Look::Nothing => {
                least = Look::Open;
                continue;
            }
            Extent::AtLeast(_) | Extent::From(_) | Extent::Never => continue,
        };
        for len in lengths.map(|len| len + OVERHEAD) {
            match bytes.get(..len) {
                Some(whole) if is_frame(whole) => return Look::Frame(len),
                Some(_) => {}
                None => least = Look::Beginning,
            }
        }
    }
    least
}
