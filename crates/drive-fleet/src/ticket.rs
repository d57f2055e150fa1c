//! Tickets: what tells how far a command has come, from the moment that it was given.

use std::{
    fmt,
    future::IntoFuture,
    pin::Pin,
    sync::atomic::{AtomicBool, Ordering},
};

use tokio::sync::mpsc;

use crate::{
    message::Urgent,
    outcome::{Outcome, Refused},
    progress::{Hearer, outcome},
    supervisor::CallId,
};

/// An order that was given to a drive: it is on its way, whether or not anybody awaits this.
///
/// Awaiting it gives what [`finished`](Self::finished) gives.
///
/// # Dropping
/// **An order whose ticket is dropped before its outcome was heard is withdrawn**: before [`in_force`](Self::in_force) or
/// [`finished`](Self::finished) has returned, as in a `timeout` that is over or a branch of a `select!` that was not taken.
/// - What is unsent of it never is.
/// - A start whose run command was sent, or may have been, is taken back by a stop along the ramp, which is repeated until it is
///   confirmed, also where the motor ran before: so nothing runs by a start that nobody has heard of. It is not where
///   somebody else has started or stopped the motor since. So is one of which no more than the setpoint was sent, or may have been,
///   where the motor ran by this side: it goes to that setpoint.
/// - A setpoint that was given by itself stays. A reset, a release and a save that are under way are finished: they are edges, and half of one
///   would stand in the drive.
///
/// Once its outcome was heard, dropping it does nothing. **Behind the last handle of the fleet it does nothing either**: nothing more is begun
/// then, see [`Fleet`](crate::Fleet). A struct that holds both declares its tickets first, because fields are dropped in that order.
///
/// # Example
///
/// ```
/// # use drive_core::{Direction, Frequency};
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
/// // It is on its way, and in force long before the motor has reached its speed.
/// let run = pump.run(Direction::Forward, Frequency::from_hertz(50));
/// assert!(run.in_force().await.is_confirmed());
/// assert!(!machine.observe().output_frequency.eq(&5_000));
/// assert!(run.finished().await.is_confirmed());
///
/// // Who waits no longer has heard of nothing: what he has started is stopped again.
/// let slower = pump.run(Direction::Forward, Frequency::from_hertz(10));
/// assert!(tokio::time::timeout(Duration::from_secs(1), slower).await.is_err());
/// machine.wait_until(|seen| !seen.running).await;
/// # Ok(())
/// # }
/// ```
#[must_use = "an order is withdrawn when its ticket is dropped before its outcome was heard"]
pub struct Ticket {
    /// `None` when it is dropped.
    hearer: Option<Hearer>,
    heard: AtomicBool,
    id: CallId,
    /// Weak, because a drive without handles is supervised no more, whoever holds a ticket.
    urgent: mpsc::WeakUnboundedSender<Urgent>,
}

impl Ticket {
    pub(crate) const fn new(id: CallId, hearer: Hearer, urgent: mpsc::WeakUnboundedSender<Urgent>) -> Self {
        Self { hearer: Some(hearer), heard: AtomicBool::new(false), id, urgent }
    }

    /// Waits until the drive's own words show that the order is in force, or why it is not: a start and a setpoint do not wait for
    /// the reference here. For other orders the same as [`finished`](Self::finished).
    ///
    /// # Cancellation
    /// Dropping the wait leaves the ticket as it is.
    pub async fn in_force(&self) -> Outcome {
        self.hear(true).await
    }

    /// Waits for what became of the order: see [`Until`](crate::Until).
    ///
    /// # Cancellation
    /// Dropping the wait leaves the ticket as it is.
    pub async fn finished(&self) -> Outcome {
        self.hear(false).await
    }

    /// Takes the order back as if nobody had heard of it: see [dropping](#dropping).
    pub fn withdraw(mut self) {
        *self.heard.get_mut() = false;
    }

    /// Whether something of it was sent to the drive, or may have been.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.hearer.as_ref().is_some_and(|hearer| hearer.borrow().begun)
    }

    async fn hear(&self, early: bool) -> Outcome {
        let outcome = self.unheard(early).await;
        self.keep();
        outcome
    }

    /// The same, and dropping the ticket still withdraws the order.
    pub(crate) async fn unheard(&self, early: bool) -> Outcome {
        match &self.hearer {
            Some(hearer) => outcome(hearer, early).await,
            None => Outcome::Refused(Refused::ShutDown),
        }
    }

    /// Where it is heard how far it has come. Whoever holds that takes the withdrawal from an order that is not taken on yet.
    pub(crate) fn hearer(&self) -> Option<Hearer> {
        self.hearer.clone()
    }

    /// Dropping it does nothing from now on.
    pub(crate) fn keep(&self) {
        self.heard.store(true, Ordering::Relaxed);
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        if !*self.heard.get_mut() {
            // First of all, so that the order is not taken on that overtakes its own withdrawal.
            self.hearer = None;
            if let Some(urgent) = self.urgent.upgrade() {
                let _ = urgent.send(Urgent::Withdraw(self.id));
            }
        }
    }
}

impl IntoFuture for Ticket {
    type Output = Outcome;
    type IntoFuture = Pin<Box<dyn Future<Output = Outcome> + Send>>;

    fn into_future(self) -> Self::IntoFuture {
        Box::pin(async move { self.finished().await })
    }
}

impl fmt::Debug for Ticket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ticket").field("id", &self.id).finish_non_exhaustive()
    }
}

/// A stop that was given to a drive: it is on its way, ahead of everything, whether or not anybody awaits this.
///
/// Awaiting it gives what [`finished`](Self::finished) gives. **A stop is never withdrawn**: when the ticket is dropped it is
/// repeated all the same until the drive stands, or until its time is over where no handle of the fleet is left. Only the runtime of the
/// fleet ends it, by its own end.
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
/// # assert!(pump.start_at(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
/// let stop = pump.stop(StopMode::Ramp);
/// // No run command is in force any more; the motor comes down.
/// assert!(stop.in_force().await.is_confirmed());
/// assert!(stop.finished().await.is_confirmed());
/// # assert!(!machine.observe().running);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
#[must_use = "a stop that is not confirmed is an alarm"]
pub struct StopTicket {
    hearer: Hearer,
}

impl StopTicket {
    pub(crate) const fn new(hearer: Hearer) -> Self {
        Self { hearer }
    }

    /// Waits until the drive shows that no run command is in force any more: the motor comes down by itself from here. Or
    /// until the time of the settings is over, as [`finished`](Self::finished).
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn in_force(&self) -> Outcome {
        outcome(&self.hearer, true).await
    }

    /// Waits until the drive shows standstill, or until the time of the settings is over: the stop goes on being repeated
    /// then.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn finished(&self) -> Outcome {
        outcome(&self.hearer, false).await
    }
}

impl IntoFuture for StopTicket {
    type Output = Outcome;
    type IntoFuture = Pin<Box<dyn Future<Output = Outcome> + Send>>;

    fn into_future(self) -> Self::IntoFuture {
        Box::pin(async move { self.finished().await })
    }
}
