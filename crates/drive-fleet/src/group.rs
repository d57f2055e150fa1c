//! [`Group`]: several drives commanded together.

use std::{borrow::Cow, collections::BTreeSet, fmt, sync::Arc, time::Duration};

use drive_core::{BroadcastWrite, Class, Direction, Setpoint, StopMode, Terms};
use futures_util::{
    StreamExt,
    future::{join, join_all},
    stream,
};
use tokio::time::{Instant, sleep, sleep_until, timeout};
use tokio_modbus::{Request, client::Client};

use crate::{
    fleet::{Fleet, LineEntry},
    handle::{DriveHandle, Entry},
    outcome::{Order, Outcome, Refused, Unconfirmed, Until},
    snapshot::Link,
};

/// Commands of a group that are on their way on one line at a time: enough to keep it busy.
const AT_ONCE: usize = 3;

/// Mute drives that a stop of a line is reckoned with at least.
const MUTE: u32 = 3;

/// A name that no drive of the fleet has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the fleet has no drive {0:?}")]
pub struct NoSuchDrive(pub String);

impl Fleet {
    /// All drives as one group.
    #[must_use]
    pub fn all(&self) -> Group {
        Group::new(self.clone(), self.drives())
    }

    /// Some drives as one group.
    ///
    /// # Errors
    /// [`NoSuchDrive`] for a name that no drive has.
    pub fn group<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<Group, NoSuchDrive> {
        let members =
            names.into_iter().map(|name| self.drive(name).ok_or_else(|| NoSuchDrive(name.to_owned())));
        Ok(Group::new(self.clone(), members.collect::<Result<_, _>>()?))
    }

    /// Stops every drive: see [`Group::stop`].
    pub async fn stop_all(&self, mode: StopMode) -> StopReport {
        self.all().stop(mode).await
    }
}

/// What became of a stop of several drives.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StopReport {
    /// Drives that show standstill.
    pub confirmed: Vec<Arc<str>>,
    /// Drives that do not, and why. Their stops go on being repeated.
    pub unconfirmed: Vec<(Arc<str>, Outcome)>,
    /// Drives that are only read: nothing was sent to them.
    pub read_only: Vec<Arc<str>>,
    /// Lines on which one broadcast went out first.
    pub broadcasts: Vec<Arc<str>>,
}

impl StopReport {
    /// Whether every drive that may be commanded shows standstill.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.unconfirmed.is_empty()
    }
}

impl fmt::Display for StopReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} confirmed", self.confirmed.len())?;
        for (name, outcome) in &self.unconfirmed {
            write!(f, "; {name}: {outcome}")?;
        }
        Ok(())
    }
}

/// How a group starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GroupStart {
    /// The direction.
    pub direction: Direction,
    /// The setpoint for each; `None`: what each holds.
    pub setpoint: Option<Setpoint>,
    /// From one start to the next; zero: as close together as the line allows, all setpoints first.
    pub spacing: Duration,
    /// When a start counts as done.
    pub until: Until,
}

/// Why a group did not start, or did not stay started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GroupFailure {
    /// These were not ready. Nobody was started.
    NotReady(Vec<(Arc<str>, Refused)>),
    /// All were ready, and these did not start; those that did were stopped again.
    Failed {
        /// The outcomes that are not confirmed.
        outcomes: Vec<(Arc<str>, Outcome)>,
        /// What became of the stop.
        stopped: StopReport,
    },
}

impl fmt::Display for GroupFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReady(reasons) => {
                f.write_str("nobody was started, not ready:")?;
                reasons.iter().try_for_each(|(name, refused)| write!(f, " {name} ({refused})"))
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

/// Several drives of a fleet, commanded together.
#[derive(Debug, Clone)]
pub struct Group {
    fleet: Fleet,
    members: Vec<DriveHandle>,
}

impl Group {
    pub(crate) const fn new(fleet: Fleet, members: Vec<DriveHandle>) -> Self {
        Self { fleet, members }
    }

    /// This group, commanded under a name.
    #[must_use]
    pub fn commanded_by(&self, commander: &str) -> Self {
        let members = self.members.iter().map(|member| member.commanded_by(commander)).collect();
        Self { fleet: self.fleet.clone(), members }
    }

    /// Its drives.
    #[must_use]
    pub fn members(&self) -> &[DriveHandle] {
        &self.members
    }

