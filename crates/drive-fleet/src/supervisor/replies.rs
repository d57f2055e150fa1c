//! What comes back of a job: its reply, that it was dropped or that its driver has panicked, and what the family has read besides.

use drive_core::{Error, Ground, Lease, PortError, Refusal};
use tokio::time::Instant;

use super::{Job, Reply, Supervisor};
use crate::{
    cause::{Cause, Policy},
    event::EventKind,
    snapshot::Link,
};

/// How many panics of a driver are told that say something else, until its drive is found anew.
const PANICS: usize = 8;

impl Supervisor {
    /// The reply to the job in flight.
    pub(crate) fn handle_reply(&mut self, now: Instant, reply: Reply) {
        let job = self.in_flight.take();
        let worn = self.wearing.take().filter(|_| reply.may_have_written());
        self.changed = true;
        if let Some(error) = reply.error() {
            self.last_error = Some(error.clone());
            self.counters.failures += 1;
            // The line has asked it often enough: nobody waits until its status is too old.
            if is_gone(error) && self.link == Link::Connected {
                self.lose(now);
            }
        }
        match reply {
            Reply::Status(result) => {
                let is_seen = result.is_ok() && matches!(job, Some(Job::Status { anew: true }));
                self.handle_status(now, result);
                self.unseen &= !is_seen;
            }
            Reply::Measurements(result) => self.handle_measurements(now, result),
            Reply::Faults(result) => self.handle_faults(now, result),
            Reply::Identity(result) => {
                if let Some(event) = self.checks.handle_identity(now, result) {
                    self.emit_by(event, Cause::Found);
                }
                if self.checks.is_another() {
                    // Whatever turns its motor is not ours.
                    self.withdrawal = None;
                    self.end_writes();
                }
                if self.link == Link::Connected {
                    self.adopt_run(now);
                    // The status that it showed before it was asked.
                    self.judge_stop(now);
                }
            }
            Reply::Watchdog(result) if matches!(job, Some(Job::RestoreWatchdog(_))) => {
                self.handle_restored(result);
            }
            Reply::Watchdog(result) => {
                let armed = matches!(job, Some(Job::ArmWatchdog(..)));
                let control = self.settings.control;
                if let Some(event) = self.checks.handle_watchdog(now, armed, control, result) {
                    let cause = if armed { Cause::policy(Policy::Watchdog) } else { Cause::Found };
                    self.emit_by(event, cause);
                }
                self.tell_watchdog();
            }
            Reply::SelfRestarts(result) => {
                if let Some(event) = self.checks.handle_restarts(now, result) {
                    self.emit_by(event, Cause::Found);
                }
            }
            Reply::Told(told) => self.handle_told(told),
            Reply::Withdrawn(result) => self.handle_withdrawn(now, result),
            Reply::KeptAlive(result) => self.checks.handle_kept_alive(now, result.is_ok()),
            Reply::Stopped(result) => self.handle_stopped(now, result),
            Reply::Setpoint(result) => self.handle_setpoint_reply(now, result),
            Reply::Ordered(result) => self.handle_order_reply(now, result.map(Some)),
            Reply::Saved(result) => {
                if let Ok(saves) = result {
                    self.counters.saves = u64::from(saves);
                }
                self.handle_order_reply(now, result.map(|_| None));
            }
        }
        self.note_eeprom(now, worn);
    }

    /// Its task has panicked: the job in flight has failed by it. Gives whether there is one.
    pub(crate) fn handle_panicked(&mut self, now: Instant, said: String) -> bool {
        self.note_panic(said.clone());
        let Some(job) = self.in_flight else { return false };
        self.handle_reply(now, Reply::failed(job, Error::DriverPanicked(said)));
        true
    }

    /// Its driver has panicked, and goes on being asked.
    pub(crate) fn note_panic(&mut self, said: String) {
        // What it has half read counts for nothing.
        self.doubtful = true;
        if self.panics.len() < PANICS && !self.panics.contains(&said) {
            self.panics.push(said.clone());
            self.emit_by(EventKind::DriverPanicked(said), Cause::Found);
        }
    }

    /// The drive has heard a frame, and answered it. No reply of a job tells that: some take no exchange at all.
    pub(crate) fn handle_heard(&mut self, at: Instant) {
        self.checks.heard(at);
    }

    /// The run command of this side that stands, as the family keeps it.
    pub(crate) fn handle_lease(&mut self, lease: Option<Lease>) {
        self.changed |= self.lease != lease;
        self.lease = lease;
    }

    /// What is set up otherwise in the drive than its words are taken for, as the family has read it.
    pub(crate) fn handle_unmet(&mut self, unmet: Option<Refusal>) {
        self.changed |= self.unmet != unmet;
        self.unmet = unmet;
        // Of another drive that is told, and no setting.
        let is_known = !matches!(
            self.checks.identity(),
            crate::snapshot::IdentityCheck::Unchecked | crate::snapshot::IdentityCheck::OtherFamily { .. }
        );
        if is_known && self.unmet_told != unmet {
            let before = std::mem::replace(&mut self.unmet_told, unmet);
            if let Some(because) = unmet.or(before) {
                self.emit_shown(
                    EventKind::SetUpOtherwise { because, present: unmet.is_some() },
                    Cause::Found,
                );
            }
        }
    }

    /// What a contract with the drive rests on has changed without this side.
    pub(crate) fn handle_changed(&mut self, now: Instant, ground: Ground) {
        self.checks.changed(now, ground);
        if ground == Ground::Units {
            // What it was counted in, or may be, is not what it was when it was given.
            self.given = None;
        }
        self.emit_shown(EventKind::ContractChanged(ground), Cause::Drive);
    }

    /// The job in flight was dropped: because the machine asked for it, or because its time was over. What it was to write may
    /// have been written.
    pub(crate) fn handle_dropped(&mut self, now: Instant) {
        let Some(job) = self.in_flight.take() else { return };
        if let Job::ArmWatchdog(..) = job {
            self.changed = true;
            self.checks.arming_dropped(now);
        }
        let worn = self.wearing.take();
        self.note_eeprom(now, worn);
    }
}

/// Whether an error says that the drive cannot be reached at all now.
const fn is_gone(error: &Error) -> bool {
    matches!(
        error,
        Error::Port { problem: PortError::Offline { .. } | PortError::LineDown(_) | PortError::Closed, .. }
    )
}
