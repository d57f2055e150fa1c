//! The exit: each drive's policy acts (rule 8), and what was armed for this fleet is not left to trip a drive that stands.

use drive_core::{Error, Result, StopMode, Watchdog};
use tokio::time::Instant;

use super::{Asker, Job, Supervisor, stopping::Stopping};
use crate::{
    cause::{Cause, Policy},
    event::{EventKind, ExitAction},
    outcome::{Order, Outcome, Refused},
    settings::{Left, OnExit, OnExitAdopted, OnExitWatchdog, RunRecord},
    snapshot::Link,
};

/// How often the watchdog is tried to be put back.
const ATTEMPTS: u8 = 3;

/// How far the exit is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Exit {
    /// Nobody has asked for it.
    No,
    /// A stop is under way.
    Stopping {
        /// Whether control is given back afterwards.
        release: bool,
    },
    /// Control is to be given back.
    Release,
    /// Control is being given back.
    Releasing,
    /// The watchdog is being put back to what was found.
    Restoring {
        found: Watchdog,
        /// How often it may still be tried.
        attempts: u8,
        /// What was done to the motor before.
        action: ExitAction,
    },
    /// Done. Until all that end together are done, the drive is asked and stopped like any other.
    Done(ExitAction),
}

/// Whether the conversation with the drive ends behind its exit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Leaving {
    /// Others are waited for.
    No,
    /// Unless a stop is under way.
    OnceStopped,
    /// Whatever is under way.
    Now,
    /// It has ended.
    Gone,
}

