//! The wire: which character is on it when, who speaks, and what rule is broken. No clock and no I/O: `now` is an
//! argument.

mod speak;
mod transmission;

use std::{collections::VecDeque, time::Duration};

use drive_core::SerialSettings;
use tokio::time::Instant;

use self::transmission::{Overlap, Transmission};
use crate::{
    fault::{Fault, flip},
    framing::Framing,
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
    settings: SerialSettings,
    pacing: Pacing,
    delivery: Delivery,
    framing: Box<dyn Framing>,
    /// The master's characters that follow each other without a pause: when the first began, and how many.
    run: Option<(Instant, usize)>,
    /// When the last character of anybody ended.
    quiet_since: Option<Instant>,
    /// In the order of their starts.
    transmissions: VecDeque<Transmission>,
    speech: Vec<Speech>,
    /// Characters of the frame that is being received, for the ideal time of its exchange.
    frame_characters: usize,
}

impl Wire {
    pub(crate) fn new(
        settings: SerialSettings,
        pacing: Pacing,
        delivery: Delivery,
        framing: Box<dyn Framing>,
    ) -> Self {
        Self {
            settings,
            pacing,
            delivery,
            framing,
            run: None,
            quiet_since: None,
            transmissions: VecDeque::new(),
            speech: Vec::new(),
            frame_characters: 0,
        }
    }

    /// Characters that the master sent, all at once, seen at `now`.
    pub(crate) fn receive(&mut self, now: Instant, bytes: &[u8], line: &mut State) {
        let ended = self.run.map(|(start, count)| start + self.time(count));
        let begins = match self.pacing {
            Pacing::Simulated => now,
            // What a port hands over has just ended, all of it.
            Pacing::Hardware => now.checked_sub(self.time(bytes.len())).unwrap_or(now),
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
        self.collide(begins, &mut heard, line);
        for byte in heard {
            self.hear(byte, line);
        }
        let is_open = !self.framing.is_between_frames();
        if self.pacing == Pacing::None && is_open && !self.framing.awaits_more() {
            // Without time there is no silence to wait for: a frame of unknown length ends with what came at once.
            self.framing.silence(line, &mut self.speech);
            self.answer(line);
        }
    }

    /// What is to be done at `now`.
    pub(crate) fn poll(&mut self, now: Instant, line: &mut State) -> Step {
        for (slave, answer) in line.take_released(|_| true) {
            self.speech.extend(self.framing.release(slave, answer, now));
        }
        let silence_due = self.silence_due();
        if silence_due.is_some_and(|due| due <= now) {
            self.framing.silence(line, &mut self.speech);
        }
        self.answer(line);
        if let Some((index, end, due)) = self.next_delivery()
            && due <= now
        {
            return Step::Send(self.deliver(index, end, due, now, line));
        }
        let delivery_due = self.next_delivery().map(|(_, _, due)| due);
        Step::Wait(self.silence_due().into_iter().chain(delivery_due).min())
    }

    /// t3.5 of this wire.
    fn t3_5(&self) -> Duration {
        if self.pacing == Pacing::None { Duration::ZERO } else { self.settings.t3_5() }
    }

    /// The silence after which a frame that has begun is over.
    fn frame_timeout(&self) -> Duration {
        if self.pacing == Pacing::None { UNPACED_TIMEOUT } else { self.framing.frame_timeout(self.t3_5()) }
    }

    /// t1.5 of this wire: 1.5 characters, and a fixed 750 µs above 19200 bit/s (MODBUS over Serial Line V1.02 p. 13).
    fn t1_5(&self) -> Duration {
        if self.settings.baud() > 19_200 {
            Duration::from_micros(750)
        } else {
            self.settings.bits(self.settings.format().bits() * 3) / 2
        }
    }

    fn time(&self, characters: usize) -> Duration {
        if self.pacing == Pacing::None { Duration::ZERO } else { self.settings.characters(characters) }
    }

    /// When a frame that is being received would be over by silence.
    fn silence_due(&self) -> Option<Instant> {
        let (start, count) = self.run.filter(|_| !self.framing.is_between_frames())?;
        Some(start + self.time(count) + self.frame_timeout())
    }

    /// A pause between two characters of the master.
    fn pause(&mut self, at: Instant, paused: Duration, line: &mut State) {
        if self.framing.is_between_frames() {
            return;
        }
        if paused >= self.frame_timeout() {
            self.framing.silence(line, &mut self.speech);
            self.answer(line);
        } else if self.framing.keeps_silences() && self.pacing != Pacing::None && paused > self.t1_5() {
            line.breach(at, Breach::Gap { paused, allowed: self.t1_5() });
        }
    }

    /// One character of the master: checks the silence before a frame, and hands it to the protocol.
    fn hear(&mut self, byte: u8, line: &mut State) {
        let Some((start, count)) = self.run else { return };
        let (begins, ends) = (start + self.time(count), start + self.time(count + 1));
        self.run = Some((start, count + 1));
        if self.framing.is_between_frames() {
            self.frame_characters = 0;
            self.check_silence(begins, line);
            let counts = self.framing.keeps_silences() && self.pacing != Pacing::None;
            line.frame_began = counts.then_some(begins);
        }
        self.frame_characters += 1;
        self.quiet_since = self.quiet_since.max(Some(ends));
        line.stats.last = line.stats.last.max(Some(ends));
        let requests = line.stats.requests;
        self.framing.byte(byte, ends, line, &mut self.speech);
        if line.stats.requests > requests {
            let silence = if self.framing.keeps_silences() { self.t3_5() } else { Duration::ZERO };
            line.stats.ideal += self.time(self.frame_characters) + silence;
        }
        self.answer(line);
    }

    fn check_silence(&self, begins: Instant, line: &mut State) {
        let Some(quiet_since) = self.quiet_since else { return };
        let (kept, required) = (begins.saturating_duration_since(quiet_since), self.t3_5());
        let shortest = line.stats.shortest_silence.get_or_insert(kept);
        *shortest = kept.min(*shortest);
        if self.framing.keeps_silences() && kept < required {
            line.breach(begins, Breach::Silence { kept, required });
        }
    }

    /// What the faults do to the master's characters.
    fn disturb(&mut self, begins: Instant, heard: &mut Vec<u8>, line: &mut State) {
        if line.faults.strikes(Fault::Echo).is_some() {
            self.transmissions.push_back(Transmission {
                slave: 0,
                start: begins,
                bytes: heard.clone(),
                delivered: 0,
                late: false,
                echo: true,
            });
        }
        if let Some(random) = line.faults.strikes(Fault::RequestFlipped) {
            flip(heard, self.settings.format().data_bits(), random);
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
        let ends = begins + self.time(heard.len());
        let (settings, mut hit) = (self.settings, None);
        for transmission in self.transmissions.iter_mut().filter(|transmission| !transmission.echo) {
            let overlap = Overlap::of(transmission, begins, ends, settings);
            if let Some(overlap) = overlap {
                hit = hit.or(Some((transmission.slave, transmission.late)));
                transmission.damage(overlap, settings);
                for (index, byte) in heard.iter_mut().enumerate() {
                    if overlap.touches(begins + settings.characters(index), settings) {
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

fn count_of(length: usize) -> u64 {
    u64::try_from(length).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
