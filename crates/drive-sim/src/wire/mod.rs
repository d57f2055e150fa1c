//! The wire: which character is on it when, who speaks, and what rule is broken. No clock and no I/O: `now` is an
//! argument.

mod disturb;
mod ear;
mod misheard;
mod speak;
mod transmission;

use std::{collections::VecDeque, time::Duration};

use drive_core::SerialSettings;
use tokio::time::Instant;

use self::{
    ear::Ear,
    transmission::{Kind, Overlap, Transmission},
};

#[cfg(unix)]
pub(crate) use self::ear::Errors;
pub(crate) use self::ear::Master;
use crate::{
    fault::{Fault, flip},
    model::Dialect,
    record::Breach,
    speech::Speech,
    state::State,
};

/// The silence that ends a frame where characters take no time: what a busy machine may pause between two pieces.
const UNPACED_TIMEOUT: Duration = Duration::from_millis(50);

/// How time passes on a wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pacing {
    /// Characters take their time here, because what carries them (memory, a pty, TCP) takes none.
    Simulated,
    /// A real port paces what we write; what we read has just ended.
    Hardware,
    /// Characters take no time: for measurements of everything else.
    None,
}

/// In which pieces an answer reaches the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// Whole, when its last bit has arrived.
    #[default]
    Whole,
    /// So many characters at a time, each piece when its last bit has arrived; 1: character by character.
    Pieces(usize),
}

/// What the wire's task does next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Step {
    /// Hand these characters to the master now.
    Send(Vec<u8>),
    /// Nothing before this moment, or before something is received.
    Wait(Option<Instant>),
}

/// One end of a half-duplex line, with the slaves' side of its protocol.
pub(crate) struct Wire {
    /// How the master's port is set.
    master: Master,
    pacing: Pacing,
    delivery: Delivery,
    /// The slaves of each dialect listen for themselves. Those of the line's own come first, also without any.
    ears: Vec<Ear>,
    /// The master's characters that follow each other without a pause: when the first began, and how many.
    run: Option<(Instant, usize)>,
    /// When the last character of anybody ended.
    quiet_since: Option<Instant>,
    /// In the order of their starts.
    transmissions: VecDeque<Transmission>,
    /// What slaves have to say, and by which ear they have heard what they answer.
    speech: Vec<(usize, Speech)>,
    /// Up to when noise on the idle wire was heard.
    noise_until: Option<Instant>,
    /// When the master last saw the line fall low because nobody drives it.
    fell_low: Option<Instant>,
}

impl Wire {
    pub(crate) fn new(dialect: Dialect, pacing: Pacing, delivery: Delivery) -> Self {
        Self {
            master: Master::of(dialect.settings),
            pacing,
            delivery,
            ears: vec![Ear::new(dialect)],
            run: None,
            quiet_since: None,
            transmissions: VecDeque::new(),
            speech: Vec::new(),
            noise_until: None,
            fell_low: None,
        }
    }

    /// The master has set its port so. Without time on the wire there is no speed.
    pub(crate) fn tune(&mut self, master: Master) {
        if self.pacing != Pacing::None {
            self.master = master;
        }
    }

    /// Characters that the master sent, all at once, seen at `now`.
    pub(crate) fn receive(&mut self, now: Instant, bytes: &[u8], line: &mut State) {
        let settings = self.master.settings;
        self.listen(line);
        let ended = self.run.map(|(start, count)| start + self.time(count, settings));
        let begins = match self.pacing {
            Pacing::Simulated => now,
            // What a port hands over has just ended, all of it.
            Pacing::Hardware => now.checked_sub(self.time(bytes.len(), settings)).unwrap_or(now),
            Pacing::None => now,
        };
        let begins = ended.map_or(begins, |ended| ended.max(begins));
        if let Some(ended) = ended {
            self.pause(begins, begins - ended, line);
        }
        if ended != Some(begins) {
            self.run = Some((begins, 0));
        }
        line.stats.characters_in += count_of(bytes.len());
        line.stats.first.get_or_insert(begins);
        let mut heard = bytes.to_vec();
        self.disturb(begins, &mut heard, line);
        self.disturb_request(begins, &mut heard, line);
        self.collide(begins, &mut heard, line);
        self.hear(&heard, line);
        // Without time there is no silence to wait for: a frame of unknown length ends with what came at once.
        if self.pacing == Pacing::None {
            self.end_frames(line, |ear| !ear.framing.awaits_more());
        }
    }

