//! Answers: where one ends, and whether it belongs to its request.

use bytes::Bytes;
use tokio_modbus::{ExceptionCode, Request, Response};

use crate::pdu::{MAX_PDU, MEI_IDENTIFICATION};

/// How long the answer is, as far as its first bytes tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Too few bytes to know; it has at least this many.
    AtLeast(usize),
    /// This many bytes.
    Exactly(usize),
    /// Either of the two; the check tells which.
    Either(usize, usize),
    /// Any length from this one on; the check and the silence after it tell.
    From(usize),
    /// No answer to this request begins like this.
    Never,
}

/// How long the PDU of the answer to `request` is, from the bytes of it that are there.
#[must_use]
pub fn extent(request: &Request<'_>, pdu: &[u8]) -> Extent {
    let function = request.function_code().value();
    let Some(&first) = pdu.first() else { return Extent::AtLeast(2) };
    if first == function | 0x80 {
        return exception_extent(first, pdu);
    }
    if first != function {
        return Extent::Never;
    }
    match request {
        Request::ReadCoils(_, quantity) | Request::ReadDiscreteInputs(_, quantity) => {
            counted(pdu, Some(usize::from(*quantity).div_ceil(8)))
        }
        Request::ReadHoldingRegisters(_, quantity)
        | Request::ReadInputRegisters(_, quantity)
        | Request::ReadWriteMultipleRegisters(_, quantity, ..) => {
            counted(pdu, Some(usize::from(*quantity) * 2))
        }
        Request::Custom(0x08, data) => Extent::Exactly(1 + data.len()),
        // What carries the code of another request as a vendor's own has no length that is known.
        Request::Custom(0x01..=0x06 | 0x0F | 0x10 | 0x16 | 0x17, _) => Extent::From(1),
        Request::Custom(0x2B, data) if data.first() != Some(&MEI_IDENTIFICATION) => Extent::From(1),
        _ => extent_unasked(pdu),
    }
}

/// How long the PDU of an answer is whose request is not known, from the bytes of it that are there. Function 08 counts
/// as one with a word of data, as all but 08/00 are.
#[must_use]
pub fn extent_unasked(pdu: &[u8]) -> Extent {
    let Some(&function) = pdu.first() else { return Extent::AtLeast(2) };
    match function {
        0 => Extent::Never,
        0x80.. => exception_extent(function, pdu),
        0x01..=0x04 | 0x0C | 0x11 | 0x14 | 0x15 | 0x17 => counted(pdu, None),
        0x05 | 0x06 | 0x08 | 0x0B | 0x0F | 0x10 => Extent::Exactly(5),
        0x07 => Extent::Exactly(2),
        0x16 => Extent::Exactly(7),
        0x2B => identification_extent(pdu),
        _ => Extent::From(1),
    }
}

/// How long the PDU of a request is, from the bytes of it that are there (MODBUS Application Protocol V1.1b3,
/// section 6). Function 08 as in [`extent_unasked`].
#[must_use]
pub fn extent_of_request(pdu: &[u8]) -> Extent {
    // The count of the bytes behind it stands at this place.
    let counted = |at: usize| match pdu.get(at) {
        None => Extent::AtLeast(at + 1),
        Some(&count) => bounded(at + 1 + usize::from(count)),
    };
    match pdu {
        [] => Extent::AtLeast(1),
        [0 | 0x80.., ..] => Extent::Never,
        [0x01..=0x06 | 0x08, ..] => Extent::Exactly(5),
        [0x07 | 0x0B | 0x0C | 0x11, ..] => Extent::Exactly(1),
        [0x0F | 0x10, ..] => counted(5),
        [0x14 | 0x15, ..] => counted(1),
        [0x16, ..] => Extent::Exactly(7),
        [0x17, ..] => counted(9),
        [0x18, ..] => Extent::Exactly(3),
        [0x2B] => Extent::AtLeast(4),
        [0x2B, MEI_IDENTIFICATION, ..] => Extent::Exactly(4),
        _ => Extent::From(1),
    }
}

