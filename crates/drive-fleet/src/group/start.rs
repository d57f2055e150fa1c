//! A group starts, all of it or none.

use std::{
    collections::HashSet,
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use drive_core::{Direction, Setpoint, StopMode};
use futures_util::future::join_all;
use tokio::time::{Instant, sleep, timeout};

use super::Group;
use crate::{
    group_ticket::{GroupTicket, StopReport, Told},
    handle::DriveHandle,
    outcome::{Order, Outcome, Refused, Unconfirmed, Unknown, Until},
    snapshot::{Snapshot, has_reached},
    supervisor::{Expiry, Leave},
};

/// How a group starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GroupStart {
    /// The direction.
    pub direction: Direction,
    /// The setpoint for each; `None`: what each was given last, or else what it holds.
    pub setpoint: Option<Setpoint>,
    /// From one start to the next at the least; zero: as close together as the lines allow, all setpoints first.
    pub spacing: Duration,
    /// When a start counts as done.
    pub until: Until,
}

impl GroupStart {
    /// What is told of it when nobody carries it out any more, by what became of what each member was given last.
    fn abandoned(&self, outcomes: Vec<(Arc<str>, Outcome)>) -> GroupFailure {
        let refused = outcomes.iter().map(|(name, outcome)| match outcome {
            Outcome::Refused(refused) => Some((Arc::clone(name), refused.clone())),
            _ => None,
        });
        if let Some(nobody) = refused.collect() {
            return GroupFailure::NotReady(nobody);
        }
        let of_start = |(name, outcome)| match (outcome, self.setpoint) {
            // It was that of the setpoint, which is given first.
            (Outcome::Confirmed, Some(setpoint)) => {
                (name, Outcome::not_started(setpoint, Some(Refused::ShutDown), None))
            }
            (outcome, _) => (name, outcome),
        };
        GroupFailure::Abandoned(outcomes.into_iter().map(of_start).collect())
    }
}

/// Why a group did not start, or did not stay started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GroupFailure {
    /// These were not ready. Nobody was started.
    NotReady(Vec<(Arc<str>, Refused)>),
    /// The runtime of the fleet has ended before it was known: what became of each. **Nobody stops again what may turn** by it.
    Abandoned(Vec<(Arc<str>, Outcome)>),
    /// All were ready, and these did not start, or did not take the setpoint; those that were started were stopped again.
    Failed {
        /// The outcomes that are not confirmed. Drives whose turn had not come are not among them: they were never
        /// commanded.
        outcomes: Vec<(Arc<str>, Outcome)>,
        /// What became of the stop; of nobody where nobody was started.
        stopped: StopReport,
    },
}

/// What became of the start of a group: of each drive how it started, or why the group did not.
pub type GroupStarted = Result<Vec<(Arc<str>, Outcome)>, GroupFailure>;

impl fmt::Display for GroupFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReady(reasons) => {
                f.write_str("nobody was started, not ready:")?;
                reasons.iter().try_for_each(|(name, refused)| write!(f, " {name} ({refused})"))
            }
            Self::Abandoned(outcomes) => {
                f.write_str("the fleet has ended meanwhile, nobody is stopped again:")?;
                outcomes.iter().try_for_each(|(name, outcome)| write!(f, " {name} ({outcome})"))
            }
            Self::Failed { outcomes, stopped } if *stopped == StopReport::default() => {
                f.write_str("nobody was started, because not all took the setpoint:")?;
                outcomes.iter().try_for_each(|(name, outcome)| write!(f, " {name} ({outcome})"))
            }
            Self::Failed { outcomes, stopped } => {
                f.write_str("stopped again, because not all started:")?;
                outcomes.iter().try_for_each(|(name, outcome)| write!(f, " {name} ({outcome})"))?;
                write!(f, "; stop: {stopped}")
            }
        }
    }
}

impl std::error::Error for GroupFailure {}

impl Group {
    /// Starts every drive of the group, or none: first all are asked whether they would start, then they start, as close
    /// together as their lines allow or one after the other. When one of them does not, no other is begun, and those
    /// that did are stopped again along their ramps. Who refused, or whose turn had not come, is left alone.
    ///
    /// On one line the starts wait for each other here and not on the line: one drive is commanded at a time, and after
    /// it the line is left to the polls for as long as they need it to keep every value fresh, by the line's plan. So a
    /// full line takes its time: 31 Altivar 312 at 19200 bit/s a minute or more where a quarter of the line is left for commands, and six where
    /// it is full. Stops wait for none of this. A drive that is stopped meanwhile, by whomever, is not started any more even if its turn comes
    /// when that stop is long confirmed; nor is one that is started by somebody else, or asked for another setpoint than the start brings along.
    ///
    /// Each drive's outcome says which setpoint its start uses. [`GroupFailure`] names who was not ready, or did not start. Dropping the ticket before its outcome was heard takes the
    /// whole start back: see [`GroupTicket`].
    pub fn start(&self, start: GroupStart) -> GroupTicket<GroupStarted> {
        let group = self.in_one_act();
        let abandoned = move |outcomes| Err(start.abandoned(outcomes));
        GroupTicket::spawn(&self.fleet.inner.runtime, self.names(), abandoned, async move |told| {
            group.started(start, &told).await
        })
    }

