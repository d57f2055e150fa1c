//! A run command of this side that stands and is not in force, as its family judges from each status: it is told, and
//! withdrawn, so that nothing starts by it when what keeps it from acting goes away (rule 5).

use std::time::Duration;

use drive_core::{
    Command, Control, Error, ErrorKind, Lack, Motion, Refusal, Result, StopMode, Verdict, Withdrawn,
};
use tokio::time::Instant;

use super::{Asker, Job, Supervisor, stopping::REPEAT, verdict::status_of};
use crate::{
    cause::{Cause, Policy},
    event::EventKind,
    outcome::Outcome,
    settings::OnControlTaken,
    snapshot::Link,
};

/// Who withdraws and stops here, as events name it: by what the run command lacks.
const fn by(lacks: Lack) -> Policy {
    match lacks {
        Lack::Output => Policy::OutputBlocked,
        Lack::Reference => Policy::ReferenceTaken,
        _ => Policy::ControlTaken,
    }
}

/// A run command that is to be withdrawn.
#[derive(Debug)]
pub(super) struct Withdrawal {
    asker: Asker,
    /// When it is tried next; `None` where the family cannot, with what the shaft did then: of one that stands it may be able to.
    next_try: Option<Instant>,
    lacked: Option<Motion>,
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
    /// What a new status says of the run command of this side.
    pub(super) fn judge_run(&mut self, now: Instant) {
        let Some(verdict) = self.status.as_ref().map(|status| status.value.verdict) else { return };
        if self.judge_adoption(verdict) {
            return;
        }
        match verdict {
            Some(Verdict::NotInForce { lacks, because }) => self.run_suspended(now, lacks, because),
            Some(Verdict::InForce) => {
                (self.suspended, self.reported) = (None, false);
                // It could not be withdrawn, and acts again now.
                let acts = self.withdrawal.take();
                if let Some(withdrawal) = crate::mutant!("run-that-acts-again-left", acts, None::<Withdrawal>)
                {
                    self.stop_by_policy(now, withdrawal.asker, StopMode::Ramp);
                }
            }
            Some(_) => {}
            None => {
                (self.suspended, self.reported) = (None, false);
                self.withdrawal = None;
            }
        }
    }

    fn run_suspended(&mut self, now: Instant, lacks: Lack, because: Refusal) {
        let tripped = matches!(because, Refusal::Tripped | Refusal::Fault(_));
        // A trip, and who has taken control, are told as such.
        let told_otherwise = tripped || matches!(because, Refusal::NotInControl(_));
        if self.suspended.replace((lacks, because)) != Some((lacks, because))
            && !self.ends_by_itself()
            && !told_otherwise
        {
            let kind = match lacks {
                Lack::Output => EventKind::OutputBlocked(because),
                Lack::Reference => EventKind::ReferenceTaken(because),
                _ => EventKind::CommandOverridden(because),
            };
            self.emit_shown(kind, Cause::Drive);
        }
        let reports = self.settings.on_control_taken == OnControlTaken::Report;
        self.reported |= reports && lacks == Lack::Command;
        match (tripped, lacks) {
            // Where its own restart is accepted the command stands for that.
            (true, _) if !self.settings.accept_self_restart.is_empty() => {}
            (true, _) => self.withdraw(now, Policy::Tripped),
            (false, _) if self.reported => {}
            (false, lack) if self.settings.accept_resume.contains(&lack) => {}
            (false, lack) => self.withdraw(now, by(lack)),
        }
    }

    /// Whether the withdrawal that is sent now may be what stops the motor: not where its output is cut, somebody else commands it, or it is
    /// on its way down.
    pub(super) fn may_withdrawal_stop(&self) -> bool {
        let is_cut = self.suspended.is_some_and(|(lacks, _)| lacks == Lack::Output);
        let obeys = self.status.as_ref().is_some_and(|status| {
            status.value.motion == Motion::Driven && matches!(status.value.control, None | Some(Control::Bus))
        });
        obeys && !is_cut
    }

    /// Whether a stop ends the run command anyhow, or a start is under way that has its own verdict.
    fn ends_by_itself(&self) -> bool {
        self.stopping.is_some() || self.is_being_started()
    }

    fn withdraw(&mut self, now: Instant, policy: Policy) {
        let is_another = self.checks.is_another();
        if self.settings.control
            && !is_another
            && !self.ends_by_itself()
            && crate::mutant!("suspended-run-stands", self.withdrawal.is_none(), false)
        {
            let asker = Asker::Policy(policy);
            let alarm_at = Some(now + self.settings.times.stop_alarm);
            self.withdrawal = Some(Withdrawal {
                asker,
                next_try: Some(now),
                lacked: None,
                pause: REPEAT.0,
                alarm_at,
                stands: None,
            });
        }
        let motion = self.status.as_ref().map(|status| status.value.motion);
        if let Some(withdrawal) =
            self.withdrawal.as_mut().filter(|it| it.lacked.is_some() && it.lacked != motion)
        {
            (withdrawal.next_try, withdrawal.lacked) = (Some(now), None);
        }
    }

    pub(super) fn withdraw_job(&self, now: Instant) -> Option<Job> {
        let due = self.withdrawal.as_ref()?.next_try? <= now;
        if !due || self.is_unseen() {
            return None;
        }
        // Nothing is written to a drive of which nobody knows which it is, as long as it has not been asked.
        let asks = self.checks.identity_job(now).filter(|_| self.link == Link::Connected);
        Some(asks.unwrap_or(Job::Withdraw))
    }

    pub(super) fn handle_withdrawn(&mut self, now: Instant, result: Result<Withdrawn>) {
        let Some(withdrawal) = &mut self.withdrawal else { return };
        match result {
            Ok(withdrawn) => {
                let asker = withdrawal.asker.clone();
                self.withdrawal = None;
                // Of what did not stand nobody says that it was withdrawn.
                let outcome = match withdrawn {
                    Withdrawn::Ended(_) => Outcome::Confirmed,
                    Withdrawn::Nothing(_) => {
                        crate::mutant!("nothing-told-as-withdrawn", Outcome::NothingStood, Outcome::Confirmed)
                    }
                };
                self.conclude(asker, Command::Withdraw, None, outcome);
                self.accept_status(now, withdrawn.into_status());
            }
            Err(error) => {
                let lacks = error.kind() == ErrorKind::Unsupported;
                withdrawal.next_try = (!lacks).then_some(now + withdrawal.pause);
                withdrawal.lacked = self.status.as_ref().map(|status| status.value.motion).filter(|_| lacks);
                withdrawal.pause = (withdrawal.pause * 2).min(REPEAT.1);
                let alarm = withdrawal.alarm_at.take_if(|at| lacks || *at <= now).is_some();
                if withdrawal.alarm_at.is_none() {
                    withdrawal.stands = Some(error.clone());
                }
                let status = status_of(&error);
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
