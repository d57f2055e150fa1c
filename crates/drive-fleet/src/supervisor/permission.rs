//! Whether an order may be sent: the rules of motion (4, 7, 11) and the policies of the settings.

use drive_core::{Direction, Setpoint, State, Status};
use tokio::time::Instant;

use super::{Asker, Job, Supervisor};
use crate::{
    limits::LimitProblem,
    outcome::{Order, Refused, Until},
    snapshot::{IdentityCheck, Link, WatchdogCheck},
};

/// How many orders of one drive may wait.
pub(super) const QUEUE: usize = 16;

/// Why an order cannot be sent now.
pub(super) enum Blocked {
    /// Never.
    Refused(Refused),
    /// Not before this job.
    Needs(Job, Refused),
    /// Not before something that is on its way.
    Waits(Refused),
}

impl From<Refused> for Blocked {
    fn from(refused: Refused) -> Self {
        Self::Refused(refused)
    }
}

/// That a drive would start. It is gone once a stop has been asked of the drive, also when that stop is long confirmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leave {
    stops: u64,
}

impl Supervisor {
    /// The leave to start, or why a start would not be sent now.
    pub(crate) fn leave(
        &mut self,
        now: Instant,
        name: &str,
        setpoint: Option<Setpoint>,
    ) -> Result<Leave, Refused> {
        self.unready(now, name, setpoint).map_or(Ok(Leave { stops: self.stops }), Err)
    }

    fn unready(&mut self, now: Instant, name: &str, setpoint: Option<Setpoint>) -> Option<Refused> {
        let order = Order::Start { direction: Direction::Forward, setpoint, until: Until::InForce };
        if !self.settings.control {
            return Some(Refused::ReadOnly);
        }
        if !self.settings.commanders.allow(name) {
            return Some(Refused::Commander(name.to_owned()));
        }
        if self.stopping.is_some() {
            return Some(Refused::StopPending);
        }
        // The question must not count as an attempt of the order under way.
        let active = self.active.take();
        let result = self.allow(now, order);
        self.active = active;
        match result {
            Ok(_) => None,
            Err(Blocked::Refused(refused) | Blocked::Needs(_, refused) | Blocked::Waits(refused)) => {
                Some(refused)
            }
        }
    }

    pub(super) fn refuse_at_once(
        &self,
        asker: &Asker,
        order: &Order,
        leave: Option<Leave>,
    ) -> Option<Refused> {
        if !self.settings.control {
            return Some(Refused::ReadOnly);
        }
        if self.is_exiting() {
            return Some(Refused::ShutDown);
        }
        if let Asker::Caller { name, .. } = asker
            && !self.settings.commanders.allow(name)
        {
            return Some(Refused::Commander(name.to_string()));
        }
        if self.stopping.is_some() && *order != Order::AcceptIdentity {
            return Some(Refused::StopPending);
        }
        if leave.is_some_and(|leave| leave.stops != self.stops) {
            return Some(Refused::Stopped);
        }
        (self.queue.len() >= QUEUE).then_some(Refused::QueueFull)
    }

    /// The next job of an order; `None` when it is done.
    pub(super) fn allow(&mut self, now: Instant, order: Order) -> Result<Option<Job>, Blocked> {
        self.allow_writing(now, order)?;
        let status = self.status.as_ref().map(|status| status.value.clone()).ok_or(Refused::NotConnected)?;
        let setpoint_given = self.active.as_ref().is_some_and(|active| active.setpoint_given);
        Ok(match order {
            Order::AcceptIdentity => {
                self.checks.accept_identity();
                None
            }
            Order::ResetFaults if !status.is_fault() => None,
            Order::ResetFaults => Some(Job::ResetFaults),
            Order::Release => Some(Job::Release),
            Order::Persist => Some(Job::Persist),
            Order::Setpoint { setpoint, until } => {
                if status.is_standstill() {
                    if until == Until::AtReference {
                        return Err(Refused::State(status.state).into());
                    }
                } else {
                    self.allow_motion(now, &status)?;
                }
                self.allow_setpoint(now, setpoint)?;
                Some(Job::SetSetpoint(setpoint))
            }
            Order::Start { direction, setpoint, .. } => {
                self.allow_motion(now, &status)?;
                match setpoint {
                    Some(setpoint) if !setpoint_given => {
                        self.allow_setpoint(now, setpoint)?;
                        Some(Job::SetSetpoint(setpoint))
                    }
                    None if !self.settings.limits.is_empty() && self.given.is_none() => {
                        return Err(Refused::Limit(LimitProblem::UnknownSetpoint).into());
                    }
                    _ => Some(Job::Start(direction)),
                }
            }
        })
    }

    /// What holds for everything that is written: the drive is there, its status is fresh, and it is the one that is
    /// meant (rules 4 and 7).
    fn allow_writing(&mut self, now: Instant, order: Order) -> Result<(), Blocked> {
        if self.link != Link::Connected {
            return Err(Refused::NotConnected.into());
        }
        let fresh = self
            .status
            .as_ref()
            .is_some_and(|status| now.saturating_duration_since(status.at) <= self.settings.periods.max_age);
        if !fresh {
            let hurried =
                self.active.as_mut().is_none_or(|active| std::mem::replace(&mut active.hurried, true));
            if !hurried {
                self.pace.hurry(now);
            }
            return Err(Blocked::Waits(Refused::Stale));
        }
        match self.identity_check() {
            IdentityCheck::Same(_) | IdentityCheck::CannotSay => Ok(()),
            IdentityCheck::Changed { .. } if order == Order::AcceptIdentity => Ok(()),
            IdentityCheck::Changed { .. } => Err(Refused::IdentityChanged.into()),
            IdentityCheck::Unchecked => Err(match self.checks.identity_job(now) {
                Some(job) => Blocked::Needs(job, Refused::IdentityUnchecked),
                None => Blocked::Waits(Refused::IdentityUnchecked),
            }),
        }
    }

    /// What holds for motion besides: a state that the manual explains, no fault, the watchdog armed. Who has control is
    /// for the family to judge, which reads it anew before a start: on some drives a command of the bus takes it.
    fn allow_motion(&mut self, now: Instant, status: &Status) -> Result<(), Blocked> {
        if status.is_fault() {
            return Err(Refused::Tripped(status.fault_code).into());
        }
        if matches!(status.state, State::Unknown | State::NotReady) {
            return Err(Refused::State(status.state).into());
        }
        if self.watchdog_allows_motion() {
            return Ok(());
        }
        let unverified = Refused::WatchdogUnverified;
        Err(match self.watchdog_check() {
            WatchdogCheck::WaitsForStandstill(_) => {
                let tried =
                    self.active.as_mut().is_none_or(|active| std::mem::replace(&mut active.armed, true));
                match self.checks.arm() {
                    Some(job) if !tried => Blocked::Needs(job, unverified),
                    _ => unverified.into(),
                }
            }
            WatchdogCheck::Broken(_) => unverified.into(),
            _ => match self.checks.watchdog_job(now) {
                Some(job) => Blocked::Needs(job, unverified),
                None => Blocked::Waits(unverified),
            },
        })
    }

    fn allow_setpoint(&self, now: Instant, setpoint: Setpoint) -> Result<(), Refused> {
        let moving = self.status.as_ref().is_some_and(|status| !status.value.is_standstill());
        let last = self.given.filter(|_| moving);
        self.settings.limits.allow(now, setpoint, last).map_err(Refused::Limit)
    }
}
