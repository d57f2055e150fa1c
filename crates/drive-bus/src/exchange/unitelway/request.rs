//! UNI-TE: the requests of the card's manual (VVDED397054 p. 11–13/35–37), and what the registers of a family become
//! among them. Words are little-endian.

use bytes::{BufMut, Bytes, BytesMut};
use tokio_modbus::{
    ExceptionCode, Request, Response,
    prelude::{ConformityLevel, DeviceIdObject, ReadDeviceIdentificationResponse},
};

use crate::exchange::Answer;

/// The function code under which a UNI-TE request itself travels in a [`Request::Custom`]: the data are its code and its
/// body without the category, which the line adds; the answer's data are the whole reply. One of the codes that Modbus
/// leaves to its users (MODBUS Application Protocol V1.1b3, section 5: 100 to 110).
pub const UNITE: u8 = 100;

/// The most words of a read and of a write of objects (p. 11/35).
const MOST_READ: usize = 63;
const MOST_WRITTEN: usize = 60;
/// Segment of internal words, and the type of a 16-bit word (p. 12/36).
const WORDS: [u8; 2] = [0x68, WORD];
const WORD: u8 = 0x07;
/// The negative reply (p. 13/37).
pub(super) const REFUSED: u8 = 0xFD;
/// The reply to a mirror request.
pub(super) const MARK: u8 = 0xFB;
/// The reply of what brings nothing but its being done.
const DONE: u8 = 0xFE;

/// The requests, by their codes (p. 11/35).
pub(crate) mod code {
    pub(crate) const IDENTIFICATION: u8 = 0x0F;
    pub(crate) const PROTOCOL_VERSION: u8 = 0x30;
    pub(crate) const MIRROR: u8 = 0xFA;
    pub(crate) const READ_COUNTERS: u8 = 0xA2;
    pub(crate) const CLEAR_COUNTERS: u8 = 0xA4;
    pub(crate) const READ_WORD: u8 = 0x04;
    pub(crate) const WRITE_WORD: u8 = 0x14;
    pub(crate) const READ_OBJECTS: u8 = 0x36;
    pub(crate) const WRITE_OBJECTS: u8 = 0x37;
    pub(crate) const SPECIFIC: u8 = 0xF2;
}

/// The UNI-TE form of a request, from its code on.
///
/// # Errors
/// Why it has none.
pub(super) fn encode(request: &Request<'_>, category: u8) -> Result<Bytes, String> {
    let mut unite = BytesMut::with_capacity(16);
    let mut put = |code: u8| unite.put_slice(&[code, category]);
    match request {
        Request::ReadHoldingRegisters(address, 1) | Request::ReadInputRegisters(address, 1) => {
            put(code::READ_WORD);
            unite.put_u16_le(*address);
        }
        Request::ReadHoldingRegisters(first, quantity) | Request::ReadInputRegisters(first, quantity) => {
            check_quantity(usize::from(*quantity), MOST_READ)?;
            put(code::READ_OBJECTS);
            put_objects(&mut unite, *first, *quantity);
        }
        Request::WriteSingleRegister(address, word) => {
            put(code::WRITE_WORD);
            unite.put_u16_le(*address);
            unite.put_u16_le(*word);
        }
        Request::WriteMultipleRegisters(first, words) => {
            check_quantity(words.len(), MOST_WRITTEN)?;
            put(code::WRITE_OBJECTS);
            put_objects(&mut unite, *first, words.len() as u16);
            for word in words.iter() {
                unite.put_u16_le(*word);
            }
        }
        Request::Custom(0x08, data) => {
            let [0, 0, mirrored @ ..] = &**data else {
                return Err("UNI-TELWAY has the echo 08/00 and no other diagnostics".to_owned());
            };
            put(code::MIRROR);
            unite.put_slice(mirrored);
        }
        Request::ReadDeviceIdentification(_, 0) => put(code::IDENTIFICATION),
        Request::Custom(UNITE, data) => {
            let [code, body @ ..] = &**data else { return Err("a UNI-TE request has a code".to_owned()) };
            put(*code);
            unite.put_slice(body);
        }
        other => {
            let function = other.function_code().value();
            return Err(format!("UNI-TELWAY has no request for function {function:02X}h"));
        }
    }
    Ok(unite.freeze())
}

