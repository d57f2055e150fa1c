//! Whether an order may be sent: the rules of motion (4, 7, 11) and the policies of the settings. To ask changes nothing.

use drive_core::{Control, Direction, Motion, Refusal, Setpoint, Status};
use tokio::time::Instant;

use super::{Asker, Job, Supervisor, orders::Active};
use crate::{
    limits::{Given, LimitProblem},
    outcome::{Order, Refused, Until},
    snapshot::{Link, Timed, WatchdogCheck},
};

/// How many orders of one drive may wait.
pub(super) const QUEUE: usize = 16;

/// Why an order cannot be sent now, and what may change that.
pub(super) enum Blocked {
    /// Nothing.
    For(Refused),
    /// This job.
    Until(Job, Refused),
    /// Something that is on its way.
    Meanwhile(Refused),
}

impl Blocked {
    pub(super) fn reason(self) -> Refused {
        let (Self::For(reason) | Self::Until(_, reason) | Self::Meanwhile(reason)) = self;
        reason
    }
}

impl From<Refused> for Blocked {
    fn from(refused: Refused) -> Self {
        Self::For(refused)
    }
}

impl From<Refusal> for Blocked {
    fn from(reason: Refusal) -> Self {
        Self::For(Refused::Because(reason))
    }
}

/// That a drive would start. It is gone once a stop has been asked of the drive, also when that stop is long confirmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leave {
    stops: u64,
    /// When it was given.
    pub(super) since: Instant,
    /// The direction of that start.
    pub(super) direction: Direction,
    /// It brings a setpoint of its own along.
    brings_setpoint: bool,
}

impl Supervisor {
    /// The leave to start, or why a start would not be sent now.
    pub(crate) fn leave(
        &self,
        now: Instant,
        name: &str,
        direction: Direction,
        setpoint: Option<Setpoint>,
    ) -> Result<Leave, Refused> {
        let order = Order::Start { direction, setpoint, until: Until::InForce };
        match self.refuse_commander(Some(name), &order) {
            Some(refused) => Err(refused),
            None => {
                let brings_setpoint = setpoint.is_some();
                let leave = Leave { stops: self.stops, since: now, direction, brings_setpoint };
                self.allow(now, order, None).map_err(Blocked::reason)?;
                self.driven_by_another().map_or(Ok(leave), |refusal| Err(Refused::Because(refusal)))
            }
        }
    }

    /// Who turns the motor instead of the bus, by the last status: no family takes it over from him. A motor that nobody turns is for
    /// the family to judge.
    fn driven_by_another(&self) -> Option<Refusal> {
        let status = &self.status.as_ref()?.value;
        let other = status.control.filter(|control| *control != Control::Bus)?;
        (status.motion == Motion::Driven).then_some(Refusal::NotInControl(other))
    }

    /// Why a start would not be sent now, whoever asks for it.
    pub(super) fn start_refused(&self, now: Instant) -> Option<Refused> {
        let order = Order::Start { direction: Direction::Forward, setpoint: None, until: Until::InForce };
        let refused = self
            .refuse_commander(None, &order)
            .or_else(|| self.allow(now, order, None).map_err(Blocked::reason).err());
        // Whether a setpoint is allowed is not a matter of the drive.
        refused.filter(|refused| !matches!(refused, Refused::Limit(_)))
    }

    /// Why nobody of this name may give this order now.
    fn refuse_commander(&self, name: Option<&str>, order: &Order) -> Option<Refused> {
        let accepts = matches!(order, Order::AcceptIdentity(_));
        let pending = crate::mutant!("start-amid-a-stop", self.stopping.is_some(), false) && !accepts;
        self.may_not_command(name, order).or_else(|| pending.then_some(Refused::StopPending))
    }

    /// Why nobody of this name may command the drive so, stop or none.
    fn may_not_command(&self, name: Option<&str>, order: &Order) -> Option<Refused> {
        // Nothing is sent by it, and whoever only reads a drive is told as well that it is another.
        let accepts = matches!(order, Order::AcceptIdentity(_));
        if crate::mutant!("read-only-moved", !self.settings.control && !accepts, false) {
            return Some(Refused::ReadOnly);
        }
        if self.is_exiting() {
            return Some(self.gone());
        }
        let stranger = name.filter(|name| !self.settings.commanders.allow(name));
        stranger.map(|name| Refused::Commander(name.to_owned()))
    }

