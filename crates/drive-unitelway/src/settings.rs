//! What a UNI-TELWAY line can be set to, and how long its frames and exchanges are.

use std::time::Duration;

use crate::{
    frame,
    network::{NetworkHeader, STANDARD_LEN},
};

/// Start bit, 8 data bits, odd parity, stop bit: the link has one format.
const CHARACTER_BITS: u64 = 11;

/// How many replies that are not its request's an exchange takes from a slave: more than any is known to keep.
pub(crate) const LEFTOVERS: u32 = 16;
/// Characters of a poll.
pub(crate) const POLL_LEN: usize = 3;
/// The highest category of a request.
const CATEGORIES: u8 = 7;

/// What a UNI-TELWAY line can be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UniTelwaySettings {
    /// The network header. Which form the card VW3-A58303 needs is not printed.
    pub header: NetworkHeader,
    /// The category in each request, 0 to 7. The manual's sample has 7 (p. 12/36).
    pub category: u8,
    /// The silence before each of our transmissions inside an exchange, in bits.
    pub silence_bits: u32,
    /// How long a slave may take to begin its acknowledgement, or what it answers to a poll.
    pub link_timeout: Duration,
    /// From a poll that brought nothing, or a refusal, to the next attempt, at first; it grows with the time that the
    /// slave has kept us waiting. Other slaves are served meanwhile.
    pub poll_pause: Duration,
    /// How often a damaged reply is refused, so that the slave sends it again.
    pub repeats: u32,
    /// How long a slave may go on refusing a request (NAK), because it is busy.
    pub busy_timeout: Duration,
}

impl Default for UniTelwaySettings {
    /// The standard header, category 7, 10 bits, 100 ms, 5 ms, 1, 1 s. None but the category stands in the card's manual; the
    /// others are those of public implementations, or chosen so that a slow slave is not lost.
    fn default() -> Self {
        Self {
            header: NetworkHeader::default(),
            category: CATEGORIES,
            silence_bits: 10,
            link_timeout: Duration::from_millis(100),
            poll_pause: Duration::from_millis(5),
            repeats: 1,
            busy_timeout: Duration::from_secs(1),
        }
    }
}

impl UniTelwaySettings {
    /// Whether the category is one.
    #[must_use]
    pub const fn is_category(&self) -> bool {
        self.category <= CATEGORIES
    }
}

/// The speed of a line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Speed(u32);

impl Speed {
    /// That of so many bit/s.
    pub(crate) const fn new(baud: u32) -> Self {
        Self(if baud == 0 { 1 } else { baud })
    }

    /// The time that so many bits take, rounded up to the next nanosecond.
    pub(crate) fn bits(self, bits: u32) -> Duration {
        self.time(bits.into())
    }

    /// The time that so many characters take.
    pub(crate) fn characters(self, characters: usize) -> Duration {
        self.time(characters as u64 * CHARACTER_BITS)
    }

    fn time(self, bits: u64) -> Duration {
        Duration::from_nanos(bits.saturating_mul(1_000_000_000).div_ceil(u64::from(self.0)))
    }
}

/// How long an exchange may hold the line at the most, from its first bit until a stop to another slave may be sent, when
/// everything goes wrong that the settings still put up with. Request and replies have so many characters at the most.
#[must_use]
pub fn longest(
    baud: u32,
    settings: UniTelwaySettings,
    chunk_gap: Duration,
    request: usize,
    reply: usize,
) -> Duration {
    let speed = Speed::new(baud);
    let said = |characters| speed.bits(settings.silence_bits) + speed.characters(characters);
    // A request; a poll with a reply, and our word to it; the last poll, which may bring one more.
    let asked = said(request) + settings.link_timeout + speed.characters(1);
    let polled = said(POLL_LEN) + settings.link_timeout + speed.characters(reply) + chunk_gap + said(1);
    asked + polled * 2
}

/// How many characters the data frame has that carries a Modbus PDU of this length, without doubled bytes.
#[must_use]
pub const fn request_len(pdu: usize) -> usize {
    frame::len(pdu + STANDARD_LEN + 4)
}

/// How many characters come and go from the end of a request to the end of its exchange: two acknowledgements, two polls,
/// the reply and an EOT.
#[must_use]
pub const fn reply_len(pdu: usize) -> usize {
    3 + 2 * POLL_LEN + frame::len(pdu + STANDARD_LEN)
}
