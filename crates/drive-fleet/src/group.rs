//! [`Group`]: several drives commanded together.

use std::{
    borrow::Cow,
    collections::{HashMap, HashSet},
    convert::identity,
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Waker},
    time::Duration,
};

use drive_core::{BroadcastWrite, Class, Direction, Setpoint, StopMode, Terms};
use futures_util::future::join_all;
use tokio::{
    sync::watch,
    time::{Instant, sleep, sleep_until, timeout},
};
use tokio_modbus::{Request, client::Client};

use crate::{
    cause::Act,
    fleet::Fleet,
    group_ticket::{GroupStop, GroupTicket, StopReport, Told},
    handle::{DriveHandle, Entry},
    line_entry::LineEntry,
    members::Members,
    outcome::{Order, Outcome, Refused, Unconfirmed, Unknown, Until},
    round::Round,
    snapshot::{Link, Snapshot, has_reached},
    stop_order::{StopOrder, strength},
    supervisor::{Expiry, Leave},
};

/// Mute drives that a stop of a line allows for at least.
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

    /// These drives of this fleet as one group. One that has left the fleet stays a member of it, and refuses every command.
    #[must_use]
    pub fn group_of(&self, members: impl IntoIterator<Item = DriveHandle>) -> Group {
        Group::new(self.clone(), members.into_iter().collect())
    }

    /// Stops every drive: see [`Group::stop`].
    pub fn stop_all(&self, order: impl Into<StopOrder>) -> GroupStop {
        self.all().stop(order)
    }
}

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

