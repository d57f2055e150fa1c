//! Questions that a far end was asked in vain, and where each stands behind others.

use std::time::Duration;

use tokio::time::Instant;

use crate::shape::Shape;

/// A question in vain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Owed {
    pub(super) slave: u8,
    pub(super) number: Option<u16>,
    pub(super) shape: Shape,
    pub(super) asked: Instant,
    pub(super) until: Instant,
    /// `None`: nobody knows what stands before it.
    pub(super) turn: Option<Turn>,
    /// It was asked over a connection that is gone, and so may be the question.
    pub(super) over_a_lost_port: bool,
}

impl Owed {
    /// Its slave, which has not answered; of what a lost connection has asked nobody knows.
    pub(super) fn given_up(&self) -> Option<u8> {
        (!self.over_a_lost_port).then_some(self.slave)
    }
}

/// Where a question stands behind others, in a far end that does one thing at a time: it is over so many waits behind the moment at which
/// the far end was free. What stood before it and could no longer come counts as well: it was waited for all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Turn {
    pub(super) free_from: Instant,
    pub(super) place: u32,
}

/// A question that was given up, or is under way.
#[derive(Debug, Clone, Copy)]
pub(in crate::master) struct Asked {
    pub(in crate::master) slave: u8,
    pub(in crate::master) number: Option<u16>,
    pub(in crate::master) shape: Shape,
    pub(in crate::master) at: Instant,
    pub(in crate::master) place: Place,
}

/// Behind what a question was sent. What stood before it may be over, as far as is known, when it is given up itself.
#[derive(Debug, Clone, Copy)]
pub(in crate::master) struct Place {
    pub(super) turn: Option<Turn>,
    /// When what stood before it could no longer come.
    pub(super) begins: Option<Instant>,
}

/// How long a far end waits for each that was done at `now` with the question of this turn. `asked`: when that was asked, and those
/// before it, the latest first. Between two it may have been at nothing, so that all of them together show less than the last few:
/// what was asked since then was waited for since then, and no longer.
pub(super) fn waited(now: Instant, turn: Turn, asked: impl Iterator<Item = Instant>) -> Option<Duration> {
    let last_few = (1..turn.place).zip(asked);
    let each = last_few.chain([(turn.place, turn.free_from)]).map(|(places, since)| {
        let waits = crate::mutant!("far-end-waits-for-one", places.max(1), 1);
        now.saturating_duration_since(since) / waits
    });
    each.min().filter(|waited| *waited > Duration::ZERO)
}
