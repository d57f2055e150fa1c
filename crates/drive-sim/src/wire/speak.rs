//! What the slaves say: onto the wire, with what the faults make of it, and to the master when it has arrived.

use std::time::Duration;

use fastrand::Rng;
use tokio::time::Instant;

use super::{
    Delivery, Pacing, Wire, count_of,
    transmission::{Overlap, Transmission},
};
use crate::{
    fault::{Fault, flip},
    pdu::is_confirmation,
    speech::{Content, Speech},
    state::State,
};

impl Wire {
    /// Puts on the wire what the slaves have to say.
    pub(super) fn answer(&mut self, line: &mut State) {
        for speech in std::mem::take(&mut self.speech) {
            self.say(speech, line);
        }
    }

    /// One answer, with what the faults make of it.
    fn say(&mut self, speech: Speech, line: &mut State) {
        let Speech { slave, content, heard, turnaround } = speech;
        let start = heard + turnaround;
        let (bytes, start) = match content {
            Content::Signal(signal) => (signal, start),
            Content::Message(message) => self.message(slave, message, start, line),
        };
        line.stats.ideal += turnaround + self.time(bytes.len());
        let bytes = self.garble(bytes, line);
        let late = line.faults.strikes(Fault::Late).is_some();
        let start = if late { start + line.faults.lateness() } else { start };
        if line.faults.strikes(Fault::Lost).is_some() {
            return;
        }
        if line.faults.strikes(Fault::Duplicated).is_some() {
            let again = start + self.time(bytes.len()) + self.t3_5();
            self.transmit(slave, start, bytes.clone(), late, line);
            self.transmit(slave, again, bytes, late, line);
        } else {
            self.transmit(slave, start, bytes, late, line);
        }
    }

    /// The frame of a message and its start, after the faults that need to understand it.
    fn message(
        &mut self,
        slave: u8,
        mut message: Vec<u8>,
        start: Instant,
        line: &mut State,
    ) -> (Vec<u8>, Instant) {
        if is_confirmation(&message)
            && let Some(random) = line.faults.strikes(Fault::WrongEcho)
            && let Some(data) = message.get_mut(1..)
        {
            flip(data, 8, random);
        }
        let foreign = line.faults.strikes(Fault::Foreign).map(Rng::fork);
        let Some(mut random) = foreign else { return (self.framing.encode(slave, &message, line), start) };
        let stranger = line.stranger(slave, &mut random);
        let frame = self.framing.encode(stranger, &message, line);
        let after = start + self.time(frame.len()) + self.t3_5();
        self.transmit(stranger, start, frame, false, line);
        (self.framing.encode(slave, &message, line), after)
    }

    /// What the faults that only see characters make of a frame.
    fn garble(&self, mut bytes: Vec<u8>, line: &mut State) -> Vec<u8> {
        if let Some(random) = line.faults.strikes(Fault::Flipped) {
            flip(&mut bytes, self.settings.format().data_bits(), random);
        }
        if let Some(random) = line.faults.strikes(Fault::Truncated) {
            bytes.truncate(random.usize(0..bytes.len().max(1)));
        }
        if let Some(random) = line.faults.strikes(Fault::Noise) {
            let noise = random.usize(1..=4);
            bytes.splice(0..0, std::iter::repeat_with(|| random.u8(..)).take(noise));
        }
        bytes
    }

    fn transmit(&mut self, slave: u8, start: Instant, bytes: Vec<u8>, late: bool, line: &mut State) {
        let mut transmission = Transmission { slave, start, bytes, delivered: 0, late, echo: false };
        let (settings, ends) = (self.settings, start + self.time(transmission.bytes.len()));
        if self.pacing == Pacing::Simulated {
            for other in self.transmissions.iter_mut().filter(|other| !other.echo) {
                if let Some(overlap) = Overlap::of(other, start, ends, settings) {
                    line.stats.slave_collisions += 1;
                    other.damage(overlap, settings);
                    transmission.damage(overlap, settings);
                }
            }
        }
        line.stats.answers += 1;
        if !transmission.bytes.is_empty() {
            self.transmissions.push_back(transmission);
        }
    }

    /// The transmission that has something to deliver first: its index, up to which character, and when.
    pub(super) fn next_delivery(&self) -> Option<(usize, usize, Instant)> {
        let next = |(index, transmission): (usize, &Transmission)| {
            let whole = transmission.bytes.len();
            let upto = match self.delivery {
                Delivery::Whole => whole,
                Delivery::Pieces(size) => (transmission.delivered + size.max(1)).min(whole),
            };
            // A real port paces by itself what it is given.
            let (upto, taken) = if self.pacing == Pacing::Hardware { (whole, 0) } else { (upto, upto) };
            (index, upto, transmission.start + self.time(taken))
        };
        self.transmissions.iter().enumerate().map(next).min_by_key(|(_, _, due)| *due)
    }

    pub(super) fn deliver(
        &mut self,
        index: usize,
        upto: usize,
        due: Instant,
        now: Instant,
        line: &mut State,
    ) -> Vec<u8> {
        let wire_time = self.time(upto);
        let Some(transmission) = self.transmissions.get_mut(index) else { return Vec::new() };
        let piece = transmission.bytes.get(transmission.delivered..upto).unwrap_or_default().to_vec();
        transmission.delivered = upto;
        let is_over = upto == transmission.bytes.len();
        if !transmission.echo {
            // Nobody can hear a character before it is handed over, so a late hand-over is a later end.
            let ends = (transmission.start + wire_time).max(now);
            self.quiet_since = self.quiet_since.max(Some(ends));
            line.stats.last = line.stats.last.max(Some(ends));
            line.stats.characters_out += count_of(piece.len());
            line.stats.lag += if is_over { now.saturating_duration_since(due) } else { Duration::ZERO };
        }
        if is_over
            && let Some(transmission) = self.transmissions.remove(index)
            && !transmission.echo
        {
            line.answered(transmission.slave, (transmission.start + wire_time).max(now));
        }
        piece
    }
}
