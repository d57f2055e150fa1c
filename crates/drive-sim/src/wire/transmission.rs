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
    /// The adapter's echo of the master's own characters: it is no use of the line.
    pub(super) echo: bool,
}

impl Transmission {
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
