//! Requests and answers as the clients of a gateway send and get them: pure.

use std::borrow::Cow;

use drive_core::{
    registers::{Place, Space},
    tokio_modbus::{ExceptionCode, Request, Response},
};

/// Words that a read and a write may name, and coils that are written (MODBUS Application Protocol V1.1b3, sections 6.3, 6.12 and 6.11).
const READ_WORDS: u16 = 125;
const WRITE_WORDS: u16 = 123;
const WRITE_COILS: u16 = 0x07B0;
/// What switches a coil on by function 05 (section 6.5).
const ON: u16 = 0xFF00;

/// Set in the function code of an exception.
const EXCEPTION: u8 = 0x80;

/// What a client asks.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Ask {
    /// Function 03 or 04.
    Read { function: u8, address: u16, count: u16 },
    /// Function 06 or 10h; 05 or 0Fh, where a word is a coil: 1 is on.
    Write { function: u8, address: u16, words: Vec<u16> },
    /// What is passed on as it is and changes nothing: 08/00 (return query data) and 2Bh/0Eh (read device
    /// identification).
    Pass { function: u8, data: Vec<u8> },
}

impl Ask {
    /// What the PDU of a request asks.
    ///
    /// # Errors
    /// The exception that answers it.
    pub(super) fn of(pdu: &[u8]) -> Result<Self, ExceptionCode> {
        let word = |high: u8, low: u8| u16::from_be_bytes([high, low]);
        match *pdu {
            [function @ (0x03 | 0x04), a, b, c, d] => {
                let (address, count) = (word(a, b), word(c, d));
                if !(1..=READ_WORDS).contains(&count) {
                    return Err(ExceptionCode::IllegalDataValue);
                }
                last(address, count).map(|_| Self::Read { function, address, count })
            }
            [0x06, a, b, c, d] => {
                Ok(Self::Write { function: 0x06, address: word(a, b), words: vec![word(c, d)] })
            }
            [0x05, a, b, c, d] => match word(c, d) {
                state @ (0 | ON) => {
                    let words = vec![u16::from(state == ON)];
                    Ok(Self::Write { function: 0x05, address: word(a, b), words })
                }
                _ => Err(ExceptionCode::IllegalDataValue),
            },
            [0x0F, a, b, c, d, bytes, ref data @ ..] => {
                let (address, count) = (word(a, b), word(c, d));
                let fits = usize::from(count).div_ceil(8) == data.len() && usize::from(bytes) == data.len();
                if !(1..=WRITE_COILS).contains(&count) || !fits {
                    return Err(ExceptionCode::IllegalDataValue);
                }
                let bits = data.iter().flat_map(|byte| (0..8).map(move |bit| u16::from(byte >> bit & 1)));
                let words = bits.take(usize::from(count)).collect();
                last(address, count).map(|_| Self::Write { function: 0x0F, address, words })
            }
            [0x10, a, b, c, d, bytes, ref data @ ..] => {
                let (address, count) = (word(a, b), word(c, d));
                let (words, rest) = data.as_chunks::<2>();
                let fits = words.len() == usize::from(count) && usize::from(bytes) == data.len();
                if !(1..=WRITE_WORDS).contains(&count) || !fits || !rest.is_empty() {
                    return Err(ExceptionCode::IllegalDataValue);
                }
                let words = words.iter().map(|word| u16::from_be_bytes(*word)).collect();
                last(address, count).map(|_| Self::Write { function: 0x10, address, words })
            }
            [function @ 0x08, 0, 0, ref data @ ..] if !data.is_empty() => {
                Ok(Self::Pass { function, data: [&[0, 0], data].concat() })
            }
            [function @ 0x2B, mei @ 0x0E, code @ 1..=4, object] => {
                Ok(Self::Pass { function, data: vec![mei, code, object] })
            }
            [0x03..=0x06 | 0x0F | 0x10, ..] | [0x2B, 0x0E, ..] => Err(ExceptionCode::IllegalDataValue),
            _ => Err(ExceptionCode::IllegalFunction),
        }
    }

    pub(super) const fn function(&self) -> u8 {
        match *self {
            Self::Read { function, .. } | Self::Write { function, .. } | Self::Pass { function, .. } => {
                function
            }
        }
    }

