//! Until when a request waits besides the silences and its slave's pause, and which stops the line waits for.
//!
//! A request waits for the latest of these:
//! - the **exchange with its slave that was put aside** goes on. The write of a stop ends that instead, unless it is a
//!   stop's itself;
//! - no **answer that may still come** could be taken for its own, nor for that of the read which asks the adapter for its
//!   echo on its behalf. The write of a stop waits for neither;
//! - the **far end** is done with what it owes, or can do more meanwhile. The write of a stop waits for nothing of that;
//! - the stop of its slave that is under way over the **second connection** is over, where it is another write;
//! - the stop of a slave that is off-line, once it was sent in vain, for **its share of the line**.
//!
//! A stop that waits for none of them **holds the line**: nothing less urgent starts, not in its slave's pause either. One
//! that has to wait lets the others go first.

use std::{collections::BTreeMap, time::Duration};

use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{
    Asked, Purpose, aside::Aside, far_end::FarEnd, offline::Offline, second::Second, station::Station,
};
use crate::{answer, exchange::Machine, pdu, schedule::Entry, shape::Shape};

/// How long what may not overtake an exchange that was put aside waits until it is looked at again: less than a poll of
/// UNI-TELWAY takes, so that nothing is late for it.
const LOOK: Duration = Duration::from_millis(1);

/// What the rule looks at.
pub(super) struct Waits<'a, C> {
    pub(super) exchange: &'a dyn Machine,
    pub(super) stations: &'a BTreeMap<u8, Box<Station>>,
    pub(super) aside: &'a BTreeMap<u8, Aside<C>>,
    pub(super) offline: &'a Offline,
    pub(super) far_end: &'a FarEnd,
    pub(super) second: &'a Second,
}

impl<C> Waits<'_, C> {
    /// Until when it waits. `None`: for nothing.
    pub(super) fn until(&self, now: Instant, entry: &Entry<Asked<C>>) -> Option<Instant> {
        let is_stop = entry.terms.class == Class::Stop;
        let goes_at_once =
            crate::mutant!("stop-waits-for-the-gateway", is_stop && entry.work.is_write, false);
        let aside = self.aside.get(&entry.slave).filter(|aside| !goes_at_once || aside.is_stop());
        let aside = aside.map(|aside| aside.at.max(now + LOOK));
        let station = self.stations.get(&entry.slave);
        let doubt = station.filter(|_| !goes_at_once).and_then(|station| {
            let read = wants_echo_read(self.exchange, entry)
                .then(|| shape_of(self.exchange, &station.harmless_read()));
            station.place(now, entry).1.max(read.and_then(|read| station.doubt.wait(now, read)))
        });
        let share = if is_stop { self.offline.stop_at(entry.slave) } else { None };
        let owes = !goes_at_once && self.far_end.owes() > 0;
        let gate = if owes { self.far_end.gate(self.proves_something(entry)) } else { None };
        let second = self.second.holds(entry.slave).filter(|_| entry.work.is_write && !is_stop);
        aside.max(doubt).max(share).max(gate).max(second).filter(|until| *until > now)
    }

    /// Since when a stop waits for nothing but the line: one that was sent in vain to a slave that is off-line, since its share of the
    /// line was there. `None`: it waits for something else.
    pub(super) fn since(&self, now: Instant, stop: &Entry<Asked<C>>) -> Option<Instant> {
        let share = self.offline.stop_at(stop.slave);
        self.until(now, stop).is_none().then(|| share.map_or(stop.arrived, |share| share.max(stop.arrived)))
    }
}

impl<C> Waits<'_, C> {
    /// Whether its answer would say something of the far end: it is a read of a drive that answers, or of any if none does.
    fn proves_something(&self, entry: &Entry<Asked<C>>) -> bool {
        let answers = |slave: u8, station: &Station| station.is_answering() && !self.offline.contains(slave);
        let may_answer = || {
            self.stations.get(&entry.slave).is_some_and(|station| answers(entry.slave, station))
                || !self.stations.iter().any(|(slave, station)| answers(*slave, station))
        };
        !entry.work.is_write && may_answer()
    }
}

impl<C> Aside<C> {
    /// Whether it is the exchange of a stop.
    fn is_stop(&self) -> bool {
        matches!(&self.flight.purpose, Purpose::Call(Some(entry)) if entry.terms.class == Class::Stop)
    }
}

/// The shape of the answer to `request`.
pub(super) fn shape_of(exchange: &dyn Machine, request: &Request<'_>) -> Shape {
    exchange.shape(&pdu::encode(request).unwrap_or_default())
}

/// Whether the adapter is to be asked for its echo before this request: otherwise its answer would prove nothing.
pub(super) fn wants_echo_read<C>(exchange: &dyn Machine, entry: &Entry<Asked<C>>) -> bool {
    exchange.echo_is_unknown()
        && !entry.work.echo_was_read
        && entry.slave != 0
        && answer::equals_its_request(&entry.work.request)
}
