//! The daemon's own clock beside the wall's.

use std::time::{Duration, SystemTime};

use tokio::time::Instant;

use crate::record::Moment;

/// Both clocks of the daemon.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clocks(Instant);

impl Clocks {
    /// From now on.
    #[must_use]
    pub(crate) fn begin() -> Self {
        Self(Instant::now())
    }

    /// Now.
    #[must_use]
    pub(crate) fn now(&self) -> Moment {
        let wall = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        Moment { steady_ms: self.of(Instant::now()), wall_ms: milliseconds(wall) }
    }

    pub(crate) fn of(&self, at: Instant) -> i64 {
        match at.checked_duration_since(self.0) {
            Some(after) => milliseconds(after),
            None => -milliseconds(self.0.duration_since(at)),
        }
    }
}

pub(crate) fn milliseconds(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}
