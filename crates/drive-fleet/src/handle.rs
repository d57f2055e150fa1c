//! [`DriveHandle`]: one drive of a fleet, as its users hold it.

use std::{
    fmt,
    pin::pin,
    sync::{
        Arc, LazyLock, PoisonError, RwLock,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use drive_bus::{Latest, Line};
use drive_core::{
    BroadcastWrite, Capabilities, Direction, Faults, Identity, Row, Setpoint, SlaveAddress, StopMode,
    WatchdogCapability, Written,
};
use tokio::{
    sync::{mpsc, oneshot, watch},
    time::{Instant, sleep},
};

use crate::{
    cause::Act,
    event::ExitAction,
    line_entry::LineEntry,
    message::{Message, Urgent},
    outcome::{Order, Refused, Until},
    place::Place,
    plan::Demand,
    progress::{Progress, refused},
    round::Round,
    settings::{DriveSettings, Left},
    snapshot::{Snapshot, WatchdogCheck},
    stop_order::StopOrder,
    supervisor::{CallId, Expiry, Leave, Question, Told},
    ticket::{StopTicket, Ticket},
};

/// What the handles of a drive share.
pub(crate) struct Entry {
    pub(crate) name: Arc<str>,
    pub(crate) place: Place,
    pub(crate) line: Arc<LineEntry>,
    pub(crate) slave: SlaveAddress,
    pub(crate) capabilities: &'static Capabilities,
    pub(crate) watchdog: Option<WatchdogCapability>,
    /// They may be exchanged. Shared with the handles of whoever knows the drive by a name that it had before.
    pub(crate) settings: Arc<RwLock<Arc<DriveSettings>>>,
    /// The writes that stop every drive of its family on a line, by mode.
    pub(crate) broadcasts: Arc<[(StopMode, BroadcastWrite)]>,
    pub(crate) messages: mpsc::Sender<Message>,
    pub(crate) urgent: mpsc::UnboundedSender<Urgent>,
    /// The number of the last call.
    pub(crate) calls: Arc<AtomicU64>,
    pub(crate) snapshots: Latest<Arc<Snapshot>>,
    pub(crate) exit: watch::Receiver<Option<(ExitAction, Left)>>,
    /// It was removed from a fleet that goes on.
    pub(crate) removed: Arc<AtomicBool>,
}

impl Entry {
    pub(crate) fn settings(&self) -> Arc<DriveSettings> {
        Arc::clone(&self.settings.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// What was done to it at its end, once it is.
    pub(crate) fn exit_action(&self) -> ExitAction {
        self.exit.borrow().as_ref().map_or(ExitAction::TimeOver, |(action, _)| action.clone())
    }

    /// Why nothing is asked of it any more, whose task is gone.
    fn gone(&self) -> Refused {
        if self.removed.load(Ordering::Relaxed) { Refused::Removed } else { Refused::ShutDown }
    }

    fn new_call(&self) -> CallId {
        CallId(self.calls.fetch_add(1, Ordering::Relaxed))
    }

    /// What it wants of its line.
    pub(crate) fn demand(&self) -> Demand {
        let settings = self.settings();
        Demand {
            drive: self.name.to_string(),
            capabilities: self.capabilities,
            watchdog_capability: self.watchdog,
            periods: settings.periods,
            watchdog: settings.watchdog,
        }
    }
}

/// One drive of a fleet. Cheap to clone; the drive is supervised as long as any handle of the fleet lives, and until a stop that was given
/// has ended: see [`Fleet`](crate::Fleet).
///
/// # Commands
/// Each method that commands the drive has **given the command when it returns**, before anything is awaited, and returns a
/// ticket that tells what becomes of it. An order whose [`Ticket`] is dropped before its outcome was heard is withdrawn, and a
/// start is taken back; a stop never is, whoever drops its [`StopTicket`].
///
/// # Example
///
/// ```
/// # use drive_core::{Direction, Frequency, StopMode};
/// # use std::time::Duration;
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
/// # let pump = fleet.drive("pump 1").ok_or("no such pump")?;
/// # pump.ready(Duration::from_secs(10)).await?;
/// // Who commands stands in every event of it.
/// let pump = pump.commanded_by("night shift");
/// let started = pump.run(Direction::Forward, Frequency::from_hertz(30)).await;
/// assert!(started.is_confirmed(), "{started}");
///
/// let seen = pump.snapshot();
/// assert_eq!(seen.setpoint, Some(Frequency::from_hertz(30).into()));
/// assert!(pump.stop(StopMode::Ramp).await.is_confirmed());
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct DriveHandle {
    pub(crate) entry: Arc<Entry>,
    act: Arc<Act>,
}

impl fmt::Debug for DriveHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DriveHandle")
            .field("name", &self.entry.name)
            .field("act", &self.act)
            .finish_non_exhaustive()
    }
}

impl DriveHandle {
    pub(crate) fn new(entry: Arc<Entry>) -> Self {
        /// Whoever does not say who he is, once for all drives: a stop of all takes a handle of each.
        static PROGRAM: LazyLock<Arc<Act>> = LazyLock::new(|| Arc::new(Act::of("program")));
        Self { entry, act: Arc::clone(&PROGRAM) }
    }

    /// This drive, commanded under a name: for the settings that say who may command it, and for the events. An [`Act`] says
    /// besides through which door, and which act it is of which the command is a part.
    #[must_use]
    pub fn commanded_by(&self, act: impl Into<Act>) -> Self {
        self.in_act(&Arc::new(act.into()))
    }

    /// This drive, commanded as a part of an act.
    pub(crate) fn in_act(&self, act: &Arc<Act>) -> Self {
        Self { entry: Arc::clone(&self.entry), act: Arc::clone(act) }
    }

    pub(crate) const fn act(&self) -> &Arc<Act> {
        &self.act
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &Arc<str> {
        &self.entry.name
    }

    /// Which machine it is, by whatever name.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.entry.place
    }

    /// Its address on its line.
    #[must_use]
    pub fn slave(&self) -> SlaveAddress {
        self.entry.slave
    }

    /// The line that it is on, and the name of that.
    #[must_use]
    pub fn line(&self) -> (&Arc<str>, &Line) {
        (&self.entry.line.name, &self.entry.line.line)
    }

    /// What its family can do.
    #[must_use]
    pub fn capabilities(&self) -> &'static Capabilities {
        self.entry.capabilities
    }

    /// What it was told.
    #[must_use]
    pub fn settings(&self) -> Arc<DriveSettings> {
        self.entry.settings()
    }

    /// What is known of it now.
    #[must_use]
    pub fn snapshot(&self) -> Arc<Snapshot> {
        self.entry.snapshots.now()
    }

    /// The time of the communication watchdog that runs in the drive, as far as is known: as it was read last, or the one that
    /// the drive always has. `None` where it is off or nothing is known of it.
    #[must_use]
    pub fn watchdog_timeout(&self) -> Option<Duration> {
        let fixed = self.entry.watchdog.and_then(|watchdog| watchdog.fixed());
        let read = match &self.snapshot().watchdog {
            WatchdogCheck::Verified(found) | WatchdogCheck::WaitsForStandstill(found) => Some(*found),
            WatchdogCheck::NoContract { found } => *found,
            WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => None,
        };
        read.and_then(|found| found.timeout).or(fixed)
    }

    /// What is known of it, and a notice of every change. A reader that is slow sees the latest, and holds up nobody.
    #[must_use]
    pub fn watch(&self) -> Latest<Arc<Snapshot>> {
        self.entry.snapshots.clone()
    }

    /// Waits until a snapshot is so, and gives it. After the end of the fleet it gives the last snapshot there is.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn wait_until(&self, mut is_so: impl FnMut(&Snapshot) -> bool) -> Arc<Snapshot> {
        let there = self.watch().until(|snapshot| is_so(snapshot)).await;
        there.unwrap_or_else(|_| self.snapshot())
    }

    /// Waits until a start would be sent: the drive answers, was identified, its watchdog verified, and nothing stands in
    /// the way. Gives the reason that it still has when `patience` is over.
    ///
    /// # Errors
    /// Why a start would be refused.
    ///
    /// # Panics
    /// Outside a tokio runtime, for `patience` needs its clock.
    pub async fn ready(&self, patience: Duration) -> Result<(), Refused> {
        // Patience without end is a wish that a point in time could not hold.
        let mut over = pin!(sleep(patience));
        let mut watch = self.watch();
        loop {
            watch.look();
            let Some(refused) = self.unready().await else { return Ok(()) };
            tokio::select! {
                changed = watch.changed() => if changed.is_err() {
                    return Err(refused);
                },
                () = &mut over => return Err(refused),
            }
        }
    }

    /// Why the drive would refuse a start now, whatever the setpoint; `None` when it is ready.
    pub async fn unready(&self) -> Option<Refused> {
        // Whether a setpoint is allowed is judged last, and not a matter of the drive.
        self.would_refuse(None).await.filter(|refused| !matches!(refused, Refused::Limit(_)))
    }

    /// Why a start at this setpoint, or at the one that the drive holds, would be refused now; `None` when it would be sent.
    pub async fn would_refuse(&self, setpoint: Option<Setpoint>) -> Option<Refused> {
        // No direction is judged before the drive is asked.
        self.ask(Direction::Forward, setpoint).await.err()
    }

    /// The leave to start later, or why a start would be refused now.
    pub(crate) async fn ask(
        &self,
        direction: Direction,
        setpoint: Option<Setpoint>,
    ) -> Result<Leave, Refused> {
        let (reply, answer) = oneshot::channel();
        let name = Arc::clone(&self.act.commander);
        self.post(Message::Ask { name, direction, setpoint, reply })?;
        answer.await.unwrap_or_else(|_| Err(self.entry.gone()))
    }

    /// Starts the motor at the setpoint that this fleet gave it last, which is given anew (another master may have written the reference
    /// since), or, where it gave none that is known, at the one that the drive holds. Confirmed when the run command shows in its words.
    pub fn start(&self, direction: Direction) -> Ticket {
        self.order(Order::Start { direction, setpoint: None, until: Until::InForce })
    }

    /// Gives a setpoint and starts the motor. Confirmed when the run command shows in its words, at that setpoint: the speed is then on its
    /// way, and [`run`](Self::run) waits until it is reached. A motor that runs this way already gets the setpoint alone, and one that ran and
    /// that somebody has stopped since this was asked is not started.
    pub fn start_at(&self, direction: Direction, setpoint: impl Into<Setpoint>) -> Ticket {
        let setpoint = Some(setpoint.into());
        self.order(Order::Start { direction, setpoint, until: Until::InForce })
    }

    /// Gives a setpoint and starts the motor. Finished when it has reached the setpoint; [`start_at`](Self::start_at) does not
    /// wait for that.
    pub fn run(&self, direction: Direction, setpoint: impl Into<Setpoint>) -> Ticket {
        let setpoint = Some(setpoint.into());
        self.order(Order::Start { direction, setpoint, until: Until::AtReference })
    }

    /// Changes the setpoint. Confirmed when the drive holds it. A setpoint that is not yet sent gives its place to a
    /// later one.
    pub fn set_setpoint(&self, setpoint: impl Into<Setpoint>) -> Ticket {
        self.order(Order::Setpoint { setpoint: setpoint.into(), until: Until::InForce })
    }

    /// Stops the motor. It goes ahead of everything, interrupts what is asked of this drive, and is repeated until the
    /// drive shows standstill. A mode that the drive does not have is replaced by its driver; an event says so.
    ///
    /// It is in force when the drive shows that no run command is, and finished at standstill, or when the time of the
    /// settings is over: it goes on being repeated then.
    ///
    /// A stop under way that is as hard takes a later one in, which is confirmed by what the drive shows after it; one that is
    /// harder takes its place: freewheel, then fast, then injection of direct current, then the ramp.
    pub fn stop(&self, order: impl Into<StopOrder>) -> StopTicket {
        self.stop_within(order.into(), None, None)
    }

    /// The same as one of several, with the time of its line.
    pub(crate) fn stop_within(
        &self,
        order: StopOrder,
        patience: Option<Duration>,
        round: Option<Round>,
    ) -> StopTicket {
        let (reply, hearer) = watch::channel(Progress::default());
        let (id, act) = (self.entry.new_call(), Arc::clone(&self.act));
        match self.entry.urgent.send(Urgent::Stop { id, order, act, patience, round, reply }) {
            Ok(()) => StopTicket::new(hearer),
            Err(_) => StopTicket::new(refused(self.entry.gone())),
        }
    }

    /// Resets the present fault, once. The motor does not start.
    pub fn reset_faults(&self) -> Ticket {
        self.order(Order::ResetFaults)
    }

    /// Gives control back to the panel or the terminals; the motor must stand.
    pub fn release(&self) -> Ticket {
        self.order(Order::Release)
    }

    /// Takes what the drive says it is for right from now on, after
    /// [`IdentityChanged`](crate::EventKind::IdentityChanged). `shown`: what it said when somebody looked; where it says something
    /// else by now that is refused. Nothing is sent, so that it holds for a drive that is only read too.
    pub fn accept_identity(&self, shown: &Identity) -> Ticket {
        self.order(Order::AcceptIdentity(shown.into()))
    }

    /// Saves the drive's parameters to EEPROM: refused when nothing changed, and counted
    /// ([`Counters::saves`](crate::Counters::saves)).
    pub fn persist(&self) -> Ticket {
        self.order(Order::Persist)
    }

    /// What is left of it once it has [left the fleet](crate::Fleet::remove), for whoever goes on with it; before that, nothing.
    #[must_use]
    pub fn left(&self) -> Left {
        self.entry.exit.borrow().as_ref().map(|(_, left)| left.clone()).unwrap_or_default()
    }

    /// Gives an order.
    pub fn order(&self, order: Order) -> Ticket {
        self.order_on(None, None, order)
    }

    /// Gives an order of which nothing is sent after `expires`, whatever lifetime the settings give.
    pub fn order_until(&self, order: Order, expires: Instant) -> Ticket {
        self.order_on(None, Some(Expiry::at(expires)), order)
    }

    /// Gives an order that somebody gave then, with another lifetime than that of the settings: nothing of it is written behind its end. A
    /// start for which its drive was asked something by then, as one that takes long to answer is, or that waited for others of its line that
    /// start, goes on for 2 s at the most.
    pub fn order_since(&self, order: Order, given: Instant, lifetime: Duration) -> Ticket {
        self.order_on(None, Some(Expiry::since(given, lifetime)), order)
    }

    /// Gives an order, and no more if a stop has come since its leave.
    pub(crate) fn order_on(&self, leave: Option<Leave>, expires: Option<Expiry>, order: Order) -> Ticket {
        let (reply, hearer) = watch::channel(Progress::default());
        let (id, act) = (self.entry.new_call(), Arc::clone(&self.act));
        let hearer = match self.post(Message::Order { id, order, leave, expires, act, reply }) {
            Ok(()) => hearer,
            Err(error) => refused(error),
        };
        Ticket::new(id, hearer, self.entry.urgent.downgrade())
    }

    /// Reads the present faults and the history, when the drive's turn comes.
    ///
    /// # Errors
    /// Why they cannot be read.
    pub async fn faults(&self) -> Result<Faults, Refused> {
        match self.question(Question::Faults).await? {
            Told::Faults(faults) => Ok(faults),
            _ => Err(Refused::ShutDown),
        }
    }

    /// Reads a row of the family, when the drive's turn comes.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub async fn read_parameter(&self, row: &'static Row) -> Result<u16, Refused> {
        match self.question(Question::Read(row)).await? {
            Told::Word(word) => Ok(word),
            _ => Err(Refused::ShutDown),
        }
    }

    /// Writes a row of the family, when the drive's turn comes, unless it holds the word already, and reads it back. For
    /// those who may command the drive.
    ///
    /// # Errors
    /// Why it is not written, or not confirmed.
    pub async fn write_parameter(&self, row: &'static Row, word: u16) -> Result<Written, Refused> {
        match self.question(Question::Write(row, word)).await? {
            Told::Written(written) => Ok(written),
            _ => Err(Refused::ShutDown),
        }
    }

    async fn question(&self, question: Question) -> Result<Told, Refused> {
        let (reply, told) = oneshot::channel();
        let (id, name) = (self.entry.new_call(), Arc::clone(&self.act.commander));
        self.post(Message::Question { id, question, name, reply })?;
        told.await.unwrap_or_else(|_| Err(question.abandoned(self.entry.slave)))
    }

    fn post(&self, message: Message) -> Result<(), Refused> {
        self.entry.messages.try_send(message).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => Refused::QueueFull,
            mpsc::error::TrySendError::Closed(_) => self.entry.gone(),
        })
    }
}
