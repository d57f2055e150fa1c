//! What was written last that changes what the motor does, and why: so that what the drive then shows has its cause.

use super::{Job, Supervisor, orders::Active};
use crate::cause::Cause;

/// What was written last that changes the motor, and why.
#[derive(Debug)]
pub(super) struct Acted {
    pub(super) job: Job,
    pub(super) cause: Cause,
    /// No status has come since.
    pub(super) is_new: bool,
}

impl Supervisor {
    /// A job is sent: what changes the motor is remembered with its cause, until it shows.
    pub(super) fn note_act(&mut self, job: Job) {
        let cause = match job {
            Job::Stop(_) => self.begin_attempt(),
            Job::Withdraw if self.may_withdrawal_stop() => {
                self.withdrawal.as_ref().map(|withdrawal| withdrawal.asker().cause())
            }
            Job::Withdraw => {
                // What the motor does is somebody else's doing already, or that of a stop of here.
                self.acted.take_if(|acted| !matches!(acted.job, Job::Stop(_) | Job::Withdraw));
                return;
            }
            Job::Start(_) | Job::ResetFaults | Job::Release => self.active.as_ref().map(Active::cause),
            _ => return,
        };
        self.acted = cause.map(|cause| Acted { job, cause, is_new: true });
    }
}