/// What a reply says to its request.
///
/// # Errors
/// What does not fit, in words.
pub(super) fn decode(request: &Request<'_>, reply: &Bytes) -> Result<Answer, String> {
    // Of the causes only one is printed, a wrong number of parameters (p. 13/37), without its number. That is what the
    // exception 03 says.
    if let [REFUSED] | [REFUSED, _] = **reply {
        return Ok(Err(ExceptionCode::IllegalDataValue));
    }
    let words = |data: &[u8], quantity: u16| {
        let (words, rest) = data.as_chunks::<2>();
        let fits = rest.is_empty() && words.len() == usize::from(quantity);
        let decoded = || words.iter().map(|word| u16::from_le_bytes(*word)).collect::<Vec<_>>();
        fits.then(decoded).ok_or_else(|| format!("{} bytes instead of {quantity} words", data.len()))
    };
    let wrong = || format!("the reply {reply:02X?}");
    Ok(Ok(match (request, &**reply) {
        (Request::ReadHoldingRegisters(_, 1), [0x34, data @ ..]) => {
            Response::ReadHoldingRegisters(words(data, 1)?)
        }
        (Request::ReadInputRegisters(_, 1), [0x34, data @ ..]) => {
            Response::ReadInputRegisters(words(data, 1)?)
        }
        (Request::ReadHoldingRegisters(_, quantity @ 2..), [0x66, WORD, data @ ..]) => {
            Response::ReadHoldingRegisters(words(data, *quantity)?)
        }
        (Request::ReadInputRegisters(_, quantity @ 2..), [0x66, WORD, data @ ..]) => {
            Response::ReadInputRegisters(words(data, *quantity)?)
        }
        (Request::WriteSingleRegister(address, word), [DONE]) => {
            Response::WriteSingleRegister(*address, *word)
        }
        (Request::WriteMultipleRegisters(first, words), [DONE]) => {
            Response::WriteMultipleRegisters(*first, words.len() as u16)
        }
        (Request::Custom(0x08, data), [MARK, mirrored @ ..]) if data.get(2..) == Some(mirrored) => {
            Response::Custom(0x08, Bytes::copy_from_slice(data))
        }
        (
            Request::ReadDeviceIdentification(read_code, 0),
            [0x3F, _product, _subtype, version, len, rating @ ..],
        ) if rating.len() == usize::from(*len) => {
            let object = |id, value| DeviceIdObject { id, value };
            let version = Bytes::from(format!("V{}.{}", version >> 4, version & 0x0F));
            Response::ReadDeviceIdentification(ReadDeviceIdentificationResponse {
                read_code: *read_code,
                conformity_level: ConformityLevel::BasicIdentificationStreamOnly,
                more_follows: false,
                next_object_id: 0,
                device_id_objects: vec![object(1, Bytes::copy_from_slice(rating)), object(2, version)],
            })
        }
        (Request::Custom(UNITE, data), [code, ..])
            if data.first().map(|code| reply_to(*code)) == Some(*code) =>
        {
            Response::Custom(UNITE, reply.clone())
        }
        _ => return Err(wrong()),
    }))
}

/// Whether a request may change something.
pub(super) fn is_write(request: &Request<'_>) -> Option<bool> {
    let Request::Custom(UNITE, data) = request else { return None };
    Some(!matches!(
        data.first(),
        Some(
            &(code::IDENTIFICATION
                | code::PROTOCOL_VERSION
                | code::MIRROR
                | code::READ_COUNTERS
                | code::READ_WORD
                | code::READ_OBJECTS)
        )
    ))
}

/// Whether it is the specific request, which commands.
pub(super) fn is_specific(request: &Request<'_>) -> bool {
    matches!(request, Request::Custom(UNITE, data) if data.first() == Some(&code::SPECIFIC))
}

/// The code of the positive reply.
const fn reply_to(request: u8) -> u8 {
    match request {
        code::MIRROR => MARK,
        code::CLEAR_COUNTERS | code::WRITE_WORD | code::WRITE_OBJECTS => DONE,
        code::SPECIFIC => code::SPECIFIC,
        other => other.wrapping_add(0x30),
    }
}

fn check_quantity(quantity: usize, most: usize) -> Result<(), String> {
    if (1..=most).contains(&quantity) {
        Ok(())
    } else {
        Err(format!("UNI-TELWAY carries 1 to {most} words in this request, not {quantity}"))
    }
}

