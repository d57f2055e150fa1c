//! Modbus ASCII: the receiver of the line's own machine, and the characters that it was given.

use std::time::Duration;

use super::{Found, Noise, Split};
use crate::{
    content::{Content, NoFrame},
    exchange::ascii::{BEGIN, Heard, Receiver},
    exchange::rtu::MAX_FRAME,
    listen::timed::Timed,
};

pub(super) struct Ascii {
    character_gap: Duration,
    receiver: Receiver,
    /// What the receiver has not heard yet.
    coming: Timed,
    /// What it has heard since the last frame ended.
    heard: Timed,
    last: Option<Duration>,
    noise: Noise,
    is_over: bool,
}

impl Ascii {
    pub(super) fn new(character_gap: Duration) -> Self {
        Self {
            character_gap,
            receiver: Receiver::default(),
            coming: Timed::default(),
            heard: Timed::default(),
            last: None,
            noise: Noise::default(),
            is_over: false,
        }
    }

    /// What the receiver has made of everything before the character that it heard last, or with it.
    fn found(&mut self, heard: Heard) -> Option<Found> {
        let taken = self.heard.take(usize::MAX)?;
        Some(match heard {
            Heard::Frame { slave, pdu } => Found::Frame(taken, Content::Pdu { slave, pdu }),
            Heard::Garbled { why, .. } => Found::Damaged(taken, NoFrame(why)),
        })
    }

    fn hear(&mut self) -> Option<Found> {
        let next = self.coming.take(1)?;
        let character = next.bytes.first().copied().unwrap_or_default();
        let was_open = self.receiver.is_open();
        let heard = self.receiver.hear(character);
        if character != BEGIN && !was_open {
            self.noise.add(Some(next), NoFrame("characters outside any frame"));
            return (self.noise.len() >= MAX_FRAME).then(|| self.noise.take()).flatten();
        }
        // `:` begins a frame, whatever it stands in.
        let cut_short = (character == BEGIN).then_some(heard.clone()).flatten();
        let before = cut_short.and_then(|heard| self.found(heard));
        self.heard.push(next.last, &next.bytes);
        if character == BEGIN {
            return before.or_else(|| self.noise.take());
        }
        heard.and_then(|heard| self.found(heard))
    }
}

impl Split for Ascii {
    fn push(&mut self, now: Duration, bytes: &[u8]) {
        self.coming.push(now, bytes);
        self.last = Some(now);
        self.is_over = false;
    }

    fn next(&mut self) -> Option<Found> {
        while !self.coming.is_empty() {
            let found = self.hear();
            if found.is_some() {
                return found;
            }
        }
        if !self.is_over {
            return None;
        }
        let broken_off = self.receiver.give_up();
        broken_off.and_then(|heard| self.found(heard)).or_else(|| self.noise.take())
    }

    fn deadline(&self) -> Option<Duration> {
        let is_open = self.receiver.is_open() || self.noise.len() > 0;
        self.last.filter(|_| is_open && !self.is_over).map(|last| last + self.character_gap)
    }

    fn give_up(&mut self) {
        self.is_over = true;
    }
}
