//! The network's part of a message: the header in front of the UNI-TE request or reply.

use bytes::Bytes;

use crate::request::Refusal;

/// First byte of a message: UNI-TE follows at once.
const SIMPLIFIED: u8 = 0x00;
/// First byte of a message: five bytes of address and then UNI-TE follow.
const STANDARD: u8 = 0x20;
/// First byte of a message that the network could not deliver.
const UNDELIVERABLE: u8 = 0x22;
/// The longer header.
pub(crate) const STANDARD_LEN: usize = 6;
/// The longest message.
pub(crate) const MAX_MESSAGE: usize = 255;

/// What stands in front of each UNI-TE request: whom on the network it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NetworkHeader {
    /// One byte 00h.
    Simplified,
    /// 20h and five bytes.
    Standard {
        /// Network.
        network: u8,
        /// Station.
        station: u8,
        /// Gate.
        gate: u8,
        /// The two bytes after the gate.
        extensions: [u8; 2],
    },
}

impl Default for NetworkHeader {
    /// `20 00 FE 00 00 00`.
    fn default() -> Self {
        Self::Standard { network: 0, station: 0xFE, gate: 0, extensions: [0, 0] }
    }
}

impl NetworkHeader {
    /// The message that carries this UNI-TE request.
    pub(crate) fn message(self, unite: &[u8]) -> Vec<u8> {
        match self {
            Self::Simplified => [&[SIMPLIFIED], unite].concat(),
            Self::Standard { network, station, gate, extensions: [first, second] } => {
                [&[STANDARD, network, station, gate, first, second], unite].concat()
            }
        }
    }
}

/// The UNI-TE part of a data frame's message, or what the network has to say instead; `None` for an unknown header.
#[must_use]
pub fn unite_of(message: &Bytes) -> Option<Result<Bytes, Refusal>> {
    match *message.first()? {
        SIMPLIFIED => Some(Ok(message.slice(1..))),
        STANDARD if message.len() >= STANDARD_LEN => Some(Ok(message.slice(STANDARD_LEN..))),
        UNDELIVERABLE => Some(Err(Refusal::Undeliverable)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_taken_apart_as_it_was_put_together() {
        let own = NetworkHeader::Standard { network: 1, station: 2, gate: 3, extensions: [4, 5] };
        let headers: [(NetworkHeader, &[u8]); 3] = [
            (NetworkHeader::Simplified, &[0x00]),
            (NetworkHeader::default(), &[0x20, 0x00, 0xFE, 0x00, 0x00, 0x00]),
            (own, &[0x20, 1, 2, 3, 4, 5]),
        ];
        for (header, bytes) in headers {
            let message = header.message(&[0xFA, 0x07]);
            assert_eq!(message, [bytes, &[0xFA, 0x07]].concat());
            assert_eq!(unite_of(&message.into()), Some(Ok(Bytes::from_static(&[0xFA, 0x07]))));
        }
    }

    #[test]
    fn a_message_that_was_not_delivered_says_so_and_an_unknown_header_says_nothing() {
        let undeliverable = unite_of(&Bytes::from_static(&[0x22, 0x00, 0xFE]));
        assert_eq!(undeliverable, Some(Err(Refusal::Undeliverable)));
        let unknown: [&[u8]; 3] = [&[], &[0x20, 0x00, 0xFE, 0x00, 0x00], &[0x30, 0xFB]];
        for message in unknown {
            assert_eq!(unite_of(&Bytes::from_static(message)), None, "{message:02X?}");
        }
    }
}
