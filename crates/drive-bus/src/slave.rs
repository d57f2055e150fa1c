//! [`Slave`]: one slave of a line as a tokio-modbus client and as a drive's port.

use std::{fmt, io, sync::Arc, time::Duration};

use async_trait::async_trait;
use drive_core::{Port, PortError, SlaveAddress, Terms};
use tokio::time::Instant;
use tokio_modbus::{
    ExceptionCode, Request, Response,
    client::{Client, Context},
    slave::SlaveContext,
};

use crate::{
    config::SlaveSettings,
    latest::Latest,
    schedule::Ticket,
    shared::{Caller, Handle},
};

/// One slave of a [`Line`](crate::Line): a tokio-modbus [`Client`] and a drive's [`Port`]. Cheap to clone; each clone has
/// its own [`Terms`].
///
/// # Cancellation
/// A call does nothing until it is polled, and is in the schedule after its first poll. It may be dropped at any time. What has
/// not been sent never is; what is on the wire finishes there and its answer is discarded. **The write of a stop is sent all the
/// same**, and again as if its caller waited. The next call is not affected.
///
/// # Errors
/// A slave's exception is the inner error of a call. Everything else is a [`PortError`] inside
/// [`tokio_modbus::Error::Transport`]; [`PortError::from_modbus`] takes it out.
///
/// ```
/// use drive_bus::{Line, LineConfig};
/// use drive_core::{Class, PortError, SerialSettings, Terms};
/// use std::time::Duration;
/// use tokio_modbus::{Request, client::Client};
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let stream = plant.in_memory();
/// let line = Line::over(stream, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
/// let mut slave = line.slave(1).with_terms(Terms::of(Class::Status).within(Duration::from_secs(1)));
/// let eta = Request::ReadHoldingRegisters(3201, 1);
/// assert!(slave.call(eta.clone()).await?.is_ok());
///
/// machine.mute();
/// let error = slave.call(eta).await.unwrap_err();
/// assert!(matches!(PortError::from_modbus(error), PortError::Timeout { .. }));
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Slave {
    pub(crate) handle: Arc<Handle>,
    address: u8,
    pub(crate) terms: Terms,
    asked_at: Option<Instant>,
    /// How many more refusals are worth it, and the last.
    refusals: Option<(u32, ExceptionCode)>,
}

impl Slave {
    pub(crate) fn new(handle: Arc<Handle>, address: u8) -> Self {
        Self { handle, address, terms: Terms::default(), asked_at: None, refusals: None }
    }

    /// Its address, 0 for the broadcast.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.address
    }

    /// When the last of its values was asked for after which another, different answer to the same question came: it may have
    /// been that of an earlier one, so that what was asked for then counts for nothing. `None`: there was none.
    #[must_use]
    pub fn retracted(&self) -> Option<Instant> {
        self.handle.shared.master().retracted(self.address)
    }

    /// How many values of all slaves of its line were withdrawn: whenever that changes [`retracted`](Self::retracted) may have.
    #[must_use]
    pub fn retractions(&self) -> Latest<u64> {
        self.handle.shared.retractions()
    }

    /// When the last exchange began that it has answered, also by an exception and whoever has asked: not before then has it
    /// heard a frame of this line, so its watchdog runs from there. `None`: it has answered nothing yet.
    #[must_use]
    pub fn answered_at(&self) -> Option<Instant> {
        self.handle.shared.master().answered_at(self.address)
    }

    /// How often its line has lost its port. Behind each loss, however short, another slave may answer: the one that is behind the
    /// address or the adapter that the port has then.
    #[must_use]
    pub fn port_losses(&self) -> Latest<u64> {
        self.handle.shared.losses()
    }

    /// This slave for somebody who does not know what it is: when it has refused him so often, whatever he asks further counts as
    /// refused in the same way, and nothing is sent.
    #[must_use]
    pub fn until_refused(mut self, times: u32) -> Self {
        self.refusals = Some((times, ExceptionCode::IllegalDataAddress));
        self
    }

    /// This slave under other terms.
    #[must_use]
    pub fn with_terms(mut self, terms: Terms) -> Self {
        self.terms = terms;
        self
    }
}

impl fmt::Debug for Slave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Slave")
            .field("address", &self.address)
            .field("terms", &self.terms)
            .finish_non_exhaustive()
    }
}

#[async_trait]
impl Client for Slave {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        if let Some((0, refusal)) = self.refusals {
            return Ok(Err(refusal));
        }
        let (caller, outcome) = Caller::new();
        let submitted = self.handle.shared.master().submit(
            Instant::now(),
            self.address,
            request.into_owned(),
            self.terms,
            caller,
        );
        let waiting = match submitted {
            Ok(ticket) => Waiting { handle: &self.handle, ticket: Some(ticket) },
            Err(error) => return Err(tokio_modbus::Error::Transport(error.into_io())),
        };
        self.handle.shared.wake.notify_one();
        // The task drops a caller without an outcome only when its runtime goes down.
        let (outcome, at) = outcome.await.unwrap_or_else(|_| (Err(PortError::Closed), Instant::now()));
        waiting.done();
        if outcome.is_ok() {
            self.asked_at = Some(at);
        }
        if let (Some((left, last)), Ok(Err(refusal))) = (&mut self.refusals, &outcome) {
            (*left, *last) = (*left - 1, *refusal);
        }
        outcome.map_err(|error| tokio_modbus::Error::Transport(error.into_io()))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl SlaveContext for Slave {
    fn set_slave(&mut self, slave: tokio_modbus::Slave) {
        self.address = slave.0;
    }
}

impl Port for Slave {
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
    }

    /// Unless the line keeps a longer one already.
    fn wants_pause(&mut self, pause: Duration) {
        let mut master = self.handle.shared.master();
        let kept = master.config().slaves.get(&self.address).copied().unwrap_or_default();
        if kept.turnaround < pause {
            master.configure_slave(self.address, SlaveSettings { turnaround: pause, ..kept });
        }
    }

    fn asked_at(&self) -> Option<Instant> {
        self.asked_at
    }

    fn made_for(&self) -> Option<SlaveAddress> {
        SlaveAddress::try_from(self.address).ok()
    }

    fn is_ascii(&self) -> bool {
        self.handle.shared.master().config().protocol.is_ascii()
    }
}

impl From<Slave> for Context {
    fn from(slave: Slave) -> Self {
        let client: Box<dyn Client> = Box::new(slave);
        Self::from(client)
    }
}

/// Withdraws a request whose caller drops it.
struct Waiting<'a> {
    handle: &'a Handle,
    ticket: Option<Ticket>,
}

impl Waiting<'_> {
    fn done(mut self) {
        self.ticket = None;
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        if let Some(ticket) = self.ticket.take() {
            self.handle.shared.master().withdraw(ticket);
        }
    }
}
