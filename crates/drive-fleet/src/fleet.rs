//! [`Fleet`]: the handle of it all.

use std::{
    fmt,
    future::poll_fn,
    pin::Pin,
    sync::{
        Arc, Mutex, PoisonError, RwLock,
        atomic::{AtomicU64, Ordering},
    },
    task::{Context, Poll, ready},
    time::Duration,
};

use drive_bus::{Line, evidence::Finding};
use futures_core::Stream;
use futures_util::future::join_all;
use tokio::{
    runtime::Handle,
    sync::broadcast::{self, error::RecvError},
};

use crate::{
    cause::{Cause, Policy},
    event::{Event, EventKind, ExitAction, Happened, Moment, Teller},
    handle::{DriveHandle, Entry},
    members::Members,
    message::Urgent,
    place::Place,
    plan::LinePlan,
    round::Round,
};

/// Many drives on many lines, each watched by a task of its own. Cheap to clone.
///
/// Lines and drives come and go while it runs: [`extend`](Self::extend), [`reconfigure`](Self::reconfigure),
/// [`remove`](Self::remove), [`remove_line`](Self::remove_line). The others notice nothing of it, and neither do readers of
/// events.
///
/// [`shutdown`](Self::shutdown) is the end that acts by each drive's policy. When the last handle is dropped without it nothing more is
/// begun: what waits to be sent is refused, and a drive that is not being stopped is asked no more and goes on until its own watchdog acts.
/// **A stop that was given outlives the handles**: its drive is asked and stopped until it shows standstill, or until the time of the stop
/// is over, which is an alarm. So do the policies of a shut-down that was begun. Then the drive's task ends, with the last of a line the
/// line closes unless somebody holds it, and nothing more is written.
///
/// The tasks live in the tokio runtime that the fleet was started in. **Where that ends, everything ends with it**, a stop under way, too:
/// whoever lets it go awaits the ticket of the stop, or [`shutdown`](Self::shutdown), before.
///
/// ```
/// use drive_atv312::Atv312;
/// use drive_core::{Direction, Frequency, StopMode};
/// use drive_fleet::{DriveSettings, Fleet};
/// use std::time::Duration;
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let settings = drive_core::SerialSettings::MODBUS_DEFAULT;
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(settings));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let line = drive_bus::Line::over(plant.in_memory(), drive_bus::LineConfig::stream(settings));
/// let fleet = Fleet::builder()
///     .line("north", line)
///     .drive("north", 1, DriveSettings::controlled("pump 1"), |port, slave| Box::new(Atv312::new(port, slave)))
///     .start()?;
///
/// let pump = fleet.drive("pump 1").ok_or("no such pump")?;
/// pump.ready(Duration::from_secs(10)).await?;
/// assert!(pump.start_at(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
/// # assert!(machine.observe().running);
/// assert!(fleet.stop_all(StopMode::Ramp).await.is_confirmed());
///
/// for (drive, action) in fleet.shutdown(Duration::from_secs(30)).await {
///     println!("{drive}: {action}");
/// }
/// # assert!(!machine.observe().running);
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Fleet {
    pub(crate) inner: Arc<Inner>,
}

pub(crate) struct Inner {
    members: RwLock<Arc<Members>>,
    /// One change of the members at a time.
    pub(crate) changing: Mutex<()>,
    /// Gone when the fleet has shut down, so that readers see its end.
    events: Mutex<Option<Teller>>,
    /// How many acts of groups there were.
    acts: AtomicU64,
    /// Where the steps of a group's commands go on when nobody polls them.
    pub(crate) runtime: Handle,
    /// For the first readers, which miss nothing of the start.
    first: Mutex<Vec<broadcast::Receiver<Event>>>,
}

impl fmt::Debug for Fleet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let members = self.members();
        let drives: Vec<_> = members.drives().map(|entry| &entry.name).collect();
        f.debug_struct("Fleet").field("drives", &drives).finish_non_exhaustive()
    }
}

impl Fleet {
    pub(crate) fn new(members: Members, events: Teller, first: Vec<broadcast::Receiver<Event>>) -> Self {
        let inner = Inner {
            members: RwLock::new(Arc::new(members)),
            changing: Mutex::default(),
            events: Mutex::new(Some(events)),
            acts: AtomicU64::new(0),
            runtime: Handle::current(),
            first: Mutex::new(first),
        };
        Self { inner: Arc::new(inner) }
    }

