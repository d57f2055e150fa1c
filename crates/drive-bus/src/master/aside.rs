//! Exchanges that wait for their slave while others are served.

use std::time::Duration;

use bytes::Bytes;
use tokio::time::Instant;

use super::{Flight, Master, Purpose};
use crate::{exchange::Failure, record::Ending};

/// An exchange that waits.
pub(super) struct Aside<C> {
    pub(super) flight: Flight<C>,
    pub(super) at: Instant,
}

impl<C> Master<C> {
    /// The exchange that is under way goes on at `at`.
    pub(super) fn put_aside(&mut self, now: Instant, at: Instant) {
        let Some(flight) = self.flight.take() else { return };
        self.stats.busy += now.saturating_duration_since(flight.started);
        self.exchange_end = now;
        self.record.ended(now, flight.slave, flight.started, Ending::PutAside);
        self.evidence.put_aside(flight.slave);
        self.aside.insert(flight.slave, Aside { flight, at });
    }

    /// When the next exchange that was put aside goes on, and whose it is.
    pub(super) fn next_aside(&self) -> Option<(Instant, u8)> {
        self.aside.iter().map(|(slave, aside)| (aside.at, *slave)).min()
    }

    /// Goes on with an exchange.
    pub(super) fn resume(&mut self, now: Instant, slave: u8) -> Option<Bytes> {
        let Aside { mut flight, .. } = self.aside.remove(&slave)?;
        flight.started = now;
        self.flight = Some(flight);
        self.last_slave = Some(slave);
        self.resumed = true;
        self.evidence.resume(slave);
        self.exchange.resume(slave)
    }

    /// A stop is sent to a slave whose exchange was put aside: that ends without an answer.
    pub(super) fn forsake(&mut self, now: Instant, slave: u8) {
        let Some(Aside { flight, .. }) = self.aside.remove(&slave) else { return };
        self.exchange.forsake(slave);
        self.evidence.forsake(Some(slave));
        if let Purpose::Call(Some(entry)) = flight.purpose {
            self.fail(now, entry, Failure::Timeout, Duration::ZERO);
        }
    }
}
