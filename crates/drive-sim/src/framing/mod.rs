//! What a protocol does with the characters of a line, seen from its slaves.

mod ascii;
pub(crate) mod rtu;
mod unitelway;

use std::time::Duration;

use tokio::time::Instant;

use self::{ascii::Ascii, rtu::Rtu, unitelway::UniTelway};

use crate::{
    model::Protocol,
    speech::{Content, Speech},
    state::State,
};

/// The slaves' side of a protocol, that has heard nothing yet.
pub(crate) fn of(protocol: Protocol) -> Box<dyn Framing> {
    match protocol {
        Protocol::Rtu => Box::new(Rtu::default()),
        Protocol::Ascii => Box::new(Ascii::default()),
        Protocol::UniTelway => Box::new(UniTelway::default()),
    }
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

    /// A character of which parity or stop bit is wrong: the frame that it belongs to is none.
    fn damaged(&mut self, at: Instant, line: &mut State);

    /// Whether the end of the frame that has begun is still to come, as far as its characters tell.
    fn awaits_more(&self) -> bool;

    /// The silence that ends a frame.
    fn silence(&mut self, line: &mut State, speech: &mut Vec<Speech>);

    /// An answer that was held back is released: said at once, or kept until its slave may speak.
    fn release(&mut self, slave: u8, message: Vec<u8>, now: Instant) -> Option<Speech> {
        let content = Content::Message(message);
        Some(Speech { slave, content, heard: now, turnaround: Duration::ZERO, is_to_another: false })
    }

    /// The frame of a message.
    fn encode(&self, slave: u8, message: &[u8], line: &State) -> Vec<u8>;
}
