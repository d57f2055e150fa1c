//! What slaves send, and where it overlaps with what others send.

use drive_core::SerialSettings;
use tokio::time::Instant;

/// What is or will be on the wire towards the master.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Transmission {
    pub(super) slave: u8,
    pub(super) start: Instant,
    pub(super) bytes: Vec<u8>,
    pub(super) delivered: usize,
    pub(super) late: bool,
    /// The adapter's echo of the master's own characters: it is no use of the line.
    pub(super) echo: bool,
}

impl Transmission {
    /// Inverts the characters that fall into a span and are not yet delivered.
    pub(super) fn damage(&mut self, overlap: Overlap, settings: SerialSettings) {
        for (index, byte) in self.bytes.iter_mut().enumerate().skip(self.delivered) {
            if overlap.touches(self.start + settings.characters(index), settings) {
                *byte = !*byte;
            }
        }
    }
}

/// A span of time in which two parties send.
#[derive(Debug, Clone, Copy)]
pub(super) struct Overlap {
    begins: Instant,
    ends: Instant,
}

impl Overlap {
    pub(super) fn of(
        transmission: &Transmission,
        begins: Instant,
        ends: Instant,
        settings: SerialSettings,
    ) -> Option<Self> {
        let over = transmission.start + settings.characters(transmission.bytes.len());
        let span = Self { begins: begins.max(transmission.start), ends: ends.min(over) };
        (span.begins < span.ends).then_some(span)
    }

    /// Whether a character that begins at this moment falls into it.
    pub(super) fn touches(self, character: Instant, settings: SerialSettings) -> bool {
        character < self.ends && character + settings.characters(1) > self.begins
    }
}