    /// The registers that it names.
    pub(super) fn registers(&self) -> impl Iterator<Item = u16> + use<> {
        let (address, count) = match *self {
            Self::Read { address, count, .. } => (address, count),
            // A PDU has no room for more.
            Self::Write { address, ref words, .. } => (address, words.len() as u16),
            Self::Pass { .. } => (0, 0),
        };
        (0..count).map(move |number| address.wrapping_add(number))
    }

    /// The places that it writes, and what.
    pub(super) fn places(&self) -> impl Iterator<Item = (Place, u16)> + use<'_> {
        let space = if self.is_of_coils() { Space::Coil } else { Space::HoldingRegister };
        self.writes().map(move |(address, word)| (Place { space, address }, word))
    }

    /// Whether it writes coils.
    pub(super) const fn is_of_coils(&self) -> bool {
        matches!(self, Self::Write { function: 0x05 | 0x0F, .. })
    }

    /// The addresses that it writes, and what.
    pub(super) fn writes(&self) -> impl Iterator<Item = (u16, u16)> + use<'_> {
        let words: &[u16] = if let Self::Write { words, .. } = self { words } else { &[] };
        self.registers().zip(words.iter().copied())
    }

    /// As the line takes it.
    pub(super) fn request(&self) -> Request<'static> {
        match self {
            Self::Read { function: 0x04, address, count } => Request::ReadInputRegisters(*address, *count),
            Self::Read { address, count, .. } => Request::ReadHoldingRegisters(*address, *count),
            Self::Write { function: 0x05, address, words } => {
                Request::WriteSingleCoil(*address, words.first().is_some_and(|word| *word != 0))
            }
            Self::Write { function: 0x0F, address, words } => {
                Request::WriteMultipleCoils(*address, words.iter().map(|word| *word != 0).collect())
            }
            Self::Write { function: 0x06, address, words } => {
                Request::WriteSingleRegister(*address, words.first().copied().unwrap_or_default())
            }
            Self::Write { address, words, .. } => {
                Request::WriteMultipleRegisters(*address, Cow::Owned(words.clone()))
            }
            Self::Pass { function, data } => Request::Custom(*function, Cow::Owned(data.clone())),
        }
    }

    /// The lengths of the PDUs of the request and of its answer when all goes well.
    pub(super) fn lengths(&self) -> (usize, usize) {
        match self {
            Self::Read { count, .. } => (5, 2 + 2 * usize::from(*count)),
            Self::Write { function: 0x05 | 0x06, .. } => (5, 5),
            Self::Write { function: 0x0F, words, .. } => (6 + words.len().div_ceil(8), 5),
            Self::Write { words, .. } => (6 + 2 * words.len(), 5),
            Self::Pass { function: 0x08, data } => (1 + data.len(), 1 + data.len()),
            // Three objects of a name's length.
            Self::Pass { data, .. } => (1 + data.len(), 64),
        }
    }

    /// The PDU that confirms a write.
    pub(super) fn confirmation(&self) -> Vec<u8> {
        let (address, second) = match self {
            Self::Write { function: function @ (0x05 | 0x06), address, words } => {
                let word = words.first().copied().unwrap_or_default();
                (*address, if *function == 0x05 { word * ON } else { word })
            }
            Self::Write { address, words, .. } => (*address, words.len() as u16),
            _ => return Vec::new(),
        };
        let [a, b] = address.to_be_bytes();
        let [c, d] = second.to_be_bytes();
        vec![self.function(), a, b, c, d]
    }
}

/// The last register, which there has to be.
fn last(address: u16, count: u16) -> Result<u16, ExceptionCode> {
    address.checked_add(count - 1).ok_or(ExceptionCode::IllegalDataAddress)
}

/// The PDU that answers a read with these words.
pub(super) fn words(function: u8, words: &[u16]) -> Vec<u8> {
    // No read asks for more than a byte can count.
    let mut pdu = vec![function, (words.len() * 2) as u8];
    pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    pdu
}

/// The PDU of what a slave has answered.
pub(super) fn answer(ask: &Ask, response: Response) -> Vec<u8> {
    match response {
        Response::ReadHoldingRegisters(read) | Response::ReadInputRegisters(read) => {
            words(ask.function(), &read)
        }
        Response::Custom(function, data) => [&[function], data.as_ref()].concat(),
        // The line has checked that an answer fits its request.
        _ => ask.confirmation(),
    }
}

