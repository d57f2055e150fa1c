//! Exchanges that wait for their slave while others are served.

use std::time::Duration;

use bytes::Bytes;
use drive_core::Class;
use tokio::time::Instant;

use super::{Flight, Job, Master, Purpose};
use crate::{exchange::Failure, schedule::Entry};

/// How long what may not overtake an exchange that was put aside waits until it is looked at again.
const LOOK: Duration = Duration::from_millis(1);

/// An exchange that waits.
pub(super) struct Aside<C> {
    pub(super) flight: Flight<C>,
    at: Instant,
}

impl<C> Aside<C> {
    /// Whether this request is sent all the same: the write of a stop, whose slave is asked for nothing less.
    fn gives_way_to(&self, entry: &Entry<Job<C>>) -> bool {
        let call = match &self.flight.purpose {
            Purpose::Call(call) => call.as_ref(),
            Purpose::Probe | Purpose::Settle => None,
        };
        let stops = |entry: &Entry<Job<C>>| entry.terms.class == Class::Stop;
        stops(entry) && entry.work.is_write && !call.is_some_and(stops)
    }

    /// Until when this request to the same slave waits for it.
    pub(super) fn holds(&self, now: Instant, entry: &Entry<Job<C>>) -> Option<Instant> {
        (!self.gives_way_to(entry)).then(|| self.at.max(now + LOOK))
    }
}

impl<C> Master<C> {
    /// The exchange that is under way goes on at `at`.
    pub(super) fn put_aside(&mut self, now: Instant, at: Instant) {
        let Some(flight) = self.flight.take() else { return };
        self.stats.busy += now.saturating_duration_since(flight.started);
        self.exchange_end = now;
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
        self.exchange.resume(slave)
    }

    /// A stop is sent to a slave whose exchange was put aside: that ends without an answer.
    pub(super) fn forsake(&mut self, now: Instant, slave: u8) {
        let Some(Aside { flight, .. }) = self.aside.remove(&slave) else { return };
        self.exchange.forsake(slave);
        if let Purpose::Call(Some(entry)) = flight.purpose {
            self.fail(now, entry, Failure::Timeout, Duration::ZERO);
        }
    }
}
