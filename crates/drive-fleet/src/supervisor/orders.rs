//! Orders: checked, sent once within their lifetime, and followed until the drive's own words show what became of them.

use std::collections::VecDeque;

use drive_core::{Error, Setpoint, StopMode};
use tokio::time::Instant;

use super::{Asker, CallId, Expiry, Job, Leave, Lifetime, Supervisor, Turn, permission::Blocked, ran::Look};
use crate::{
    cause::{Cause, Policy},
    outcome::{Order, Outcome, Refused, Unconfirmed},
};

/// An order that waits.
#[derive(Debug)]
pub(super) struct Queued {
    pub(super) asker: Asker,
    pub(super) order: Order,
    /// The leave for the start that it prepares, or is, of a group.
    before: Option<Leave>,
    /// When it may not be sent any more.
    pub(super) expires: Expiry,
    /// The motor ran by this side when it was given.
    ran: bool,
}

/// The order that is being carried out.
#[derive(Debug)]
pub(super) struct Active {
    pub(super) asker: Asker,
    pub(super) order: Order,
    /// The leave for the start that it prepares, or is, of a group.
    pub(super) before: Option<Leave>,
    /// When its lifetime is over.
    expiry: Expiry,
    /// The setpoint of a start, once it has been given.
    pub(super) setpoint_given: Option<Setpoint>,
    /// The watchdog was written on its behalf.
    pub(super) armed: bool,
    /// Why it could not be sent yet.
    blocked: Option<Refused>,
    /// How a motor that ran when it was given was looked at since; `None`: it stood.
    pub(super) ran: Option<Look>,
    /// Whether it has the turn at which the drives of its line start.
    turn: Turn,
    /// It has waited for that, and not for a line on which nothing goes on.
    stood_in_row: bool,
    pub(super) phase: Phase,
}

#[derive(Debug)]
pub(super) enum Phase {
    /// Nothing was sent yet, or not all.
    Prepare,
    /// A job of it is in flight.
    Sending(Job),
    /// An answer of this job was lost or denied it: the drive is asked.
    Verifying { job: Job, error: Error, until: Instant, again: Instant, seen: bool },
    /// In force; on its way to the reference.
    Awaiting { since: Instant, until: Instant },
}

impl Active {
    pub(super) fn wake_at(&self) -> Option<Instant> {
        match self.phase {
            Phase::Prepare => Some(self.expires()),
            Phase::Sending(_) => None,
            Phase::Verifying { job: Job::SetSetpoint(..), until, again, .. } => Some(until.min(again)),
            Phase::Verifying { until, .. } | Phase::Awaiting { until, .. } => Some(until),
        }
    }

    /// When nothing more of it is sent.
    const fn expires(&self) -> Instant {
        self.expiry.of(self.has_begun())
    }

    /// Whether something of it was sent, or would have been were it not for others of its line.
    const fn has_begun(&self) -> bool {
        self.setpoint_given.is_some() || self.stood_in_row
    }

    /// Its setpoint is in the drive.
    pub(super) fn set_given(&mut self, setpoint: Setpoint) {
        self.setpoint_given = Some(setpoint);
        self.ran = self.ran.map(|_| Look::Wanted);
    }

    /// Its drive has told its status.
    pub(super) fn is_seen(&mut self) {
        self.ran = self.ran.map(Look::taken);
    }

    pub(super) const fn is_start(&self) -> bool {
        matches!(self.order, Order::Start { .. })
    }

    pub(super) const fn start_turn(&self) -> Turn {
        self.turn
    }

    /// Whether nobody has said yet if it is its turn.
    pub(super) fn asks_for_turn(&self) -> bool {
        self.turn == Turn::Wanted && !self.stood_in_row
    }

    pub(super) const fn grant_turn(&mut self) {
        self.turn = Turn::Granted;
    }

    pub(super) const fn stand_in_row(&mut self) {
        self.stood_in_row = true;
    }

    pub(super) fn cause(&self) -> Cause {
        self.asker.cause()
    }

