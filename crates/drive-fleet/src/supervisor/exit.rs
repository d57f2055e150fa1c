//! The exit: each drive's policy acts (rule 8).

use drive_core::StopMode;
use tokio::time::Instant;

use super::{Asker, Supervisor, orders::Queued};
use crate::{
    event::{EventKind, ExitAction},
    outcome::{Order, Outcome},
    settings::OnExit,
};

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
    /// Done.
    Done(ExitAction),
}

impl Supervisor {
    /// The fleet shuts down. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn handle_exit(&mut self, now: Instant) -> bool {
        if self.exit != Exit::No {
            return false;
        }
        self.refuse_queue();
        let started = self.started_here || self.is_starting();
        // Rule 1 ends with its confirmation, whatever the policy.
        let stopping = self.stopping.is_some();
        let policy = self.settings.on_exit;
        match policy {
            _ if !self.settings.control => self.exit_done(ExitAction::Left),
            OnExit::Stop(mode) | OnExit::Release(mode) if started || stopping => {
                self.exit = Exit::Stopping { release: matches!(policy, OnExit::Release(_)) };
                self.stop_by_policy(now, Asker::Exit, mode);
            }
            OnExit::Leave if stopping => {
                self.exit = Exit::Stopping { release: false };
                self.stop_by_policy(now, Asker::Exit, StopMode::Ramp);
            }
            OnExit::Release(_) if self.stands() => self.exit = Exit::Release,
            OnExit::Stop(_) | OnExit::Release(_) | OnExit::Leave => self.exit_done(ExitAction::Left),
        }
        true
    }

    /// The time for shutting down is over.
    pub(crate) fn handle_exit_time_over(&mut self) {
        if !matches!(self.exit, Exit::Done(_)) {
            self.exit_done(ExitAction::TimeOver);
        }
    }

    pub(super) fn is_exiting(&self) -> bool {
        self.exit != Exit::No
    }

    /// A command of the exit has ended.
    pub(super) fn exit_concluded(&mut self, outcome: &Outcome) {
        match self.exit {
            Exit::Stopping { release: true } if outcome.is_confirmed() => self.exit = Exit::Release,
            Exit::Stopping { .. } => self.exit_done(ExitAction::Stopped(outcome.clone())),
            Exit::Releasing => self.exit_done(ExitAction::Released(outcome.clone())),
            Exit::No | Exit::Release | Exit::Done(_) => {}
        }
    }

    pub(super) fn advance_exit(&mut self, now: Instant) {
        if self.exit == Exit::Release {
            self.exit = Exit::Releasing;
            self.enqueue(Queued { asker: Asker::Exit, order: Order::Release, issued: now });
        }
    }

    fn exit_done(&mut self, action: ExitAction) {
        self.emit(EventKind::Exit(action.clone()));
        self.exit = Exit::Done(action);
    }
}