    /// Stops every drive of the group.
    ///
    /// On a line whose drives all belong to the group, may all be commanded and all take the same write for this mode,
    /// one broadcast goes out first. Nobody confirms it, so each drive is then stopped by itself, which also verifies it.
    /// The report comes when every drive stands or its time is over; a drive that does not answer is named after the time
    /// that its line's plan gives. Stops that are not confirmed go on being repeated.
    pub async fn stop(&self, mode: StopMode) -> StopReport {
        let mut report = StopReport::default();
        let (members, read_only): (Vec<DriveHandle>, Vec<DriveHandle>) =
            self.members.iter().cloned().partition(|member| member.entry.control);
        report.read_only = read_only.iter().map(|member| Arc::clone(member.name())).collect();
        let mut stops = Vec::new();
        for (number, line) in self.fleet.lines().iter().enumerate() {
            let members = members.iter().filter(|member| member.entry.line == number);
            stops.push(stop_line(line, self.common_write(number, mode), members.cloned().collect(), mode));
        }
        for (broadcast, outcomes) in join_all(stops).await {
            report.broadcasts.extend(broadcast);
            for (name, outcome) in outcomes {
                if outcome.is_confirmed() {
                    report.confirmed.push(name);
                } else {
                    report.unconfirmed.push((name, outcome));
                }
            }
        }
        report
    }

    /// The write that stops every drive of a line, if it means a stop to all of them and all are meant.
    fn common_write(&self, line: usize, mode: StopMode) -> Option<BroadcastWrite> {
        let group: BTreeSet<&Arc<str>> = self.members.iter().map(DriveHandle::name).collect();
        let mut on_line = self.fleet.entries().iter().filter(|entry| entry.line == line);
        let write = |entry: &Arc<Entry>| {
            let allowed = entry.control && group.contains(&entry.name);
            let write = entry.broadcasts.iter().find(|(stop, _)| *stop == mode).map(|(_, write)| *write);
            write.filter(|_| allowed)
        };
        let first = write(on_line.next()?)?;
        on_line.all(|entry| write(entry) == Some(first)).then_some(first)
    }

    /// Starts every drive of the group, or none: first all are asked whether they would start, then they start, as close
    /// together as the line allows or one after the other. When one of them does not, those that did are stopped again
    /// along their ramps.
    ///
    /// # Errors
    /// [`GroupFailure`] names who was not ready, or did not start.
    pub async fn start(&self, start: GroupStart) -> Result<(), GroupFailure> {
        let GroupStart { direction, setpoint, spacing, until } = start;
        let asked: Vec<_> = self.members.iter().map(|member| ask(member.clone(), setpoint)).collect();
        let unready: Vec<_> = join_all(asked).await.into_iter().flatten().collect();
        if !unready.is_empty() {
            return Err(GroupFailure::NotReady(unready));
        }
        let started = if spacing.is_zero() {
            if let Some(setpoint) = setpoint {
                self.keep_or_stop(self.set_setpoint(setpoint).await).await?;
            }
            self.each(Order::Start { direction, setpoint: None, until: Until::InForce }).await
        } else {
            let order = Order::Start { direction, setpoint, until: Until::InForce };
            let begin = Instant::now();
            let mut starts = Vec::new();
            for (member, number) in self.members.iter().zip(0_u32..) {
                starts.push(order_one(member.clone(), order, begin + spacing.saturating_mul(number)));
            }
            join_all(starts).await
        };
        self.keep_or_stop(started).await?;
        if until == Until::AtReference {
            let reached: Vec<_> = self.members.iter().map(|member| reach(member.clone())).collect();
            self.keep_or_stop(join_all(reached).await).await?;
        }
        Ok(())
    }

    /// Gives every drive of the group a setpoint.
    pub async fn set_setpoint(&self, setpoint: impl Into<Setpoint>) -> Vec<(Arc<str>, Outcome)> {
        self.each(Order::Setpoint { setpoint: setpoint.into(), until: Until::InForce }).await
    }

    /// Commands every drive, the lines beside each other. On a line that has watchdogs to feed, commands take one half of
    /// the time and leave the other to the rest; on another as many go at once as keep it busy.
    async fn each(&self, order: Order) -> Vec<(Arc<str>, Outcome)> {
        let mut lines = Vec::new();
        for (number, line) in self.fleet.lines().iter().enumerate() {
            let members = self.members.iter().filter(|member| member.entry.line == number);
            lines.push(order_line(members.cloned().collect(), order, line.plan.feed_gap.is_some()));
        }
        join_all(lines).await.into_iter().flatten().collect()
    }

