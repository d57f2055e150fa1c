//! One drive of the demo, as the story and the table see it: a drive of the fleet, and the simulated machine behind it.

use std::{fmt, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, Status, StopMode};
use drive_fleet::{DriveHandle, Freshness, Outcome};
use drive_sim::SimSlave;
use tokio::{sync::watch, time::Instant};

use super::story::TELLER;
use drived_config::names::KnownAs;
use drived_plant::plant::views::DriveView;
use drived_words::drive_spec::DriveName;

/// A handle of one drive; cheap to clone.
#[derive(Clone)]
pub(super) struct Unit {
    pub(super) name: DriveName,
    pub(super) machine: SimSlave,
    handle: DriveHandle,
    last: Arc<watch::Sender<Option<Done>>>,
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
    pub(super) outcome: Outcome,
}

impl Unit {
    pub(super) fn new(name: DriveName, machine: SimSlave, handle: DriveHandle) -> Self {
        Self { name, machine, handle: handle.commanded_by(TELLER), last: Arc::new(watch::Sender::new(None)) }
    }

    /// Gives an order; its outcome is shown when it is known.
    pub(super) fn order(&self, order: Order) {
        let Self { handle, last, .. } = self.clone();
        tokio::spawn(async move {
            let began = Instant::now();
            let outcome = match order {
                Order::Setpoint(frequency) => handle.set_setpoint(frequency).await,
                Order::Start(direction) => handle.start(direction).await,
                Order::Stop(mode) => handle.stop(mode).await,
                Order::Reset => handle.reset_faults().await,
            };
            last.send_replace(Some(Done { order, took: began.elapsed(), outcome }));
        });
    }

    /// Waits until the drive can be started, until `by` at the latest. Why it cannot, its first order is told.
    pub(super) async fn is_ready_by(&self, by: Instant) {
        drop(self.handle.ready(by.saturating_duration_since(Instant::now())).await);
    }

    /// What is known of it.
    pub(super) fn drive(&self) -> DriveView {
        DriveView::of("demo", &self.handle, KnownAs::of_name(self.handle.name()))
    }

    /// How its last order ended.
    pub(super) fn last(&self) -> Option<Done> {
        self.last.borrow().clone()
    }

    /// Status polls that were answered.
    pub(super) fn answered(&self) -> u64 {
        self.handle.snapshot().counters.answered
    }

    /// What it shows, if that is so now.
    pub(super) fn status(&self) -> Option<Arc<Status>> {
        let snapshot = self.handle.snapshot();
        let is_fresh = snapshot.freshness(Instant::now()) == Freshness::Fresh;
        snapshot.status.as_ref().filter(|_| is_fresh).map(|status| Arc::clone(&status.value))
    }

    /// Whether the drive itself says that its motor is not driven.
    pub(super) fn stands(&self) -> bool {
        let snapshot = self.handle.snapshot();
        snapshot.stop.is_none() && snapshot.status.as_ref().is_some_and(|status| status.value.is_undriven())
    }
}
