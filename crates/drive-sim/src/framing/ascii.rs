//! Modbus ASCII from the slaves' side: `:`, hexadecimal pairs, LRC, CR, and a last character that each slave can be told
//! to change (MODBUS over Serial Line V1.02 p. 16–18; VVDED397054 p. 19, 23).

use std::time::Duration;

use tokio::time::Instant;

use super::Framing;
use crate::{model::Damage, slave::LINE_FEED, speech::Speech, state::State};

const BEGIN: u8 = b':';
const CARRIAGE_RETURN: u8 = b'\r';
/// The longest frame between `:` and CR: 255 bytes in pairs (MODBUS over Serial Line V1.02 p. 17).
const LONGEST: usize = 510;
/// The longest pause between two characters of a frame (p. 17).
const PAUSE: Duration = Duration::from_secs(1);

/// The receiver of all slaves of a line.
#[derive(Debug)]
pub(crate) struct Ascii {
    stage: Stage,
    digits: Vec<u8>,
    /// The last character of the frame that is being answered: an answer ends as its request did, also the one to the
    /// request that changes this character.
    delimiter: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Idle,
    Reception,
    /// CR has come.
    End,
}

impl Default for Ascii {
    fn default() -> Self {
        Self { stage: Stage::Idle, digits: Vec::new(), delimiter: LINE_FEED }
    }
}

impl Framing for Ascii {
    fn is_between_frames(&self) -> bool {
        self.stage == Stage::Idle
    }

    fn keeps_silences(&self) -> bool {
        false
    }

    fn frame_timeout(&self, _: Duration) -> Duration {
        PAUSE
    }

    fn byte(&mut self, byte: u8, at: Instant, line: &mut State, speech: &mut Vec<Speech>) {
        match (self.stage, byte) {
            (_, BEGIN) => {
                // A frame that another one cuts short was damaged.
                if self.stage != Stage::Idle {
                    line.bad_frame(Damage::Check);
                }
                self.stage = Stage::Reception;
                self.digits.clear();
            }
            (Stage::Reception, CARRIAGE_RETURN) => self.stage = Stage::End,
            (Stage::Reception, _) if self.digits.len() < LONGEST => self.digits.push(byte),
            (Stage::Reception, _) => self.silence(line, speech),
            (Stage::End, _) => {
                self.stage = Stage::Idle;
                self.finish(byte, at, line, speech);
            }
            (Stage::Idle, _) => {}
        }
    }

    fn damaged(&mut self, _: Instant, line: &mut State) {
        if self.stage != Stage::Idle {
            self.stage = Stage::Idle;
            line.bad_frame(Damage::Check);
        }
    }

    fn awaits_more(&self) -> bool {
        true
    }

    fn silence(&mut self, line: &mut State, _: &mut Vec<Speech>) {
        self.stage = Stage::Idle;
        line.bad_frame(Damage::Check);
    }

    fn encode(&self, slave: u8, message: &[u8], _: &State) -> Vec<u8> {
        frame(slave, message, self.delimiter)
    }
}

impl Ascii {
    fn finish(&mut self, delimiter: u8, at: Instant, line: &mut State, speech: &mut Vec<Speech>) {
        let bytes = unhex(&self.digits).unwrap_or_default();
        match &bytes[..] {
            [slave, request @ .., _] if !request.is_empty() && sum(&bytes) == 0 => {
                self.delimiter = delimiter;
                speech.extend(line.request_ended_by(at, *slave, request, Some(delimiter)));
            }
            _ => line.bad_frame(Damage::Check),
        }
    }
}

/// A frame with its LRC.
pub(crate) fn frame(slave: u8, message: &[u8], delimiter: u8) -> Vec<u8> {
    let lrc = slave.wrapping_add(sum(message)).wrapping_neg();
    let mut frame = Vec::with_capacity(2 * message.len() + 7);
    frame.push(BEGIN);
    for byte in [&[slave], message, &[lrc]].concat() {
        frame.extend(format!("{byte:02X}").bytes());
    }
    frame.extend([CARRIAGE_RETURN, delimiter]);
    frame
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

/// The bytes of upper-case hexadecimal pairs; the specification has no others.
fn unhex(digits: &[u8]) -> Option<Vec<u8>> {
    let value = |digit: u8| match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        _ => None,
    };
    let pairs = digits.chunks(2).map(|pair| match *pair {
        [high, low] => Some(value(high)? << 4 | value(low)?),
        _ => None,
    });
    pairs.collect()
}