    async fn keep_or_stop(&self, outcomes: Vec<(Arc<str>, Outcome)>) -> Result<(), GroupFailure> {
        let outcomes: Vec<_> = outcomes.into_iter().filter(|(_, outcome)| !outcome.is_confirmed()).collect();
        if outcomes.is_empty() {
            return Ok(());
        }
        // A drive whose start is uncertain is among those that are stopped.
        let stopped = Box::pin(self.stop(StopMode::Ramp)).await;
        Err(GroupFailure::Failed { outcomes, stopped })
    }
}

/// Stops drives of one line, after a broadcast where there is one.
async fn stop_line(
    line: &LineEntry,
    write: Option<BroadcastWrite>,
    members: Vec<DriveHandle>,
    mode: StopMode,
) -> (Option<Arc<str>>, Vec<(Arc<str>, Outcome)>) {
    let broadcast = async {
        match write {
            Some(write) if send(line, write).await => Some(Arc::clone(&line.name)),
            _ => None,
        }
    };
    let silent = members.iter().filter(|member| member.snapshot().link != Link::Connected).count();
    let mute = u32::try_from(silent).unwrap_or(u32::MAX).max(MUTE);
    let patience = line.plan.stop_all(mute) + line.line.worst_case_stop();
    let stops: Vec<_> = members.into_iter().map(|member| stop_one(member, mode, patience)).collect();
    // Both at once: the broadcast is first on the line, and no start of before can come behind it.
    join(broadcast, join_all(stops)).await
}

async fn stop_one(member: DriveHandle, mode: StopMode, patience: Duration) -> (Arc<str>, Outcome) {
    let outcome = member.stop_within(mode, Some(patience)).await;
    (Arc::clone(member.name()), outcome)
}

async fn ask(member: DriveHandle, setpoint: Option<Setpoint>) -> Option<(Arc<str>, Refused)> {
    let refused = member.unready(setpoint).await?;
    Some((Arc::clone(member.name()), refused))
}

async fn order_one(member: DriveHandle, order: Order, at: Instant) -> (Arc<str>, Outcome) {
    sleep_until(at).await;
    let outcome = member.order(order).await;
    (Arc::clone(member.name()), outcome)
}

/// Commands the drives of one line; `watched`: it has watchdogs to feed.
async fn order_line(members: Vec<DriveHandle>, order: Order, watched: bool) -> Vec<(Arc<str>, Outcome)> {
    let commands = members.into_iter().map(|member| async move {
        let begun = Instant::now();
        let ended = order_one(member, order, begun).await;
        if watched {
            sleep(begun.elapsed()).await;
        }
        ended
    });
    let at_once = if watched { 1 } else { AT_ONCE };
    stream::iter(commands).buffer_unordered(at_once).collect().await
}

/// Waits until a drive that was started shows that it has reached its reference.
async fn reach(member: DriveHandle) -> (Arc<str>, Outcome) {
    let after = member.entry.reference;
    let there = member.wait_until(|snapshot| snapshot.is_at_setpoint() || !snapshot.started_here);
    let outcome = match timeout(after, there).await {
        Ok(snapshot) if snapshot.is_at_setpoint() => Outcome::Confirmed,
        Ok(_) => Outcome::NotConfirmed(Unconfirmed::Stopped),
        Err(_) => {
            let status = member.snapshot().status.as_ref().map(|status| Arc::clone(&status.value));
            Outcome::NotConfirmed(Unconfirmed::TimeOver { after, status })
        }
    };
    (Arc::clone(member.name()), outcome)
}

/// Sends a broadcast; whether it went out.
async fn send(line: &LineEntry, write: BroadcastWrite) -> bool {
    let request = match write.function {
        0x10 => Request::WriteMultipleRegisters(write.register, Cow::Owned(vec![write.value])),
        _ => Request::WriteSingleRegister(write.register, write.value),
    };
    let mut all = line.line.broadcast().with_terms(Terms::of(Class::Stop));
    all.call(request).await.is_ok_and(|answer| answer.is_ok())
}
