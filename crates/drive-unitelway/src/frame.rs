//! Frames of the UNI-TELWAY link: what is put on the line and what is heard there.

use std::mem;

use bytes::{Buf, Bytes, BytesMut};

const DLE: u8 = 0x10;
const STX: u8 = 0x02;
const ENQ: u8 = 0x05;
/// "I have it."
pub(crate) const ACK: u8 = 0x06;
/// "Once more."
pub(crate) const NAK: u8 = 0x15;
/// "I have nothing to say."
pub(crate) const EOT: u8 = 0x04;

/// The longest frame: 255 bytes, each doubled, with all that surrounds them.
pub(crate) const MAX_FRAME: usize = 5 + 2 * 255 + 1;

/// How many characters a data frame has, without doubled bytes.
#[must_use]
pub const fn len(message: usize) -> usize {
    message + 5
}

/// The data frame of a message of at most 255 bytes: 10h 02h, address, length, data, BCC. In the data, and where the
/// length is 10h, each 10h is sent twice; the BCC is the sum of all bytes before it.
#[must_use]
pub fn data(address: u8, message: &[u8]) -> Bytes {
    let mut frame = BytesMut::with_capacity(2 * message.len() + 6);
    frame.extend_from_slice(&[DLE, STX, address]);
    let length = u8::try_from(message.len()).unwrap_or(u8::MAX);
    for byte in [length].iter().chain(message.iter().take(usize::from(length))) {
        frame.extend_from_slice(&[*byte]);
        if *byte == DLE {
            frame.extend_from_slice(&[DLE]);
        }
    }
    let check = sum(&frame);
    frame.extend_from_slice(&[check]);
    frame.freeze()
}

/// The poll of a slave, which may speak then.
#[must_use]
pub fn poll(address: u8) -> Bytes {
    Bytes::copy_from_slice(&[DLE, ENQ, address])
}

/// What was heard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Heard {
    /// One of the three single characters: 06h, 15h or 04h.
    Signal {
        /// Which of them.
        byte: u8,
        /// Nothing else came since something was last sent.
        alone: bool,
    },
    /// Somebody polls a slave.
    Poll(u8),
    /// A data frame whose BCC fits.
    Data {
        /// The slave that it is for or from.
        address: u8,
        /// What it carries: the network header, and UNI-TE behind it.
        message: Bytes,
    },
    /// So many bytes of a data frame whose BCC does not fit, or that breaks off.
    Damaged(usize),
    /// Bytes that make nothing.
    Noise(usize),
}

/// What stands at the beginning of some bytes.
#[derive(Debug)]
enum Found {
    Whole(Heard, usize),
    Beginning,
    Nothing,
}

/// The receiver: an iterator of what was heard in the bytes that were [pushed](Self::push), all of them in their order.
/// It finds the next good frame behind whatever came before it.
#[derive(Debug, Default)]
pub struct Receiver {
    /// What has come and is not yet part of anything. It never holds more than one frame can have.
    received: BytesMut,
    /// How many bytes have come since something was sent.
    since: usize,
}

impl Receiver {
    /// Takes what came in.
    pub fn push(&mut self, bytes: &[u8]) {
        self.received.extend_from_slice(bytes);
    }

    /// What has begun goes on no more: it is dropped, and what stands behind its beginning is looked at anew.
    pub fn give_up(&mut self) -> Option<Heard> {
        if self.received.is_empty() {
            return None;
        }
        let is_data = self.received.starts_with(&[DLE, STX]);
        let len = if is_data { 2 } else { 1 };
        self.received.advance(len);
        Some(self.take(if is_data { Heard::Damaged(len) } else { Heard::Noise(1) }, len))
    }

    /// Whether something has begun.
    #[must_use]
    pub fn is_open(&self) -> bool {
        !self.received.is_empty()
    }

    /// Something is sent now: what comes from now on may be its answer. The bytes of what had begun are no part of it.
    pub(crate) fn begin(&mut self) -> usize {
        self.since = 0;
        mem::take(&mut self.received).len()
    }

    /// What was heard last was our own and does not count.
    pub(crate) fn discount(&mut self) {
        self.since = 0;
    }

    fn take(&mut self, heard: Heard, len: usize) -> Heard {
        let alone = self.since == 0;
        self.since = self.since.saturating_add(len);
        match heard {
            Heard::Signal { byte, .. } => Heard::Signal { byte, alone },
            other => other,
        }
    }
}

impl Iterator for Receiver {
    type Item = Heard;

