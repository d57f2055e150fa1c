//! Frames of Modbus RTU: address, PDU, CRC (MODBUS over Serial Line V1.02 p. 13).

use bytes::{BufMut, Bytes, BytesMut};
use crc::{CRC_16_MODBUS, Crc, Table};

use crate::pdu::MAX_PDU;

static CRC: Crc<u16, Table<16>> = Crc::<u16, Table<16>>::new(&CRC_16_MODBUS);

/// Address and CRC around a PDU.
pub(crate) const OVERHEAD: usize = 3;

/// The longest frame.
pub(crate) const MAX_FRAME: usize = MAX_PDU + OVERHEAD;

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

pub(super) fn crc_fits(bytes: &[u8]) -> bool {
    bytes
        .split_last_chunk::<2>()
        .is_some_and(|(content, crc)| CRC.checksum(content) == u16::from_le_bytes(*crc))
}

/// Whether these bytes are a whole frame of this slave when one bit is turned round.
pub(crate) fn is_frame_but_for_one_bit(bytes: &[u8], slave: u8) -> bool {
    // What one bit does to the CRC depends on nothing but how many follow it. Over a frame with its CRC it is 0.
    let wrong = CRC.checksum(bytes);
    let mut turned: [u16; 8] = std::array::from_fn(|bit| behind_a_byte(1 << bit));
    for (index, byte) in bytes.iter().enumerate().rev() {
        if let Some(bit) = turned.iter().position(|of_bit| *of_bit == wrong) {
            let first = if index == 0 { Some(byte ^ 1 << bit) } else { bytes.first().copied() };
            return first == Some(slave);
        }
        turned = turned.map(behind_a_byte);
    }
    false
}

/// The register of the CRC after eight bits 0 more.
fn behind_a_byte(register: u16) -> u16 {
    (0..8).fold(register, |register, _| (register >> 1) ^ if register & 1 == 1 { 0xA001 } else { 0 })
}

/// How long the frame is that these bytes begin with: one of a function that is known has its length, of any other it is the shortest
/// whose check fits. A frame whose check ends with 00h, one of 256, is also a frame without that byte.
pub(super) fn shortest_frame(bytes: &[u8]) -> Option<usize> {
    const FIXED: usize = OVERHEAD + 5;
    let lengths = match *bytes {
        [_, 3 | 4, count, ..] => [OVERHEAD + 2 + usize::from(count), FIXED],
        [_, 5 | 6 | 15 | 16, ..] => [FIXED; 2],
        [_, 0x80..=0xFF, ..] => [OVERHEAD + 2; 2],
        _ => [0; 2],
    };
    let known = lengths.into_iter().find(|len| bytes.get(..*len).is_some_and(is_frame));
    if known.is_some() {
        return known;
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Found by `drive-fire fuzz --target Schedule`: a late answer was taken for a shorter frame, and its slave was not given its pause.
    #[test]
    fn a_frame_whose_check_ends_with_nought_is_not_taken_for_one_that_is_shorter_by_it() {
        let answer = [0x01, 0x03, 0x02, 0x00, 0xF0, 0xB8, 0x00];
        assert!(crc_fits(&answer) && crc_fits(&answer[..6]));
        assert_eq!(shortest_frame(&answer), Some(7));
        for low in 0..=u8::MAX {
            for pdu in [&[6, 0, 100, 0, low][..], &[3, 2, 0, low], &[3, 0, 0, 0, low], &[0x83, low]] {
                let frame = frame(1, pdu);
                assert_eq!(shortest_frame(&frame), Some(frame.len()), "{frame:02X?}");
            }
        }
    }
}
