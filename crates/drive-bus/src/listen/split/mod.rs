//! Where one frame ends and the next begins, told by what the bytes say and by their check. Pauses only tell that a frame
//! goes on no more: those that a host sees are not those of the line.

#[cfg(feature = "ascii")]
mod ascii;
mod rtu;
#[cfg(feature = "unitelway")]
mod unitelway;

use std::time::Duration;

use super::timed::{Taken, Timed};
use crate::{
    config::LineConfig,
    content::{Content, NoFrame},
    protocol::Protocol,
};

/// What was found, in the order in which it came.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Found {
    Frame(Taken, Content),
    Damaged(Taken, NoFrame),
}

/// The splitter of one protocol.
pub(super) trait Split: Send {
    /// Takes what there is now.
    fn push(&mut self, now: Duration, bytes: &[u8]);

    /// What is found next; `None`: more bytes are needed, or [`deadline`](Self::deadline).
    fn next(&mut self) -> Option<Found>;

    /// When what has begun goes on no more, unless bytes come before.
    fn deadline(&self) -> Option<Duration>;

    /// The deadline has passed.
    fn give_up(&mut self);
}

/// The splitter of what a line of this configuration speaks; `None` for Modbus TCP, which cannot be listened to.
pub(super) fn of(config: &LineConfig) -> Option<Box<dyn Split>> {
    let chunk_gap = config.chunk_gap.max(config.serial.t3_5());
    Some(match config.protocol {
        Protocol::Rtu => Box::new(rtu::Rtu::new(config.serial.t3_5(), chunk_gap)),
        #[cfg(feature = "tcp")]
        Protocol::Tcp => return None,
        #[cfg(feature = "ascii")]
        Protocol::Ascii(settings) => Box::new(ascii::Ascii::new(settings.character_gap)),
        #[cfg(feature = "unitelway")]
        Protocol::UniTelway(_) => Box::new(unitelway::UniTelway::new(chunk_gap)),
    })
}

/// Bytes that make no frame, until a frame follows them or they are as many as one has.
#[derive(Debug, Default)]
struct Noise(Option<(Taken, NoFrame)>);

impl Noise {
    fn add(&mut self, taken: Option<Taken>, why: NoFrame) {
        let Some(taken) = taken else { return };
        self.0 = Some(match self.0.take() {
            Some((before, why)) => (before.and(taken), why),
            None => (taken, why),
        });
    }

    fn len(&self) -> usize {
        self.0.as_ref().map_or(0, |(taken, _)| taken.bytes.len())
    }

    fn last(&self) -> Option<Duration> {
        self.0.as_ref().map(|(taken, _)| taken.last)
    }

    fn take(&mut self) -> Option<Found> {
        self.0.take().map(|(taken, why)| Found::Damaged(taken, why))
    }
}

/// Takes the first `len` bytes as the frame that carries this.
fn frame(received: &mut Timed, len: usize, content: Content) -> Option<Found> {
    received.take(len).map(|taken| Found::Frame(taken, content))
}