/// The PDU that refuses a request.
pub(super) fn exception(function: u8, code: ExceptionCode) -> Vec<u8> {
    vec![function | EXCEPTION, code.into()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Requests as the specification prints them (MODBUS Application Protocol V1.1b3, sections 6.3 to 6.6, 6.8, 6.11, 6.12).
    #[test]
    fn the_requests_of_the_specification_are_understood() {
        let coils = vec![1, 0, 1, 1, 0, 0, 1, 1, 1, 0];
        let printed: [(&[u8], Ask); 7] = [
            (&[0x03, 0x00, 0x6B, 0x00, 0x03], Ask::Read { function: 3, address: 0x6B, count: 3 }),
            (&[0x04, 0x00, 0x08, 0x00, 0x01], Ask::Read { function: 4, address: 8, count: 1 }),
            (&[0x05, 0x00, 0xAC, 0xFF, 0x00], Ask::Write { function: 5, address: 0xAC, words: vec![1] }),
            (
                &[0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01],
                Ask::Write { function: 0x0F, address: 0x13, words: coils },
            ),
            (&[0x06, 0x00, 0x01, 0x00, 0x03], Ask::Write { function: 6, address: 1, words: vec![3] }),
            (&[0x08, 0x00, 0x00, 0xA5, 0x37], Ask::Pass { function: 8, data: vec![0x00, 0x00, 0xA5, 0x37] }),
            (
                &[0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02],
                Ask::Write { function: 0x10, address: 1, words: vec![0x000A, 0x0102] },
            ),
        ];
        for (pdu, ask) in printed {
            assert_eq!(Ask::of(pdu).as_ref(), Ok(&ask));
            assert_eq!(drive_bus::pdu::encode(&ask.request()).unwrap(), pdu, "and sent on as it came");
        }
        let write = Ask::of(&[0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02]).unwrap();
        assert_eq!(write.confirmation(), [0x10, 0x00, 0x01, 0x00, 0x02]);
        let one = [0x05, 0x00, 0xAC, 0xFF, 0x00];
        assert_eq!(Ask::of(&one).unwrap().confirmation(), one);
        let several = Ask::of(&[0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01]).unwrap();
        assert_eq!(several.confirmation(), [0x0F, 0x00, 0x13, 0x00, 0x0A]);
    }

    #[test]
    fn what_is_not_carried_is_refused_by_01_and_what_is_malformed_by_03() {
        use ExceptionCode::{IllegalDataAddress, IllegalDataValue, IllegalFunction};

        let of = |pdu: &[u8]| Ask::of(pdu).unwrap_err();
        for pdu in [&[0x01, 0, 0, 0, 1][..], &[0x16], &[0x17, 0], &[0x08, 0, 4, 0, 0], &[0x5A]] {
            assert_eq!(of(pdu), IllegalFunction, "{pdu:02X?}");
        }
        for pdu in [
            &[0x03][..],
            &[0x03, 0, 0, 0],
            &[0x03, 0, 0, 0, 0],
            &[0x03, 0, 0, 0, 126],
            &[0x03, 0, 0, 0, 1, 0],
            &[0x06, 0, 0, 0],
            &[0x05, 0, 0, 0, 1],
            &[0x05, 0, 0, 0xFF],
            &[0x0F, 0, 0, 0, 0, 0],
            &[0x0F, 0, 0, 0, 9, 1, 0],
            &[0x0F, 0, 0, 0, 8, 2, 0],
            &[0x10, 0, 0, 0, 0, 0],
            &[0x10, 0, 0, 0, 2, 4, 0, 1],
            &[0x10, 0, 0, 0, 1, 3, 0, 1, 0],
            &[0x2B, 0x0E, 0, 0],
        ] {
            assert_eq!(of(pdu), IllegalDataValue, "{pdu:02X?}");
        }
        assert_eq!(of(&[0x03, 0xFF, 0xFF, 0, 2]), IllegalDataAddress);
    }

    proptest::proptest! {
        #[test]
        fn no_request_of_a_stranger_is_too_strange(pdu in proptest::collection::vec(0_u8.., 0..=253)) {
            if let Ok(ask) = Ask::of(&pdu) {
                let sent_on = drive_bus::pdu::encode(&ask.request()).unwrap();
                // Bits behind the last coil of a write are nothing.
                let is_padded = ask.is_of_coils() && Ask::of(&sent_on) == Ok(ask);
                proptest::prop_assert!(is_padded || sent_on.as_ref() == pdu);
            }
        }
    }
}
