//! The port comes and goes, and the line is closed.

use std::mem;

use drive_core::{Class, PortError};
use tokio::time::Instant;

use super::{Asked, Flight, Master, row::Row};
use crate::schedule::Entry;

/// The state of the port.
pub(super) enum PortState {
    /// The port is open.
    Open,
    /// It was lost a moment ago, for this reason, or is being opened for the first time: what waits goes on waiting.
    Opening(Option<String>),
    /// It cannot be opened: nothing is accepted.
    Down(String),
}

impl PortState {
    /// Why it is not open, as far as is known.
    pub(super) fn away(&self) -> Option<&str> {
        match self {
            Self::Open => None,
            Self::Opening(reason) => reason.as_deref(),
            Self::Down(reason) => Some(reason),
        }
    }
}

impl<C> Master<C> {
    /// The port is open.
    pub fn handle_up(&mut self, now: Instant) {
        tracing::debug!(endpoint = ?self.config.endpoint, "line up");
        self.port = PortState::Open;
        self.exchange.reset();
        self.quiet_from = now;
        self.exchange_end = now;
        if self.stats.opened > 0 {
            self.open_again(now);
        }
        self.stats.opened += 1;
        self.opened_at.get_or_insert(now);
    }

    /// The port is lost. What waits goes on waiting, but for writes that are no stops: whoever answers over the next port may be
    /// another than the one for which they were meant.
    pub fn handle_lost(&mut self, now: Instant, reason: &str) {
        tracing::debug!(endpoint = ?self.config.endpoint, reason, "line lost");
        self.port = PortState::Opening(Some(reason.to_owned()));
        self.stats.lost += 1;
        self.exchange.reset();
        // Over the next one another may answer.
        self.stations.values_mut().for_each(|station| station.row = Row::default());
        let asked = self.flight.as_ref().and_then(Flight::asked);
        self.far_end.lost(asked);
        self.end_second(now);
        self.fail_flight(now, reason);
        self.sending = None;
        let is_for_this = |entry: &Entry<Asked<C>>| entry.work.is_write && entry.terms.class != Class::Stop;
        for entry in self.schedule.withdraw_all(is_for_this) {
            self.drop_unsent(entry, PortError::LineDown(reason.to_owned()));
        }
    }

    /// The port cannot be opened. What waits without a lifetime ends; what has one expires.
    pub fn handle_down(&mut self, reason: &str) {
        if let PortState::Opening(_) = mem::replace(&mut self.port, PortState::Down(reason.to_owned())) {
            tracing::debug!(endpoint = ?self.config.endpoint, reason, "line down");
        }
        for entry in self.schedule.withdraw_all(|entry| entry.terms.lifetime.is_none()) {
            self.drop_unsent(entry, PortError::LineDown(reason.to_owned()));
        }
    }

    /// The line is to be closed. A stop that waits there is sent before, where there is a port: whoever has given it may have gone, and
    /// nobody else would stop the motor.
    pub fn handle_close(&mut self) {
        self.closing = true;
        let is_open = matches!(self.port, PortState::Open);
        let is_stop = |entry: &Entry<Asked<C>>| entry.terms.class == Class::Stop && entry.work.is_write;
        let stays = |entry: &Entry<Asked<C>>| {
            crate::mutant!("stop-dropped-with-its-line", is_open && is_stop(entry), false)
        };
        for entry in self.schedule.withdraw_all(|entry| !stays(entry)) {
            self.drop_unsent(entry, PortError::Closed);
        }
    }

    /// Whether the line is closed and nothing is under way any more.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        let owes_stop = matches!(self.port, PortState::Open) && !self.schedule.is_empty();
        self.closing && self.flight.is_none() && self.aside.is_empty() && !owes_stop
    }
}
