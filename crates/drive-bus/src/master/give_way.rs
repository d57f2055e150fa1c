//! What makes room for a stop: what would undo it, and what is under way and not worth its wait.

use std::time::Duration;

use drive_core::{Class, PortError};
use tokio::time::Instant;

use super::{Asked, Flight, Master, Purpose};
use crate::{exchange::Failure, record::Ending, schedule::Entry};

impl<C> Master<C> {
    /// A stop arrives: commands that wait for the same slave would undo it, and no probe is worth its wait.
    pub(super) fn clear_the_way(&mut self, now: Instant, slave: u8) {
        let overtaken = self.schedule.withdraw_all(|entry| {
            let is_command =
                crate::mutant!("stop-spares-commands", entry.terms.class == Class::Command, false);
            is_command && entry.work.is_write && (slave == 0 || entry.slave == slave)
        });
        for entry in overtaken {
            self.drop_unsent(entry, PortError::Superseded);
        }
        // A repetition that waits for its share of the line is worth no probe.
        if self.offline.stop_at(slave).is_some_and(|at| at > now) {
            return;
        }
        let Some(flight) = self.flight.take_if(|flight| matches!(flight.purpose, Purpose::Probe)) else {
            return;
        };
        self.break_off(now, &flight);
        self.offline.probe_again(now, flight.slave);
    }

    /// Whether a stop was written to a slave, or to all, since an order began.
    pub(super) fn is_stopped_since(&self, slave: u8, begun: Option<Instant>) -> bool {
        let stopped = |slave| self.stations.get(&slave).and_then(|station| station.stopped);
        let since = begun.zip(stopped(slave).max(stopped(0)));
        since.is_some_and(|(begun, stopped)| stopped >= begun)
    }

    /// The exchange that was under way is given up for a stop.
    pub(super) fn break_off(&mut self, now: Instant, flight: &Flight<C>) {
        self.exchange.abandon();
        self.count_strays(now);
        self.to_send = None;
        self.record.ended(now, flight.slave, flight.started, Ending::GivenUp);
        self.fear_late_answer(now, flight);
        self.owe(flight);
        // Whatever came behind the request, damaged or cut off here, was its slave's.
        let sent = flight.sent.map(|sent| sent.end);
        let heard = self.heard.map(|(_, until)| until);
        if let Some(until) = heard.filter(|until| sent.is_some_and(|sent| *until > sent)) {
            self.station(flight.slave).spoke(until);
        }
        if !matches!(flight.purpose, Purpose::Probe) {
            self.fresh.in_vain(now);
        }
        self.quiet_from = self.quiet_from.max(now);
        self.exchange_end = self.quiet_from;
    }

    /// What only goes on because the far end owes something is given up for a stop that was not sent yet: behind what is
    /// owed that is the next.
    pub(super) fn let_stops_through(&mut self, now: Instant) {
        if self.gives_way_at().is_none_or(|at| at > now) {
            return;
        }
        let Some(flight) = self.flight.take() else { return };
        self.break_off(now, &flight);
        match flight.purpose {
            Purpose::Call(Some(entry)) => {
                let waited = flight.sent.map_or(Duration::ZERO, |sent| sent.timeout);
                self.fail(now, entry, Failure::Timeout, waited);
            }
            Purpose::Call(None) => {}
            Purpose::ThrowAway => self.thrown_away(now),
            Purpose::Probe | Purpose::EchoRead => self.offline.probe_again(now, flight.slave),
        }
    }

    /// When the exchange that is under way gives way to a stop that waits, if it does before its time.
    pub(super) fn gives_way_at(&self) -> Option<Instant> {
        let sent = self.flight.as_ref().filter(|flight| flight.behind > 0)?.sent?;
        let first = |entry: &Entry<Asked<C>>| {
            (entry.work.is_write && entry.work.attempts == 0).then_some(entry.arrived)
        };
        self.schedule.first_stop(first).map(|_| sent.usually_by)
    }
}
