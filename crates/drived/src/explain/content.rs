//! What a frame carries: its slave and PDU, where its check fits.

use drive_bus::{capture::Dissector, exchange::rtu};

/// What stands between the marks of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Content {
    /// A request or an answer of Modbus.
    Pdu { slave: u8, pdu: Vec<u8> },
    /// What only the link says, or what is carried is no Modbus.
    Link { slave: Option<u8>, text: String },
    /// No frame; why not.
    Damaged(String),
}

/// What these bytes carry on a line that speaks this.
pub(super) fn content(dissector: Dissector, bytes: &[u8]) -> Content {
    match (dissector, bytes) {
        (_, []) => Content::Damaged("nothing".to_owned()),
        (Dissector::Rtu, _) => of_rtu(bytes),
        (Dissector::Tcp, _) => of_tcp(bytes),
        (Dissector::Data, [b':', ..]) => of_ascii(bytes),
        (Dissector::Data, _) => of_unitelway(bytes),
    }
}

fn of_rtu(bytes: &[u8]) -> Content {
    match bytes {
        [slave, pdu @ .., _, _] if rtu::is_frame(bytes) => Content::Pdu { slave: *slave, pdu: pdu.to_vec() },
        [_, _, _, _, ..] => Content::Damaged("the CRC does not fit".to_owned()),
        _ => Content::Damaged("too short for a frame".to_owned()),
    }
}

/// The header of Modbus TCP: transaction, protocol 0, length, unit (MODBUS Messaging on TCP/IP V1.0b, section 3.1.3).
fn of_tcp(bytes: &[u8]) -> Content {
    match bytes {
        [_, _, 0, 0, high, low, slave, pdu @ ..]
            if usize::from(u16::from_be_bytes([*high, *low])) == pdu.len() + 1 && !pdu.is_empty() =>
        {
            Content::Pdu { slave: *slave, pdu: pdu.to_vec() }
        }
        _ => Content::Damaged("the header of Modbus TCP does not fit".to_owned()),
    }
}

/// `:`, hexadecimal digits with the LRC, CR and LF (MODBUS over Serial Line V1.02, section 2.5.2).
fn of_ascii(bytes: &[u8]) -> Content {
    let damaged = |why: &str| Content::Damaged(why.to_owned());
    let digits = bytes.strip_prefix(b":").and_then(|rest| rest.strip_suffix(b"\n"));
    let Some(digits) = digits.and_then(|rest| rest.strip_suffix(b"\r")) else {
        return damaged("no frame of Modbus ASCII");
    };
    let digit = |byte: u8| char::from(byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
    let pairs = digits.chunks(2).map(|pair| match *pair {
        [high, low] => Some(digit(high)? << 4 | digit(low)?),
        _ => None,
    });
    let Some(frame) = pairs.collect::<Option<Vec<u8>>>() else {
        return damaged("digits that are none");
    };
    let sum = frame.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    match frame.split_last() {
        Some((_, [slave, pdu @ ..])) if sum == 0 && !pdu.is_empty() => {
            Content::Pdu { slave: *slave, pdu: pdu.to_vec() }
        }
        _ => damaged("the LRC does not fit"),
    }
}

/// The link of UNI-TELWAY (VVDED397054 p. 8–10). What its data frames carry is UNI-TE, told by its request code.
fn of_unitelway(bytes: &[u8]) -> Content {
    let link = |slave, text: String| Content::Link { slave, text };
    match *bytes {
        [0x06] => link(None, "ACK: taken".to_owned()),
        [0x15] => link(None, "NAK: once more".to_owned()),
        [0x04] => link(None, "EOT: nothing to say".to_owned()),
        [0x10, 0x05, slave] => link(Some(slave), "poll: the slave may speak".to_owned()),
        [0x10, 0x02, slave, ref rest @ .., check] => {
            let sum = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
            if sum.wrapping_sub(check) != check {
                return Content::Damaged("the BCC does not fit".to_owned());
            }
            link(Some(slave), format!("data of UNI-TE: {}", super::hex(rest)))
        }
        _ => Content::Damaged("no frame that is known".to_owned()),
    }
}