/// The most likely length of the answer's PDU, from which the line computes how long its characters take. An answer
/// that turns out longer extends its own time while it arrives.
#[must_use]
pub fn likely_len(request: &Request<'_>) -> usize {
    match extent(request, &[request.function_code().value()]) {
        Extent::Exactly(len) | Extent::Either(len, _) => len,
        Extent::AtLeast(least) => match request {
            Request::ReadCoils(_, quantity) | Request::ReadDiscreteInputs(_, quantity) => {
                2 + usize::from(*quantity).div_ceil(8)
            }
            Request::ReadHoldingRegisters(_, quantity)
            | Request::ReadInputRegisters(_, quantity)
            | Request::ReadWriteMultipleRegisters(_, quantity, ..) => 2 + usize::from(*quantity) * 2,
            _ => least.max(64),
        },
        Extent::From(_) | Extent::Never => 64,
    }
}

/// Whether the answer to this request, when all goes well, has the very bytes of the request. Such an answer cannot be
/// told from an echo.
#[must_use]
pub fn equals_its_request(request: &Request<'_>) -> bool {
    matches!(
        request,
        Request::WriteSingleCoil(..)
            | Request::WriteSingleRegister(..)
            | Request::MaskWriteRegister(..)
            | Request::Custom(..)
    )
}

fn counted(pdu: &[u8], expected: Option<usize>) -> Extent {
    match (pdu.get(1), expected) {
        (None, _) => Extent::AtLeast(2),
        (Some(&count), Some(expected)) if usize::from(count) != expected => Extent::Never,
        (Some(&count), _) => bounded(2 + usize::from(count)),
    }
}

fn bounded(len: usize) -> Extent {
    if len <= MAX_PDU { Extent::Exactly(len) } else { Extent::Never }
}

fn exception_extent(first: u8, pdu: &[u8]) -> Extent {
    if first != 0xAB {
        return Extent::Exactly(2);
    }
    match pdu.get(1) {
        None => Extent::AtLeast(2),
        // The ATV312 repeats the MEI type before the code (its manual, "Read identification"); an ordinary exception
        // with the code 0Eh has the same first bytes.
        Some(&MEI_IDENTIFICATION) => Extent::Either(2, 3),
        Some(_) => Extent::Exactly(2),
    }
}

/// Function 2Bh/0Eh: seven bytes, then objects of an id, a length and as many bytes.
fn identification_extent(pdu: &[u8]) -> Extent {
    const HEADER: usize = 7;
    if pdu.get(1).is_some_and(|&mei| mei != MEI_IDENTIFICATION) {
        return Extent::Never;
    }
    let Some(&objects) = pdu.get(HEADER - 1) else { return Extent::AtLeast(HEADER) };
    let mut end = HEADER;
    for _ in 0..objects {
        let Some(&len) = pdu.get(end + 1) else { return at_least(end + 2) };
        end += 2 + usize::from(len);
        if end > MAX_PDU {
            return Extent::Never;
        }
    }
    Extent::Exactly(end)
}

const fn at_least(len: usize) -> Extent {
    if len <= MAX_PDU { Extent::AtLeast(len) } else { Extent::Never }
}

/// Decodes an answer's PDU and checks that it belongs to its request: function, address, quantity, echoed values.
///
/// # Errors
/// What does not fit, in words.
pub fn check(request: &Request<'_>, pdu: Bytes) -> Result<Result<Response, ExceptionCode>, String> {
    let function = request.function_code().value();
    match pdu.as_ref() {
        [first, code] if *first == function | 0x80 => return Ok(Err(ExceptionCode::new(*code))),
        [0xAB, MEI_IDENTIFICATION, code] if function == 0x2B => return Ok(Err(ExceptionCode::new(*code))),
        [first, ..] if *first == function => {}
        [first, ..] => return Err(format!("function {first:02X}h instead of {function:02X}h")),
        [] => return Err("it is empty".to_owned()),
    }
    if let Request::Custom(_, sent) = request {
        return check_custom(function, sent, &pdu).map(Ok);
    }
    let response = Response::try_from(pdu).map_err(|error| error.to_string())?;
    check_response(request, response).map(Ok)
}

fn check_custom(function: u8, sent: &[u8], pdu: &Bytes) -> Result<Response, String> {
    let data = pdu.slice(1..);
    if function == 0x08 && data.get(..2) != sent.get(..2) {
        return Err("another sub-function".to_owned());
    }
    // Sub-function 00 returns what was sent.
    if function == 0x08 && sent.get(..2) == Some(&[0, 0]) && data != sent {
        return Err("not the data that were sent".to_owned());
    }
    Ok(Response::Custom(function, data))
}

