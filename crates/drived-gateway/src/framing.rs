//! The frames of one client: pure. No more than one frame is ever kept.

use drive_bus::{
    exchange::mbap::{HEADER, Head},
    pdu::MAX_PDU,
};

/// The longest frame (MODBUS Messaging on TCP/IP Implementation Guide V1.0b, section 3.1.3).
pub(super) const LONGEST: usize = HEADER + MAX_PDU;

/// A request as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Frame {
    /// The number that its answer has too.
    pub(super) transaction: u16,
    pub(super) unit: u8,
    pub(super) pdu: Vec<u8>,
}

/// What came is no header of Modbus TCP. Where the next one begins nobody knows: the connection ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no header of Modbus TCP")]
pub(super) struct Malformed;

/// What a client has sent and was not taken yet.
#[derive(Debug)]
pub(super) struct Frames {
    bytes: [u8; LONGEST],
    len: usize,
}

impl Frames {
    pub(super) const fn new() -> Self {
        Self { bytes: [0; LONGEST], len: 0 }
    }

    /// Where the next bytes go; not empty once every whole frame was taken.
    pub(super) fn room(&mut self) -> &mut [u8] {
        self.bytes.get_mut(self.len..).unwrap_or_default()
    }

    /// So many bytes were put there.
    pub(super) fn filled(&mut self, bytes: usize) {
        self.len = (self.len + bytes).min(LONGEST);
    }

    /// Whether a frame has begun and not ended.
    pub(super) const fn is_inside(&self) -> bool {
        self.len > 0
    }

    /// The next whole frame.
    ///
    /// # Errors
    /// [`Malformed`], as soon as the header is there.
    pub(super) fn next(&mut self) -> Result<Option<Frame>, Malformed> {
        let received = self.bytes.get(..self.len).unwrap_or_default();
        let Some(&header) = received.first_chunk::<HEADER>() else { return Ok(None) };
        let Head { transaction, unit, pdu } = Head::of(header).ok_or(Malformed)?;
        let end = HEADER + pdu;
        let Some(pdu) = received.get(HEADER..end) else { return Ok(None) };
        let frame = Frame { transaction, unit, pdu: pdu.to_vec() };
        self.bytes.copy_within(end..self.len, 0);
        self.len -= end;
        Ok(Some(frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Feeds bytes in pieces of a size and gives the frames until the end or the first header that is none.
    fn fed(bytes: &[u8], piece: usize) -> (Vec<Frame>, Result<(), Malformed>) {
        let (mut frames, mut all) = (Frames::new(), Vec::new());
        let mut rest = bytes;
        while !rest.is_empty() {
            let room = frames.room();
            assert!(!room.is_empty(), "no room, and no frame is whole");
            let fits = rest.len().min(room.len()).min(piece);
            room[..fits].copy_from_slice(&rest[..fits]);
            frames.filled(fits);
            rest = &rest[fits..];
            loop {
                match frames.next() {
                    Ok(Some(frame)) => all.push(frame),
                    Ok(None) => break,
                    Err(malformed) => return (all, Err(malformed)),
                }
            }
        }
        (all, Ok(()))
    }

    /// The example of the guide's section 3.1.3: transaction 1501h, unit FFh, function 3, one register from 0004h.
    const EXAMPLE: [u8; 12] = [0x15, 0x01, 0x00, 0x00, 0x00, 0x06, 0xFF, 0x03, 0x00, 0x04, 0x00, 0x01];

    #[test]
    fn the_example_of_the_guide_is_a_frame_whole_byte_by_byte_and_twice_over() {
        let frame = Frame { transaction: 0x1501, unit: 0xFF, pdu: EXAMPLE[7..].to_vec() };
        for piece in 1..=24 {
            assert_eq!(fed(&EXAMPLE, piece), (vec![frame.clone()], Ok(())), "{piece}");
            let twice = [EXAMPLE, EXAMPLE].concat();
            assert_eq!(fed(&twice, piece), (vec![frame.clone(), frame.clone()], Ok(())), "{piece}");
        }
    }

    #[test]
    fn another_protocol_or_a_length_that_no_frame_has_ends_it_with_the_header() {
        for (at, value) in [(2, 1), (3, 1), (4, 1), (5, 0), (5, 1), (5, 255)] {
            let mut bytes = EXAMPLE;
            bytes[at] = value;
            let (frames, end) = fed(&bytes[..HEADER], 1);
            assert_eq!((frames.len(), end), (0, Err(Malformed)), "byte {at} is {value}");
        }
        let garbage = vec![0xA5; 64 * 1024];
        assert_eq!(fed(&garbage, LONGEST), (vec![], Err(Malformed)));
    }

    proptest::proptest! {
        #[test]
        fn frames_come_out_as_they_went_in_however_they_are_cut(
            frames in proptest::collection::vec(
                (proptest::num::u16::ANY, proptest::num::u8::ANY, proptest::collection::vec(0_u8.., 1..=MAX_PDU)),
                0..8,
            ),
            piece in 1..600_usize,
        ) {
            let bytes: Vec<u8> = frames
                .iter()
                .flat_map(|(transaction, unit, pdu)| {
                    drive_bus::exchange::mbap::frame(*transaction, *unit, pdu).to_vec()
                })
                .collect();
            let expected: Vec<Frame> = frames
                .into_iter()
                .map(|(transaction, unit, pdu)| Frame { transaction, unit, pdu })
                .collect();
            proptest::prop_assert_eq!(fed(&bytes, piece), (expected, Ok(())));
        }

        #[test]
        fn whatever_bytes_come_no_more_than_a_frame_is_kept(bytes: Vec<u8>, piece in 1..600_usize) {
            let _ = fed(&bytes, piece);
        }
    }
}
