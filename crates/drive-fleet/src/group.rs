//! [`Group`]: several drives commanded together.

mod start;
mod stop;

use std::{convert::identity, sync::Arc};

use drive_core::Setpoint;
use futures_util::future::join_all;
use tokio::time::{Instant, sleep_until};

use crate::{
    cause::Act,
    fleet::Fleet,
    group_ticket::{GroupStop, GroupTicket},
    handle::DriveHandle,
    outcome::{Order, Outcome, Until},
    stop_order::StopOrder,
};

pub use self::start::{GroupFailure, GroupStart, GroupStarted};

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

    fn names(&self) -> Vec<Arc<str>> {
        self.members.iter().map(|member| Arc::clone(member.name())).collect()
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
}
