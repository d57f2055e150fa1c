//! What bytes are that came to a question of Modbus RTU.

use crate::exchange::rtu;

/// Address and check around a PDU.
const AROUND: usize = 3;

/// What came in vain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Came {
    /// The answer but for its first byte, which is its address: the check fits with it.
    WithoutFirst,
    /// The answer but for its last byte: the other half of the check fits.
    WithoutLast,
    /// The answer but for one bit: with it turned round the check fits. Two that speak at once differ in more, at the least in
    /// their checks.
    ButForOneBit,
    /// Two whole answers of one length that differ.
    TwoThatDiffer,
    /// Whole frames and nothing else.
    Frames,
    Other,
}

/// What these bytes are, where an answer with a PDU of `expected` bytes was due from `slave`.
pub(super) fn what_came(came: &[u8], slave: u8, expected: usize) -> Came {
    let lens = [expected + AROUND, 2 + AROUND];
    if lens.iter().any(|len| came.len() + 1 == *len) {
        let whole: Vec<u8> = [slave].iter().chain(came).copied().collect();
        if rtu::is_frame(&whole) {
            return Came::WithoutFirst;
        }
        if came.first() == Some(&slave)
            && let Some((low, body)) = came.split_last()
            && rtu::frame(slave, body.get(1..).unwrap_or_default()).get(body.len()) == Some(low)
        {
            return Came::WithoutLast;
        }
    }
    if lens.contains(&came.len()) && rtu::is_frame_but_for_one_bit(came, slave) {
        return Came::ButForOneBit;
    }
    let len = expected + AROUND;
    if let (Some(first), Some(second)) = (came.get(..len), came.get(len..2 * len))
        && [first, second].iter().all(|frame| frame.first() == Some(&slave) && rtu::is_frame(frame))
        && first != second
    {
        return Came::TwoThatDiffer;
    }
    if is_whole(came) { Came::Frames } else { Came::Other }
}

/// So many bytes are told of what came.
const TOLD: usize = 8;

/// What came instead of an answer, in words: how much, which bytes first, and why it was not taken. `None`: nothing of this slave.
pub(super) fn told(came: &[u8], slave: u8, expected: usize, is_early: bool) -> Option<String> {
    let why = match what_came(came, slave, expected) {
        _ if came.is_empty() => return None,
        Came::WithoutFirst => "the answer without its first byte",
        Came::WithoutLast => "the answer without its last byte",
        Came::ButForOneBit => "the answer with one bit wrong",
        Came::TwoThatDiffer => "two answers that differ",
        // Somebody else's.
        Came::Frames if !is_early => return None,
        _ if is_early => "sooner than the speed of the line can carry it",
        Came::Frames | Came::Other => "no frame whose check fits",
    };
    let first: Vec<String> = came.iter().take(TOLD).map(|byte| format!("{byte:02X}")).collect();
    let more = if came.len() > TOLD { " ..." } else { "" };
    let bytes = if came.len() == 1 { "byte" } else { "bytes" };
    Some(format!("{} {bytes} came, {}{more}: {why}", came.len(), first.join(" ")))
}

/// What stands behind the whole answer of `len` bytes of PDU.
pub(super) fn behind(came: &[u8], slave: u8, len: usize) -> &[u8] {
    let len = len + AROUND;
    let is_it = |start: &usize| {
        came.get(*start..*start + len)
            .is_some_and(|frame| frame.first() == Some(&slave) && rtu::is_frame(frame))
    };
    let start = (0..=came.len().saturating_sub(len)).find(is_it);
    start.and_then(|start| came.get(start + len..)).unwrap_or_default()
}