fn put_objects(unite: &mut BytesMut, first: u16, quantity: u16) {
    unite.put_slice(&WORDS);
    unite.put_u16_le(first);
    unite.put_u16_le(quantity);
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    #[test]
    fn registers_become_words_and_objects() {
        let encoded = |request: Request<'_>| encode(&request, 7).map(|unite| unite.to_vec());
        // The manual's sample reads W250 to W253 (p. 12/36): code and category 0736h, six bytes of parameters.
        let read = encoded(Request::ReadHoldingRegisters(250, 4));
        assert_eq!(read, Ok(vec![0x36, 0x07, 0x68, 0x07, 0xFA, 0x00, 0x04, 0x00]));
        assert_eq!(encoded(Request::ReadInputRegisters(250, 1)), Ok(vec![0x04, 0x07, 0xFA, 0x00]));
        let write = encoded(Request::WriteSingleRegister(400, 6));
        assert_eq!(write, Ok(vec![0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
        let write = encoded(Request::WriteMultipleRegisters(400, Cow::Borrowed(&[6, 500])));
        let expected = vec![0x37, 0x07, 0x68, 0x07, 0x90, 0x01, 0x02, 0x00, 0x06, 0x00, 0xF4, 0x01];
        assert_eq!(write, Ok(expected));
        let echo = encoded(Request::Custom(0x08, Cow::Borrowed(&[0, 0, 0xA5, 0x37])));
        assert_eq!(echo, Ok(vec![0xFA, 0x07, 0xA5, 0x37]));
    }

    #[test]
    fn what_the_protocol_has_no_form_for_is_refused() {
        for request in [
            Request::ReadHoldingRegisters(0, 64),
            Request::ReadHoldingRegisters(0, 0),
            Request::WriteMultipleRegisters(0, Cow::Owned(vec![0; 61])),
            Request::Custom(0x08, Cow::Borrowed(&[0, 4, 0, 0])),
            Request::Custom(0x0B, Cow::Borrowed(&[])),
            Request::Custom(UNITE, Cow::Borrowed(&[])),
            Request::ReadCoils(0, 1),
        ] {
            assert!(encode(&request, 7).is_err(), "{request:?}");
        }
    }

    #[test]
    fn a_reply_is_decoded_only_if_it_fits_its_request() {
        let read = Request::ReadHoldingRegisters(250, 2);
        let decode = |request: &Request<'_>, reply: &[u8]| decode(request, &Bytes::copy_from_slice(reply));
        let words = Response::ReadHoldingRegisters(vec![500, 0x1234]);
        assert_eq!(decode(&read, &[0x66, 0x07, 0xF4, 0x01, 0x34, 0x12]), Ok(Ok(words)));
        for refused in [&[0xFD][..], &[0xFD, 0x06]] {
            assert_eq!(decode(&read, refused), Ok(Err(ExceptionCode::IllegalDataValue)), "{refused:02X?}");
        }
        let wrong: [&[u8]; 6] = [
            &[0x66, 0x07, 0xF4, 0x01],
            &[0x66, 0x07, 0xF4, 0x01, 0x34],
            &[0x66, 0x08, 0xF4, 0x01, 0x34, 0x12],
            &[0x34, 0xF4, 0x01],
            &[0xFE],
            &[],
        ];
        for reply in wrong {
            assert!(decode(&read, reply).is_err(), "{reply:02X?}");
        }
        let write = Request::WriteSingleRegister(400, 6);
        assert_eq!(decode(&write, &[0xFE]), Ok(Ok(Response::WriteSingleRegister(400, 6))));
        assert!(decode(&write, &[0xFE, 0]).is_err());
        let echo = Request::Custom(0x08, Cow::Borrowed(&[0, 0, 0xA5, 0x37]));
        let echoed = Response::Custom(0x08, Bytes::from_static(&[0, 0, 0xA5, 0x37]));
        assert_eq!(decode(&echo, &[0xFB, 0xA5, 0x37]), Ok(Ok(echoed)));
        assert!(decode(&echo, &[0xFB, 0xA5, 0x38]).is_err());
    }

    #[test]
    fn every_request_of_the_manual_has_its_reply_code() {
        for (request, reply) in [
            (0x0F, 0x3F),
            (0x30, 0x60),
            (0xFA, 0xFB),
            (0xA2, 0xD2),
            (0xA4, 0xFE),
            (0x04, 0x34),
            (0x14, 0xFE),
            (0x36, 0x66),
            (0x37, 0xFE),
            (0xF2, 0xF2),
        ] {
            assert_eq!(reply_to(request), reply, "{request:02X}h");
        }
    }
}