fn check_response(request: &Request<'_>, mut response: Response) -> Result<Response, String> {
    let quantity = |got: usize, asked: usize| {
        if got == asked { Ok(()) } else { Err(format!("{got} values instead of {asked}")) }
    };
    let address = |got: u16, asked: u16| {
        let is_it = crate::mutant!("confirmed-address-unchecked", got == asked, true);
        if is_it { Ok(()) } else { Err(format!("address {got} instead of {asked}")) }
    };
    let value = |got: u16, sent: u16| {
        let is_it = crate::mutant!("confirmed-value-unchecked", got == sent, true);
        if is_it { Ok(()) } else { Err(format!("value {got} instead of {sent}")) }
    };
    match (request, &mut response) {
        (Request::ReadCoils(_, asked), Response::ReadCoils(coils))
        | (Request::ReadDiscreteInputs(_, asked), Response::ReadDiscreteInputs(coils)) => {
            quantity(coils.len().div_ceil(8), usize::from(*asked).div_ceil(8))?;
            coils.truncate(usize::from(*asked));
        }
        (Request::ReadHoldingRegisters(_, asked), Response::ReadHoldingRegisters(words))
        | (Request::ReadInputRegisters(_, asked), Response::ReadInputRegisters(words))
        | (Request::ReadWriteMultipleRegisters(_, asked, ..), Response::ReadWriteMultipleRegisters(words)) => {
            quantity(words.len(), usize::from(*asked))?;
        }
        (Request::WriteSingleCoil(at, sent), Response::WriteSingleCoil(got_at, got)) => {
            address(*got_at, *at)?;
            value(u16::from(*got), u16::from(*sent))?;
        }
        (Request::WriteSingleRegister(at, sent), Response::WriteSingleRegister(got_at, got)) => {
            address(*got_at, *at)?;
            value(*got, *sent)?;
        }
        (Request::WriteMultipleCoils(at, sent), Response::WriteMultipleCoils(got_at, got)) => {
            address(*got_at, *at)?;
            quantity(usize::from(*got), sent.len())?;
        }
        (Request::WriteMultipleRegisters(at, sent), Response::WriteMultipleRegisters(got_at, got)) => {
            address(*got_at, *at)?;
            quantity(usize::from(*got), sent.len())?;
        }
        (Request::MaskWriteRegister(at, and, or), Response::MaskWriteRegister(got_at, got_and, got_or)) => {
            address(*got_at, *at)?;
            value(*got_and, *and)?;
            value(*got_or, *or)?;
        }
        (Request::ReadDeviceIdentification(code, _), Response::ReadDeviceIdentification(identification)) => {
            if identification.read_code != *code {
                return Err("another identification code".to_owned());
            }
        }
        (Request::ReportServerId, Response::ReportServerId(..)) => {}
        _ => return Err("another function".to_owned()),
    }
    Ok(response)
}