/// Whether these are whole frames and nothing else.
pub(super) fn is_whole(mut bytes: &[u8]) -> bool {
    while !bytes.is_empty() {
        let Some(len) = (4..=bytes.len()).find(|len| bytes.get(..*len).is_some_and(rtu::is_frame)) else {
            return false;
        };
        bytes = bytes.get(len..).unwrap_or_default();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    // MODBUS over Serial Line V1.02, appendix B: the answer 02 07 with its check 41 12 is the one printed there.
    const ANSWER: [u8; 4] = [0x02, 0x07, 0x41, 0x12];

    #[test]
    fn a_check_proves_that_one_byte_is_missing_and_which() {
        assert!(rtu::is_frame(&ANSWER));
        let frame = rtu::frame(3, &[3, 2, 0x12, 0x34]);
        assert_eq!(what_came(&frame[1..], 3, 4), Came::WithoutFirst);
        assert_eq!(what_came(&frame[..6], 3, 4), Came::WithoutLast);
        assert_eq!(what_came(&frame[..5], 3, 4), Came::Other);
        assert_eq!(what_came(&frame[1..], 4, 4), Came::Other, "it is another's");
        let refusal = rtu::frame(3, &[0x83, 2]);
        assert_eq!(what_came(&refusal[1..], 3, 4), Came::WithoutFirst);
        assert_eq!(what_came(&refusal[..4], 3, 4), Came::WithoutLast);
    }

    #[test]
    fn one_bit_that_is_wrong_is_told_from_two_that_speak_at_once() {
        let frame = rtu::frame(3, &[3, 2, 0x12, 0x34]);
        for bit in 0..frame.len() * 8 {
            let mut came = frame.to_vec();
            came[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(what_came(&came, 3, 4), Came::ButForOneBit, "bit {bit}");
            came[(bit / 8 + 1) % 7] ^= 4;
            assert_eq!(what_came(&came, 3, 4), Came::Other, "and another");
        }
        // A line on which the low bits of either win.
        let at_once =
            |other: &[u8]| -> Vec<u8> { frame.iter().zip(other).map(|(one, other)| one & other).collect() };
        let is_one_bit = |word: &u16| {
            let other = rtu::frame(3, &[&[3, 2], &word.to_be_bytes()[..]].concat());
            what_came(&at_once(&other), 3, 4) == Came::ButForOneBit
        };
        let mistaken = (0..=u16::MAX).filter(is_one_bit).count();
        assert!(mistaken < 655, "{mistaken} of 65 536");
        assert_eq!(what_came(&frame, 3, 4), Came::Frames);
    }

    #[test]
    fn what_came_instead_of_an_answer_is_told_with_its_length_its_first_bytes_and_why_it_was_not_taken() {
        let frame = rtu::frame(3, &[3, 2, 0x12, 0x34]);
        let said = |came: &[u8], is_early| told(came, 3, 4, is_early);
        assert_eq!(said(&[0xFF], false).unwrap(), "1 byte came, FF: no frame whose check fits");
        assert!(said(&frame[1..], false).unwrap().ends_with(": the answer without its first byte"));
        assert!(said(&frame, true).unwrap().starts_with("7 bytes came, 03 03 02 12 34 "));
        assert!(said(&frame, true).unwrap().ends_with("sooner than the speed of the line can carry it"));
        assert!(said(&[0; 20], false).unwrap().starts_with("20 bytes came, 00 00 00 00 00 00 00 00 ...: no"));
        assert_eq!(said(&[], false), None);
        assert_eq!(said(&rtu::frame(4, &[3, 2, 0, 1]), false), None, "another's");
    }

    #[test]
    fn two_answers_to_one_question_are_told_from_one_that_comes_twice() {
        let (one, other) = (rtu::frame(3, &[3, 2, 0, 1]), rtu::frame(3, &[3, 2, 0, 2]));
        assert_eq!(what_came(&[&one[..], &other].concat(), 3, 4), Came::TwoThatDiffer);
        assert_eq!(what_came(&[&one[..], &one].concat(), 3, 4), Came::Frames);
    }

    #[test]
    fn what_stands_behind_an_answer_is_found_whatever_stands_before_it() {
        let frame = rtu::frame(3, &[3, 2, 0, 1]);
        let bytes = [&[0], &frame[..], &[0xFF, 0xFE]].concat();
        assert_eq!(behind(&bytes, 3, 4), [0xFF, 0xFE]);
        assert_eq!(behind(&frame, 3, 4), [0; 0]);
        assert!(is_whole(&frame) && is_whole(&ANSWER) && !is_whole(&bytes));
    }
}
