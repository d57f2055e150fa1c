//! The last character of a frame, which each slave waits for: function 08/03 changes it, and a slave that has lost its
//! supply has forgotten it.

use std::{collections::BTreeMap, mem};

use tokio_modbus::Request;

/// After how many unanswered requests a slave may wait for another last character: one may have been lost.
const DOUBT_AFTER: u32 = 2;

/// Which last character each slave waits for.
#[derive(Debug)]
pub(super) struct Delimiters {
    usual: u8,
    /// The slaves whose last character may not be the usual one.
    known: BTreeMap<u8, Delimiter>,
}

#[derive(Debug, Clone, Copy)]
struct Delimiter {
    likely: u8,
    other: u8,
    unanswered: u32,
}

impl Delimiters {
    pub(super) const fn new(usual: u8) -> Self {
        Self { usual, known: BTreeMap::new() }
    }

    /// What the next request to this slave ends with.
    pub(super) fn of(&self, slave: u8) -> u8 {
        self.known.get(&slave).map_or(self.usual, |delimiter| delimiter.likely)
    }

    /// A request was carried out or refused: its slave heard the end of it.
    pub(super) fn answered(&mut self, slave: u8, request: &Request<'_>, carried_out: bool) {
        let present = self.of(slave);
        if let Some(new) = new_delimiter(request).filter(|_| carried_out) {
            self.known.insert(slave, Delimiter { likely: new, other: present, unanswered: 0 });
        } else if let Some(delimiter) = self.known.get_mut(&slave) {
            delimiter.unanswered = 0;
        }
    }

    /// A request was not answered: perhaps its slave waited for another last character.
    pub(super) fn unanswered(&mut self, slave: u8, request: &Request<'_>) {
        if let Some(new) = new_delimiter(request) {
            let unchanged = Delimiter { likely: self.usual, other: self.usual, unanswered: 0 };
            self.known.entry(slave).or_insert(unchanged).other = new;
        }
        let Some(delimiter) = self.known.get_mut(&slave) else { return };
        delimiter.unanswered = delimiter.unanswered.saturating_add(1);
        if delimiter.unanswered >= DOUBT_AFTER {
            mem::swap(&mut delimiter.likely, &mut delimiter.other);
        }
    }
}

/// The last character that a request makes its slave wait for: function 08/03, `XX 00`.
pub(super) fn new_delimiter(request: &Request<'_>) -> Option<u8> {
    match request {
        Request::Custom(0x08, data) => match **data {
            [0, 3, new, ..] => Some(new),
            _ => None,
        },
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    const READ: Request<'static> = Request::ReadHoldingRegisters(0, 1);
    const CHANGE: Request<'static> = Request::Custom(0x08, Cow::Borrowed(&[0, 3, b';', 0]));

    #[test]
    fn a_slave_that_confirms_another_character_is_asked_with_it_and_no_other_slave_is() {
        let mut delimiters = Delimiters::new(b'\n');
        delimiters.answered(1, &CHANGE, false);
        assert_eq!(delimiters.of(1), b'\n');
        delimiters.answered(1, &CHANGE, true);
        assert_eq!((delimiters.of(1), delimiters.of(2)), (b';', b'\n'));
    }

    #[test]
    fn a_slave_that_falls_silent_after_a_change_is_asked_both_ways_in_turn() {
        let mut delimiters = Delimiters::new(b'\n');
        delimiters.answered(1, &CHANGE, true);
        let mut asked = Vec::new();
        for _ in 0..4 {
            delimiters.unanswered(1, &READ);
            asked.push(delimiters.of(1));
        }
        assert_eq!(asked, [b';', b'\n', b';', b'\n']);
        delimiters.answered(1, &READ, true);
        delimiters.unanswered(1, &READ);
        assert_eq!(delimiters.of(1), b'\n');
    }

    #[test]
    fn a_change_that_nobody_confirmed_may_have_happened() {
        let mut delimiters = Delimiters::new(b'\n');
        delimiters.unanswered(1, &CHANGE);
        assert_eq!(delimiters.of(1), b'\n');
        delimiters.unanswered(1, &READ);
        assert_eq!(delimiters.of(1), b';');
    }
}
