//! UNI-TELWAY: the receiver of the link, and the bytes that it was given.

use std::time::Duration;

use drive_unitelway::{Heard, Receiver, data_frame, poll};

use super::{Found, Noise, Split, frame};
use crate::{
    capture::Dissector,
    content::{Content, NoFrame},
    exchange::rtu::MAX_FRAME,
    listen::timed::Timed,
};

pub(super) struct UniTelway {
    chunk_gap: Duration,
    receiver: Receiver,
    /// What the receiver has and has not made anything of.
    received: Timed,
    noise: Noise,
    /// A frame that stands behind noise.
    held: Option<Heard>,
    is_over: bool,
}

impl UniTelway {
    pub(super) fn new(chunk_gap: Duration) -> Self {
        Self {
            chunk_gap,
            receiver: Receiver::default(),
            received: Timed::default(),
            noise: Noise::default(),
            held: None,
            is_over: false,
        }
    }

    fn found(&mut self, heard: Heard) -> Option<Found> {
        let (len, why) = match &heard {
            Heard::Damaged(len) => (*len, NoFrame("the BCC of a data frame does not fit, or it breaks off")),
            Heard::Noise(len) => (*len, NoFrame("nothing that UNI-TELWAY has")),
            intact => {
                if let Some(noise) = self.noise.take() {
                    self.held = Some(heard);
                    return Some(noise);
                }
                let len = match intact {
                    Heard::Poll(slave) => poll(*slave).len(),
                    Heard::Data { address, message } => data_frame(*address, message).len(),
                    _ => 1,
                };
                let content = Content::of(Dissector::Data, self.received.bytes().get(..len)?).ok()?;
                return frame(&mut self.received, len, content);
            }
        };
        let taken = self.received.take(len);
        self.noise.add(taken, why);
        (self.noise.len() >= MAX_FRAME).then(|| self.noise.take()).flatten()
    }
}

impl Split for UniTelway {
    fn push(&mut self, now: Duration, bytes: &[u8]) {
        self.received.push(now, bytes);
        self.receiver.push(bytes);
        self.is_over = false;
    }

    fn next(&mut self) -> Option<Found> {
        loop {
            let given_up = |receiver: &mut Receiver| receiver.give_up();
            let heard = self.held.take().or_else(|| self.receiver.next());
            let heard = heard.or_else(|| if self.is_over { given_up(&mut self.receiver) } else { None });
            let Some(heard) = heard else { return if self.is_over { self.noise.take() } else { None } };
            let found = self.found(heard);
            if found.is_some() {
                return found;
            }
        }
    }

    fn deadline(&self) -> Option<Duration> {
        let is_open = self.receiver.is_open() || self.noise.len() > 0;
        let last = self.received.last().or(self.noise.last());
        last.filter(|_| is_open && !self.is_over).map(|last| last + self.chunk_gap)
    }

    fn give_up(&mut self) {
        self.is_over = true;
    }
}