/// The confirmation of a request that nobody answers, in the form that tokio-modbus expects of an answer. `None` for a
/// request whose answer would carry data.
#[must_use]
pub fn confirmation(request: &Request<'_>) -> Option<Response> {
    Some(match request {
        Request::WriteSingleCoil(address, coil) => Response::WriteSingleCoil(*address, *coil),
        Request::WriteSingleRegister(address, word) => Response::WriteSingleRegister(*address, *word),
        Request::WriteMultipleCoils(address, coils) => {
            Response::WriteMultipleCoils(*address, u16::try_from(coils.len()).ok()?)
        }
        Request::WriteMultipleRegisters(address, words) => {
            Response::WriteMultipleRegisters(*address, u16::try_from(words.len()).ok()?)
        }
        Request::MaskWriteRegister(address, and, or) => Response::MaskWriteRegister(*address, *and, *or),
        Request::Custom(function, data) if crate::pdu::is_write(request) => {
            Response::Custom(*function, Bytes::copy_from_slice(data))
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use tokio_modbus::prelude::ReadCode;

    use super::*;

    /// Every answer that is fed byte by byte elsewhere, with its request.
    fn golden() -> Vec<(Request<'static>, Vec<u8>)> {
        let mut identification = vec![0x2B, 0x0E, 0x01, 0x01, 0x00, 0x00, 0x03];
        for (id, text) in [(0, "Telemecanique"), (1, "ATV21H075M3X"), (2, "0201")] {
            identification.extend([id, text.len() as u8]);
            identification.extend(text.as_bytes());
        }
        vec![
            (Request::ReadCoils(0x13, 0x13), vec![0x01, 0x03, 0xCD, 0x6B, 0x05]),
            (Request::ReadDiscreteInputs(0xC4, 0x16), vec![0x02, 0x03, 0xAC, 0xDB, 0x35]),
            (Request::ReadHoldingRegisters(0x6B, 2), vec![0x03, 0x04, 0x02, 0x2B, 0x00, 0x64]),
            (Request::ReadInputRegisters(8, 1), vec![0x04, 0x02, 0x00, 0x0A]),
            (Request::WriteSingleCoil(0xAC, true), vec![0x05, 0x00, 0xAC, 0xFF, 0x00]),
            (Request::WriteSingleRegister(1, 3), vec![0x06, 0x00, 0x01, 0x00, 0x03]),
            (Request::Custom(0x08, Cow::Borrowed(&[0, 0, 0xA5, 0x37])), vec![0x08, 0x00, 0x00, 0xA5, 0x37]),
            (Request::Custom(0x0B, Cow::Borrowed(&[])), vec![0x0B, 0xFF, 0xFF, 0x01, 0x08]),
            (Request::WriteMultipleRegisters(1, Cow::Borrowed(&[1, 2])), vec![0x10, 0x00, 0x01, 0x00, 0x02]),
            (Request::ReadDeviceIdentification(ReadCode::Basic, 0), identification),
        ]
    }

    #[test]
    fn the_length_is_known_as_soon_as_the_bytes_tell_it() {
        for (request, pdu) in golden() {
            for cut in 0..pdu.len() {
                match extent(&request, &pdu[..cut]) {
                    Extent::AtLeast(least) => {
                        assert!(least > cut && least <= pdu.len(), "{request:?} at {cut}");
                    }
                    Extent::Exactly(len) => assert_eq!(len, pdu.len(), "{request:?} at {cut}"),
                    other => panic!("{request:?} at {cut}: {other:?}"),
                }
            }
            assert_eq!(extent(&request, &pdu), Extent::Exactly(pdu.len()), "{request:?}");
        }
    }

    #[test]
    fn an_answer_that_fits_is_decoded() {
        for (request, pdu) in golden() {
            let response = check(&request, Bytes::from(pdu)).unwrap().unwrap();
            assert_eq!(response.function_code().value(), request.function_code().value());
        }
    }

    #[test]
    fn a_wrong_confirmation_is_refused() {
        let request = Request::WriteSingleRegister(0x2135, 3);
        for (wrong, why) in [
            (vec![0x06, 0x21, 0x36, 0x00, 0x03], "address 8502 instead of 8501"),
            (vec![0x06, 0x21, 0x35, 0x00, 0x04], "value 4 instead of 3"),
            (vec![0x03, 0x02, 0x00, 0x04], "function 03h instead of 06h"),
        ] {
            assert_eq!(check(&request, Bytes::from(wrong)), Err(why.to_owned()));
        }
    }

    #[test]
    fn a_short_answer_to_a_read_is_no_answer_to_it() {
        let request = Request::ReadHoldingRegisters(0, 2);
        assert_eq!(extent(&request, &[0x03, 0x02]), Extent::Never);
        let short = Bytes::from_static(&[0x03, 0x02, 0x00, 0x01]);
        assert_eq!(check(&request, short), Err("1 values instead of 2".to_owned()));
    }

    #[test]
    fn both_forms_of_a_refused_identification_are_exceptions() {
        let request = Request::ReadDeviceIdentification(ReadCode::Basic, 9);
        // ATV21: the ordinary form.
        assert_eq!(extent(&request, &[0xAB, 0x02]), Extent::Exactly(2));
        let ordinary = check(&request, Bytes::from_static(&[0xAB, 0x02]));
        assert_eq!(ordinary, Ok(Err(ExceptionCode::IllegalDataAddress)));
        // ATV312: with the MEI type before the code.
        assert_eq!(extent(&request, &[0xAB, 0x0E]), Extent::Either(2, 3));
        let with_mei = check(&request, Bytes::from_static(&[0xAB, 0x0E, 0x02]));
        assert_eq!(with_mei, Ok(Err(ExceptionCode::IllegalDataAddress)));
    }

    #[test]
    fn coils_come_in_the_number_that_was_asked_for() {
        let answer = check(&Request::ReadCoils(0, 3), Bytes::from_static(&[0x01, 0x01, 0xFF]));
        assert_eq!(answer, Ok(Ok(Response::ReadCoils(vec![true; 3]))));
    }
}