    /// Whether its setpoint is on the wire, or was, and nothing is known of it yet.
    const fn is_at_setpoint(&self) -> bool {
        let (Phase::Sending(job) | Phase::Verifying { job, .. }) = &self.phase else { return false };
        matches!(job, Job::SetSetpoint(..))
    }

    /// How it ends when something comes in between.
    pub(super) fn ended_by(&self, unsent: Refused, sent: Unconfirmed) -> Outcome {
        match &self.phase {
            Phase::Prepare if self.setpoint_given.is_none() => Outcome::Refused(unsent),
            _ => Outcome::NotConfirmed(sent),
        }
    }
}

impl Supervisor {
    /// Somebody commands the drive, on a leave that was given before or on none, until it expires or for the lifetime of
    /// the settings. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn handle_order(
        &mut self,
        now: Instant,
        asker: Asker,
        order: Order,
        leave: Option<Leave>,
        expires: Option<Expiry>,
    ) -> bool {
        self.changed = true;
        if let Some(refused) = self.refuse_at_once(&asker, &order, leave) {
            self.conclude_order(asker, &order, Outcome::Refused(refused));
            return false;
        }
        let drops = matches!(order, Order::Setpoint { .. }) && self.supersede_setpoints();
        // What a group gives its members counts as asked when the group was.
        let asked_at = Some(leave.map_or(now, |leave| leave.since));
        if order.setpoint().is_some() {
            self.setpoint_asked_at = asked_at;
        }
        if matches!(order, Order::Start { .. }) {
            self.start_asked_at = asked_at;
        }
        self.enqueue(now, asker, order, leave, expires);
        self.poll_gives_way() || drops
    }

    /// Whether the job in flight gives way to an order. A poll does once; the next waits for its status, or a stream of orders would blind
    /// the fleet.
    pub(super) fn poll_gives_way(&mut self) -> bool {
        let gives_way = self.in_flight.is_some_and(Job::is_poll) && !self.yielded;
        self.yielded |= gives_way;
        gives_way
    }

    /// An order that is not even taken on.
    pub(crate) fn refuse(&mut self, asker: Asker, order: Order, refused: Refused) {
        self.conclude_order(asker, &order, Outcome::Refused(refused));
    }

    /// Nobody has heard what became of an order, and nobody will. What is unsent of it never is; a start whose run command
    /// was sent, or may have been, is taken back. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn handle_withdrawal(&mut self, now: Instant, id: CallId) -> bool {
        let is_it = |asker: &Asker| asker.id() == Some(id);
        if let Some(at) = self.queue.iter().position(|queued| is_it(&queued.asker)) {
            if let Some(Queued { asker, order, .. }) = self.queue.remove(at) {
                self.refuse(asker, order, Refused::Withdrawn);
            }
            return false;
        }
        if self.active.as_ref().is_some_and(|active| is_it(&active.asker)) {
            return self.break_off(now);
        }
        let ours = self.lease.is_some() || self.is_starting();
        ours && self.started_by == Some(id) && self.take_back(now)
    }

    /// A start that is being carried out for a motor at rest, and that the settings would refuse by now, is broken off. Gives whether the job
    /// in flight has to be dropped for it.
    pub(super) fn end_forbidden_start(&mut self, now: Instant) -> bool {
        let is_sent = |active: &&Active| active.is_start() && matches!(active.phase, Phase::Sending(_));
        let Some(active) = self.active.as_ref().filter(|_| self.stands()).filter(is_sent) else {
            return false;
        };
        let setpoint = active.order.setpoint().or(self.given.map(|given| given.setpoint));
        let by_limit = || setpoint.and_then(|setpoint| self.allow_setpoint(now, setpoint).err());
        let refused = self.refused_since(active).or_else(by_limit);
        crate::mutant!("forbidden-start-goes-on", refused.is_some(), false) && self.break_off(now)
    }

    /// Nothing more of the order that is carried out is sent. Gives whether the job in flight has to be dropped for it.
    fn break_off(&mut self, now: Instant) -> bool {
        let Some(active) = &self.active else { return false };
        let id = active.asker.id();
        // A motor that runs already goes to the setpoint of a start, before that is sent or without it.
        let moves = active.is_start()
            && self.lease.is_some()
            && (active.setpoint_given.is_some() || active.is_at_setpoint());
        match active.phase {
            Phase::Prepare => {
                self.end_active(Refused::Withdrawn, Unconfirmed::Withdrawn);
                moves && self.take_back(now)
            }
            Phase::Sending(Job::SetSetpoint(..)) => {
                // It may stand in the drive or not: a later start must not count on it.
                self.given = None;
                self.end_active(Refused::Withdrawn, Unconfirmed::Withdrawn);
                if moves {
                    self.take_back(now);
                }
                true
            }
            _ if id.is_some() && self.started_by == id => self.take_back(now),
            Phase::Verifying { job: Job::SetSetpoint(..), .. } => {
                self.end_active(Refused::Withdrawn, Unconfirmed::Withdrawn);
                moves && self.take_back(now)
            }
            // An edge is not left half done.
            Phase::Sending(_) | Phase::Verifying { .. } | Phase::Awaiting { .. } => false,
        }
    }

    fn take_back(&mut self, now: Instant) -> bool {
        self.stop_by_policy(now, Asker::Policy(Policy::StartWithdrawn), StopMode::Ramp);
        self.drops_for_stop()
    }

    /// Only the latest setpoint counts; what is not yet sent gives its place away, and what is being sent as well, or it would be repeated behind
    /// the latest where its answer was lost. Of two in a row the second is carried out: a stream of setpoints comes to the drive. Gives whether
    /// the job in flight has to be dropped.
    fn supersede_setpoints(&mut self) -> bool {
        let is_setpoint = |order: &Order| matches!(order, Order::Setpoint { .. });
        let (older, rest): (VecDeque<_>, VecDeque<_>) =
            std::mem::take(&mut self.queue).into_iter().partition(|queued| is_setpoint(&queued.order));
        self.queue = rest;
        for queued in older {
            self.conclude_order(queued.asker, &queued.order, Outcome::Refused(Refused::Superseded));
        }
        let may_be_dropped = !self.setpoint_dropped;
        let replaced = self.active.take_if(|active| {
            let is_sent = matches!(active.phase, Phase::Sending(Job::SetSetpoint(..)));
            let waits = matches!(active.phase, Phase::Prepare | Phase::Verifying { .. });
            is_setpoint(&active.order) && (waits || is_sent && may_be_dropped)
        });
        let Some(active) = replaced else { return false };
        let is_sent = matches!(active.phase, Phase::Sending(_));
        if is_sent {
            // It may stand in the drive or not, and does so if the latest is never sent.
            (self.given, self.setpoint_dropped) = (None, true);
            self.dropped_for_later = Some((active.asker, active.order));
            return true;
        }
        let outcome = active.ended_by(Refused::Superseded, Unconfirmed::Superseded);
        self.conclude_order(active.asker, &active.order, outcome);
        false
    }

    /// What became of a setpoint that has given its place while it was being sent: something later was written, or never will be.
    pub(super) fn conclude_dropped(&mut self, outcome: Outcome) {
        if let Some((asker, order)) = self.dropped_for_later.take() {
            self.conclude_order(asker, &order, outcome);
        }
    }

    pub(super) fn enqueue(
        &mut self,
        now: Instant,
        asker: Asker,
        order: Order,
        before: Option<Leave>,
        expires: Option<Expiry>,
    ) {
        let expires = expires.unwrap_or(Expiry::since(now, self.settings.times.lifetime));
        let ran = self.runs_by_this_side();
        self.queue.push_back(Queued { asker, order, before, expires, ran });
    }

    pub(super) fn enqueue_reset(&mut self, now: Instant) {
        self.enqueue(now, Asker::Policy(Policy::OnFault), Order::ResetFaults, None, None);
    }

    /// Whether a start is on its way to the drive, or its outcome is looked for.
    pub(super) fn is_being_started(&self) -> bool {
        self.active.as_ref().is_some_and(|active| {
            matches!(
                active.phase,
                Phase::Sending(Job::Start(_)) | Phase::Verifying { job: Job::Start(_), .. }
            )
        })
    }

    /// Whether a start is being carried out.
    pub(super) fn is_starting(&self) -> bool {
        self.active
            .as_ref()
            .is_some_and(|active| active.is_start() && !matches!(active.phase, Phase::Prepare))
    }

    /// The setpoint with which the start is given that is carried out: its own, or the one that its group has just given.
    pub(crate) fn starts_at(&self) -> Option<Setpoint> {
        let active = self.active.as_ref().filter(|active| active.is_start())?;
        active.setpoint_given.or(self.given.map(|given| given.setpoint))
    }

    /// Who waits for the order of which something is sent now, or may be.
    pub(crate) fn asker_of_sent(&self) -> Option<CallId> {
        let sends = |active: &&Active| matches!(active.phase, Phase::Sending(_));
        self.active.as_ref().filter(sends).and_then(|active| active.asker.id())
    }

    /// How long the calls of the order in flight may wait.
    pub(super) fn order_lifetime(&self, now: Instant) -> Lifetime {
        let left = |active: &Active| active.expiry.left(now, active.is_start(), active.has_begun());
        self.active.as_ref().map_or(Expiry::at(now).left(now, false, false), left)
    }

    /// The job that the orders want next, and how long it may take.
    pub(super) fn order_job(&mut self, now: Instant) -> Option<(Job, Option<Instant>)> {
        loop {
            let next_waits = !self.queue.is_empty();
            if let Some(active) =
                self.active.take_if(|active| next_waits && matches!(active.phase, Phase::Awaiting { .. }))
            {
                let outcome = Outcome::NotConfirmed(Unconfirmed::Superseded);
                self.conclude_order(active.asker, &active.order, outcome);
            }
            if self.active.is_none() {
                if self.queue.is_empty() && self.dropped_for_later.is_some() {
                    let unknown = self.unknown(now, self.last_error.clone());
                    self.conclude_dropped(unknown);
                }
                let Queued { asker, order, before, expires, ran } = self.queue.pop_front()?;
                self.active = Some(Active {
                    asker,
                    order,
                    before,
                    expiry: expires,
                    setpoint_given: None,
                    armed: false,
                    blocked: None,
                    ran: ran.then_some(Look::Wanted),
                    turn: Turn::Unwanted,
                    stood_in_row: false,
                    phase: Phase::Prepare,
                });
            }
            let active = self.active.as_ref()?;
            match &active.phase {
                Phase::Prepare => {}
                Phase::Verifying { job: Job::SetSetpoint(..), until, again, .. } if *again <= now => {
                    return Some((Job::Measurements, Some(*until)));
                }
                Phase::Sending(_) | Phase::Verifying { .. } | Phase::Awaiting { .. } => return None,
            }
            let (order, expires) = (active.order, active.expires());
            if let Some(refused) = self.refused_since(active) {
                self.end_unsent(now, Outcome::Refused(refused));
                continue;
            }
            if expires <= now {
                let waited = active.blocked.is_some();
                // What it has waited for may have come just now, and then something else is in the way, or nothing.
                let blocked = self.allow(now, order, self.active.as_ref()).err().filter(|_| waited);
                self.end_unsent(now, blocked.map_or(Outcome::Expired, |by| Outcome::Refused(by.reason())));
                continue;
            }
            match self.allow(now, order, self.active.as_ref()) {
                Ok(Some(Job::Start(direction)))
                    if self.active.as_ref().is_some_and(|active| active.ran.is_some()) =>
                {
                    if let Some(look) = self.start_of_a_running_motor(now, order, direction) {
                        return Some((look, Some(expires)));
                    }
                }
                Ok(Some(_)) if self.waits_for_turn() => return None,
                Ok(Some(job)) => {
                    if matches!(job, Job::Start(_)) {
                        self.is_started_by_active();
                    }
                    self.set_phase(Phase::Sending(job));
                    return Some((job, None));
                }
                Ok(None) => {
                    if matches!(order, Order::AcceptIdentity(_)) {
                        self.checks.accept_identity();
                    }
                    self.end_order(Outcome::Confirmed);
                }
                Err(Blocked::For(refused)) => self.end_unsent(now, Outcome::Refused(refused)),
                Err(Blocked::Until(job, refused)) => {
                    self.leave_row();
                    self.block(refused, matches!(job, Job::ArmWatchdog(..)));
                    return Some((job, Some(expires)));
                }
                Err(Blocked::Meanwhile(refused)) => {
                    self.leave_row();
                    let stale = refused == Refused::Stale;
                    let first = self.block(refused, false);
                    if stale && first {
                        self.pace.hurry(now);
                    }
                    return None;
                }
            }
        }
    }

    pub(super) fn is_started_by_active(&mut self) {
        self.started_by = self.active.as_ref().and_then(|active| active.asker.id());
        // What is started anew is not to be withdrawn any more.
        self.withdrawal = None;
    }

    /// Whether the order is a start whose turn among those of its line has not come; it wants it from now on.
    fn waits_for_turn(&mut self) -> bool {
        let Some(active) = self.active.as_mut().filter(|active| active.is_start()) else { return false };
        if active.turn == Turn::Unwanted {
            active.turn = Turn::Wanted;
        }
        active.turn == Turn::Wanted
    }

    /// Nobody else of its line waits for what it has to wait for.
    fn leave_row(&mut self) {
        if let Some(active) = &mut self.active {
            active.turn = Turn::Unwanted;
        }
    }

    fn conclude_order(&mut self, asker: Asker, order: &Order, outcome: Outcome) {
        self.conclude(asker, order.command(), order.start_setpoint(), outcome);
    }

    pub(super) fn set_phase(&mut self, phase: Phase) {
        if let Some(active) = &mut self.active {
            // While something of a start is sent nobody else of its line begins one, and not while its drive is asked what became of it.
            if let Phase::Verifying { .. } | Phase::Awaiting { .. } = phase {
                active.turn = Turn::Unwanted;
            }
            active.phase = phase;
        }
    }

    /// The order has to wait for this reason; whether it is the first. `armed`: the watchdog is written on its behalf.
    fn block(&mut self, refused: Refused, armed: bool) -> bool {
        let Some(active) = &mut self.active else { return false };
        active.armed |= armed;
        active.blocked.replace(refused).is_none()
    }

    pub(super) fn end_order(&mut self, outcome: Outcome) {
        if let Some(active) = self.active.take() {
            self.conclude_order(active.asker, &active.order, outcome);
        }
    }

    pub(super) fn end_orders_by_stop(&mut self) {
        self.end_active(Refused::Stopped, Unconfirmed::Stopped);
        self.end_queue(&Refused::Stopped);
    }

    /// The drive was lost. What was sent and is still uncertain keeps its time to be read back: a drive may be deaf for a
    /// while because of it.
    pub(super) fn end_orders_by_loss(&mut self) {
        let uncertain = self
            .active
            .as_ref()
            .is_some_and(|active| matches!(active.phase, Phase::Sending(_) | Phase::Verifying { .. }));
        if !uncertain {
            self.end_active(Refused::NotConnected, Unconfirmed::Lost);
        }
        self.end_queue(&Refused::NotConnected);
    }

    /// The drive has tripped: a motion order that was sent is over.
    pub(super) fn end_order_by_trip(&mut self) {
        let ends = self.active.as_ref().is_some_and(|active| {
            active.order.is_motion()
                && matches!(active.phase, Phase::Verifying { .. } | Phase::Awaiting { .. })
        });
        if ends {
            self.end_order(Outcome::NotConfirmed(Unconfirmed::Tripped));
        }
    }

    pub(super) fn refuse_queue(&mut self) {
        let gone = self.gone();
        self.end_queue(&gone);
        self.end_questions(&gone);
    }

    fn end_active(&mut self, unsent: Refused, sent: Unconfirmed) {
        if let Some(active) = &self.active {
            let outcome = active.ended_by(unsent, sent);
            self.end_order(outcome);
        }
    }

    fn end_queue(&mut self, refused: &Refused) {
        for queued in std::mem::take(&mut self.queue) {
            self.conclude_order(queued.asker, &queued.order, Outcome::Refused(refused.clone()));
        }
    }
}
