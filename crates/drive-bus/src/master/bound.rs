//! How late a Stop can be on this line as it is: the bound of the configuration with what was learned in its place.

use std::time::Duration;

use super::Master;

impl<C> Master<C> {
    /// The longest time from the call of a Stop to its first bit on the line, while the line goes on as it has: the longest
    /// exchange asked so far, with the slowest of the slaves that are on-line, whole and unanswered, and the silences. Where
    /// anything but answers was ever heard, the longest foreign frame and the time that damage may take are in it too.
    pub(super) fn learned_worst_case_stop(&self) -> Duration {
        let heard_else = self.stats.foreign + self.stats.noise_bytes > 0
            || self.stations.values().any(|station| station.stats.has_heard_else());
        let shown = self.stations.values().filter_map(|station| station.timeout.short()).max();
        let on_line =
            self.stations.iter().filter(|(slave, _)| **slave != 0 && !self.offline.contains(**slave));
        let timeouts = on_line.map(|(_, station)| match shown {
            Some(short) if !station.timeout.is_learned() => short.min(station.timeout.current()),
            _ => station.timeout.current(),
        });
        let timeout = timeouts.max().unwrap_or(self.config.response_timeout);
        let broadcast = if self.stats.broadcasts > 0 { self.config.broadcast_pause } else { Duration::ZERO };
        let (request, answer) = self.longest;
        let behind = if self.far_end.is_there() {
            self.far_end.stop_waits() + self.config.behind_gateway((request, answer), timeout)
        } else {
            Duration::ZERO
        };
        behind
            + self.config.stop_bound(
                (request, answer),
                timeout.max(broadcast),
                self.exchange.echo_is_unknown(),
                heard_else,
            )
    }
}
