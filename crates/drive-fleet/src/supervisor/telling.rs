//! What is told: events to everybody, outcomes and answers to who asked, and the snapshot of what is known.

use std::sync::Arc;

use drive_core::{Command, Setpoint};
use tokio::time::Instant;

use super::{Asker, CallId, Supervisor, Told, stopping::Stopping, withdraw::Withdrawal};
use crate::{
    cause::Cause,
    concern,
    event::{EventKind, Happened},
    outcome::{Outcome, Refused},
    snapshot::Snapshot,
};

/// What the machine wants told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Output {
    /// To everybody.
    Event(Happened),
    /// To one caller: the drive shows that it is in force what he has asked for.
    InForce(CallId, Outcome),
    /// To one caller.
    Answer(CallId, Outcome),
    /// To one who asked a question.
    Told(CallId, Result<Told, Refused>),
    /// To one whose write is on its way: nobody knows what becomes of it.
    Untold(CallId),
}

impl Supervisor {
    /// What is to be told, in order.
    pub(crate) fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// The snapshot, if anything changed since this was last asked.
    pub(crate) fn take_snapshot(&mut self, now: Instant) -> Option<Snapshot> {
        if !std::mem::take(&mut self.changed) {
            return None;
        }
        let mut snapshot = self.snapshot(now);
        concern::note(&mut self.since, &snapshot.concerns(now), now);
        snapshot.since.clone_from(&self.since);
        Some(snapshot)
    }

    /// What is known now.
    pub(crate) fn snapshot(&self, now: Instant) -> Snapshot {
        Snapshot {
            name: self.name(),
            link: self.link,
            error: self.last_error.clone(),
            status: self.status.clone(),
            retracted: self.retraction.is_open,
            measurements: self.measurements.clone(),
            setpoint: self.given.map(|given| given.setpoint),
            identity: self.checks.identity().clone(),
            watchdog: self.checks.watchdog().clone(),
            self_restarts: self.checks.restarts().cloned(),
            restarts_accepted: self.checks.restarts_accepted(),
            control_taken: self.control_taken,
            run_command_stands: self.withdrawal.as_ref().and_then(Withdrawal::stands).cloned(),
            eeprom_worn: self.ledger.is_worn(now),
            exceeded: self.exceeded.values().copied().collect(),
            unmet: self.unmet,
            off_setpoint: self.off_setpoint.off(),
            since: self.since.clone(),
            stop: self.stopping.as_ref().map(Stopping::pending),
            lease: self.lease,
            suspended: self.suspended.map(|(_, because)| because),
            start_refused: self.start_refused(now),
            trips: Arc::clone(&self.trips),
            counters: self.counters,
            max_age: self.settings.periods.max_age,
            measurements_max_age: self.settings.periods.slow.saturating_add(self.settings.periods.max_age),
        }
    }

    /// Tells what the drive does by itself, as far as this side knows.
    pub(super) fn emit(&mut self, kind: EventKind) {
        self.emit_by(kind, Cause::Drive);
    }

    pub(super) fn emit_by(&mut self, kind: EventKind, cause: Cause) {
        self.changed = true;
        self.outputs.push_back(Output::Event(Happened { kind, cause, words: Arc::default() }));
    }

    /// Tells what a status shows, with the words that changed with it.
    pub(super) fn emit_shown(&mut self, kind: EventKind, cause: Cause) {
        self.changed = true;
        self.outputs.push_back(Output::Event(Happened { kind, cause, words: Arc::clone(&self.words) }));
    }

    /// Tells everybody how a command ended, and its caller first.
    pub(super) fn conclude(
        &mut self,
        asker: Asker,
        command: Command,
        setpoint: Option<Setpoint>,
        outcome: Outcome,
    ) {
        let (commander, cause) = (asker.name(), asker.cause());
        match asker {
            Asker::Caller { id, .. } => self.outputs.push_back(Output::Answer(id, outcome.clone())),
            Asker::Policy(_) if asker.is_exit() => self.exit_concluded(&outcome),
            Asker::Policy(_) => {}
        }
        self.emit_by(EventKind::Command { command, setpoint, commander, outcome }, cause);
    }
}
