//! What a protocol does with the characters of a line, seen from its slaves.

mod ascii;
pub(crate) mod rtu;
mod unitelway;

use std::time::Duration;

use tokio::time::Instant;

pub(crate) use self::{ascii::Ascii, rtu::Rtu, unitelway::UniTelway};

use crate::state::State;

/// Something that a slave is about to say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Speech {
    pub(crate) slave: u8,
    pub(crate) content: Content,
    /// When the last bit of what it answers was on the wire, and how long the slave waits after it.
    pub(crate) heard: Instant,
    pub(crate) turnaround: Duration,
}

/// What is said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Content {
    /// A message, still to be put into a frame.
    Message(Vec<u8>),
    /// Characters of the protocol itself, such as an acknowledgement.
    Signal(Vec<u8>),
}

/// The slaves' side of a protocol. It has no clock: it is told when each character ended, and when a
/// silence has ended a frame.
pub(crate) trait Framing: Send {
    /// Whether the next character begins a frame.
    fn is_between_frames(&self) -> bool;

    /// Whether the protocol asks for t3.5 between frames and t1.5 inside them.
    fn keeps_silences(&self) -> bool;

    /// The silence after which a frame that has begun is over, on a line with this t3.5.
    fn frame_timeout(&self, t3_5: Duration) -> Duration;

    /// A character whose last bit was on the wire at this moment.
    fn byte(&mut self, byte: u8, at: Instant, line: &mut State, speech: &mut Vec<Speech>);

    /// Whether the end of the frame that has begun is still to come, as far as its characters tell.
    fn awaits_more(&self) -> bool;

    /// The silence that ends a frame.
    fn silence(&mut self, line: &mut State, speech: &mut Vec<Speech>);

    /// An answer that was held back is released: said at once, or kept until its slave may speak.
    fn release(&mut self, slave: u8, message: Vec<u8>, now: Instant) -> Option<Speech> {
        Some(Speech { slave, content: Content::Message(message), heard: now, turnaround: Duration::ZERO })
    }

    /// The frame of a message.
    fn encode(&self, slave: u8, message: &[u8], line: &State) -> Vec<u8>;
}
