//! Frames of Modbus ASCII: what is put on the line and what is heard there.

use std::mem;

use bytes::{Bytes, BytesMut};

use crate::pdu::MAX_PDU;

/// Begins a frame, wherever it stands.
pub(crate) const BEGIN: u8 = b':';
const CARRIAGE_RETURN: u8 = b'\r';
/// Ends a frame until function 08/03 says otherwise.
pub(super) const LINE_FEED: u8 = b'\n';

/// Address and LRC around a PDU.
const OVERHEAD: usize = 2;
/// The most digits of a frame.
const MAX_DIGITS: usize = 2 * (MAX_PDU + OVERHEAD);
/// The longest frame: its digits, `:`, CR and LF (MODBUS over Serial Line V1.02 p. 17: 513 characters).
pub(super) const MAX_FRAME: usize = MAX_DIGITS + 3;

/// How many characters the frame of a PDU has.
#[must_use]
pub const fn len(pdu: usize) -> usize {
    2 * (pdu + OVERHEAD) + 3
}

/// The frame of a PDU, ended by CR and this character.
#[must_use]
pub fn frame(slave: u8, pdu: &[u8], delimiter: u8) -> Bytes {
    let mut frame = BytesMut::with_capacity(len(pdu.len()));
    frame.extend_from_slice(&[BEGIN]);
    let lrc = slave.wrapping_add(sum(pdu)).wrapping_neg();
    for byte in [slave].iter().chain(pdu).chain(&[lrc]) {
        frame.extend_from_slice(&[digit(byte >> 4), digit(byte & 0x0F)]);
    }
    frame.extend_from_slice(&[CARRIAGE_RETURN, delimiter]);
    frame.freeze()
}

/// What was heard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Heard {
    /// A frame whose LRC fits.
    Frame { slave: u8, pdu: Bytes },
    /// Something that began as a frame and is none.
    Garbled {
        /// Address and function code, where it begins with two bytes.
        head: Option<(u8, u8)>,
        /// How many characters it had.
        len: usize,
        /// What is wrong with it.
        why: &'static str,
    },
}

/// The receiver of MODBUS over Serial Line V1.02 p. 17: idle, reception, waiting for the end.
#[derive(Debug, Default)]
pub(crate) struct Receiver {
    stage: Stage,
    digits: Vec<u8>,
    /// Characters between frames since somebody asked.
    noise: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    #[default]
    Idle,
    Reception,
    /// CR has come: one more character.
    End,
}

impl Receiver {
    /// Takes one character; what it completes.
    pub(crate) fn hear(&mut self, character: u8) -> Option<Heard> {
        match (self.stage, character) {
            (_, BEGIN) => {
                let cut_short = self.give_up();
                self.stage = Stage::Reception;
                cut_short
            }
            (Stage::Idle, _) => {
                self.noise += 1;
                None
            }
            (Stage::Reception, CARRIAGE_RETURN) => {
                self.stage = Stage::End;
                None
            }
            (Stage::Reception, _) if self.digits.len() < MAX_DIGITS => {
                self.digits.push(character);
                None
            }
            (Stage::Reception, _) => self.garbled("longer than a frame"),
            (Stage::End, _) => {
                let Some(bytes) = unhex(&self.digits) else { return self.garbled("not hexadecimal") };
                match *bytes {
                    [slave, ref pdu @ .., _] if !pdu.is_empty() => {
                        if crate::mutant!("lrc-unchecked", sum(&bytes) != 0, false) {
                            return self.garbled("LRC");
                        }
                        let pdu = Bytes::copy_from_slice(pdu);
                        self.begin_anew();
                        Some(Heard::Frame { slave, pdu })
                    }
                    _ => self.garbled("shorter than a frame"),
                }
            }
        }
    }

    /// Whether a frame has begun.
    pub(crate) fn is_open(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// The frame that has begun goes on no more.
    pub(crate) fn give_up(&mut self) -> Option<Heard> {
        if self.is_open() { self.garbled("it breaks off") } else { None }
    }

    /// How many characters came between frames since the last call.
    pub(crate) fn take_noise(&mut self) -> usize {
        mem::take(&mut self.noise)
    }

    fn garbled(&mut self, why: &'static str) -> Option<Heard> {
        let head = self.digits.get(..4).and_then(unhex);
        let head = head.and_then(|bytes| bytes.first().copied().zip(bytes.get(1).copied()));
        let end = usize::from(self.stage == Stage::End);
        let len = 1 + self.digits.len() + end;
        self.begin_anew();
        Some(Heard::Garbled { head, len, why })
    }

    fn begin_anew(&mut self) {
        self.stage = Stage::Idle;
        self.digits.clear();
    }
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

const fn digit(value: u8) -> u8 {
    match value {
        0..=9 => b'0' + value,
        _ => b'A' + value - 10,
    }
}

/// The bytes of hexadecimal pairs. The specification has the characters 0 to 9 and A to F and no others (p. 16).
fn unhex(digits: &[u8]) -> Option<Vec<u8>> {
    let value = |digit: u8| match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        _ => None,
    };
    let (pairs, rest) = digits.as_chunks::<2>();
    if !rest.is_empty() {
        return None;
    }
    pairs.iter().map(|&[high, low]| Some(value(high)? << 4 | value(low)?)).collect()
}
