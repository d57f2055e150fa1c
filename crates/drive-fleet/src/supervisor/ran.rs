//! A start that was given to a motor which runs by this side: between the two it may have been stopped by somebody else.

use drive_core::{Direction, Status, Verdict};
use tokio::time::Instant;

use super::{Job, Supervisor, shown::follows_another};
use crate::{
    outcome::{Order, Outcome, Refused},
    snapshot::Timed,
};

/// Whether a status was taken since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    Wanted,
    Taken,
    /// What the ordinary one does not tell, as the command word of some drives, is read again.
    WantedAnew,
    TakenAnew,
}

/// What became of a motor that ran when its start was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RunsOn {
    /// It runs as it is to.
    ThisWay,
    /// It runs, and is to be told how.
    OtherWay,
    /// Somebody has stopped it.
    Ended,
}

impl Look {
    /// A status has come.
    pub(super) const fn taken(self) -> Self {
        match self {
            Self::Wanted | Self::Taken => Self::Taken,
            Self::WantedAnew | Self::TakenAnew => Self::TakenAnew,
        }
    }
}

impl Supervisor {
    /// What the start does for a motor that ran when it was given: the look that it needs first, or nothing any more. One that is to be
    /// turned round goes on as every other.
    pub(super) fn start_of_a_running_motor(
        &mut self,
        now: Instant,
        order: Order,
        direction: Direction,
    ) -> Option<Job> {
        match self.runs_on(direction) {
            None => {
                let anew = self.active.as_ref().is_some_and(|active| active.ran == Some(Look::WantedAnew));
                return Some(Job::Status { anew });
            }
            Some(RunsOn::Ended) => self.end_unsent(now, Outcome::Refused(Refused::Stopped)),
            Some(RunsOn::OtherWay) => {
                if let Some(active) = &mut self.active {
                    active.ran = None;
                }
            }
            Some(RunsOn::ThisWay) => {
                self.is_started_by_active();
                let status = self.status.as_ref().map(|status| status.value.clone());
                self.is_in_force(now, order, order.done(status.as_deref()));
            }
        }
        None
    }

    /// Whether the motor is driven by the run command of this side, as far as the last status tells.
    pub(super) fn runs_by_this_side(&self) -> bool {
        let runs = |status: &Timed<Status>| {
            let is_in_force = matches!(status.value.verdict, Some(Verdict::InForce | Verdict::NotKnown));
            is_in_force && !status.value.is_undriven()
        };
        self.lease.is_some() && self.status.as_ref().is_some_and(runs)
    }

    /// What a motor does that ran when its start was given, by a status since; `None`: there is none yet that tells. One that somebody has
    /// stopped meanwhile is not started against that will, and to one that runs this way nothing is to be written.
    fn runs_on(&mut self, direction: Direction) -> Option<RunsOn> {
        let (starts_at, lease) = (self.starts_at(), self.lease);
        let look = self.active.as_mut()?.ran.as_mut()?;
        let status = &self.status.as_ref()?.value;
        match (*look, status.verdict) {
            (Look::Wanted | Look::WantedAnew, _) => return None,
            (Look::Taken, Some(Verdict::NotKnown)) if !status.is_undriven() => {
                *look = Look::WantedAnew;
                return None;
            }
            _ => {}
        }
        Some(match (status.verdict, lease) {
            (Some(Verdict::InForce), Some(lease)) if lease.direction == direction => {
                match follows_another(starts_at, status) {
                    None => RunsOn::ThisWay,
                    // Its driver sees why.
                    Some(_) => RunsOn::OtherWay,
                }
            }
            (None | Some(Verdict::NotInForce { .. }), _) => RunsOn::Ended,
            (Some(Verdict::NotKnown), _) if status.is_undriven() => RunsOn::Ended,
            _ => RunsOn::OtherWay,
        })
    }
}