    /// Why an order that was taken on is not sent any more, whatever it has waited for: its drive ends, is only read by now, or may not be
    /// commanded any more by whoever has given it.
    pub(super) fn refused_since(&self, active: &Active) -> Option<Refused> {
        if active.asker.is_exit() {
            return None;
        }
        let refused = self.may_not_command(active.asker.commander(), &active.order);
        crate::mutant!("order-judged-once", refused, None)
    }

    pub(super) fn refuse_at_once(
        &self,
        asker: &Asker,
        order: &Order,
        leave: Option<Leave>,
    ) -> Option<Refused> {
        if let Some(refused) = self.refuse_commander(asker.commander(), order) {
            return Some(refused);
        }
        let is_over =
            |leave: Leave| crate::mutant!("leave-outlives-a-stop", leave.stops != self.stops, false);
        if leave.is_some_and(is_over) {
            return Some(Refused::Stopped);
        }
        // Who has been asked for another setpoint since does not come back to this one, and is not started at that one; who has been started
        // since is not turned round.
        let is_older = |leave: Leave| {
            let since = |at: Option<Instant>| at.is_some_and(|at| leave.since < at);
            since(self.start_asked_at) || leave.brings_setpoint && since(self.setpoint_asked_at)
        };
        if crate::mutant!("group-overrules-a-later-start", leave.is_some_and(is_older), false) {
            return Some(Refused::Superseded);
        }
        (self.queue.len() >= QUEUE).then_some(Refused::QueueFull)
    }

    /// The next job of an order; `None` when it is done, or needs none. `active`: what was done for it before.
    pub(super) fn allow(
        &self,
        now: Instant,
        order: Order,
        active: Option<&Active>,
    ) -> Result<Option<Job>, Blocked> {
        self.allow_writing(now, order)?;
        let status = self.status.as_ref().map(|status| &*status.value).ok_or(Refused::NotConnected)?;
        Ok(match order {
            Order::AcceptIdentity(shown) => match self.checks.refuses_to_accept(shown) {
                Some(refused) => return Err(refused.into()),
                None => None,
            },
            // Its driver looks whether there is a fault: the last status may be older than a trip.
            Order::ResetFaults => Some(Job::ResetFaults),
            Order::Release => Some(Job::Release),
            Order::Persist => Some(Job::Persist),
            Order::Setpoint { setpoint, until } => {
                if status.is_undriven() {
                    // A motor that stands never comes to it.
                    if until == Until::AtReference {
                        return Err(Refusal::State(status.state).into());
                    }
                } else {
                    self.allow_motion(now, status, active)?;
                }
                self.allow_setpoint(now, setpoint)?;
                let start = active.and_then(|active| active.before).map(|leave| leave.direction);
                Some(Job::SetSetpoint(setpoint, start.filter(|_| !self.was_just_at_rest(now))))
            }
            Order::Start { direction, setpoint, .. } => {
                self.allow_motion(now, status, active)?;
                // What the drive holds may be another master's by now, or counted otherwise, and the limits others than when it was given:
                // what is shown as its setpoint is given anew.
                let leave = active.and_then(|active| active.before);
                // A group has just done so.
                let is_new = |given: &Given| leave.is_some_and(|leave| given.at >= leave.since);
                let setpoint =
                    setpoint.or(self.given.filter(|given| !is_new(given)).map(|given| given.setpoint));
                if setpoint.is_none() && self.given.is_none() && !self.settings.limits.is_empty() {
                    return Err(Refused::Limit(LimitProblem::UnknownSetpoint).into());
                }
                match setpoint {
                    Some(setpoint) if active.is_none_or(|active| active.setpoint_given.is_none()) => {
                        self.allow_setpoint(now, setpoint)?;
                        Some(Job::SetSetpoint(setpoint, (!self.was_just_at_rest(now)).then_some(direction)))
                    }
                    _ => {
                        // It was given within the limits of then.
                        if let Some(given) = self.given {
                            self.allow_setpoint(now, given.setpoint)?;
                        }
                        Some(Job::Start(direction))
                    }
                }
            }
        })
    }

