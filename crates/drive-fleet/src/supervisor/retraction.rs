//! Values that a second, different answer to their question has withdrawn.

use drive_core::StopMode;
use tokio::time::Instant;

use super::{Asker, Supervisor};
use crate::{
    cause::{Cause, Policy},
    event::EventKind,
};

/// What was withdrawn.
#[derive(Debug)]
pub(super) struct Retraction {
    /// The last that has withdrawn a status.
    told: Option<Instant>,
    /// The status that stands was withdrawn.
    pub(super) is_open: bool,
    /// When the last status, and the last measurements, were taken for true.
    status_taken: Instant,
    measurements_taken: Instant,
    /// The stop that a status has confirmed, and when that was read.
    confirmed: Option<(Instant, StopMode)>,
}

impl Retraction {
    pub(super) const fn new(now: Instant) -> Self {
        Self { told: None, is_open: false, status_taken: now, measurements_taken: now, confirmed: None }
    }

    /// Another status is taken for true.
    pub(super) const fn status(&mut self, now: Instant) {
        (self.is_open, self.status_taken) = (false, now);
    }

    pub(super) const fn measurements(&mut self, now: Instant) {
        self.measurements_taken = now;
    }

    /// A stop was confirmed by the status that was read then.
    pub(super) const fn confirmed(&mut self, at: Instant, mode: StopMode) {
        self.confirmed = Some((at, mode));
    }
}

impl Supervisor {
    /// What was asked for at this time counts for nothing: another, different answer has come to it. The status is asked for
    /// anew, and a stop that it has confirmed goes on. That a reading under way counts for nothing is told once it is taken. Gives
    /// whether the job in flight has to be dropped for it.
    pub(crate) fn handle_retracted(&mut self, now: Instant, at: Instant) -> bool {
        if self
            .measurements
            .as_ref()
            .is_some_and(|measured| measured.at <= at && at <= self.retraction.measurements_taken)
        {
            self.measurements = None;
            self.changed = true;
        }
        let Some(read) = self.status.as_ref().map(|status| status.at) else { return false };
        if at < read || self.retraction.status_taken < at || self.retraction.told.replace(at) == Some(at) {
            return false;
        }
        self.retraction.is_open = true;
        self.emit_by(EventKind::ValueWithdrawn, Cause::Found);
        self.pace.hurry(now);
        if let Some((_, mode)) = self.retraction.confirmed.take_if(|(confirmed, _)| *confirmed == read)
            && self.settings.control
            && self.stopping.is_none()
        {
            let by = Asker::Policy(Policy::ValueWithdrawn);
            self.stop_by_policy(now, by, mode);
            return self.drops_for_stop();
        }
        false
    }
}
