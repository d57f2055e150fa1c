//! [`DriveHandle`]: one drive of a fleet, as its users hold it.

use std::{
    fmt,
    pin::pin,
    sync::{Arc, PoisonError, RwLock},
    time::Duration,
};

use drive_bus::Line;
use drive_core::{
    BroadcastWrite, Capabilities, Direction, Faults, Row, Setpoint, SlaveAddress, StopMode,
    WatchdogCapability, Written,
};
use tokio::{
    sync::{mpsc, oneshot, watch},
    time::{Instant, sleep},
};

use crate::{
    cause::Act,
    event::ExitAction,
    fleet::LineEntry,
    outcome::{Order, Outcome, Refused, Until},
    plan::Demand,
    settings::DriveSettings,
    snapshot::{Snapshot, WatchdogCheck},
    supervisor::{Leave, Question, Told},
    task::{Message, Urgent},
};

/// What the handles of a drive share.
pub(crate) struct Entry {
    pub(crate) name: Arc<str>,
    pub(crate) line: Arc<LineEntry>,
    pub(crate) slave: SlaveAddress,
    pub(crate) capabilities: &'static Capabilities,
    pub(crate) watchdog: Option<WatchdogCapability>,
    /// They may be exchanged.
    pub(crate) settings: RwLock<Arc<DriveSettings>>,
    /// The writes that stop every drive of its family on a line, by mode.
    pub(crate) broadcasts: Vec<(StopMode, BroadcastWrite)>,
    pub(crate) messages: mpsc::Sender<Message>,
    pub(crate) urgent: mpsc::UnboundedSender<Urgent>,
    pub(crate) snapshots: watch::Receiver<Arc<Snapshot>>,
    pub(crate) exit: watch::Receiver<Option<ExitAction>>,
}

impl Entry {
    pub(crate) fn settings(&self) -> Arc<DriveSettings> {
        Arc::clone(&self.settings.read().unwrap_or_else(PoisonError::into_inner))
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

/// One drive of a fleet. Cheap to clone; the drive is supervised as long as any handle of the fleet lives.
///
/// # Cancellation
/// Dropping the future of a command does not take the command back: what is sent is sent, what is not yet sent expires
/// by its lifetime, and a stop is repeated until it is confirmed.
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
        Self { entry, act: Arc::new(Act::of("program")) }
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
        Arc::clone(&self.entry.snapshots.borrow())
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

    /// What is known of it, and a notice of every change. A reader that is slow sees the latest.
    #[must_use]
    pub fn watch(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.entry.snapshots.clone()
    }

    /// Waits until a snapshot is so, and gives it. After the end of the fleet it gives the last snapshot there is.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn wait_until(&self, mut is_so: impl FnMut(&Snapshot) -> bool) -> Arc<Snapshot> {
        let mut watch = self.watch();
        match watch.wait_for(|snapshot| is_so(snapshot)).await {
            Ok(snapshot) => Arc::clone(&snapshot),
            Err(_) => self.snapshot(),
        }
    }

    /// Waits until a start would be sent: the drive answers, was identified, its watchdog verified, and nothing stands in
    /// the way. Gives the reason that it still has when `patience` is over.
    ///
    /// # Errors
    /// Why a start would be refused.
    pub async fn ready(&self, patience: Duration) -> Result<(), Refused> {
        // Patience without end is a wish that a point in time could not hold.
        let mut over = pin!(sleep(patience));
        let mut watch = self.watch();
        loop {
            watch.mark_unchanged();
            let refused = match self.unready(None).await {
                // Whether a setpoint is allowed is not a matter of the drive.
                None | Some(Refused::Limit(_)) => return Ok(()),
                Some(refused) => refused,
            };
            tokio::select! {
                changed = watch.changed() => if changed.is_err() {
                    return Err(refused);
                },
                () = &mut over => return Err(refused),
            }
        }
    }

    /// Why a start, with this setpoint, would be refused now; `None` when it would be sent.
    pub async fn unready(&self, setpoint: Option<Setpoint>) -> Option<Refused> {
        self.ask(setpoint).await.err()
    }

    /// The leave to start later, or why a start would be refused now.
    pub(crate) async fn ask(&self, setpoint: Option<Setpoint>) -> Result<Leave, Refused> {
        let (reply, answer) = oneshot::channel();
        let name = Arc::clone(&self.act.commander);
        self.post(Message::Ask { name, setpoint, reply })?;
        answer.await.unwrap_or(Err(Refused::ShutDown))
    }

