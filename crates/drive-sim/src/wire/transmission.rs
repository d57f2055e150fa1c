//! What slaves send, and where it overlaps with what others send.

use std::time::Duration;

use tokio::time::Instant;

use super::misheard::Character;
use crate::model::Dialect;

/// What is or will be on the wire towards the master.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Transmission {
    pub(super) slave: u8,
    pub(super) dialect: Dialect,
    pub(super) start: Instant,
    /// As the master hears them.
    pub(super) characters: Vec<Character>,
    /// The time on the wire.
    pub(super) takes: Duration,
    pub(super) delivered: usize,
    pub(super) late: bool,
    pub(super) kind: Kind,
}

/// Whose characters these are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    /// A slave's.
    Answer,
    /// A slave's to a second master.
    AnswerToAnother,
    /// The adapter's echo of the master's own: it is no use of the line.
    Echo,
    /// Nobody's.
    Noise,
    /// A second master's: this PDU, if it arrives as it was sent.
    Request { sent: Vec<Character>, pdu: Vec<u8> },
}

impl Transmission {
    pub(super) fn is_echo(&self) -> bool {
        self.kind == Kind::Echo
    }

    /// Whether it is another answer in the name of the same slave, to the same request.
    pub(super) fn is_of_the_same_address(&self, other: &Self) -> bool {
        let answers = |one: &Self| matches!(one.kind, Kind::Answer | Kind::AnswerToAnother) && !one.late;
        answers(self) && answers(other) && (self.slave, self.dialect) == (other.slave, other.dialect)
    }

    /// Inverts the characters that fall into a span and are not yet delivered.
    pub(super) fn damage(&mut self, overlap: Overlap) {
        let (start, settings) = (self.start, self.dialect.settings);
        for character in self.characters.iter_mut().skip(self.delivered) {
            let begins = start + settings.bits(character.begins);
            if overlap.touches(begins, start + settings.bits(character.ends)) {
                character.byte = !character.byte;
            }
        }
    }

    /// Takes in what another slave says at the same moment and in the same way: who listens hears one of them, intact where
    /// they say the same. `false`: they do not begin together.
    pub(super) fn merge(&mut self, other: &Self) -> bool {
        let is_together =
            (self.start, self.dialect, self.delivered) == (other.start, other.dialect, other.delivered);
        if !is_together {
            return false;
        }
        for (own, other) in self.characters.iter_mut().zip(&other.characters) {
            if own.byte != other.byte {
                own.byte = !own.byte;
            }
        }
        self.characters.extend_from_slice(other.characters.get(self.characters.len()..).unwrap_or_default());
        self.takes = self.takes.max(other.takes);
        true
    }

    /// Takes in what another slave with the same address begins to say while this one speaks: one UART hears them, nothing
    /// whole from there on, and no more characters than there is time for.
    pub(super) fn speak_over(&mut self, other: &Self, overlap: Overlap) {
        self.damage(overlap);
        let (over, settings) = (self.start + self.takes, other.dialect.settings);
        let shift = other.start.saturating_duration_since(self.start);
        let bits = u32::try_from(shift.as_nanos() / settings.bits(1).as_nanos().max(1)).unwrap_or(u32::MAX);
        let behind =
            other.characters.iter().filter(|character| other.start + settings.bits(character.begins) >= over);
        self.characters.extend(behind.map(|character| Character {
            byte: !character.byte,
            begins: character.begins.saturating_add(bits),
            ends: character.ends.saturating_add(bits),
            intact: character.intact,
        }));
        self.takes = self.takes.max(shift + other.takes);
    }
}

/// A span of time in which two parties send.
#[derive(Debug, Clone, Copy)]
pub(super) struct Overlap {
    begins: Instant,
    ends: Instant,
}

impl Overlap {
    pub(super) fn of(transmission: &Transmission, begins: Instant, ends: Instant) -> Option<Self> {
        let over = transmission.start + transmission.takes;
        let span = Self { begins: begins.max(transmission.start), ends: ends.min(over) };
        (span.begins < span.ends).then_some(span)
    }

    /// Whether a character between these moments falls into it.
    pub(super) fn touches(self, begins: Instant, ends: Instant) -> bool {
        begins < self.ends && ends > self.begins
    }
}
