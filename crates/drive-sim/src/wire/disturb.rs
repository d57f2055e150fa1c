//! What the defects of the line do: noise, a second master, and a cable that is disturbed.

use fastrand::Rng;
use tokio::time::Instant;

use super::{
    Wire,
    misheard::{self, Character},
    transmission::{Kind, Transmission},
};
use crate::{
    defects::{Polarity, Rest},
    model::Dialect,
    state::State,
};

impl Wire {
    /// Puts on the wire what neither the master nor its slaves send, as far as its time has come; when there is more.
    pub(super) fn others(&mut self, now: Instant, line: &mut State) -> Option<Instant> {
        while let Some((start, slave, pdu)) = line.defective.next_request()
            && start <= now
        {
            let pdu = pdu.to_vec();
            line.defective.request_made();
            // What was due while nobody was there to hear it is over.
            let is_over = line.defective.next_request().is_some_and(|(next, ..)| next <= now);
            let frame =
                self.ears.first().map(|ear| ear.framing.encode(slave, &pdu, line)).filter(|_| !is_over);
            if let Some(frame) = frame {
                self.foreign(slave, start, &frame, Some(pdu), line);
            }
        }
        self.fall_low(now, line);
        let heard = *self.noise_until.get_or_insert(now);
        let mut next = line.defective.next_burst(heard);
        while let Some((begins, ends)) = next.filter(|(begins, _)| *begins <= now) {
            self.noise_until = Some(begins);
            if !self.is_busy(begins) {
                let character = self.time(1, self.master.settings).as_nanos().max(1);
                let count = ((ends - begins).as_nanos() / character).max(1);
                let bytes: Vec<u8> = (0..count).map(|_| line.defective.stray()).collect();
                self.foreign(0, begins, &bytes, None, line);
            }
            next = line.defective.next_burst(begins);
        }
        let request = line.defective.next_request().map(|(start, ..)| start);
        let falls_low = self.falls_low_at(now, line);
        request.into_iter().chain(next.map(|(begins, _)| begins)).chain(falls_low).min()
    }

    /// What noise and interference make of the master's characters on their way.
    pub(super) fn disturb_request(&self, begins: Instant, heard: &mut [u8], line: &mut State) {
        if let Some(random) = heard.first().and_then(|slave| interference(*slave, begins, line)) {
            damage(heard.iter_mut(), random);
        }
        if line.defective.defects.noise.is_some() {
            let settings = self.master.settings;
            for (index, byte) in heard.iter_mut().enumerate() {
                let [begins, ends] = [index, index + 1].map(|count| begins + self.time(count, settings));
                *byte = line.defective.disturb(*byte, begins, ends);
            }
        }
    }

    /// What they make of a slave's.
    pub(super) fn disturb_answer(&self, answer: &mut Transmission, line: &mut State) {
        if let Some(random) = interference(answer.slave, answer.start, line) {
            damage(answer.characters.iter_mut().map(|character| &mut character.byte), random);
        }
        if line.defective.defects.noise.is_some() {
            let (start, settings) = (answer.start, answer.dialect.settings);
            for Character { byte, begins, ends, .. } in &mut answer.characters {
                let (begins, ends) = (start + settings.bits(*begins), start + settings.bits(*ends));
                *byte = line.defective.disturb(*byte, begins, ends);
            }
        }
    }

    /// Where A and B are swapped and the line has its bias, the receiver of the master sees a break as soon as nobody drives the
    /// line: a character that is low from its start to behind its stop bit.
    fn fall_low(&mut self, now: Instant, line: &State) {
        if line.defective.defects.swapped != Some(Rest::Low) {
            return;
        }
        let settings = self.master.settings;
        let free = self.run.map_or(now, |(start, count)| start + self.time(count, settings));
        if free > now
            || self.fell_low.is_some_and(|at| at >= free)
            || self.fell_low.is_some() && self.run.is_none()
        {
            return;
        }
        self.fell_low = Some(free);
        let characters =
            vec![Character { byte: 0, begins: 0, ends: settings.format().bits(), intact: false }];
        let (dialect, takes) = (Dialect { settings, ..Dialect::default() }, self.time(1, settings));
        let kind = Kind::Noise;
        self.transmissions.push_back(Transmission {
            slave: 0,
            dialect,
            start: free,
            characters,
            takes,
            delivered: 0,
            late: false,
            kind,
        });
    }

    /// When the line will be left by the master, where that is heard.
    fn falls_low_at(&self, now: Instant, line: &State) -> Option<Instant> {
        line.defective.defects.swapped.filter(|rest| *rest == Rest::Low)?;
        let (start, count) = self.run?;
        Some(start + self.time(count, self.master.settings)).filter(|free| *free > now)
    }

    /// Whether anybody sends at this moment.
    fn is_busy(&self, at: Instant) -> bool {
        let sends = |transmission: &Transmission| {
            transmission.start <= at && at < transmission.start + transmission.takes
        };
        let settings = self.master.settings;
        let asks =
            self.run.is_some_and(|(start, count)| start <= at && at < start + self.time(count, settings));
        asks || self.transmissions.iter().any(sends)
    }

    /// Characters of somebody else: noise, or the request of a second master with this PDU.
    fn foreign(&mut self, slave: u8, start: Instant, bytes: &[u8], pdu: Option<Vec<u8>>, line: &mut State) {
        let Some(dialect) = self.ears.first().map(|ear| ear.dialect) else { return };
        let settings = if pdu.is_some() { dialect.settings } else { self.master.settings };
        let polarity = if pdu.is_some() { line.defective.polarity() } else { Polarity::Right };
        let characters = misheard::heard_as(polarity, bytes, settings, self.master.settings);
        let kind = match pdu {
            Some(pdu) => Kind::Request { sent: characters.clone(), pdu },
            None => Kind::Noise,
        };
        let takes = self.time(bytes.len(), settings);
        self.put(
            Transmission { slave, dialect, start, characters, takes, delivered: 0, late: false, kind },
            line,
        );
    }
}

/// What a cable that is disturbed by somebody else's motor does to a frame of a slave, if it does anything now.
fn interference(slave: u8, at: Instant, line: &mut State) -> Option<Rng> {
    line.defective.defects.interference?;
    let source = line.defective.interferes(slave)?;
    let is_running = line.places().into_iter().any(|place| {
        line.at(place).is_some_and(|other| other.address() == source && other.observe(at).running)
    });
    if is_running { line.defective.strike() } else { None }
}

/// Damages one character behind the first, and some of the others.
fn damage<'a>(bytes: impl ExactSizeIterator<Item = &'a mut u8>, mut random: Rng) {
    let first = random.usize(1..bytes.len().max(2));
    for (index, byte) in bytes.enumerate().skip(1) {
        if index == first || random.u8(..) < 64 {
            *byte ^= random.u8(1..);
        }
    }
}