    /// Starts the motor at the setpoint that the drive holds. Confirmed when the run command shows in its words.
    pub async fn start(&self, direction: Direction) -> Outcome {
        self.order(Order::Start { direction, setpoint: None, until: Until::InForce }).await
    }

    /// Gives a setpoint and starts the motor. Confirmed when the run command shows in its words: the speed is then on its
    /// way, and [`run`](Self::run) waits until it is reached.
    pub async fn start_at(&self, direction: Direction, setpoint: impl Into<Setpoint>) -> Outcome {
        let setpoint = Some(setpoint.into());
        self.order(Order::Start { direction, setpoint, until: Until::InForce }).await
    }

    /// Gives a setpoint, starts the motor, and waits until it has reached it; [`start_at`](Self::start_at) does not wait.
    pub async fn run(&self, direction: Direction, setpoint: impl Into<Setpoint>) -> Outcome {
        let setpoint = Some(setpoint.into());
        self.order(Order::Start { direction, setpoint, until: Until::AtReference }).await
    }

    /// Changes the setpoint. Confirmed when the drive holds it. A setpoint that is not yet sent gives its place to a
    /// later one.
    pub async fn set_setpoint(&self, setpoint: impl Into<Setpoint>) -> Outcome {
        self.order(Order::Setpoint { setpoint: setpoint.into(), until: Until::InForce }).await
    }

    /// Stops the motor. It goes ahead of everything, interrupts what is asked of this drive, and is repeated until the
    /// drive shows standstill. A mode that the drive does not have is replaced by its driver; an event says so.
    ///
    /// The outcome comes at standstill, or when the time of the settings is over: the stop goes on being repeated then.
    pub async fn stop(&self, mode: StopMode) -> Outcome {
        self.stop_within(mode, false, None).await
    }

    pub(crate) async fn stop_within(
        &self,
        mode: StopMode,
        anyhow: bool,
        patience: Option<Duration>,
    ) -> Outcome {
        let (reply, outcome) = oneshot::channel();
        let act = Arc::clone(&self.act);
        if self.entry.urgent.send(Urgent::Stop { mode, anyhow, act, patience, reply }).is_err() {
            return Outcome::Refused(Refused::ShutDown);
        }
        outcome.await.unwrap_or(Outcome::Refused(Refused::ShutDown))
    }

    /// Resets the present fault, once. The motor does not start.
    pub async fn reset_faults(&self) -> Outcome {
        self.order(Order::ResetFaults).await
    }

    /// Gives control back to the panel or the terminals; the motor must stand.
    pub async fn release(&self) -> Outcome {
        self.order(Order::Release).await
    }

    /// Takes what the drive says it is for right from now on, after
    /// [`IdentityChanged`](crate::EventKind::IdentityChanged).
    pub async fn accept_identity(&self) -> Outcome {
        self.order(Order::AcceptIdentity).await
    }

    /// Saves the drive's parameters to EEPROM: refused when nothing changed, and counted
    /// ([`Counters::saves`](crate::Counters::saves)).
    pub async fn persist(&self) -> Outcome {
        self.order(Order::Persist).await
    }

    /// Gives an order and waits for its outcome.
    pub async fn order(&self, order: Order) -> Outcome {
        self.order_on(None, None, order).await
    }

    /// Gives an order that is not sent after `expires`, whatever lifetime the settings give, and waits for its outcome.
    pub async fn order_until(&self, order: Order, expires: Instant) -> Outcome {
        self.order_on(None, Some(expires), order).await
    }

    /// Gives an order, and no more if a stop has come since its leave.
    pub(crate) async fn order_on(
        &self,
        leave: Option<Leave>,
        expires: Option<Instant>,
        order: Order,
    ) -> Outcome {
        let (reply, outcome) = oneshot::channel();
        let act = Arc::clone(&self.act);
        match self.post(Message::Order { order, leave, expires, act, reply }) {
            Ok(()) => outcome.await.unwrap_or(Outcome::Refused(Refused::ShutDown)),
            Err(refused) => Outcome::Refused(refused),
        }
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
        let name = Arc::clone(&self.act.commander);
        self.post(Message::Question { question, name, reply })?;
        told.await.unwrap_or(Err(Refused::ShutDown))
    }

    fn post(&self, message: Message) -> Result<(), Refused> {
        self.entry.messages.try_send(message).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => Refused::QueueFull,
            mpsc::error::TrySendError::Closed(_) => Refused::ShutDown,
        })
    }
}