    /// The next thing that was heard, if it is whole.
    fn next(&mut self) -> Option<Heard> {
        let mut noise = 0;
        loop {
            match look(&self.received) {
                Found::Nothing => {
                    self.received.advance(1);
                    noise += 1;
                }
                // What made nothing is told first; the next call finds the rest.
                _ if noise > 0 => return Some(self.take(Heard::Noise(noise), noise)),
                Found::Whole(heard, len) => {
                    self.received.advance(len);
                    return Some(self.take(heard, len));
                }
                Found::Beginning => return None,
            }
        }
    }
}

fn look(bytes: &[u8]) -> Found {
    match *bytes {
        [byte @ (ACK | NAK | EOT), ..] => Found::Whole(Heard::Signal { byte, alone: false }, 1),
        [] | [DLE] | [DLE, ENQ] => Found::Beginning,
        [DLE, ENQ, address, ..] => Found::Whole(Heard::Poll(address), 3),
        [DLE, STX, ..] => look_at_data(bytes),
        _ => Found::Nothing,
    }
}

fn look_at_data(bytes: &[u8]) -> Found {
    let mut rest = bytes.iter().copied().enumerate().skip(2);
    let Some((_, address)) = rest.next() else { return Found::Beginning };
    // A byte of the frame; 10h counts when it comes twice, and a single one begins another frame.
    let mut undoubled = || match rest.next() {
        None => Err(Found::Beginning),
        Some((_, DLE)) => match rest.next() {
            None => Err(Found::Beginning),
            Some((_, DLE)) => Ok(DLE),
            Some(_) => Err(Found::Nothing),
        },
        Some((_, byte)) => Ok(byte),
    };
    let length = match undoubled() {
        Ok(length) => usize::from(length),
        Err(found) => return found,
    };
    let mut message = BytesMut::with_capacity(length);
    while message.len() < length {
        match undoubled() {
            Ok(byte) => message.extend_from_slice(&[byte]),
            Err(found) => return found,
        }
    }
    let Some((at, check)) = rest.next() else { return Found::Beginning };
    let fits = bytes.get(..at).is_some_and(|before| sum(before) == check);
    let heard =
        if fits { Heard::Data { address, message: message.freeze() } } else { Heard::Damaged(at + 1) };
    Found::Whole(heard, at + 1)
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames as the link's rules make them (the card's manual prints none), each with its address and its data.
    const VECTORS: &[(&[u8], u8, &[u8])] = &[
        // Mirror of 10h 04h, simplified header: the 10h is sent twice.
        (&[0x10, 0x02, 0x01, 0x05, 0x00, 0xFA, 0x01, 0x10, 0x10, 0x04, 0x37], 1, &[0, 0xFA, 1, 0x10, 4]),
        // Its reply.
        (&[0x10, 0x02, 0x01, 0x04, 0x00, 0xFB, 0x10, 0x10, 0x04, 0x36], 1, &[0, 0xFB, 0x10, 4]),
        // Reply to a mirror of 05h.
        (&[0x10, 0x02, 0x01, 0x03, 0x00, 0xFB, 0x05, 0x16], 1, &[0, 0xFB, 5]),
        // Reply to a mirror of 00h with the network header.
        (
            &[0x10, 0x02, 0x01, 0x08, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xFB, 0x00, 0x34],
            1,
            &[0x20, 0, 0xFE, 0, 0, 0, 0xFB, 0],
        ),
        // Request 00h of category 7 to slave 2 with the network header.
        (
            &[0x10, 0x02, 0x02, 0x0A, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x00, 0x07, 0x00, 0x00, 0x43],
            2,
            &[0x20, 0, 0xFE, 0, 0, 0, 0, 7, 0, 0],
        ),
        // Its reply, 30h.
        (
            &[0x10, 0x02, 0x02, 0x09, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x30, 0x00, 0x00, 0x6B],
            2,
            &[0x20, 0, 0xFE, 0, 0, 0, 0x30, 0, 0],
        ),
        // Reply to a reading of the error counters, all 0.
        (
            &[0x10, 0x02, 0x01, 0x0F, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xD2, 0, 0, 0, 0, 0, 0, 0, 0, 0x12],
            1,
            &[0x20, 0, 0xFE, 0, 0, 0, 0xD2, 0, 0, 0, 0, 0, 0, 0, 0],
        ),
    ];

    fn heard(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Heard> {
        receiver.push(bytes);
        std::iter::from_fn(|| receiver.next()).collect()
    }

    fn frame(address: u8, message: &[u8]) -> Heard {
        Heard::Data { address, message: Bytes::copy_from_slice(message) }
    }

    #[test]
    fn the_test_vectors_are_sent_byte_for_byte() {
        for (bytes, address, message) in VECTORS {
            assert_eq!(data(*address, message), *bytes);
        }
        assert_eq!(*poll(1), [0x10, 0x05, 0x01]);
    }

    #[test]
    fn the_test_vectors_are_heard_whole_byte_by_byte_and_twice_in_a_row() {
        for (bytes, address, message) in VECTORS {
            let whole = frame(*address, message);
            let receiver = &mut Receiver::default();
            assert_eq!(heard(receiver, bytes), vec![whole.clone()]);
            for (index, byte) in bytes.iter().enumerate() {
                let last = index + 1 == bytes.len();
                let expected = if last { vec![whole.clone()] } else { vec![] };
                assert_eq!(heard(receiver, &[*byte]), expected, "{bytes:02X?} at {index}");
            }
            assert_eq!(heard(receiver, &[*bytes, bytes].concat()), [whole.clone(), whole]);
            assert!(!receiver.is_open());
        }
    }

    #[test]
    fn a_damaged_vector_is_never_heard_as_another_message_and_the_next_one_is() {
        for (bytes, address, message) in VECTORS {
            for at in 0..bytes.len() {
                for bit in 0..8 {
                    let mut damaged = bytes.to_vec();
                    damaged[at] ^= 1 << bit;
                    let receiver = &mut Receiver::default();
                    let mut all = heard(receiver, &damaged);
                    while let Some(given_up) = receiver.give_up() {
                        all.push(given_up);
                        all.extend(std::iter::from_fn(|| receiver.next()));
                    }
                    let understood = all.iter().any(|heard| matches!(heard, Heard::Data { .. }));
                    assert!(!understood, "{damaged:02X?}: {all:?}");
                    assert_eq!(heard(receiver, bytes), [frame(*address, message)]);
                }
            }
        }
    }

    #[test]
    fn a_message_of_sixteen_bytes_has_its_length_doubled() {
        let message = [7; 16];
        let bytes = data(3, &message);
        assert_eq!(bytes[..6], [0x10, 0x02, 0x03, 0x10, 0x10, 7]);
        assert_eq!(heard(&mut Receiver::default(), &bytes), [frame(3, &message)]);
    }

    #[test]
    fn an_address_of_sixteen_and_a_check_of_sixteen_are_not_doubled() {
        assert_eq!(heard(&mut Receiver::default(), &data(0x10, &[1, 2])), [frame(0x10, &[1, 2])]);
        // 10h + 02h + 01h + 01h + FCh = 110h.
        let bytes = data(1, &[0xFC]);
        assert_eq!(*bytes, [0x10, 0x02, 0x01, 0x01, 0xFC, 0x10]);
        assert_eq!(heard(&mut Receiver::default(), &bytes), [frame(1, &[0xFC])]);
    }

    #[test]
    fn a_frame_is_found_behind_one_that_breaks_off() {
        let good = data(1, &[0, 0xFE]);
        for broken in
            [&[0x10, 0x02, 0x01, 0x09, 0x00][..], &[0x10, 0x02, 0x01, 0xFF, 1, 2, 3], &[0x10], &[0xAA]]
        {
            let all = heard(&mut Receiver::default(), &[broken, &good].concat());
            assert_eq!(all.last(), Some(&frame(1, &[0, 0xFE])), "{broken:02X?}: {all:?}");
        }
        // A lone 10h before the next 10h makes a byte of the data: only time tells that the first has broken off.
        let receiver = &mut Receiver::default();
        assert_eq!(heard(receiver, &[&[0x10, 0x02, 0x01, 0xFF, 1, 0x10][..], &good].concat()), []);
        let mut all = Vec::new();
        while let Some(given_up) = receiver.give_up() {
            all.push(given_up);
            all.extend(std::iter::from_fn(|| receiver.next()));
        }
        assert!(all.contains(&frame(1, &[0, 0xFE])), "{all:?}");
    }

    #[test]
    fn a_signal_is_alone_only_when_nothing_else_came() {
        let receiver = &mut Receiver::default();
        assert_eq!(heard(receiver, &[ACK]), [Heard::Signal { byte: ACK, alone: true }]);
        assert_eq!(heard(receiver, &[NAK]), [Heard::Signal { byte: NAK, alone: false }]);
        receiver.begin();
        let expected = [Heard::Noise(2), Heard::Signal { byte: EOT, alone: false }];
        assert_eq!(heard(receiver, &[0xAA, 0x01, EOT]), expected);
    }
}
