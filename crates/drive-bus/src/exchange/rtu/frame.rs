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

/// How long the shortest frame is that these bytes begin with.
pub(super) fn shortest_frame(bytes: &[u8]) -> Option<usize> {
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
