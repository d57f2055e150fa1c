//! Frames as they stand on each way, cut apart and made by hand: nothing here comes from the line that is attacked.

use super::Way;

/// A frame that was cut apart: whom it names, its PDU, and on Modbus TCP its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cut {
    pub(super) slave: u8,
    pub(super) pdu: Vec<u8>,
    pub(super) number: [u8; 2],
}

/// The frame in these bytes; `None`: none, or one of UNI-TELWAY, whose frames carry no PDU of Modbus.
pub(super) fn cut(way: Way, bytes: &[u8]) -> Option<Cut> {
    match way {
        Way::Rtu | Way::RtuOverTcp => {
            let (content, check) = bytes.split_last_chunk::<2>()?;
            let (&slave, pdu) = content.split_first()?;
            (crc(content) == *check).then(|| Cut { slave, pdu: pdu.to_vec(), number: [0; 2] })
        }
        Way::Ascii => {
            // Whatever stands in the place of LF: its check is over by then, and another frame may have met it there.
            let [b':', digits @ .., b'\r', _] = bytes else { return None };
            let text = std::str::from_utf8(digits).ok()?;
            let pairs =
                (0..text.len() / 2).map(|at| u8::from_str_radix(text.get(2 * at..2 * at + 2)?, 16).ok());
            let content: Vec<u8> = pairs.collect::<Option<_>>()?;
            let [slave, pdu @ .., _] = content.as_slice() else { return None };
            (sum(&content) == 0).then(|| Cut { slave: *slave, pdu: pdu.to_vec(), number: [0; 2] })
        }
        Way::ModbusTcp => match bytes {
            [a, b, 0, 0, _, _, slave, pdu @ ..] => {
                Some(Cut { slave: *slave, pdu: pdu.to_vec(), number: [*a, *b] })
            }
            _ => None,
        },
        Way::UniTelway => None,
    }
}

/// What came at once, frame by frame where its length, or its colon, says where one ends and the next begins.
pub(super) fn apart(way: Way, bytes: &[u8]) -> Vec<&[u8]> {
    if way == Way::Ascii {
        return bytes.chunk_by(|_, next| *next != b':').collect();
    }
    let mut frames = Vec::new();
    let mut rest = bytes;
    while way == Way::ModbusTcp
        && let [_, _, 0, 0, high, low, ..] = rest
    {
        let len = 6 + usize::from(u16::from_be_bytes([*high, *low]));
        let Some((frame, behind)) = rest.split_at_checked(len) else { break };
        frames.push(frame);
        rest = behind;
    }
    if !rest.is_empty() {
        frames.push(rest);
    }
    frames
}

/// The frame of a cut.
pub(super) fn join(way: Way, cut: &Cut) -> Vec<u8> {
    let mut frame = [&[cut.slave], cut.pdu.as_slice()].concat();
    match way {
        Way::Rtu | Way::RtuOverTcp | Way::UniTelway => {
            frame.extend(crc(&frame));
            frame
        }
        Way::Ascii => {
            frame.push(sum(&frame).wrapping_neg());
            let digits: String = frame.iter().map(|byte| format!("{byte:02X}")).collect();
            format!(":{digits}\r\n").into_bytes()
        }
        Way::ModbusTcp => {
            let [a, b] = cut.number;
            let len = (frame.len() as u16).to_be_bytes();
            [&[a, b, 0, 0, len[0], len[1]], frame.as_slice()].concat()
        }
    }
}

/// CRC-16 as MODBUS over Serial Line V1.02, p. 39, computes it, bit by bit.
fn crc(bytes: &[u8]) -> [u8; 2] {
    let mut register: u16 = 0xFFFF;
    for byte in bytes {
        register ^= u16::from(*byte);
        for _ in 0..8 {
            let carry = register & 1 == 1;
            register >>= 1;
            if carry {
                register ^= 0xA001;
            }
        }
    }
    register.to_le_bytes()
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// MODBUS over Serial Line V1.02 prints no whole frame; these are the README's of drive-sim and a manual's (VVDED397054 p. 24).
    #[test]
    fn what_is_cut_is_joined_again_and_a_frame_of_a_manual_is_one() {
        let answer = [0x01, 0x03, 0x02, 0x02, 0x40, 0xB8, 0xD4];
        let found = cut(Way::Rtu, &answer).expect("it is a frame");
        assert_eq!((found.slave, found.pdu.as_slice()), (1, &[3, 2, 2, 0x40][..]));
        assert_eq!(join(Way::Rtu, &found), answer);
        for way in [Way::Rtu, Way::RtuOverTcp, Way::Ascii, Way::ModbusTcp] {
            assert_eq!(cut(way, &join(way, &found)), Some(found.clone()), "{way:?}");
        }
        assert_eq!(cut(Way::Rtu, &[1, 3, 2, 2, 0x41, 0xB8, 0xD4]), None);
    }

    /// Found by a story: what a second master was told stood before our own answer, and that was an answer of nobody's.
    #[test]
    fn what_comes_behind_another_frame_is_cut_as_if_it_had_come_alone() {
        let one = Cut { slave: 3, pdu: vec![3, 2, 1, 0xF4], number: [0, 7] };
        let other = Cut { pdu: vec![3, 2, 0, 0xC8], number: [0, 8], ..one.clone() };
        for way in [Way::Ascii, Way::ModbusTcp] {
            let expected = [&one, &other].map(|cut| Cut {
                number: if way == Way::Ascii { [0; 2] } else { cut.number },
                ..cut.clone()
            });
            let together = [join(way, &one), join(way, &other)].concat();
            let found: Vec<_> =
                apart(way, &together).into_iter().filter_map(|frame| cut(way, frame)).collect();
            assert_eq!(found, expected, "{way:?}");
        }
        let mut met = join(Way::Ascii, &one);
        *met.last_mut().expect("it has an end") = 0xF5;
        assert_eq!(cut(Way::Ascii, &met), Some(Cut { number: [0; 2], ..one.clone() }));
        let behind_noise = [b"x".as_slice(), &join(Way::Ascii, &one)].concat();
        assert_eq!(apart(Way::Ascii, &behind_noise).len(), 2);
    }
}
