//! Control that somebody else takes of a drive that runs by our command, and a trip of such a drive: the run command is
//! withdrawn, so that nothing starts by it when he gives control back or resets the fault at the drive (rule 5).

use std::time::Duration;

use drive_core::{Command, Error, ErrorKind, Result, Status, StopMode};
use tokio::time::Instant;

use super::{Asker, Job, Supervisor, stopping::REPEAT};
use crate::{cause::Policy, event::EventKind, outcome::Outcome, settings::OnControlTaken};

/// Who withdraws and stops here, as events name it.
const TAKEN: Asker = Asker::Policy(Policy::ControlTaken);
const TRIPPED: Asker = Asker::Policy(Policy::Tripped);

/// A run command that is to be withdrawn.
#[derive(Debug)]
pub(super) struct Withdrawal {
    asker: Asker,
    /// When it is tried next; `None` where the family cannot.
    next_try: Option<Instant>,
    pause: Duration,
    /// When it becomes an alarm that it still stands; `None` when it has.
    alarm_at: Option<Instant>,
    /// Why it still stands, once that is an alarm.
    stands: Option<Error>,
}

impl Withdrawal {
    pub(super) const fn wake_at(&self) -> Option<Instant> {
        self.next_try
    }

    pub(super) const fn asker(&self) -> &Asker {
        &self.asker
    }

    pub(super) const fn stands(&self) -> Option<&Error> {
        self.stands.as_ref()
    }
}

impl Supervisor {
    /// Somebody else has taken control while the drive ran by our command.
    pub(super) fn control_taken(&mut self, now: Instant) {
        if self.settings.on_control_taken == OnControlTaken::Withdraw {
            self.withdraw(now, TAKEN);
        }
    }

    /// The drive has tripped while it ran by our command. Where its own restart is accepted the command stands for that.
    pub(super) fn run_ended_by_trip(&mut self, now: Instant) {
        if self.settings.accept_self_restart.is_empty() {
            self.withdraw(now, TRIPPED);
        }
    }

    fn withdraw(&mut self, now: Instant, asker: Asker) {
        // A stop that is under way ends the run command anyhow.
        if self.settings.control && self.stopping.is_none() && self.withdrawal.is_none() {
            let alarm_at = Some(now + self.settings.times.stop_alarm);
            self.withdrawal =
                Some(Withdrawal { asker, next_try: Some(now), pause: REPEAT.0, alarm_at, stands: None });
        }
    }

    /// Control is back. A run command that could not be withdrawn acts again now.
    pub(super) fn control_returned(&mut self, now: Instant) {
        if let Some(withdrawal) = self.withdrawal.take() {
            self.stop_by_policy(now, withdrawal.asker, StopMode::Ramp);
        }
    }

    pub(super) fn withdraw_job(&self, now: Instant) -> Option<Job> {
        let due = self.withdrawal.as_ref()?.next_try? <= now;
        due.then_some(Job::Withdraw)
    }

    pub(super) fn handle_withdrawn(&mut self, now: Instant, result: Result<Status>) {
        let Some(withdrawal) = &mut self.withdrawal else { return };
        match result {
            Ok(status) => {
                let asker = withdrawal.asker.clone();
                self.withdrawal = None;
                self.started_here = false;
                self.conclude(asker, Command::Withdraw, None, Outcome::Confirmed);
                self.accept_status(now, status);
            }
            Err(error) => {
                let lacks = error.kind() == ErrorKind::Unsupported;
                withdrawal.next_try = (!lacks).then_some(now + withdrawal.pause);
                withdrawal.pause = (withdrawal.pause * 2).min(REPEAT.1);
                let alarm = withdrawal.alarm_at.take_if(|at| lacks || *at <= now).is_some();
                if withdrawal.alarm_at.is_none() {
                    withdrawal.stands = Some(error.clone());
                }
                let status = match &error {
                    Error::NotConfirmed { status, .. } => Some(Status::clone(status)),
                    _ => None,
                };
                if alarm {
                    self.emit(EventKind::RunCommandStands(error));
                }
                if let Some(status) = status {
                    self.accept_status(now, status);
                }
            }
        }
    }
}