/// Several drives of a fleet, commanded together: as of each drive, a command is given when its method returns. A drive that has left the fleet since refuses every command.
///
/// ```
/// use drive_atv312::Atv312;
/// use drive_core::{Direction, Frequency, StopMode};
/// use drive_fleet::{DriveSettings, Fleet, GroupStart, Until};
/// use std::time::Duration;
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let settings = drive_core::SerialSettings::MODBUS_DEFAULT;
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(settings));
/// # for address in 1..=2 {
/// #     plant.add(address, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # }
/// # let line = drive_bus::Line::over(plant.in_memory(), drive_bus::LineConfig::stream(settings));
/// let pump = |name| DriveSettings::controlled(name);
/// let fleet = Fleet::builder()
///     .line("north", line)
///     .drive("north", 1, pump("pump 1"), |port, slave| Box::new(Atv312::new(port, slave)))
///     .drive("north", 2, pump("pump 2"), |port, slave| Box::new(Atv312::new(port, slave)))
///     .start()?;
/// # for drive in fleet.drives() {
/// #     drive.ready(Duration::from_secs(10)).await?;
/// # }
/// let pumps = fleet.group(["pump 1", "pump 2"])?;
/// let start = GroupStart {
///     direction: Direction::Forward,
///     setpoint: Some(Frequency::from_hertz(20).into()),
///     spacing: Duration::from_secs(2),
///     until: Until::InForce,
/// };
/// // All of them, or none.
/// for (drive, outcome) in pumps.start(start).await? {
///     println!("{drive}: {outcome}");
/// }
/// assert!(pumps.stop(StopMode::Ramp).await.is_confirmed());
/// # Ok(())
/// # }
/// ```
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
    pub fn commanded_by(&self, act: impl Into<Act>) -> Self {
        let act = Arc::new(act.into());
        let members = self.members.iter().map(|member| member.in_act(&act)).collect();
        Self { fleet: self.fleet.clone(), members }
    }

    /// The same group for one act: behind all of its commands stands one id.
    fn in_one_act(&self) -> Self {
        if self.members.iter().all(|member| member.act().id.is_some()) {
            return self.clone();
        }
        let id = self.fleet.new_act();
        // Those that were of one act are of one again.
        let mut last: Option<(Arc<Act>, Arc<Act>)> = None;
        let with_id = |member: &DriveHandle| {
            if member.act().id.is_some() {
                return member.clone();
            }
            let known = last.take().filter(|(of, _)| Arc::ptr_eq(of, member.act()));
            let (of, act) = known.unwrap_or_else(|| {
                (Arc::clone(member.act()), Arc::new(Act::clone(member.act()).with_id(&id)))
            });
            let member = member.in_act(&act);
            last = Some((of, act));
            member
        };
        Self { fleet: self.fleet.clone(), members: self.members.iter().map(with_id).collect() }
    }

    /// Its drives.
    #[must_use]
    pub fn members(&self) -> &[DriveHandle] {
        &self.members
    }

    /// Stops every drive of the group. All of it is on its way when this returns, and goes on whoever drops the ticket.
    ///
    /// On a line whose drives all belong to the group, may all be commanded and all take the same write for this mode,
    /// one broadcast goes out first. Nobody confirms it, so each drive is then stopped by itself, which also verifies it.
    /// It is finished when every drive stands or its time is over; a drive that does not answer is named after the time
    /// that its line's plan gives. Stops that are not confirmed go on being repeated, by each drive's own task.
    ///
    /// No broadcast comes over the stop of a drive that is harder, nor once every drive of the line is being stopped so.
    pub fn stop(&self, order: impl Into<StopOrder>) -> GroupStop {
        self.in_one_act().stop_each(order.into(), true)
    }

    /// Stops those of these drives that may be commanded, by a broadcast first where there can be one and it is wanted. Line by line, and nothing is made here
    /// but what a stop needs: among ten thousand drives the last is stopped no later than it has to be.
    fn stop_each(&self, order: StopOrder, by_broadcast: bool) -> GroupStop {
        let standing = self.fleet.members();
        let mut lines = Vec::<OfLine<'_>>::new();
        let mut by_line = HashMap::new();
        let mut read_only = Vec::new();
        let mut count = 0;
        for member in &self.members {
            if !member.entry.settings().control {
                read_only.push(Arc::clone(member.name()));
                continue;
            }
            let line = &member.entry.line;
            let number = *by_line.entry(Arc::as_ptr(line)).or_insert_with(|| {
                lines.push(OfLine { line, members: Vec::new() });
                lines.len() - 1
            });
            if let Some(of_line) = lines.get_mut(number) {
                of_line.members.push((count, member));
                count += 1;
            }
        }
        let (mut broadcasts, round) = (Vec::new(), Round::begin());
        let mut each = Vec::with_capacity(count);
        for of_line in &lines {
            let OfLine { line, members } = of_line;
            // It is first on the line, and no start of before can come behind the stops of each.
            if let Some(write) = of_line.common_write(&standing, order.mode).filter(|_| by_broadcast) {
                broadcasts.push((Arc::clone(&line.name), self.broadcast(line, write)));
            }
            let is_silent = |member: &DriveHandle| member.entry.snapshots.now().link != Link::Connected;
            let silent = members.iter().map(|(_, member)| u32::from(is_silent(member))).sum();
            let patience = line.plan().stop_all(MUTE.max(silent)) + line.line.worst_case_stop();
            for (number, member) in members {
                let stop = member.stop_within(order, Some(patience), Some(round.part()));
                each.push((*number, Arc::clone(member.name()), stop));
            }
        }
        drop(round);
        // As the group has them.
        each.sort_unstable_by_key(|(number, ..)| *number);
        let each = each.into_iter().map(|(_, name, stop)| (name, stop)).collect();
        GroupStop::new(each, read_only, broadcasts)
    }

    /// Sends a broadcast, which has its place on the line when this returns; whether it went out is told when it is known.
    fn broadcast(&self, line: &Arc<LineEntry>, write: BroadcastWrite) -> watch::Receiver<Option<bool>> {
        let (told, sent) = watch::channel(None);
        let line = Arc::clone(line);
        let mut sending = Box::pin(async move {
            told.send_replace(Some(send(&line, write).await));
        });
        // A call is submitted by its first poll. Whoever is woken polls it again, so that nothing is lost by a waker that
        // wakes nobody.
        let mut context = Context::from_waker(Waker::noop());
        if sending.as_mut().poll(&mut context).is_pending() {
            self.fleet.inner.runtime.spawn(sending);
        }
        sent
    }

    /// Starts every drive of the group, or none: first all are asked whether they would start, then they start, as close
    /// together as their lines allow or one after the other. When one of them does not, no other is begun, and those
    /// that did are stopped again along their ramps. Who refused, or whose turn had not come, is left alone.
    ///
    /// On one line the starts wait for each other here and not on the line: one drive is commanded at a time, and after
    /// it the line is left to the polls for as long as they need it to keep every value fresh, by the line's plan. So a
    /// full line takes its time: 31 drives at 19200 bit/s 10 s to 80 s. Stops wait for none of this. A drive that
    /// is stopped meanwhile, by whomever, is not started any more even if its turn comes when that stop is long
    /// confirmed.
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

    fn names(&self) -> Vec<Arc<str>> {
        self.members.iter().map(|member| Arc::clone(member.name())).collect()
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

    /// Gives every drive of the group a setpoint, on each line one drive after the other as in [`start`](Self::start).
    pub fn set_setpoint(&self, setpoint: impl Into<Setpoint>) -> GroupTicket<Vec<(Arc<str>, Outcome)>> {
        let order = Order::Setpoint { setpoint: setpoint.into(), until: Until::InForce };
        let group = self.in_one_act();
        GroupTicket::spawn(&self.fleet.inner.runtime, self.names(), identity, async move |told| {
            let told = &told;
            let commands = group.members.iter().map(|member| async {
                let command = async || {
                    let ticket = member.order(order);
                    told.give(member.name(), &ticket);
                    ticket.await
                };
                let outcome = group.on_line(member, command).await;
                (Arc::clone(member.name()), outcome)
            });
            join_all(commands).await
        })
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

    /// Commands a drive when its line is free for it: no other group's command is under way there, and the polls have had
    /// their share since the last.
    async fn on_line<T>(&self, member: &DriveHandle, command: impl AsyncFnOnce() -> T) -> T {
        let line = &member.entry.line;
        // Held while the command runs: the next waits here and not on the line, where it would expire behind its
        // siblings.
        let mut free_at = line.commands.lock().await;
        sleep_until(*free_at).await;
        let begun = Instant::now();
        let ended = command().await;
        *free_at = Instant::now() + line.plan().rest_after(begun.elapsed());
        ended
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

/// Those of a group that are on one line and may be commanded, each with its place among all that may.
struct OfLine<'a> {
    line: &'a Arc<LineEntry>,
    members: Vec<(usize, &'a DriveHandle)>,
}

impl OfLine<'_> {
    /// The write that stops every drive of the line, if it means a stop to all of them and all are meant.
    fn common_write(&self, standing: &Members, mode: StopMode) -> Option<BroadcastWrite> {
        let on_line = || standing.on_line(&self.line.name);
        let is_meant =
            |entry: &Arc<Entry>| self.members.iter().any(|(_, member)| Arc::ptr_eq(&member.entry, entry));
        let write = |entry: &Arc<Entry>| {
            let write = entry.broadcasts.iter().find(|(stop, _)| *stop == mode).map(|(_, write)| *write);
            write.filter(|_| entry.settings().control && is_meant(entry))
        };
        let first = write(on_line().next()?)?;
        let is_common = on_line().all(|entry| write(entry) == Some(first));
        let under_way = |entry: &Arc<Entry>| entry.snapshots.now().stop.map(|stop| strength(stop.mode));
        let (all, any) = on_line().map(under_way).fold((true, false), |(all, any), stop| {
            (all && stop >= Some(strength(mode)), any || stop > Some(strength(mode)))
        });
        (is_common && !all && !any).then_some(first)
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

/// Sends a broadcast; whether it went out.
async fn send(line: &LineEntry, write: BroadcastWrite) -> bool {
    let request = match write.function {
        0x10 => Request::WriteMultipleRegisters(write.register, Cow::Owned(vec![write.value])),
        _ => Request::WriteSingleRegister(write.register, write.value),
    };
    let mut all = line.line.broadcast().with_terms(Terms::of(Class::Stop));
    all.call(request).await.is_ok_and(|answer| answer.is_ok())
}
