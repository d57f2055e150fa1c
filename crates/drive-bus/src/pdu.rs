//! Requests as bytes: what tokio-modbus keeps to itself.

use bytes::{BufMut, Bytes, BytesMut};
use tokio_modbus::Request;

/// The longest PDU (MODBUS Application Protocol V1.1b3, section 4.1).
pub const MAX_PDU: usize = 253;

/// The MEI type of "read device identification".
pub(crate) const MEI_IDENTIFICATION: u8 = 0x0E;

/// A request that has no form on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// A quantity outside what the function allows.
    #[error("function {function:02X}h carries 1 to {most}, not {quantity}")]
    Quantity {
        /// Function code.
        function: u8,
        /// Quantity asked for.
        quantity: usize,
        /// The most that the function carries.
        most: usize,
    },
    /// A vendor request that is longer than a PDU.
    #[error("a request of {0} bytes is longer than a frame")]
    TooLong(usize),
    /// A vendor function code outside 1 to 127.
    #[error("{0:02X}h is not a function code")]
    Function(u8),
}

/// The PDU of a request.
///
/// # Errors
/// [`EncodeError`] when the request has no form on the wire.
pub fn encode(request: &Request<'_>) -> Result<Bytes, EncodeError> {
    let function = request.function_code().value();
    let limit = |quantity: usize, most: usize| {
        if (1..=most).contains(&quantity) {
            Ok(quantity as u16)
        } else {
            Err(EncodeError::Quantity { function, quantity, most })
        }
    };
    // What most requests have; a vector without room to spare becomes `Bytes` without another allocation.
    let mut pdu = BytesMut::with_capacity(5);
    pdu.put_u8(function);
    match request {
        Request::ReadCoils(address, quantity) | Request::ReadDiscreteInputs(address, quantity) => {
            pdu.put_u16(*address);
            pdu.put_u16(limit(usize::from(*quantity), 2_000)?);
        }
        Request::ReadHoldingRegisters(address, quantity) | Request::ReadInputRegisters(address, quantity) => {
            pdu.put_u16(*address);
            pdu.put_u16(limit(usize::from(*quantity), 125)?);
        }
        Request::WriteSingleCoil(address, coil) => {
            pdu.put_u16(*address);
            pdu.put_u16(if *coil { 0xFF00 } else { 0 });
        }
        Request::WriteSingleRegister(address, word) => {
            pdu.put_u16(*address);
            pdu.put_u16(*word);
        }
        Request::WriteMultipleCoils(address, coils) => {
            pdu.put_u16(*address);
            pdu.put_u16(limit(coils.len(), 1_968)?);
            pdu.put_u8(coils.len().div_ceil(8) as u8);
            for eight in coils.chunks(8) {
                pdu.put_u8(eight.iter().rev().fold(0, |byte, coil| byte << 1 | u8::from(*coil)));
            }
        }
        Request::WriteMultipleRegisters(address, words) => {
            pdu.put_u16(*address);
            put_words(&mut pdu, limit(words.len(), 123)?, words);
        }
        Request::MaskWriteRegister(address, and, or) => {
            pdu.put_u16(*address);
            pdu.put_u16(*and);
            pdu.put_u16(*or);
        }
        Request::ReadWriteMultipleRegisters(read, quantity, write, words) => {
            pdu.put_u16(*read);
            pdu.put_u16(limit(usize::from(*quantity), 125)?);
            pdu.put_u16(*write);
            put_words(&mut pdu, limit(words.len(), 121)?, words);
        }
        Request::ReadDeviceIdentification(code, object) => {
            pdu.put_slice(&[MEI_IDENTIFICATION, code.value(), *object]);
        }
        Request::ReportServerId => {}
        Request::Custom(function, data) => {
            if !(1..=0x7F).contains(function) {
                return Err(EncodeError::Function(*function));
            }
            if data.len() >= MAX_PDU {
                return Err(EncodeError::TooLong(data.len() + 1));
            }
            pdu.put_slice(data);
        }
    }
    Ok(pdu.freeze())
}

fn put_words(pdu: &mut BytesMut, quantity: u16, words: &[u16]) {
    pdu.put_u16(quantity);
    pdu.put_u8((quantity * 2) as u8);
    for word in words {
        pdu.put_u16(*word);
    }
}

/// Whether a request may change something in the slave. A vendor function that the specification does not know as a
/// read counts as a write, because sending it twice could do something twice.
#[must_use]
pub fn is_write(request: &Request<'_>) -> bool {
    match request {
        Request::ReadCoils(..)
        | Request::ReadDiscreteInputs(..)
        | Request::ReadHoldingRegisters(..)
        | Request::ReadInputRegisters(..)
        | Request::ReadDeviceIdentification(..)
        | Request::ReportServerId => false,
        // Diagnostics: 00 returns the query, 02 the diagnostic register, 0B to 14 the counters; 01 restarts, 03 changes
        // the delimiter, 04 silences the slave, 0A clears the counters.
        Request::Custom(0x08, data) => !matches!(data.as_ref(), [0, 0x00 | 0x02 | 0x0B..=0x14, ..]),
        Request::Custom(0x01..=0x04 | 0x07 | 0x0B | 0x0C | 0x11 | 0x14 | 0x18 | 0x2B, _) => false,
        _ => true,
    }
}

