//! One drive of the demo: the task that polls it and carries out its orders, and what is seen of it.

use std::{
    fmt,
    time::{Duration, Instant},
};

use drive_core::{Direction, Drive, Error, ErrorKind, Fault, Frequency, Result, Status, StopMode};
use drive_sim::SimSlave;
use tokio::{
    sync::{mpsc, watch},
    task::JoinSet,
    time,
};

use crate::{commands::reset::reset, drive_spec::DriveName};

/// Between the answer of a poll and the next poll of the same drive.
const POLL_PAUSE: Duration = Duration::from_millis(300);

/// Orders that may wait for one drive.
const WAITING: usize = 16;

/// A handle of one drive; cheap to clone.
#[derive(Clone)]
pub(super) struct Unit {
    pub(super) name: DriveName,
    pub(super) machine: SimSlave,
    orders: mpsc::Sender<Order>,
    view: watch::Receiver<View>,
}

/// What a drive is told to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Setpoint(Frequency),
    Start(Direction),
    Stop(StopMode),
    Reset,
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setpoint(frequency) => write!(f, "setpoint {frequency}"),
            Self::Start(direction) => write!(f, "start {direction}"),
            Self::Stop(mode) => write!(f, "{mode} stop"),
            Self::Reset => f.write_str("reset"),
        }
    }
}

/// How an order ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Done {
    pub(super) order: Order,
    pub(super) took: Duration,
    pub(super) failure: Option<String>,
}

/// What is seen of a drive.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    pub(super) status: Option<Status>,
    pub(super) setpoint: Option<Frequency>,
    pub(super) fault: Option<Fault>,
    pub(super) last: Option<Done>,
    /// Status polls that were answered.
    pub(super) polls: u64,
    /// Whether the status was read after the stop at the end of the demo.
    pub(super) ended: bool,
}

/// Something worth a line.
#[derive(Debug, Clone)]
pub(super) struct Event {
    pub(super) at: Instant,
    pub(super) name: DriveName,
    pub(super) text: String,
    /// Whether it is bad news.
    pub(super) alarm: bool,
}

impl Unit {
    pub(super) fn start(
        name: DriveName,
        machine: SimSlave,
        drive: Box<dyn Drive>,
        events: mpsc::Sender<Event>,
        ending: watch::Receiver<bool>,
        tasks: &mut JoinSet<()>,
    ) -> Self {
        let (orders, waiting) = mpsc::channel(WAITING);
        let (shown, view) = watch::channel(View::default());
        tasks.spawn(Task { name, drive, shown, events }.run(waiting, ending));
        Self { name, machine, orders, view }
    }

    /// Gives an order. It is dropped when too many wait: a demo does not hurry a drive.
    pub(super) fn order(&self, order: Order) {
        let _ = self.orders.try_send(order);
    }

    pub(super) fn view(&self) -> View {
        self.view.borrow().clone()
    }

    /// Whether the drive itself has said, after the stop at the end, that its motor is not driven.
    pub(super) fn stands(&self) -> bool {
        let view = self.view.borrow();
        view.ended && view.status.as_ref().is_some_and(Status::is_standstill)
    }
}

struct Task {
    name: DriveName,
    drive: Box<dyn Drive>,
    shown: watch::Sender<View>,
    events: mpsc::Sender<Event>,
}

impl Task {
    /// Carries out orders until the demo ends; then stops the motor and watches it.
    async fn run(mut self, orders: mpsc::Receiver<Order>, mut ending: watch::Receiver<bool>) {
        // What was ordered before is dropped, also when it is under way: its exchange ends by itself, unseen.
        tokio::select! {
            biased;
            () = asked(&mut ending) => {}
            () = self.obey(orders) => return,
        }
        self.carry_out(Order::Stop(StopMode::Ramp)).await;
        loop {
            self.poll().await;
            self.shown.send_modify(|view| view.ended = true);
            time::sleep(POLL_PAUSE).await;
        }
    }

    /// Carries out orders and polls between them.
    async fn obey(&mut self, mut orders: mpsc::Receiver<Order>) {
        loop {
            tokio::select! {
                biased;
                order = orders.recv() => match order {
                    Some(order) => self.carry_out(order).await,
                    None => return,
                },
                () = time::sleep(POLL_PAUSE) => self.poll().await,
            }
        }
    }

    async fn carry_out(&mut self, order: Order) {
        let began = Instant::now();
        let result = match order {
            Order::Setpoint(frequency) => self.drive.set_setpoint(frequency.into()).await.map(|()| None),
            Order::Start(direction) => self.drive.start(direction).await.map(Some),
            Order::Stop(mode) => self.stop(mode).await.map(Some),
            Order::Reset => reset(&mut *self.drive).await.map(Some),
        };
        let took = began.elapsed();
        let confirmed = format!("{order}: confirmed after {} ms", took.as_millis());
        let failure = match result {
            Ok(None) => {
                self.tell(confirmed, false);
                None
            }
            Ok(Some(status)) => {
                self.tell(format!("{confirmed}: {status}"), false);
                self.show(status);
                None
            }
            Err(error) => {
                self.tell(format!("{order}: {error}"), true);
                Some(error.to_string())
            }
        };
        let done = Done { order, took, failure };
        self.shown.send_modify(|view| {
            if let (Order::Setpoint(frequency), None) = (order, &done.failure) {
                view.setpoint = Some(frequency);
            }
            view.last = Some(done);
        });
    }

    /// A stop is repeated until the drive confirms it.
    async fn stop(&mut self, mode: StopMode) -> Result<Status> {
        loop {
            match self.drive.stop(mode).await {
                Err(error) if is_worth_repeating(&error) => time::sleep(POLL_PAUSE).await,
                result => return result.map(|stopped| stopped.status),
            }
        }
    }

    async fn poll(&mut self) {
        match self.drive.status().await {
            Ok(status) => {
                let tripped = status.is_fault();
                let before = self.shown.borrow().status.as_ref().map(|status| status.state);
                if before != Some(status.state) && !tripped {
                    self.tell(status.to_string(), false);
                }
                self.show(status);
                self.shown.send_modify(|view| view.polls += 1);
                if tripped && self.shown.borrow().fault.is_none() {
                    self.read_fault().await;
                }
            }
            Err(error) => {
                let was_seen = self.shown.send_if_modified(|view| view.status.take().is_some());
                if was_seen {
                    self.tell(error.to_string(), true);
                }
            }
        }
    }

    async fn read_fault(&mut self) {
        let Ok(faults) = self.drive.faults().await else { return };
        let Some(&fault) = faults.present.first() else { return };
        self.tell(format!("tripped: {fault}"), true);
        self.shown.send_modify(|view| view.fault = Some(fault));
    }

    fn show(&self, status: Status) {
        self.shown.send_modify(|view| {
            if !status.is_fault() {
                view.fault = None;
            }
            view.status = Some(status);
        });
    }

    fn tell(&self, text: String, alarm: bool) {
        // A terminal that is too slow misses lines; the drives do not wait for it.
        let _ = self.events.try_send(Event { at: Instant::now(), name: self.name, text, alarm });
    }
}

async fn asked(ending: &mut watch::Receiver<bool>) {
    // The plant that could ask is gone: the demo ends.
    let _ = ending.wait_for(|&ending| ending).await;
}

fn is_worth_repeating(error: &Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::NoAnswer | ErrorKind::OutcomeUnknown | ErrorKind::NotSent | ErrorKind::NotConfirmed
    )
}