impl Supervisor {
    /// The fleet shuts down, or the drive is removed from it. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn handle_exit(&mut self, now: Instant, why: Policy) -> bool {
        if self.exit != Exit::No {
            return false;
        }
        self.exits_by = why;
        self.refuse_queue();
        let started = (crate::mutant!("lease-forgotten-at-exit", self.lease.is_some(), false)
            || self.is_starting())
            && !self.checks.is_another();
        // Rule 1 ends with its confirmation, whatever the policy.
        let stopping = self.stopping.is_some();
        let turns = self.turns();
        let (policy, adopted) = (self.settings.on_exit, self.settings.on_exit_adopted);
        let release = matches!(policy, OnExit::Release(_));
        match (policy, adopted) {
            _ if !self.settings.control => self.exit_ends(ExitAction::Left),
            (OnExit::Stop(mode) | OnExit::Release(mode), _) if started || stopping => {
                self.exit_by_stop(now, mode, release);
            }
            (OnExit::Leave, _) if stopping => self.exit_by_stop(now, StopMode::Ramp, false),
            (OnExit::Leave, _) if !self.owes_stop_of_before() => self.exit_ends(ExitAction::Left),
            (OnExit::Stop(_) | OnExit::Release(_), OnExitAdopted::Stop(mode)) if turns => {
                self.exit_by_stop(now, mode, release);
            }
            (OnExit::Stop(_), OnExitAdopted::Report) if turns => self.exit_ends(ExitAction::LeftTurning),
            // What is known of it is the record of an earlier run alone: nobody has seen what became of that.
            _ if self.link != Link::Connected && self.unadopted().is_some() => {
                self.exit_ends(ExitAction::LeftTurning);
            }
            (OnExit::Release(_), _) if self.stands() => self.exit = Exit::Release,
            _ => self.exit_ends(ExitAction::Left),
        }
        true
    }

    fn exit_by_stop(&mut self, now: Instant, mode: StopMode, release: bool) {
        self.exit = Exit::Stopping { release };
        self.stop_by_policy(now, Asker::Policy(self.exits_by), mode);
    }

    /// All that end together are done. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn handle_leave(&mut self) -> bool {
        // It may have been stopped since.
        if self.exit == Exit::Done(ExitAction::LeftTurning) && self.stands() {
            self.exit = Exit::Done(ExitAction::Left);
        }
        self.leaving = Leaving::OnceStopped;
        matches!(self.in_flight, Some(Job::Status { .. } | Job::KeepAlive))
    }

    /// Nobody holds the drive any more, and nothing more can be asked of it. Gives whether it goes on all the same: a stop that was given,
    /// and a policy that acts, outlive whoever has asked for them. What waits to move the motor does not.
    pub(crate) fn handle_unheld(&mut self) -> bool {
        self.is_unheld = true;
        if self.exit == Exit::No {
            self.refuse_queue();
        }
        self.owes_an_end()
    }

    /// Whether somebody was promised an end that has not come yet: that of a stop within its time, or that of the exit.
    fn owes_an_end(&self) -> bool {
        let exits = !matches!(self.exit, Exit::No | Exit::Done(_));
        exits || self.stopping.as_ref().is_some_and(Stopping::has_time)
    }

    /// What was done at the exit, once it is.
    pub(crate) const fn exit_action(&self) -> Option<&ExitAction> {
        match &self.exit {
            Exit::Done(action) => Some(action),
            _ => None,
        }
    }

    /// Whether the conversation is over, which is told once.
    pub(super) fn is_gone(&mut self) -> bool {
        if self.is_unheld {
            return !self.owes_an_end();
        }
        let Exit::Done(action) = &self.exit else { return false };
        match self.leaving {
            Leaving::No => return false,
            Leaving::OnceStopped if self.stopping.is_some() => return false,
            Leaving::Gone => return true,
            Leaving::OnceStopped | Leaving::Now => self.leaving = Leaving::Gone,
        }
        if self.exits_by == Policy::Removal {
            let kind = EventKind::Removed(action.clone());
            self.emit_by(kind, Cause::policy(Policy::Removal));
        }
        true
    }

    /// The time for shutting down is over.
    pub(crate) fn handle_exit_time_over(&mut self) {
        self.leaving = Leaving::Now;
        match std::mem::replace(&mut self.exit, Exit::No) {
            Exit::Done(action) => self.exit = Exit::Done(action),
            Exit::Restoring { action, .. } => {
                self.watchdog_stays("the time for shutting down was over");
                self.exit_done(action);
            }
            _ => self.exit_done(ExitAction::TimeOver),
        }
    }

    /// The watchdog is not put back, if that is under way.
    pub(super) fn end_restoring(&mut self, why: &'static str) {
        if let Exit::Restoring { action, .. } = &self.exit {
            let action = action.clone();
            self.watchdog_stays(why);
            self.exit_done(action);
        }
    }

    /// What is left of the drive to whoever goes on with it.
    pub(crate) fn left(&self) -> Left {
        let is_another = self.checks.is_another();
        let lease = self.lease.filter(|_| !is_another);
        let unadopted = || lease.is_none().then(|| self.unadopted()).flatten();
        Left {
            identity: self.checks.remembered(),
            watchdog: self.checks.left(),
            run: unadopted()
                .or_else(|| RunRecord::of(|| self.says_what_it_is(), lease, self.stop_under_way())),
            eeprom: (self.ledger.kept.writes > 0).then(|| self.ledger.kept.clone()),
        }
    }

    pub(super) fn is_exiting(&self) -> bool {
        self.exit != Exit::No
    }

    /// A command of the exit has ended.
    pub(super) fn exit_concluded(&mut self, outcome: &Outcome) {
        match self.exit {
            Exit::Stopping { release: true }
                if crate::mutant!("released-without-standstill", outcome.is_confirmed(), true) =>
            {
                self.exit = Exit::Release;
            }
            Exit::Stopping { .. } => self.exit_ends(ExitAction::Stopped(outcome.clone())),
            Exit::Releasing => self.exit_ends(ExitAction::Released(outcome.clone())),
            Exit::No | Exit::Release | Exit::Restoring { .. } | Exit::Done(_) => {}
        }
    }

    pub(super) fn advance_exit(&mut self, now: Instant) {
        if self.exit == Exit::Release {
            self.exit = Exit::Releasing;
            self.enqueue(now, Asker::Policy(self.exits_by), Order::Release, None, None);
        }
    }

    /// The motor was dealt with. What is left is the watchdog of a drive that stands.
    fn exit_ends(&mut self, action: ExitAction) {
        let policy = self.settings.on_exit_watchdog;
        let why = match self.checks.to_restore() {
            _ if !self.settings.control => return self.exit_done(action),
            _ if self.link != Link::Connected => "the drive does not answer",
            _ if !self.stands() => "the motor turns",
            None => "it was found so, and nothing tells what it was before",
            Some(_) if policy == OnExitWatchdog::Leave => "its policy says so",
            Some(_) if policy == OnExitWatchdog::RestoreInRam && self.watchdog_wears => {
                "to put it back writes to the drive's EEPROM, on_exit_watchdog = \"restore\" does it all the same"
            }
            Some(found) => {
                self.exit = Exit::Restoring { found, attempts: ATTEMPTS, action };
                return;
            }
        };
        self.watchdog_stays(why);
        self.exit_done(action);
    }

    pub(super) fn restore_job(&self) -> Option<Job> {
        match self.exit {
            Exit::Restoring { found, .. } => Some(Job::RestoreWatchdog(found)),
            _ => None,
        }
    }

    pub(super) fn handle_restored(&mut self, result: Result<Watchdog>) {
        let Exit::Restoring { found, attempts, action } = &mut self.exit else { return };
        *attempts = attempts.saturating_sub(1);
        let why = match result {
            Ok(watchdog) if watchdog.timeout == found.timeout => {
                let action = action.clone();
                self.checks.put_back();
                self.emit_by(EventKind::WatchdogRestored(watchdog), Cause::policy(self.exits_by));
                return self.exit_done(action);
            }
            Err(Error::Port { .. }) if *attempts > 0 => return,
            Ok(_) => "it was put back and reads back otherwise",
            Err(Error::Port { .. }) => "the drive does not answer",
            Err(_) => "the drive refuses to have it put back",
        };
        let action = action.clone();
        self.watchdog_stays(why);
        self.exit_done(action);
    }

    /// Tells that the drive trips by its watchdog once nobody speaks to it any more.
    fn watchdog_stays(&mut self, why: &'static str) {
        if let Some(timeout) = self.checks.set_to() {
            self.emit_by(EventKind::WatchdogStays { timeout, why }, Cause::policy(self.exits_by));
        }
    }

    /// Why nothing is begun any more of a drive that ends.
    pub(super) const fn gone(&self) -> Refused {
        match self.exits_by {
            Policy::Removal => Refused::Removed,
            _ => Refused::ShutDown,
        }
    }

    fn exit_done(&mut self, action: ExitAction) {
        // Who is taken out is not gone before the others are done.
        if self.exits_by != Policy::Removal {
            self.emit_by(EventKind::Exit(action.clone()), Cause::policy(self.exits_by));
        }
        self.exit = Exit::Done(action);
    }
}
