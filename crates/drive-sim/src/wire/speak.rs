//! What the slaves say: onto the wire, with what the faults make of it, and to the master when it has arrived.

use std::time::Duration;

use fastrand::Rng;
use tokio::time::Instant;

use super::{
    Delivery, Pacing, Wire, count_of, misheard,
    transmission::{Kind, Overlap, Transmission},
};
use crate::{
    defects::Unheard,
    fault::{Fault, flip},
    model::Dialect,
    pdu::is_confirmation,
    speech::{Content, Speech},
    state::State,
};

impl Wire {
    /// Puts on the wire what the slaves have to say.
    pub(super) fn answer(&mut self, line: &mut State) {
        for (ear, speech) in std::mem::take(&mut self.speech) {
            self.say(ear, speech, line);
        }
    }

    /// One answer, with what the faults make of it.
    fn say(&mut self, ear: usize, speech: Speech, line: &mut State) {
        let Speech { slave, content, heard, turnaround, is_to_another } = speech;
        let Some(dialect) = self.ears.get(ear).map(|ear| ear.dialect) else { return };
        let start = heard + turnaround;
        let (bytes, start) = match content {
            Content::Signal(signal) => (signal, start),
            Content::Message(message) => self.message(ear, slave, message, start, line),
        };
        line.stats.ideal += turnaround + self.time(bytes.len(), dialect.settings);
        let bytes = garble(bytes, dialect, line);
        let late = line.faults.strikes(Fault::Late).is_some();
        let start = if late { start + line.faults.lateness() } else { start };
        if line.faults.strikes(Fault::Lost).is_some() {
            return;
        }
        if line.faults.strikes(Fault::Duplicated).is_some() {
            let again = start + self.time(bytes.len(), dialect.settings) + self.t3_5(dialect.settings);
            self.transmit((slave, dialect), start, &bytes, (late, is_to_another), line);
            self.transmit((slave, dialect), again, &bytes, (late, is_to_another), line);
        } else {
            self.transmit((slave, dialect), start, &bytes, (late, is_to_another), line);
        }
    }

    /// The frame of a message and its start, after the faults that need to understand it.
    fn message(
        &mut self,
        ear: usize,
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
        let Some(heard) = self.ears.get(ear) else { return (Vec::new(), start) };
        let frame = heard.framing.encode(slave, &message, line);
        let Some(mut random) = foreign else { return (frame, start) };
        let (stranger, dialect) = (line.stranger(slave, &mut random), heard.dialect);
        let foreign = heard.framing.encode(stranger, &message, line);
        let after = start + self.time(foreign.len(), dialect.settings) + self.t3_5(dialect.settings);
        self.transmit((stranger, dialect), start, &foreign, (false, false), line);
        (frame, after)
    }

    fn transmit(
        &mut self,
        (slave, dialect): (u8, Dialect),
        start: Instant,
        bytes: &[u8],
        (late, is_to_another): (bool, bool),
        line: &mut State,
    ) {
        line.stats.answers += 1;
        let takes = self.time(bytes.len(), dialect.settings);
        let polarity = line.defective.polarity();
        let characters = misheard::heard_as(polarity, bytes, dialect.settings, self.master.settings);
        let kind = if is_to_another { Kind::AnswerToAnother } else { Kind::Answer };
        let mut transmission =
            Transmission { slave, dialect, start, characters, takes, delivered: 0, late, kind };
        self.disturb_answer(&mut transmission, line);
        self.put(transmission, line);
    }

    /// Puts something on the wire, and damages it and what others send at the same time.
    pub(super) fn put(&mut self, mut transmission: Transmission, line: &mut State) {
        let (start, ends) = (transmission.start, transmission.start + transmission.takes);
        if self.pacing == Pacing::Simulated {
            for other in self.transmissions.iter_mut().filter(|other| !other.is_echo()) {
                if let Some(overlap) = Overlap::of(other, start, ends) {
                    line.stats.slave_collisions += 1;
                    if other.merge(&transmission) {
                        return;
                    }
                    if other.is_of_the_same_address(&transmission) {
                        other.speak_over(&transmission, overlap);
                        return;
                    }
                    other.damage(overlap);
                    transmission.damage(overlap);
                }
            }
        }
        if !transmission.characters.is_empty() || !transmission.takes.is_zero() {
            self.transmissions.push_back(transmission);
        }
    }