    /// What is to be done at `now`.
    pub(crate) fn poll(&mut self, now: Instant, line: &mut State) -> Step {
        for (dialect, slave, answer) in line.take_released(|_| true) {
            self.listen(line);
            let found = self.ears.iter_mut().enumerate().find(|(_, ear)| ear.dialect == dialect);
            if let Some((index, ear)) = found {
                let speech = ear.framing.release(slave, answer, now);
                self.speech.extend(speech.map(|speech| (index, speech)));
            }
        }
        let pacing = self.pacing;
        self.end_frames(line, |ear| ear.silence_due(pacing).is_some_and(|due| due <= now));
        let others_due = self.others(now, line);
        if let Some((index, end, due)) = self.next_delivery(line)
            && due <= now
        {
            return Step::Send(self.deliver(index, end, due, now, line));
        }
        let delivery_due = self.next_delivery(line).map(|(_, _, due)| due);
        let silences = self.ears.iter().filter_map(|ear| ear.silence_due(self.pacing));
        Step::Wait(silences.chain(delivery_due).chain(others_due).min())
    }

    /// t3.5 between frames that are spoken so.
    fn t3_5(&self, settings: SerialSettings) -> Duration {
        if self.pacing == Pacing::None { Duration::ZERO } else { settings.t3_5() }
    }

    /// t1.5 of the master: 1.5 characters, and a fixed 750 µs above 19200 bit/s (MODBUS over Serial Line V1.02 p. 13).
    fn t1_5(&self) -> Duration {
        let settings = self.master.settings;
        if settings.baud() > 19_200 {
            Duration::from_micros(750)
        } else {
            settings.bits(settings.format().bits() * 3) / 2
        }
    }

    fn time(&self, characters: usize, settings: SerialSettings) -> Duration {
        if self.pacing == Pacing::None { Duration::ZERO } else { settings.characters(characters) }
    }

    /// Slaves may have come, or changed how they listen.
    fn listen(&mut self, line: &State) {
        for dialect in line.dialects() {
            if !self.ears.iter().any(|ear| ear.dialect == dialect) {
                self.ears.push(Ear::new(dialect));
            }
        }
    }

    /// Ends the frames that are over, and answers them.
    fn end_frames(&mut self, line: &mut State, is_over: impl Fn(&Ear) -> bool) {
        for (index, ear) in self.ears.iter_mut().enumerate() {
            if !ear.framing.is_between_frames() && is_over(ear) {
                let mut said = Vec::new();
                (line.reached, line.frame_began) = (Some(ear.dialect), ear.began);
                ear.framing.silence(line, &mut said);
                self.speech.extend(said.into_iter().map(|speech| (index, speech)));
            }
        }
        self.answer(line);
    }

    /// A pause between two characters of the master.
    fn pause(&mut self, at: Instant, paused: Duration, line: &mut State) {
        let (pacing, settings, t1_5) = (self.pacing, self.master.settings, self.t1_5());
        let counts = |ear: &Ear| ear.dialect.settings == settings && ear.framing.keeps_silences();
        let is_open = |ear: &Ear| !ear.framing.is_between_frames() && paused < ear.frame_timeout(pacing);
        if pacing != Pacing::None && paused > t1_5 && self.ears.iter().any(|ear| counts(ear) && is_open(ear))
        {
            line.breach(at, Breach::Gap { paused, allowed: t1_5 });
        }
        self.end_frames(line, |ear| ear.silence_due(pacing).is_some_and(|due| due <= at));
    }

    /// Characters of the master without a pause between them: each ear hears what its UART makes of them.
    fn hear(&mut self, bytes: &[u8], line: &mut State) {
        let Some((start, count)) = self.run else { return };
        let settings = self.master.settings;
        let begins = start + self.time(count, settings);
        for index in 0..self.ears.len() {
            self.hear_by(index, bytes, begins, line);
            self.answer(line);
        }
        self.run = Some((start, count + bytes.len()));
        let ends = start + self.time(count + bytes.len(), settings);
        if !bytes.is_empty() {
            self.quiet_since = self.quiet_since.max(Some(ends));
            line.stats.last = line.stats.last.max(Some(ends));
        }
    }