    async fn started(&self, start: GroupStart, told: &Told<GroupStarted>) -> GroupStarted {
        let GroupStart { direction, setpoint, spacing, until } = start;
        let asked = join_all(self.members.iter().map(|member| member.ask(direction, setpoint))).await;
        let (mut leaves, mut unready) = (Vec::new(), Vec::new());
        for (member, asked) in self.members.iter().zip(asked) {
            match asked {
                Ok(leave) => leaves.push((member, leave)),
                Err(refused) => unready.push((Arc::clone(member.name()), refused)),
            }
        }
        if !unready.is_empty() {
            return Err(GroupFailure::NotReady(unready));
        }
        let together = spacing.is_zero();
        // Before the first start, so that a setpoint that one of them refuses starts nobody.
        if let Some(setpoint) = setpoint.filter(|_| together) {
            let order = Order::Setpoint { setpoint, until: Until::InForce };
            let given = self.all_or_none(&leaves, order, spacing, told).await;
            let outcomes: Vec<_> =
                { given.into_iter() }.filter(|(_, outcome)| !outcome.lets_a_start_follow()).collect();
            if !outcomes.is_empty() {
                return Err(GroupFailure::Failed { outcomes, stopped: StopReport::default() });
            }
        }
        let setpoint = setpoint.filter(|_| !together);
        let order = Order::Start { direction, setpoint, until: Until::InForce };
        let started = self.keep_or_stop(self.all_or_none(&leaves, order, spacing, told).await).await?;
        if until == Until::AtReference {
            told.in_force(Ok(started.clone()));
            let reached = self.members.iter().map(|member| reach(member.clone(), start.setpoint));
            self.keep_or_stop(join_all(reached).await).await?;
        }
        Ok(started)
    }

    /// Commands drives that have given their leave, the first now and the others each `spacing` after the one before,
    /// until one does not confirm it. Gives the outcomes of those that were commanded.
    async fn all_or_none(
        &self,
        leaves: &[(&DriveHandle, Leave)],
        order: Order,
        spacing: Duration,
        told: &Told<GroupStarted>,
    ) -> Vec<(Arc<str>, Outcome)> {
        let failed = &AtomicBool::new(false);
        let commands = leaves.iter().zip(0_u32..).map(|(&(member, leave), number)| async move {
            sleep(spacing.saturating_mul(number)).await;
            let command = async || {
                if failed.load(Ordering::Relaxed) {
                    return None;
                }
                // Its leave ends with any stop: its own time is that of a dialog on a line that has room for nothing more.
                let expires = Expiry::since(Instant::now(), 2 * member.settings().times.lifetime);
                let ticket = member.order_on(Some(leave), Some(expires), order);
                told.give(member.name(), &ticket);
                let outcome = ticket.unheard(false).await;
                told.hold(ticket);
                failed.fetch_or(!outcome.lets_a_start_follow(), Ordering::Relaxed);
                Some((Arc::clone(member.name()), outcome))
            };
            self.on_line(member, command).await
        });
        join_all(commands).await.into_iter().flatten().collect()
    }

    async fn keep_or_stop(&self, outcomes: Vec<(Arc<str>, Outcome)>) -> GroupStarted {
        if outcomes.iter().all(|(_, outcome)| outcome.lets_a_start_follow()) {
            return Ok(outcomes);
        }
        // A drive whose start is uncertain is among those that are stopped; not one that this group has not begun, which may be in
        // somebody else's hands. What somebody else is stopping already, and perhaps by its freewheel, is not slowed down by this.
        let begun = outcomes.iter().filter(|(_, outcome)| outcome.may_have_started());
        let begun: HashSet<&str> = begun.map(|(name, _)| &**name).collect();
        let is_begun = |member: &&DriveHandle| begun.contains(&**member.name());
        let members = self.members.iter().filter(is_begun).cloned().collect();
        let begun = Self::new(self.fleet.clone(), members);
        let stopped = begun.stop_each(StopMode::Ramp.into(), false).finished().await;
        let outcomes =
            { outcomes.into_iter() }.filter(|(_, outcome)| !outcome.lets_a_start_follow()).collect();
        Err(GroupFailure::Failed { outcomes, stopped })
    }
}

/// Waits until a drive that was started shows that it has reached its reference: that of the start, or the one that it
/// was given before. What is remembered of the setpoint for later commands ends with a lost status, and this does not.
async fn reach(member: DriveHandle, setpoint: Option<Setpoint>) -> (Arc<str>, Outcome) {
    let after = member.entry.settings().times.reference;
    let setpoint = setpoint.or(member.snapshot().setpoint);
    let is_there = |snapshot: &Snapshot| {
        let status = snapshot.fresh_status(Instant::now());
        status.is_some_and(|status| has_reached(setpoint, status))
    };
    let there = member.wait_until(|snapshot| is_there(snapshot) || !snapshot.started_here());
    let outcome = match timeout(after, there).await {
        Ok(snapshot) if is_there(&snapshot) => Outcome::Confirmed,
        Ok(_) => Outcome::NotConfirmed(Unconfirmed::Stopped),
        Err(_) => {
            let (now, snapshot) = (Instant::now(), member.snapshot());
            let last = snapshot.status.as_ref().map(|status| status.seen(now));
            match snapshot.fresh_status(now) {
                Some(_) => {
                    Outcome::NotConfirmed(Unconfirmed::TimeOver { after, last, because: None, stop: None })
                }
                None => Outcome::OutcomeUnknown(Unknown {
                    error: snapshot.error.clone(),
                    last,
                    ..Unknown::default()
                }),
            }
        }
    };
    (Arc::clone(member.name()), outcome)
}
