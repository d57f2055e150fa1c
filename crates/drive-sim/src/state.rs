//! What all endpoints of a line share: the slaves, the faults, and what was recorded.

use std::collections::{BTreeMap, VecDeque};

use fastrand::Rng;
use tokio::time::Instant;

use crate::{
    fault::Faults,
    model::{Cast, Damage},
    record::{Breach, KEPT, LineStats, Violation},
    slave::{LineCounters, Slave},
    speech::{Content, Speech},
};

/// The address that every slave hears and none answers.
pub(crate) const BROADCAST: u8 = 0;

#[derive(Default)]
pub(crate) struct State {
    slaves: BTreeMap<u8, Slave>,
    counters: LineCounters,
    /// Answers that a test held and has released, for an endpoint to send.
    released: Vec<(u8, Vec<u8>)>,
    pub(crate) faults: Faults,
    pub(crate) stats: LineStats,
    pub(crate) violations: VecDeque<Violation>,
    /// When the frame that is being received began, on a line where silences count.
    pub(crate) frame_began: Option<Instant>,
}

impl State {
    /// Puts a slave on the line; `false` when the address is taken.
    pub(crate) fn add(&mut self, address: u8, slave: Slave) -> bool {
        if self.slaves.contains_key(&address) {
            return false;
        }
        self.slaves.insert(address, slave);
        true
    }

    pub(crate) fn slave(&mut self, address: u8) -> Option<&mut Slave> {
        self.slaves.get_mut(&address)
    }

    pub(crate) fn addresses(&self) -> Vec<u8> {
        self.slaves.keys().copied().collect()
    }

    pub(crate) const fn counters(&self) -> LineCounters {
        self.counters
    }

    /// An intact frame whose last bit was on the wire at `at`: carried out, and answered unless it is for all.
    pub(crate) fn request(&mut self, at: Instant, address: u8, request: &[u8]) -> Option<Speech> {
        self.request_ended_by(at, address, request, None)
    }

    /// The same for a frame that a character ends: whoever waits for another character has not seen its end.
    pub(crate) fn request_ended_by(
        &mut self,
        at: Instant,
        address: u8,
        request: &[u8],
        delimiter: Option<u8>,
    ) -> Option<Speech> {
        self.good_frame();
        self.check_pauses(at, address);
        let sees_end = |slave: &Slave| delimiter.is_none_or(|delimiter| delimiter == slave.delimiter());
        if address == BROADCAST {
            self.stats.broadcasts += 1;
            for slave in self.slaves.values_mut().filter(|slave| sees_end(slave)) {
                // Nobody answers.
                let _ = slave.request(at, request, Cast::Broadcast, self.counters);
            }
            return None;
        }
        let mut slaves = self.slaves.values_mut();
        let slave = slaves.find(|slave| slave.address() == address).filter(|slave| sees_end(slave))?;
        let answer = slave.request(at, request, Cast::Unicast, self.counters)?;
        let turnaround = slave.turnaround();
        Some(Speech { slave: address, content: Content::Message(answer), heard: at, turnaround })
    }

    pub(crate) const fn good_frame(&mut self) {
        self.stats.requests += 1;
        self.counters.good += 1;
    }

    pub(crate) fn bad_frame(&mut self, damage: Damage) {
        self.stats.bad_frames += 1;
        self.counters.bad += 1;
        self.slaves.values_mut().for_each(|slave| slave.frame_damaged(damage));
    }

    /// The last bit of a slave's answer was on the wire.
    pub(crate) fn answered(&mut self, address: u8, at: Instant) {
        if let Some(slave) = self.slaves.values_mut().find(|slave| slave.address() == address) {
            slave.pause_from(at);
        }
    }

    /// Whether the request that ends now began too early for those that it concerns.
    fn check_pauses(&mut self, at: Instant, address: u8) {
        let Some(began) = self.frame_began else { return };
        let mut breaches = Vec::new();
        for slave in self.slaves.values_mut() {
            if address == BROADCAST || address == slave.address() {
                breaches.extend(slave.pause_broken(began));
            }
            if address == BROADCAST {
                slave.pause_from(at);
            }
        }
        breaches.into_iter().for_each(|breach| self.breach(began, breach));
    }

    pub(crate) fn breach(&mut self, at: Instant, breach: Breach) {
        self.stats.violations += 1;
        if self.violations.len() < KEPT {
            self.violations.push_back(Violation { at, breach });
        }
    }

    pub(crate) fn release(&mut self, address: u8) {
        let Some(slave) = self.slaves.get_mut(&address) else { return };
        if let Some(answer) = slave.release() {
            self.released.push((slave.address(), answer));
        }
    }

    /// The released answers of these slaves. An endpoint takes what it was asked for itself.
    pub(crate) fn take_released(&mut self, of: impl Fn(u8) -> bool) -> Vec<(u8, Vec<u8>)> {
        self.released.extract_if(.., |(slave, _)| of(*slave)).collect()
    }

    /// Another slave than this one, for an answer in a wrong name: one that is there if there is one.
    pub(crate) fn stranger(&self, address: u8, random: &mut Rng) -> u8 {
        let others: Vec<_> = self.slaves.keys().copied().filter(|other| *other != address).collect();
        random.choice(others).unwrap_or(if address == 1 { 2 } else { 1 })
    }
}
