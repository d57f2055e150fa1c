//! How the daemon's own clock stands to the wall's, and that it is told where that was set.

use super::Archive;
use crate::record::{Moment, Record};

/// A clock that has moved by less than this since was regulated, and no step is told.
const STEP_MS: i64 = 1_000;
/// By so much the wall's clock may drift away before times are counted by it anew.
const DRIFT_MS: i64 = 250;

/// How the daemon's own clock stood to the wall's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Clock {
    pub(super) began: Moment,
    /// Its number in the file, once it is there.
    pub(super) segment: Option<i64>,
}

impl Clock {
    pub(super) const fn ahead_ms(self) -> i64 {
        self.began.wall_ms - self.began.steady_ms
    }
}

impl Archive {
    /// Looks at the clocks: where the wall's was set, what is shown from now on counts by it as it is now, and it is told.
    pub fn look_at_clock(&mut self, now: Moment) {
        let moved = now.wall_ms - now.steady_ms - self.clock.ahead_ms();
        if moved.abs() < DRIFT_MS {
            return;
        }
        self.close(now);
        self.clock = Clock { began: now, segment: None };
        if moved.abs() >= STEP_MS {
            let way = if moved > 0 { "forward" } else { "back" };
            let text = format!(
                "the clock was set {way} by {:.1} s: the order of what is told here is that of the daemon's own clock",
                moved.abs() as f64 / 1_000.0
            );
            let was = now.wall_ms - moved;
            let body = serde_json::json!({ "from_unix_ms": was, "to_unix_ms": now.wall_ms });
            let body = Some(body.to_string());
            self.record(Record { body, ..Record::of_history(now, "clock_stepped", text) });
        }
    }
}
