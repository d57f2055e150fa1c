//! What tells one answer from another, since Modbus RTU and ASCII have no transaction number.

use tokio_modbus::{Request, Response};

/// What an answer looks like before its data: its function, and what it repeats of its request. The answer to a read
/// repeats how many bytes were asked for, the confirmation of a write where, and what or how many. Two answers of one
/// slave with the same shape cannot be told apart, except by the time at which they come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Shape {
    function: u8,
    repeated: [u8; 6],
}

impl Shape {
    /// That of every answer, in a protocol whose answers repeat nothing of their requests.
    pub const ANY: Self = Self { function: 0, repeated: [0; 6] };

    /// The shape of the answer to this request, when the slave does not refuse it.
    #[must_use]
    pub fn of_answer_to(request: &[u8]) -> Self {
        let quantity = |high, low| usize::from(u16::from_be_bytes([high, low]));
        match *request {
            [function @ (0x01 | 0x02), _, _, high, low] => {
                Self::counted(function, quantity(high, low).div_ceil(8) as u8)
            }
            [function @ (0x03 | 0x04), _, _, high, low] | [function @ 0x17, _, _, high, low, ..] => {
                Self::counted(function, (quantity(high, low) * 2) as u8)
            }
            [function @ (0x05 | 0x06 | 0x0F | 0x10), ref fields @ ..] => Self::of(function, fields, 4),
            [function @ 0x16, ref fields @ ..] => Self::of(function, fields, 6),
            [function @ 0x08, ref fields @ ..] => Self::of(function, fields, 4),
            [function, ..] => Self::of(function, &[], 0),
            [] => Self::ANY,
        }
    }

    /// The shape of a frame that was heard. Where it is the request of another master, that of the answer that follows it.
    #[must_use]
    pub fn heard(pdu: &[u8]) -> Self {
        match *pdu {
            [function @ (0x01..=0x04 | 0x17), count, ref data @ ..] if data.len() == usize::from(count) => {
                Self::counted(function, count)
            }
            _ => Self::of_answer_to(pdu),
        }
    }

    /// Whether what was heard is the request of a read, and so another master's.
    #[must_use]
    pub fn is_request(pdu: &[u8]) -> bool {
        matches!(*pdu, [0x01..=0x04, count, _, _, _] if count != 3)
    }

    /// Whether a refusal of what this answers could be one of what `other` answers: a refusal repeats the function alone.
    #[must_use]
    pub const fn shares_refusals_with(self, other: Self) -> bool {
        self.function & 0x7F == other.function & 0x7F
    }

    /// Whether this is the refusal of what `answer` answers.
    #[must_use]
    pub const fn is_refusal_of(self, answer: Self) -> bool {
        self.function == answer.function | 0x80
    }

    /// That of the answer to the same read with so many words more. `None` for what is no read of words.
    #[must_use]
    pub fn longer(self, words: u8) -> Option<Self> {
        let [count, ..] = self.repeated;
        let count = words.checked_mul(2).and_then(|bytes| count.checked_add(bytes))?;
        (matches!(self.function, 0x03 | 0x04) && count <= 250).then(|| Self::counted(self.function, count))
    }

    const fn counted(function: u8, count: u8) -> Self {
        Self { function, repeated: [count, 0, 0, 0, 0, 0] }
    }

    fn of(function: u8, fields: &[u8], most: usize) -> Self {
        let mut repeated = [0; 6];
        for (to, from) in repeated.iter_mut().zip(fields.iter().take(most)) {
            *to = *from;
        }
        Self { function, repeated }
    }
}

/// The same read with so many words more at its end. `None` for what is no read of words, and beyond what a frame carries.
pub(crate) fn lengthened(request: &Request<'_>, more: u8) -> Option<Request<'static>> {
    let longer = |quantity: u16| quantity.checked_add(more.into()).filter(|quantity| *quantity <= 125);
    match *request {
        Request::ReadHoldingRegisters(first, quantity) => {
            Some(Request::ReadHoldingRegisters(first, longer(quantity)?))
        }
        Request::ReadInputRegisters(first, quantity) => {
            Some(Request::ReadInputRegisters(first, longer(quantity)?))
        }
        _ => None,
    }
}

/// The answer to a read that was asked `more` words too long, as it was wanted.
pub(crate) fn shortened(response: Response, more: u8) -> Response {
    let cut = |mut words: Vec<u16>| {
        words.truncate(words.len().saturating_sub(usize::from(more)));
        words
    };
    match response {
        Response::ReadHoldingRegisters(words) => Response::ReadHoldingRegisters(cut(words)),
        Response::ReadInputRegisters(words) => Response::ReadInputRegisters(cut(words)),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer_to(request: &[u8]) -> Shape {
        Shape::of_answer_to(request)
    }

    #[test]
    fn reads_differ_by_their_length_and_not_by_where_they_begin() {
        assert_eq!(answer_to(&[3, 0x0C, 0x81, 0, 2]), answer_to(&[3, 0, 0, 0, 2]));
        assert_ne!(answer_to(&[3, 0x0C, 0x81, 0, 2]), answer_to(&[3, 0x0C, 0x81, 0, 3]));
        assert_ne!(answer_to(&[3, 0, 0, 0, 2]), answer_to(&[4, 0, 0, 0, 2]));
        assert_eq!(answer_to(&[1, 0, 0, 0, 9]), answer_to(&[1, 0, 0, 0, 16]), "two bytes of coils");
    }

    #[test]
    fn confirmations_differ_by_what_they_repeat() {
        assert_ne!(answer_to(&[6, 0x21, 0x35, 0, 15]), answer_to(&[6, 0x21, 0x35, 0, 7]));
        assert_eq!(answer_to(&[0x10, 0, 1, 0, 2, 4, 0, 10, 1, 2]), Shape::heard(&[0x10, 0, 1, 0, 2]));
    }

    #[test]
    fn what_is_heard_has_the_shape_of_what_it_answers_or_announces() {
        let asked = answer_to(&[3, 0x0C, 0x81, 0, 2]);
        assert_eq!(Shape::heard(&[3, 4, 0x12, 0x34, 0x56, 0x78]), asked);
        assert_eq!(Shape::heard(&[3, 0x0C, 0x81, 0, 2]), asked, "the request of another master");
        assert_eq!(Shape::heard(&[6, 0, 1, 0, 3]), answer_to(&[6, 0, 1, 0, 3]));
    }

    #[test]
    fn a_refusal_may_be_that_of_any_request_of_its_function() {
        let refusal = Shape::heard(&[0x83, 2]);
        assert!(refusal.shares_refusals_with(answer_to(&[3, 0, 0, 0, 2])));
        assert!(!refusal.shares_refusals_with(answer_to(&[6, 0, 1, 0, 3])));
    }

    #[test]
    fn a_lengthened_read_gives_what_was_wanted() {
        let longer = lengthened(&Request::ReadHoldingRegisters(7, 2), 1);
        assert_eq!(longer, Some(Request::ReadHoldingRegisters(7, 3)));
        let words = Response::ReadHoldingRegisters(vec![1, 2, 3]);
        assert_eq!(shortened(words, 1), Response::ReadHoldingRegisters(vec![1, 2]));
        assert_eq!(answer_to(&[3, 0, 7, 0, 2]).longer(1), Some(answer_to(&[3, 0, 7, 0, 3])));
        assert_eq!(lengthened(&Request::ReadInputRegisters(7, 125), 1), None);
        assert_eq!(lengthened(&Request::WriteSingleRegister(7, 125), 1), None);
    }
}
