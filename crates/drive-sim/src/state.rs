//! What all endpoints of a line share: the slaves, the faults, and what was recorded.

use std::collections::{BTreeMap, VecDeque};

use fastrand::Rng;
use tokio::time::Instant;

use crate::{
    defects::Defective,
    fault::Faults,
    model::{Cast, Damage, Dialect},
    record::{Breach, KEPT, LineStats, Violation},
    slave::{LineCounters, Slave},
    speech::Speech,
};

/// The address that every slave hears and none answers.
pub(crate) const BROADCAST: u8 = 0;

/// Where a slave was put: the address, and how many were at it before.
pub(crate) type Place = (u8, u8);

/// An answer that a test held and has released: how it is spoken, by which address, and its message.
pub(crate) type Released = (Dialect, u8, Vec<u8>);

#[derive(Default)]
pub(crate) struct State {
    slaves: BTreeMap<Place, Slave>,
    /// Whom the characters reach that are being heard; `None`: every slave.
    pub(crate) reached: Option<Dialect>,
    /// What is counted for all slaves that listen alike.
    counters: Vec<(Dialect, LineCounters)>,
    /// For an endpoint to send.
    released: Vec<Released>,
    pub(crate) faults: Faults,
    pub(crate) defective: Defective,
    pub(crate) stats: LineStats,
    pub(crate) violations: VecDeque<Violation>,
    /// When the frame that is being received began, on a line where silences count.
    pub(crate) frame_began: Option<Instant>,
}

impl State {
    /// Puts a slave on the line; the address may be taken by others.
    pub(crate) fn add(&mut self, address: u8, slave: Slave) -> Place {
        let others = (0..=u8::MAX).find(|others| !self.slaves.contains_key(&(address, *others)));
        let place = (address, others.unwrap_or(u8::MAX));
        self.slaves.insert(place, slave);
        place
    }

    /// The slave that was put at a place.
    pub(crate) fn at(&mut self, place: Place) -> Option<&mut Slave> {
        self.slaves.get_mut(&place)
    }

    /// The first slave that was put at this address, of those that are reached.
    pub(crate) fn slave(&mut self, address: u8) -> Option<&mut Slave> {
        let reached = self.reached;
        let is_reached = |slave: &Slave| reached.is_none_or(|reached| reached == slave.dialect());
        let mut slaves = self.slaves.iter_mut();
        slaves.find(|(place, slave)| place.0 == address && is_reached(slave)).map(|(_, slave)| slave)
    }

    pub(crate) fn places(&self) -> Vec<Place> {
        self.slaves.keys().copied().collect()
    }

    /// How the slaves speak and listen, each way once.
    pub(crate) fn dialects(&self) -> Vec<Dialect> {
        let mut dialects = Vec::new();
        for dialect in self.slaves.values().map(Slave::dialect) {
            if !dialects.contains(&dialect) {
                dialects.push(dialect);
            }
        }
        dialects
    }

    /// What is counted for all slaves that listen so.
    pub(crate) fn counters(&self, dialect: Dialect) -> LineCounters {
        let counted = self.counters.iter().find(|(counted, _)| *counted == dialect);
        counted.map(|(_, counters)| *counters).unwrap_or_default()
    }

    fn count(&mut self, count: impl Fn(&mut LineCounters)) {
        for dialect in self.dialects() {
            if self.reached.is_some_and(|reached| reached != dialect) {
                continue;
            }
            match self.counters.iter_mut().find(|(counted, _)| *counted == dialect) {
                Some((_, counters)) => count(counters),
                None => {
                    let mut counters = LineCounters::default();
                    count(&mut counters);
                    self.counters.push((dialect, counters));
                }
            }
        }
    }

    fn reached(&mut self) -> impl Iterator<Item = &mut Slave> {
        let reached = self.reached;
        self.slaves.values_mut().filter(move |slave| reached.is_none_or(|reached| reached == slave.dialect()))
    }

    /// An intact frame whose last bit was on the wire at `at`: carried out, and answered unless it is for all, by every
    /// slave that has this address.
    pub(crate) fn request(&mut self, at: Instant, address: u8, request: &[u8]) -> Vec<Speech> {
        self.request_ended_by(at, address, request, None)
    }

    /// The same for a frame that a character ends: whoever waits for another character has not seen its end.
    pub(crate) fn request_ended_by(
        &mut self,
        at: Instant,
        address: u8,
        request: &[u8],
        delimiter: Option<u8>,
    ) -> Vec<Speech> {
        self.good_frame();
        self.check_pauses(at, address);
        let began = self.frame_began;
        let sees_end = |slave: &Slave| {
            delimiter.is_none_or(|delimiter| delimiter == slave.delimiter()) && !slave.is_deaf(began)
        };
        if address == BROADCAST {
            self.stats.broadcasts += 1;
        }
        let cast = if address == BROADCAST { Cast::Broadcast } else { Cast::Unicast };
        let counted = self.counters.clone();
        let counters = |slave: &Slave| {
            let counted = counted.iter().find(|(dialect, _)| *dialect == slave.dialect());
            counted.map(|(_, counters)| *counters).unwrap_or_default()
        };
        let concerned = |slave: &&mut Slave| cast == Cast::Broadcast || slave.address() == address;
        let mut said = Vec::new();
        for slave in self.reached().filter(concerned).filter(|slave| sees_end(slave)) {
            said.extend(slave.asked(at, address, request, cast, counters(slave)));
        }
        said
    }

    pub(crate) fn good_frame(&mut self) {
        self.stats.requests += 1;
        self.count(|counters| counters.good += 1);
    }

    pub(crate) fn bad_frame(&mut self, damage: Damage) {
        self.stats.bad_frames += 1;
        self.count(|counters| counters.bad += 1);
        self.reached().for_each(|slave| slave.frame_damaged(damage));
    }

    /// The last bit of a slave's answer was on the wire.
    pub(crate) fn answered(&mut self, address: u8, at: Instant) {
        self.slaves
            .values_mut()
            .filter(|slave| slave.address() == address)
            .for_each(|slave| slave.pause_from(at));
    }

    /// Whether the request that ends now began too early for those that it concerns.
    fn check_pauses(&mut self, at: Instant, address: u8) {
        let Some(began) = self.frame_began else { return };
        let mut breaches = Vec::new();
        for slave in self.reached() {
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

    pub(crate) fn release(&mut self, place: Place) {
        let Some(slave) = self.slaves.get_mut(&place) else { return };
        if let Some(answer) = slave.release() {
            self.released.push((slave.dialect(), slave.address(), answer));
        }
    }

    /// The released answers of these slaves. An endpoint takes what it was asked for itself.
    pub(crate) fn take_released(&mut self, of: impl Fn(u8) -> bool) -> Vec<Released> {
        self.released.extract_if(.., |(_, slave, _)| of(*slave)).collect()
    }

    /// Another slave than this one, for an answer in a wrong name: one that is there if there is one.
    pub(crate) fn stranger(&self, address: u8, random: &mut Rng) -> u8 {
        let others: Vec<_> =
            self.slaves.keys().map(|(other, _)| *other).filter(|other| *other != address).collect();
        random.choice(others).unwrap_or(if address == 1 { 2 } else { 1 })
    }
}