    /// The drive with a name.
    #[must_use]
    pub fn drive(&self, name: &str) -> Option<DriveHandle> {
        self.members().drive(name).map(|entry| DriveHandle::new(Arc::clone(entry)))
    }

    /// The drive at a place, whatever it is called.
    #[must_use]
    pub fn drive_at(&self, place: &Place) -> Option<DriveHandle> {
        self.members().drive_at(place).map(|entry| DriveHandle::new(Arc::clone(entry)))
    }

    /// All drives, in the order in which they were added.
    #[must_use]
    pub fn drives(&self) -> Vec<DriveHandle> {
        self.members().drives().map(|entry| DriveHandle::new(Arc::clone(entry))).collect()
    }

    /// The lines by their names, in the order in which they were added.
    #[must_use]
    pub fn lines(&self) -> Vec<(Arc<str>, Line)> {
        self.members().lines().map(|entry| (Arc::clone(&entry.name), entry.line.clone())).collect()
    }

    /// The drives of a line, in the order in which they were added.
    #[must_use]
    pub fn drives_on(&self, line: &str) -> Vec<DriveHandle> {
        let members = self.members();
        members.on_line(line).map(|entry| DriveHandle::new(Arc::clone(entry))).collect()
    }

    /// What happens to the drives, from now on; the first reader gets it from the start of the fleet, and as many as
    /// [were asked for](crate::FleetBuilder::readers_from_the_start).
    #[must_use]
    pub fn events(&self) -> Events {
        let first = self.inner.first.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Events::new(first.or_else(|| self.sender().map(|events| events.subscribe())))
    }

    /// The plan of a line.
    #[must_use]
    pub fn plan(&self, line: &str) -> Option<LinePlan> {
        self.members().line(line).map(|entry| entry.plan())
    }

    /// Ends the fleet: each drive's policy acts, and what was done is listed. What is not done after `limit` is given up;
    /// a drive that is still stopping then has [`ExitAction::TimeOver`].
    ///
    /// The policies are on their way when this returns.
    ///
    /// # Cancellation
    /// When the future is dropped the policies go on, without a limit, and the drives are asked on for as long as a handle is left.
    ///
    /// # Panics
    /// When the future is polled outside a tokio runtime, for `limit` needs its clock; the policies act all the same.
    #[must_use = "a drive that was not stopped may run"]
    pub fn shutdown(
        &self,
        limit: Duration,
    ) -> impl Future<Output = Vec<(Arc<str>, ExitAction)>> + Send + use<> {
        let all = self.members().drives().cloned().collect();
        let (ended, inner) = (end(all, Policy::Exit, limit), Arc::clone(&self.inner));
        async move {
            let actions = ended.await;
            inner.events.lock().unwrap_or_else(PoisonError::into_inner).take();
            actions
        }
    }

    /// An id for an act that has none.
    pub(crate) fn new_act(&self) -> String {
        format!("group-{}", self.inner.acts.fetch_add(1, Ordering::Relaxed) + 1)
    }

