//! What became of an order: the drive's own words decide (rule 3).

use std::time::Duration;

use drive_core::{
    Control, Error, ErrorKind, Lack, Lease, Measurements, PortError, Result, SETTLED_WITHIN, Setpoint,
    Status, StopMode, Verdict,
};
use tokio::time::Instant;

use super::{
    Asker, Job, Output, Supervisor,
    orders::{Active, Phase},
    shown::follows_another,
};
use crate::{
    cause::Policy,
    limits::Given,
    outcome::{Order, Outcome, Refused, Unconfirmed, Until},
    snapshot::has_reached,
};

/// Until a reference is read back again after that has failed.
const READ_AGAIN: Duration = Duration::from_millis(100);

impl Supervisor {
    pub(super) fn handle_setpoint_reply(&mut self, now: Instant, result: Result<()>) {
        self.setpoint_dropped = false;
        let Some(Active { phase: Phase::Sending(Job::SetSetpoint(setpoint, start)), .. }) = self.active
        else {
            return;
        };
        // Where nothing was written, or nothing was done, the drive holds what it held.
        let holds = |error: &Error| error.has_written_nothing() || error.kind() == ErrorKind::Exception;
        let holds = result.as_ref().err().is_some_and(holds);
        if !holds {
            self.conclude_dropped(Outcome::NotConfirmed(Unconfirmed::Superseded));
        }
        match result {
            Ok(()) => self.setpoint_given(now, setpoint),
            Err(error) => {
                self.given.take_if(|_| !holds);
                let is_start = self.active.as_ref().is_some_and(Active::is_start);
                match error.kind() {
                    // What only a start shows, the start shows.
                    ErrorKind::NotConfirmed if is_start && error.only_a_start_shows() => {
                        self.setpoint_given(now, setpoint);
                    }
                    ErrorKind::Refused | ErrorKind::Unsupported | ErrorKind::Exception => {
                        self.note_exchange(now, &error);
                        self.end_order(Outcome::Refused(error.into()));
                    }
                    // The word that the drive holds is not what it follows: the family has looked.
                    ErrorKind::NotConfirmed => {
                        let status = status_of(&error);
                        self.end_order(Outcome::NotConfirmed(Unconfirmed::Denied(error)));
                        if let Some(status) = status {
                            self.accept_status(now, status);
                        }
                    }
                    _ if error.has_written_nothing() => self.end_order(unwritten(error)),
                    _ => self.verify(now, Job::SetSetpoint(setpoint, start), error),
                }
            }
        }
    }

    /// The drive holds the setpoint.
    fn setpoint_given(&mut self, now: Instant, setpoint: Setpoint) {
        self.given = Some(Given { setpoint, at: now });
        let Some(active) = &mut self.active else { return };
        active.set_given(setpoint);
        match active.order {
            Order::Setpoint { until: Until::InForce, .. } => self.end_order(Outcome::Confirmed),
            Order::Setpoint { .. } => self.await_reference(now, Outcome::Confirmed),
            _ => active.phase = Phase::Prepare,
        }
    }

    /// It is in force, and that is all, unless it is to come to its reference.
    pub(super) fn is_in_force(&mut self, now: Instant, order: Order, done: Outcome) {
        match order {
            Order::Start { until: Until::AtReference, .. } => self.await_reference(now, done),
            _ => self.end_order(done),
        }
    }

    /// It is in force, as told, and on its way to the reference.
    fn await_reference(&mut self, now: Instant, in_force: Outcome) {
        let until = now + self.settings.times.reference;
        self.set_phase(Phase::Awaiting { since: now, until });
        let asker = self.active.as_ref().and_then(|active| active.asker.id());
        self.outputs.extend(asker.map(|id| Output::InForce(id, in_force)));
        self.pace.quicken(now);
    }

    fn verify(&mut self, now: Instant, job: Job, error: Error) {
        let until = now + self.settings.times.effect;
        self.set_phase(Phase::Verifying { job, error, until, again: now, seen: false });
        if !matches!(job, Job::SetSetpoint(..)) {
            self.pace.hurry(now);
        }
    }

    /// Ends the order under way so of which nothing was sent, or of a start no run word. **What was written of it is told**: a motor that
    /// does not stand goes to the setpoint of a start that is refused.
    pub(super) fn end_unsent(&mut self, now: Instant, unsent: Outcome) {
        let given = self.active.as_ref().and_then(|active| active.setpoint_given);
        let last = || self.status.as_ref().map(|status| status.seen(now));
        let outcome = match (given, unsent) {
            (Some(setpoint), Outcome::Expired) => Outcome::not_started(setpoint, None, last()),
            (Some(setpoint), Outcome::Refused(why)) if !self.stands() => {
                Outcome::not_started(setpoint, Some(why), last())
            }
            (_, unsent) => unsent,
        };
        self.end_order(outcome);
    }