    /// The transmission that has something to deliver first: its index, up to which character, and when.
    pub(super) fn next_delivery(&self, line: &State) -> Option<(usize, usize, Instant)> {
        let next = |(index, transmission): (usize, &Transmission)| {
            let whole = transmission.characters.len();
            let first = (transmission.delivered + 1).min(whole);
            if let Some(handed_over) = line.defective.handed_over(self.ends(transmission, first)) {
                let arrived =
                    (first..=whole).take_while(|&upto| self.ends(transmission, upto) <= handed_over);
                return (index, arrived.last().unwrap_or(whole), handed_over);
            }
            let pieces = line.defective.next_piece(transmission.delivered, whole);
            if let Some((upto, later)) = pieces.filter(|_| transmission.kind == Kind::Answer) {
                return (index, upto, self.ends(transmission, upto) + later);
            }
            let upto = match self.delivery {
                Delivery::Whole => whole,
                Delivery::Pieces(size) => (transmission.delivered + size.max(1)).min(whole),
            };
            // A real port paces by itself what it is given.
            let (upto, ends) = match self.pacing {
                Pacing::Hardware => (whole, transmission.start),
                Pacing::Simulated | Pacing::None => (upto, self.ends(transmission, upto)),
            };
            (index, upto, ends)
        };
        self.transmissions.iter().enumerate().map(next).min_by_key(|(_, _, due)| *due)
    }

    /// When so many characters of a transmission are on the wire.
    fn ends(&self, transmission: &Transmission, characters: usize) -> Instant {
        let last = characters.checked_sub(1).and_then(|last| transmission.characters.get(last));
        let takes = match last {
            _ if characters == transmission.characters.len() => transmission.takes,
            Some(last) if self.pacing != Pacing::None => transmission.dialect.settings.bits(last.ends),
            Some(_) | None => Duration::ZERO,
        };
        transmission.start + takes
    }

    pub(super) fn deliver(
        &mut self,
        index: usize,
        upto: usize,
        due: Instant,
        now: Instant,
        line: &mut State,
    ) -> Vec<u8> {
        let on_the_wire = self.transmissions.get(index).map(|transmission| self.ends(transmission, upto));
        let Some(transmission) = self.transmissions.get_mut(index) else { return Vec::new() };
        let heard = transmission.characters.get(transmission.delivered..upto).unwrap_or_default();
        let is_unheard = matches!(
            (&transmission.kind, line.defective.unheard()),
            (Kind::Request { .. }, Some(Unheard::Requests)) | (Kind::AnswerToAnother, Some(Unheard::Answers))
        );
        let piece = if is_unheard { Vec::new() } else { self.master.errors.read(heard) };
        transmission.delivered = upto;
        let is_over = upto == transmission.characters.len();
        // Nobody can hear a character before it is handed over, so a late hand-over is a later end.
        let ends = on_the_wire.unwrap_or(now).max(now);
        if !transmission.is_echo() {
            self.quiet_since = self.quiet_since.max(Some(ends));
            line.stats.last = line.stats.last.max(Some(ends));
            line.stats.characters_out += count_of(piece.len());
            line.stats.lag += if is_over { now.saturating_duration_since(due) } else { Duration::ZERO };
        }
        if is_over && let Some(transmission) = self.transmissions.remove(index) {
            match transmission.kind {
                Kind::Answer | Kind::AnswerToAnother => line.answered(transmission.slave, ends),
                Kind::Request { sent, pdu } if sent == transmission.characters => {
                    (line.reached, line.frame_began) = (Some(transmission.dialect), Some(transmission.start));
                    let at = on_the_wire.unwrap_or(now);
                    let said = line.request(at, transmission.slave, &pdu);
                    let said = said.into_iter().map(|speech| Speech { is_to_another: true, ..speech });
                    self.speech.extend(said.map(|speech| (0, speech)));
                }
                Kind::Request { .. } | Kind::Echo | Kind::Noise => {}
            }
        }
        piece
    }
}

/// What the faults that only see characters make of a frame.
fn garble(mut bytes: Vec<u8>, dialect: Dialect, line: &mut State) -> Vec<u8> {
    if let Some(random) = line.faults.strikes(Fault::Flipped) {
        flip(&mut bytes, dialect.settings.format().data_bits(), random);
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