/// Whether the specification wants no answer to this request: 08/04, force listen-only mode.
#[must_use]
pub fn is_unanswered(request: &Request<'_>) -> bool {
    matches!(request, Request::Custom(0x08, data) if matches!(data.as_ref(), [0, 0x04, ..]))
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    /// The requests of the specification's own examples (MODBUS Application Protocol V1.1b3, section 6).
    #[test]
    fn requests_are_encoded_as_the_specification_prints_them() {
        let words = [0x000A, 0x0102];
        let coils = [true, false, true, true, false, false, true, true, true, false];
        let printed: [(Request<'_>, &[u8]); 11] = [
            (Request::ReadCoils(0x13, 0x13), &[0x01, 0x00, 0x13, 0x00, 0x13]),
            (Request::ReadDiscreteInputs(0xC4, 0x16), &[0x02, 0x00, 0xC4, 0x00, 0x16]),
            (Request::ReadHoldingRegisters(0x6B, 3), &[0x03, 0x00, 0x6B, 0x00, 0x03]),
            (Request::ReadInputRegisters(8, 1), &[0x04, 0x00, 0x08, 0x00, 0x01]),
            (Request::WriteSingleCoil(0xAC, true), &[0x05, 0x00, 0xAC, 0xFF, 0x00]),
            (Request::WriteSingleRegister(1, 3), &[0x06, 0x00, 0x01, 0x00, 0x03]),
            (Request::Custom(0x08, Cow::Borrowed(&[0, 0, 0xA5, 0x37])), &[0x08, 0x00, 0x00, 0xA5, 0x37]),
            (
                Request::WriteMultipleCoils(0x13, Cow::Borrowed(&coils)),
                &[0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01],
            ),
            (
                Request::WriteMultipleRegisters(1, Cow::Borrowed(&words)),
                &[0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02],
            ),
            (Request::MaskWriteRegister(4, 0xF2, 0x25), &[0x16, 0x00, 0x04, 0x00, 0xF2, 0x00, 0x25]),
            (
                Request::ReadWriteMultipleRegisters(3, 6, 0x0E, Cow::Borrowed(&[0xFF, 0xFF, 0xFF])),
                &[
                    0x17, 0x00, 0x03, 0x00, 0x06, 0x00, 0x0E, 0x00, 0x03, 0x06, 0x00, 0xFF, 0x00, 0xFF, 0x00,
                    0xFF,
                ],
            ),
        ];
        for (request, bytes) in printed {
            assert_eq!(encode(&request).unwrap(), bytes, "{request:?}");
        }
    }

    #[test]
    fn a_request_without_a_form_on_the_wire_is_refused() {
        let refused = [
            Request::ReadHoldingRegisters(0, 0),
            Request::ReadHoldingRegisters(0, 126),
            Request::ReadCoils(0, 2_001),
            Request::WriteMultipleRegisters(0, Cow::Owned(vec![0; 124])),
            Request::WriteMultipleCoils(0, Cow::Owned(vec![])),
            Request::ReadWriteMultipleRegisters(0, 1, 0, Cow::Owned(vec![0; 122])),
            Request::Custom(0x80, Cow::Borrowed(&[])),
            Request::Custom(0x41, Cow::Owned(vec![0; 253])),
        ];
        for request in refused {
            assert!(encode(&request).is_err(), "{request:?}");
        }
    }

    #[test]
    fn what_tokio_modbus_decodes_is_what_was_encoded() {
        let requests = [
            Request::ReadCoils(1, 2_000),
            Request::WriteMultipleCoils(9, Cow::Owned((0..1_968).map(|n| n % 3 == 0).collect())),
            Request::WriteMultipleRegisters(7, Cow::Owned((0..123).collect())),
            Request::ReadDeviceIdentification(tokio_modbus::prelude::ReadCode::Basic, 0),
            Request::ReportServerId,
        ];
        for request in requests {
            let decoded = Request::try_from(encode(&request).unwrap()).unwrap();
            assert_eq!(decoded, request);
        }
    }

    #[test]
    fn diagnostics_that_only_read_are_reads() {
        let diagnostics = |sub| Request::Custom(0x08, Cow::Owned(vec![0, sub, 0, 0]));
        for sub in [0x00, 0x02, 0x0B, 0x0F] {
            assert!(!is_write(&diagnostics(sub)), "08/{sub:02X}");
        }
        for sub in [0x01, 0x03, 0x04, 0x0A] {
            assert!(is_write(&diagnostics(sub)), "08/{sub:02X}");
        }
        assert!(is_write(&Request::Custom(0x41, Cow::Borrowed(&[]))));
    }
}