    pub(crate) fn members(&self) -> Arc<Members> {
        Arc::clone(&self.inner.members.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Tells of what the line of a drive has found wrong by what it has heard, or does not find any more. What a line finds is asked
    /// of it by whoever wants to know ([`Line::findings`]); this makes it an event among all others, in their order.
    pub fn tell_finding(&self, drive: &DriveHandle, finding: Finding, present: bool) {
        let Some(teller) = self.sender() else { return };
        let kind = EventKind::LineFinding { finding, present };
        let happened = Happened { kind, cause: Cause::Found, words: Arc::default() };
        teller.tell(Arc::clone(drive.name()), drive.place().clone(), Moment::now(), happened);
    }

    /// Changes the members. Who changes them holds [`Inner::changing`], and no members of his own.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Members) -> T) -> T {
        let write = || self.inner.members.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(members) = Arc::get_mut(&mut write()) {
            return change(members);
        }
        // Somebody reads those of before and keeps them; nobody waits while they are copied, a stop least of all.
        let mut changed = Members::clone(&self.members());
        let told = change(&mut changed);
        let before = std::mem::replace(&mut *write(), Arc::new(changed));
        drop(before);
        told
    }

    /// Where events are told; `None` after the shut-down.
    pub(crate) fn sender(&self) -> Option<Teller> {
        self.inner.events.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Has the policies of these drives act: they are on their way when this returns. Whose policy is done is asked and stopped like any other
/// until those of all are: one that is silent may take all of `limit`, and who waits for it may still turn. What is not done by then is
/// given up.
pub(crate) fn end(
    entries: Vec<Arc<Entry>>,
    why: Policy,
    limit: Duration,
) -> impl Future<Output = Vec<(Arc<str>, ExitAction)>> + Send + use<> {
    let round = Round::begin();
    tell(&entries, || Urgent::Exit(why, round.part()));
    drop(round);
    async move {
        let all_leave = async {
            join_all(entries.iter().map(|entry| has_acted(entry))).await;
            tell(&entries, || Urgent::Leave);
            join_all(entries.iter().map(|entry| has_left(entry))).await;
        };
        if tokio::time::timeout(limit, all_leave).await.is_err() {
            // Each still says how far it has come.
            tell(&entries, || Urgent::ExitTimeOver);
            join_all(entries.iter().map(|entry| has_left(entry))).await;
        }
        entries.iter().map(|entry| (Arc::clone(&entry.name), entry.exit_action())).collect()
    }
}

fn tell(entries: &[Arc<Entry>], message: impl Fn() -> Urgent) {
    for entry in entries {
        // A task that is gone has its action in the watch.
        let _ = entry.urgent.send(message());
    }
}

/// Until its policy is done. Of a task that is gone there is no more to come.
async fn has_acted(entry: &Entry) {
    let _ = entry.exit.clone().wait_for(Option::is_some).await;
}

/// Until its task is gone.
async fn has_left(entry: &Entry) {
    let mut exit = entry.exit.clone();
    while exit.changed().await.is_ok() {}
}

/// A reader of the fleet's events: by [`recv`](Self::recv), or as a [`Stream`] that ends with the fleet.
///
/// ```
/// use drive_fleet::{EventKind, Received};
/// # use std::time::Duration;
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let settings = drive_core::SerialSettings::MODBUS_DEFAULT;
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(settings));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let line = drive_bus::Line::over(plant.in_memory(), drive_bus::LineConfig::stream(settings));
/// # let fleet = drive_fleet::Fleet::builder()
/// #     .line("north", line)
/// #     .drive("north", 1, drive_fleet::DriveSettings::controlled("pump 1"), |port, slave| {
/// #         Box::new(drive_atv312::Atv312::new(port, slave))
/// #     })
/// #     .start()?;
/// let mut events = fleet.events();
/// # machine.trip(9);
/// let trip = loop {
///     match events.recv().await {
///         Received::Event(event) => {
///             println!("{}: {}", event.drive, event.kind);
///             if let EventKind::Tripped(trip) = event.kind {
///                 break trip;
///             }
///         }
///         Received::Missed(events) => println!("{events} events were missed"),
///         Received::End => return Ok(()),
///     }
/// };
/// assert!(trip.status.value.is_fault());
/// # Ok(())
/// # }
/// ```
pub struct Events {
    /// The wait for the next; `None` when the fleet has ended.
    next: Option<Next>,
}

type Next =
    Pin<Box<dyn Future<Output = (Result<Event, RecvError>, broadcast::Receiver<Event>)> + Send + Sync>>;

/// What a reader of events gets.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "nearly all that is received are events")]
pub enum Received {
    /// An event.
    Event(Event),
    /// The reader was slow: so many events are gone. The next is the oldest that is left.
    Missed(u64),
    /// The fleet has ended.
    End,
}

impl Events {
    fn new(receiver: Option<broadcast::Receiver<Event>>) -> Self {
        Self { next: receiver.map(next) }
    }

    /// The next event, or how many were missed.
    ///
    /// # Cancellation
    /// Safe to drop: nothing is lost.
    pub async fn recv(&mut self) -> Received {
        poll_fn(|context| Pin::new(&mut *self).poll_next(context)).await.unwrap_or(Received::End)
    }
}

fn next(mut receiver: broadcast::Receiver<Event>) -> Next {
    Box::pin(async move {
        let received = receiver.recv().await;
        (received, receiver)
    })
}

/// Its items are never [`Received::End`]: the end of the fleet is the end of the stream.
impl Stream for Events {
    type Item = Received;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Received>> {
        let Some(waiting) = &mut self.next else { return Poll::Ready(None) };
        let (received, receiver) = ready!(waiting.as_mut().poll(context));
        self.next = (received != Err(RecvError::Closed)).then(|| next(receiver));
        Poll::Ready(match received {
            Ok(event) => Some(Received::Event(event)),
            Err(RecvError::Lagged(missed)) => Some(Received::Missed(missed)),
            Err(RecvError::Closed) => None,
        })
    }
}

impl fmt::Debug for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Events").finish_non_exhaustive()
    }
}
