//! One drive as the daemon has told it, and how old that is now.

use std::time::Duration;

use drive_fleet::{Link, Severity};
use tokio::time::Instant;

use drived_plant::plant::views::DriveView;
use drived_screen::row::Row;

/// What was heard longer ago is old, whatever it says of itself: a drive of which nothing changes is told anew each 5 s.
const HEARD_WITHIN: Duration = Duration::from_secs(12);

/// What a drive is told to be, and when that was heard.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    /// Everything, as the daemon has told it.
    pub(super) told: DriveView,
    heard: Instant,
}

impl Drive {
    /// Takes what was told of a drive.
    pub(super) const fn told(told: DriveView, heard: Instant) -> Self {
        Self { told, heard }
    }

    pub(super) fn name(&self) -> &str {
        self.told.name()
    }

    /// Whether what it shows is what it shows now, as far as whoever is connected can know.
    pub(super) fn is_live(&self, now: Instant, connected: bool) -> bool {
        connected && self.told.snapshot.status.is_good() && self.heard_ago(now) < HEARD_WITHIN
    }

    /// How long ago all this was told.
    fn heard_ago(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.heard)
    }

    /// Its row.
    pub(super) fn row(&self, now: Instant, connected: bool) -> Row {
        Row::told(&self.told, self.is_live(now, connected), self.heard, now)
    }

    /// Whether somebody should see to it.
    pub(super) fn is_in_trouble(&self) -> bool {
        self.told.snapshot.concern().is_some_and(|concern| concern.severity.is_trouble())
    }

    /// Whether somebody should go there now.
    pub(super) fn is_alarming(&self) -> bool {
        self.told.snapshot.concern().is_some_and(|concern| concern.severity == Severity::Alarm)
    }

    /// Whether it does not answer.
    pub(super) fn is_lost(&self) -> bool {
        self.told.snapshot.link == Link::Lost
    }
}
