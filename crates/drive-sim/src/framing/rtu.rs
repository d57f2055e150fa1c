//! Modbus RTU from the slaves' side: frames are cut by expected length and CRC, and by silence where the length of a
//! function is not known.

use std::time::Duration;

use crc::{CRC_16_MODBUS, Crc};
use tokio::time::Instant;

use super::Framing;
use crate::{model::Damage, speech::Speech, state::State};

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
/// The longest frame (MODBUS over Serial Line V1.02 p. 13).
const LONGEST: usize = 256;
/// Address, function, CRC.
const SHORTEST: usize = 4;

/// The receiver of all slaves of a line.
#[derive(Debug, Default)]
pub(crate) struct Rtu {
    frame: Vec<u8>,
    too_long: bool,
    damaged: bool,
    last: Option<Instant>,
}

impl Framing for Rtu {
    fn is_between_frames(&self) -> bool {
        self.frame.is_empty()
    }

    fn keeps_silences(&self) -> bool {
        true
    }

    fn frame_timeout(&self, t3_5: Duration) -> Duration {
        t3_5
    }

    fn byte(&mut self, byte: u8, at: Instant, line: &mut State, speech: &mut Vec<Speech>) {
        self.last = Some(at);
        if self.frame.len() == LONGEST {
            self.too_long = true;
            return;
        }
        self.frame.push(byte);
        let is_whole = expected_length(&self.frame) == Some(self.frame.len()) && is_intact(&self.frame);
        if is_whole && !self.damaged {
            self.finish(line, speech);
        }
    }

    fn damaged(&mut self, at: Instant, _: &mut State) {
        self.last = Some(at);
        self.damaged = true;
        if self.frame.len() < LONGEST {
            self.frame.push(0);
        }
    }

    fn awaits_more(&self) -> bool {
        match expected_length(&self.frame) {
            Some(length) => self.frame.len() < length,
            None => self.frame.len() < SHORTEST,
        }
    }

    fn silence(&mut self, line: &mut State, speech: &mut Vec<Speech>) {
        if !self.frame.is_empty() {
            self.finish(line, speech);
        }
    }

    fn encode(&self, slave: u8, pdu: &[u8], _: &State) -> Vec<u8> {
        frame(slave, pdu)
    }
}

impl Rtu {
    /// Carries out what was received, at the moment of its last bit.
    fn finish(&mut self, line: &mut State, speech: &mut Vec<Speech>) {
        let received = std::mem::take(&mut self.frame);
        let too_long = std::mem::take(&mut self.too_long);
        let damaged = std::mem::take(&mut self.damaged);
        match (self.last, &received[..]) {
            (Some(at), [slave, request @ .., _, _]) if !too_long && !damaged && is_intact(&received) => {
                speech.extend(line.request(at, *slave, request));
            }
            _ if too_long || received.len() < SHORTEST => line.bad_frame(Damage::Length),
            _ => line.bad_frame(Damage::Check),
        }
        // The room of the last frame serves the next.
        self.frame = received;
        self.frame.clear();
    }
}

/// An address and a PDU with their CRC, low byte first.
pub(crate) fn frame(slave: u8, pdu: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(pdu.len() + 3);
    frame.push(slave);
    frame.extend(pdu);
    frame.extend(CRC.checksum(&frame).to_le_bytes());
    frame
}

fn is_intact(frame: &[u8]) -> bool {
    match frame {
        [body @ .., low, high] if frame.len() >= SHORTEST => {
            CRC.checksum(body) == u16::from_le_bytes([*low, *high])
        }
        _ => false,
    }
}

/// The length of a request, CRC included, where the function tells it; the least it can be while the byte that tells it
/// is still to come.
fn expected_length(frame: &[u8]) -> Option<usize> {
    match *frame {
        [_, 0x01..=0x06 | 0x08, ..] => Some(8),
        [_, 0x07 | 0x0B | 0x0C | 0x11, ..] => Some(4),
        [_, 0x0F | 0x10, _, _, _, _, bytes, ..] => Some(9 + usize::from(bytes)),
        [_, 0x0F | 0x10, ..] => Some(9),
        [_, 0x16, ..] => Some(10),
        [_, 0x17, _, _, _, _, _, _, _, _, bytes, ..] => Some(13 + usize::from(bytes)),
        [_, 0x17, ..] => Some(13),
        [_, 0x2B, 0x0E, ..] | [_, 0x2B] => Some(7),
        _ => None,
    }
}
