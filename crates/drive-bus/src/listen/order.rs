//! Who says what, told by the form of a frame and by what was said before it.

use std::time::Duration;

use super::Role;
use crate::{
    answer::{Extent, extent_of_request, extent_unasked},
    content::{Content, Signal},
    shape::Shape,
};

/// What is known of the conversation.
#[derive(Debug)]
pub(super) struct Order {
    /// After so long a silence nobody is answered any more.
    patience: Duration,
    last: Duration,
    /// Whether everything since the last silence or the last frame of one form alone is understood.
    is_sure: bool,
    open: Open,
}

/// What may come now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Open {
    Nothing,
    /// The answer to a Modbus request: from this slave, of this shape.
    Answer(u8, Shape),
    /// What the slave has to say that was polled.
    Polled(u8),
    /// The word to a data frame of the master to this slave, or of this slave.
    WordOfSlave(u8),
    WordOfMaster(u8),
}

impl Order {
    pub(super) const fn new(patience: Duration, now: Duration) -> Self {
        Self { patience, last: now, is_sure: false, open: Open::Nothing }
    }

    /// Whose frame this is that began and ended at these times, and which slave it is for or from.
    pub(super) fn role(&mut self, first: Duration, last: Duration, content: &Content) -> (Role, Option<u8>) {
        if first.saturating_sub(self.last) >= self.patience {
            self.is_sure = true;
            self.open = Open::Nothing;
        }
        self.last = last;
        match content {
            Content::Pdu { slave, pdu } => (self.modbus(*slave, pdu), Some(*slave)),
            Content::Poll { slave } => {
                self.is_sure = true;
                self.open = Open::Polled(*slave);
                (Role::Request, Some(*slave))
            }
            Content::Message { slave, .. } => (self.message(*slave), Some(*slave)),
            Content::Signal(signal) => self.signal(*signal),
        }
    }

    /// Something came that nobody understands.
    pub(super) const fn disturbed(&mut self, last: Duration) {
        self.last = last;
        self.is_sure = false;
        if !matches!(self.open, Open::Answer(..)) {
            self.open = Open::Nothing;
        }
    }

    fn modbus(&mut self, slave: u8, pdu: &[u8]) -> Role {
        let fits = |open| matches!(open, Open::Answer(asked, shape) if asked == slave && answers(shape, pdu));
        let role = match forms(pdu) {
            (true, false) => Role::Request,
            (false, true) => Role::Answer,
            // A request is not sent again before its answer is overdue.
            _ if self.is_sure && fits(self.open) => Role::Answer,
            _ if self.is_sure => Role::Request,
            _ => return Role::Either,
        };
        self.is_sure = true;
        self.open = match role {
            Role::Request if slave != 0 => Open::Answer(slave, Shape::of_answer_to(pdu)),
            _ => Open::Nothing,
        };
        role
    }

    fn message(&mut self, slave: u8) -> Role {
        let role = match self.open {
            Open::Polled(polled) if polled == slave => Role::Answer,
            _ if self.is_sure => Role::Request,
            _ => Role::Either,
        };
        self.open = match role {
            Role::Answer => Open::WordOfMaster(slave),
            Role::Request => Open::WordOfSlave(slave),
            _ => Open::Nothing,
        };
        role
    }

    fn signal(&mut self, signal: Signal) -> (Role, Option<u8>) {
        let (role, slave) = match (self.open, signal) {
            (Open::Polled(slave), Signal::NothingToSay) => (Role::Answer, Some(slave)),
            (Open::WordOfSlave(slave), Signal::Taken | Signal::Refused) => (Role::Answer, Some(slave)),
            (Open::WordOfMaster(slave), Signal::Taken | Signal::Refused) => (Role::Request, Some(slave)),
            _ => (Role::Either, None),
        };
        self.open = Open::Nothing;
        (role, slave)
    }
}

/// Whether a PDU can be a request, and whether it can be an answer.
fn forms(pdu: &[u8]) -> (bool, bool) {
    let fits = |extent| match extent {
        Extent::Exactly(len) => len == pdu.len(),
        Extent::Either(short, long) => [short, long].contains(&pdu.len()),
        Extent::From(_) => true,
        Extent::AtLeast(_) | Extent::Never => false,
    };
    // Words are pairs of bytes: three bytes are no words.
    let is_answer = !matches!(pdu, [0x03 | 0x04, 3, ..]) && fits(extent_unasked(pdu));
    (fits(extent_of_request(pdu)), is_answer)
}

/// Whether this is the answer of that shape, or its refusal.
fn answers(shape: Shape, pdu: &[u8]) -> bool {
    let heard = Shape::heard(pdu);
    heard == shape || heard.is_refusal_of(shape)
}