    /// The reply to a start, a reset, a release or a save.
    pub(super) fn handle_order_reply(&mut self, now: Instant, result: Result<Option<Status>>) {
        let Some(Active { phase: Phase::Sending(job), order, .. }) = self.active else {
            if let Ok(Some(status)) = result {
                self.accept_status(now, status);
            }
            return;
        };
        match result {
            Ok(status) => {
                let done = order.done(status.as_ref());
                self.is_in_force(now, order, done);
                if let Some(status) = status {
                    self.accept_status(now, status);
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::Refused | ErrorKind::Unsupported) => {
                self.note_exchange(now, &error);
                self.end_unsent(now, Outcome::Refused(error.into()));
            }
            // The family has looked for as long as it takes: nobody here knows better.
            Err(error) if error.kind() == ErrorKind::NotConfirmed => {
                let status = status_of(&error);
                self.end_order(Outcome::NotConfirmed(Unconfirmed::Denied(error)));
                if crate::mutant!("denied-start-stands", matches!(job, Job::Start(_)), false) {
                    self.withdraw_start(now);
                }
                if let Some(status) = status {
                    self.accept_status(now, status);
                }
            }
            Err(error) if error.has_written_nothing() => self.end_unsent(now, unwritten(error)),
            // A save is an edge and cannot be read back.
            Err(error) if job == Job::Persist => {
                let outcome = denied(&error).unwrap_or_else(|| self.unknown(now, Some(error)));
                self.end_order(outcome);
            }
            Err(error) => self.verify(now, job, error),
        }
    }

    /// What a new status says of the order under way.
    pub(super) fn judge_order(&mut self, now: Instant) {
        let Some(status) = self.status.as_ref().map(|status| status.value.clone()) else { return };
        let given = self.given.map(|given| given.setpoint);
        let Some(active) = &mut self.active else { return };
        // What the order itself has given counts, whatever is remembered for later ones.
        let given = match active.order {
            Order::Start { setpoint: Some(setpoint), .. } | Order::Setpoint { setpoint, .. } => {
                Some(setpoint)
            }
            _ => given,
        };
        match &mut active.phase {
            Phase::Prepare | Phase::Sending(_) | Phase::Verifying { job: Job::SetSetpoint(..), .. } => {}
            Phase::Awaiting { since, .. } => {
                let after = now.saturating_duration_since(*since);
                // One that another master has turned round is at its reference too.
                let directed = match active.order {
                    Order::Start { direction, .. } => status.direction.is_none_or(|turns| turns == direction),
                    _ => true,
                };
                if directed && has_reached(given, &status) {
                    let done = active.order.done(Some(&status));
                    self.end_order(done);
                } else if let Some(because) = status.verdict.and_then(|verdict| verdict.because()) {
                    let last = self.status.as_ref().map(|status| status.seen(now));
                    let because = Some(because);
                    self.end_order(Outcome::NotConfirmed(Unconfirmed::TimeOver {
                        after,
                        last,
                        because,
                        stop: None,
                    }));
                }
            }
            Phase::Verifying { job: Job::Start(_), error, until, seen, .. } => {
                *seen = true;
                let after = self.settings.times.effect.saturating_sub(until.saturating_duration_since(now));
                let denied = denied(error);
                self.judge_lost_start(now, &status, after, denied);
            }
            Phase::Verifying { job, error, seen, .. } => {
                *seen = true;
                if shows(*job, &status) {
                    self.end_order(Outcome::Confirmed);
                } else if let Some(outcome) = denied(error) {
                    self.end_unsent(now, outcome);
                }
            }
        }
    }

    /// What the family says of a start whose answer was lost, so long after it.
    fn judge_lost_start(&mut self, now: Instant, status: &Status, after: Duration, denied: Option<Outcome>) {
        let Some(active) = &self.active else { return };
        // Of one that was never written the run command of before is none.
        let is_its = match active.order {
            Order::Start { direction, .. } => {
                let same_way = |lease: Lease| {
                    crate::mutant!("lease-of-before-confirms", lease.direction == direction, true)
                };
                self.lease.is_some_and(same_way)
            }
            _ => true,
        };
        let verdict = status.verdict.filter(|verdict| is_its || *verdict != Verdict::InForce);
        let verdict = match (verdict, follows_another(self.starts_at(), status)) {
            (Some(Verdict::InForce), Some(because)) => Some(Verdict::lacks(Lack::Reference, because)),
            (verdict, _) => verdict,
        };
        match crate::mutant!("lost-start-believed", verdict, Some(Verdict::InForce)) {
            Some(Verdict::InForce) => {
                let order = active.order;
                self.is_in_force(now, order, order.done(Some(status)));
            }
            // A drive may take a while to show a word that it holds.
            Some(Verdict::NotInForce { because, .. }) if after >= SETTLED_WITHIN => {
                let last = self.status.as_ref().map(|status| status.seen(now));
                let because = Some(because);
                self.end_order(Outcome::NotConfirmed(Unconfirmed::TimeOver {
                    after,
                    last,
                    because,
                    stop: None,
                }));
                self.withdraw_start(now);
            }
            _ => {
                if let Some(outcome) = denied {
                    self.end_unsent(now, outcome);
                }
            }
        }
    }

    /// What the reference that was read back says of a setpoint whose answer was lost.
    pub(super) fn judge_reference(
        &mut self,
        now: Instant,
        result: Result<Measurements>,
    ) -> Result<Measurements> {
        let Some(Active {
            phase: Phase::Verifying { job: Job::SetSetpoint(asked, _), error, again, .. },
            ..
        }) = &mut self.active
        else {
            return result;
        };
        let (asked, error) = (*asked, error.clone());
        match &result {
            Err(_) => *again = now + READ_AGAIN,
            Ok(Measurements { reference: Some(reference), .. })
                if crate::mutant!("any-reference-believed", *reference == asked, true) =>
            {
                self.setpoint_given(now, asked);
            }
            Ok(Measurements { reference: Some(_), .. }) => {
                let unconfirmed = Outcome::NotConfirmed(Unconfirmed::Denied(error.clone()));
                self.end_order(denied(&error).unwrap_or(unconfirmed));
            }
            // A family that tells no reference leaves the question open.
            Ok(_) => self.end_order(self.unknown(now, Some(error))),
        }
        result
    }

    pub(super) fn check_order_times(&mut self, now: Instant) {
        let Some(active) = &self.active else { return };
        let outcome = match &active.phase {
            Phase::Verifying { error, until, seen, .. } if *until <= now => {
                if crate::mutant!("unseen-told-as-denied", *seen, true) {
                    Outcome::NotConfirmed(Unconfirmed::Denied(error.clone()))
                } else {
                    self.unknown(now, Some(error.clone()))
                }
            }
            Phase::Awaiting { since, until } if *until <= now => {
                let after = now.saturating_duration_since(*since);
                let last = self.status.as_ref().map(|status| status.seen(now));
                Outcome::NotConfirmed(Unconfirmed::TimeOver { after, last, because: None, stop: None })
            }
            _ => return,
        };
        let start = matches!(active.phase, Phase::Verifying { job: Job::Start(_), .. });
        self.end_order(outcome);
        if crate::mutant!("unshown-start-stands", start, false) {
            self.withdraw_start(now);
        }
    }

    /// A run command whose effect has not shown may still stand in the drive, or on its way there, and turn the motor when
    /// nobody expects it any more. A stop takes it back.
    fn withdraw_start(&mut self, now: Instant) {
        let by = Asker::Policy(Policy::StartNotConfirmed);
        self.stop_by_policy(now, by, StopMode::Ramp);
    }
}

/// The status that an error rests on.
pub(super) fn status_of(error: &Error) -> Option<Status> {
    match error {
        Error::NotConfirmed { status, .. } => Some(Status::clone(status)),
        _ => None,
    }
}

/// Whether a status shows what a job was to bring about.
fn shows(job: Job, status: &Status) -> bool {
    match job {
        Job::ResetFaults => !status.is_fault(),
        Job::Release => status.control.is_some_and(|control| control != Control::Bus),
        _ => false,
    }
}

/// How an order ends of which nothing was written.
fn unwritten(error: Error) -> Outcome {
    match error {
        Error::Port { problem: PortError::Expired, .. } => Outcome::Expired,
        error => Outcome::Refused(Refused::Drive(error)),
    }
}

/// How an order ends at once that the drive has answered that it does not carry out.
fn denied(error: &Error) -> Option<Outcome> {
    crate::mutant!("lost-answer-told-as-refused", error.kind() == ErrorKind::Exception, true)
        .then(|| Outcome::Refused(Refused::Drive(error.clone())))
}
