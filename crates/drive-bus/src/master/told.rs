//! What the line says of itself.

use std::time::Duration;

use tokio::time::Instant;

use super::Master;
use crate::{
    evidence::{Fact, Finding, Known},
    record::Exchange,
    stats::Stats,
};

impl<C> Master<C> {
    /// When the last question began that a slave has answered.
    pub(crate) fn answered_at(&self, slave: u8) -> Option<Instant> {
        self.stations.get(&slave)?.answered_at
    }

    /// When the last exchange began: what [`poll_outcome`](Self::poll_outcome) gives now is not older than that, and nobody
    /// knows by how much it is younger.
    #[must_use]
    pub const fn asked_at(&self) -> Instant {
        self.asked_at
    }

    /// A slave has said what its link has counted.
    #[cfg(feature = "unitelway")]
    pub(crate) fn note_link_counters(&mut self, slave: u8, counters: drive_unitelway::LinkCounters) {
        self.station(slave).stats.link = Some(counters);
    }

    /// What was counted so far, at `now`.
    #[must_use]
    pub fn stats(&self, now: Instant) -> Stats {
        let mut stats = self.stats.clone();
        stats.elapsed = self.opened_at.map_or(Duration::ZERO, |opened| now.saturating_duration_since(opened));
        stats.queued = self.schedule.len();
        stats.echoing = self.exchange.echoes();
        stats.worst_case_stop = self.learned_worst_case_stop();
        stats.far_end = self.far_end.stats(self.second.told(), self.second.stops);
        stats.away = self.port.away().map(str::to_owned);
        stats.slaves = self
            .stations
            .iter()
            .filter(|(slave, _)| **slave != 0)
            .map(|(slave, station)| {
                let mut stats = station.stats.clone();
                stats.response_timeout = station.timeout.current();
                stats.offline = self.offline.contains(*slave);
                stats.next_probe = self.probe_at(*slave).map(|at| self.probe_in(now, at));
                (*slave, stats)
            })
            .collect();
        stats
    }

    /// What was heard last that is no plain answer, the oldest first.
    #[must_use]
    pub fn evidence(&self) -> Vec<Fact> {
        self.evidence.facts()
    }

    /// What is wrong with the line at `now`, by its evidence.
    #[must_use]
    pub fn findings(&self, now: Instant) -> Vec<Finding> {
        self.evidence.findings(Known { now, is_unitelway: self.config.protocol.name() == "unitelway" })
    }

    /// Keeps the last exchanges from now on.
    pub fn keep_exchanges(&mut self, count: usize) {
        self.record.keep(count);
    }

    /// The exchanges that are kept, the oldest first.
    #[must_use]
    pub fn exchanges(&self) -> Vec<Exchange> {
        self.record.exchanges()
    }
}