    /// Whether a status that is no older than a command may be has shown a sound motor that nothing drives and nobody else commands. The setpoint of a start
    /// changes no speed of such a one, and the drive is not asked first whether it will refuse the start: thirty that start at once
    /// on one line have no time for a question more.
    fn was_just_at_rest(&self, now: Instant) -> bool {
        self.status.as_ref().is_some_and(|status| {
            let is_new = status.age(now) <= self.settings.times.lifetime;
            let elsewhere = status.value.control.is_some_and(|control| control != Control::Bus);
            is_new && status.value.is_undriven() && !status.value.is_fault() && !elsewhere
        })
    }

    /// What holds for everything that is written: the drive is there, its status is fresh, and it is the one that is
    /// meant (rules 4 and 7).
    fn allow_writing(&self, now: Instant, order: Order) -> Result<(), Blocked> {
        if crate::mutant!("lost-drive-moved", self.link != Link::Connected, false) {
            return Err(Refused::NotConnected.into());
        }
        let max_age = self.settings.periods.max_age;
        if self.retraction.is_open
            || crate::mutant!("another-behind-a-lost-line-moved", self.unseen, false)
            || self
                .status
                .as_ref()
                .is_none_or(|status| crate::mutant!("stale-status-moves", status.age(now) > max_age, false))
        {
            return Err(Blocked::Meanwhile(Refused::Stale));
        }
        match crate::mutant!("stranger-moved", self.checks.stranger(), None) {
            None => Ok(()),
            Some(Refused::IdentityChanged) if matches!(order, Order::AcceptIdentity(_)) => Ok(()),
            Some(unchecked @ Refused::IdentityUnchecked) => Err(match self.checks.identity_job(now) {
                Some(job) => Blocked::Until(job, unchecked),
                None => Blocked::Meanwhile(unchecked),
            }),
            Some(stranger) => Err(stranger.into()),
        }
    }

    /// What holds for motion besides: a state that the manual explains, no fault, the watchdog armed. Who has control is
    /// for the family to judge, which reads it anew before a start: on some drives a command of the bus takes it.
    fn allow_motion(&self, now: Instant, status: &Status, active: Option<&Active>) -> Result<(), Blocked> {
        if let Some(reason) = crate::mutant!("fault-moved", status.bars_motion(), None) {
            return Err(reason.into());
        }
        let unverified = Refused::WatchdogUnverified;
        match self.checks.watchdog() {
            check if crate::mutant!("unwatched-moved", check.allows_motion(), true) => {
                // Whoever only asks whether it would start is told by what was read last.
                let looks = active.is_some() && status.is_undriven();
                let again = self.checks.watchdog_again(now).filter(|_| looks);
                again.map_or(Ok(()), |job| Err(Blocked::Until(job, unverified)))
            }
            // It is written for an order once.
            WatchdogCheck::WaitsForStandstill(_) if active.is_none_or(|active| !active.armed) => Err(self
                .checks
                .arm()
                .map_or(Blocked::For(unverified.clone()), |job| Blocked::Until(job, unverified))),
            WatchdogCheck::WaitsForStandstill(_) | WatchdogCheck::Broken(_) => Err(unverified.into()),
            _ => Err(match self.checks.watchdog_job(now) {
                Some(job) => Blocked::Until(job, unverified),
                None => Blocked::Meanwhile(unverified),
            }),
        }
    }

    pub(super) fn allow_setpoint(&self, now: Instant, setpoint: Setpoint) -> Result<(), Refused> {
        let moving = self.status.as_ref().filter(|status| !status.value.is_undriven());
        let last = moving.and_then(|status| {
            self.given.or_else(|| crate::mutant!("unknown-setpoint-unlimited", shown(status), None))
        });
        let allowed = self.settings.limits.allow(now, setpoint, last);
        crate::mutant!("limit-passed", allowed, Ok(())).map_err(Refused::Limit)
    }
}

/// Where nobody knows what was given, as behind an order that was dropped or a line that was lost: what the motor turns at.
fn shown(status: &Timed<Status>) -> Option<Given> {
    let frequency = status.value.output_frequency.or(status.value.reference)?;
    Some(Given { setpoint: frequency.into(), at: status.at })
}