    /// Checks the silence before each frame, and hands the characters to the protocol.
    fn hear_by(&mut self, index: usize, bytes: &[u8], start: Instant, line: &mut State) {
        let (pacing, settings, quiet_since) = (self.pacing, self.master.settings, self.quiet_since);
        let Some(ear) = self.ears.get_mut(index) else { return };
        let is_alike = ear.dialect.settings == settings;
        let at = |bits: u32| if pacing == Pacing::None { start } else { start + settings.bits(bits) };
        line.reached = Some(ear.dialect);
        let polarity = line.defective.polarity();
        for character in misheard::heard_as(polarity, bytes, settings, ear.dialect.settings) {
            let (begins, ends) = (at(character.begins), at(character.ends));
            if ear.framing.is_between_frames() {
                ear.characters = 0;
                let counts = ear.framing.keeps_silences() && pacing != Pacing::None && is_alike;
                if is_alike {
                    check_silence(ear, begins, quiet_since.max(ear.last), pacing, line);
                }
                ear.began = counts.then_some(begins);
            }
            line.frame_began = ear.began;
            ear.characters += 1;
            ear.last = ear.last.max(Some(ends));
            let (requests, mut said) = (line.stats.requests, Vec::new());
            if character.intact {
                ear.framing.byte(character.byte, ends, line, &mut said);
            } else {
                ear.framing.damaged(ends, line);
            }
            if line.stats.requests > requests {
                let silence = if ear.framing.keeps_silences() { ear.t3_5(pacing) } else { Duration::ZERO };
                let frame =
                    if pacing == Pacing::None { Duration::ZERO } else { settings.characters(ear.characters) };
                line.stats.ideal += frame + silence;
            }
            self.speech.extend(said.into_iter().map(|speech| (index, speech)));
        }
    }

    /// What the faults do to the master's characters.
    fn disturb(&mut self, begins: Instant, heard: &mut Vec<u8>, line: &mut State) {
        if line.faults.strikes(Fault::Echo).is_some() {
            let settings = self.master.settings;
            self.transmissions.push_back(Transmission {
                slave: 0,
                dialect: Dialect { settings, ..Dialect::default() },
                start: begins,
                characters: misheard::heard(heard, settings, settings),
                takes: self.time(heard.len(), settings),
                delivered: 0,
                late: false,
                kind: Kind::Echo,
            });
        }
        if let Some(random) = line.faults.strikes(Fault::RequestFlipped) {
            flip(heard, self.master.settings.format().data_bits(), random);
        }
        if line.faults.strikes(Fault::RequestLost).is_some() {
            heard.clear();
        }
    }

    /// Damages what overlaps with the master's characters, on both sides.
    fn collide(&mut self, begins: Instant, heard: &mut [u8], line: &mut State) {
        if self.pacing != Pacing::Simulated {
            return;
        }
        let settings = self.master.settings;
        let ends = begins + self.time(heard.len(), settings);
        let mut hit = None;
        for transmission in self.transmissions.iter_mut().filter(|transmission| !transmission.is_echo()) {
            let overlap = Overlap::of(transmission, begins, ends);
            if let Some(overlap) = overlap {
                hit = hit.or(Some((transmission.slave, transmission.late)));
                transmission.damage(overlap);
                for (index, byte) in heard.iter_mut().enumerate() {
                    let [begins, ends] = [index, index + 1].map(|count| begins + settings.characters(count));
                    if overlap.touches(begins, ends) {
                        *byte = !*byte;
                    }
                }
            }
        }
        if let Some((slave, late)) = hit {
            line.breach(begins, Breach::Collision { slave, late });
        }
    }
}

/// Whether the silence before a frame that begins now was long enough.
fn check_silence(ear: &Ear, begins: Instant, quiet_since: Option<Instant>, pacing: Pacing, line: &mut State) {
    let Some(quiet_since) = quiet_since else { return };
    let (kept, required) = (begins.saturating_duration_since(quiet_since), ear.t3_5(pacing));
    let shortest = line.stats.shortest_silence.get_or_insert(kept);
    *shortest = kept.min(*shortest);
    if ear.framing.keeps_silences() && kept < required {
        line.breach(begins, Breach::Silence { kept, required });
    }
}

fn count_of(length: usize) -> u64 {
    u64::try_from(length).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
