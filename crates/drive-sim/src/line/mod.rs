//! The line as a test or a program holds it: [`SimLine`], and [`SimSlave`] for one of its drives.

mod handle;

use std::{
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_core::SerialSettings;
use tokio::{sync::watch, time::Instant};

pub use handle::SimSlave;

use crate::{
    defects::{Defective, Defects},
    fault::{Fault, Faults, PerMillion},
    model::{Dialect, Model, Protocol},
    record::{LineStats, Violation},
    slave::Slave,
    state::{BROADCAST, Place, State},
    wire::{Delivery, Pacing, Wire},
};

/// The highest address of a slave (MODBUS over Serial Line V1.02 p. 8).
const HIGHEST: u8 = 247;

/// How a line is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wiring {
    /// Speed and character format, of the slaves that have no others ([`SimSlave::set_dialect`]) and of a master that does
    /// not tell its own.
    pub settings: SerialSettings,
    /// What is spoken by the slaves that have no protocol of their own.
    pub protocol: Protocol,
    /// Whether characters take no time at all: for measurements of everything but the line.
    pub unpaced: bool,
    /// In which pieces an answer reaches the master.
    pub delivery: Delivery,
}

impl Wiring {
    /// Modbus RTU with the character times of these settings.
    #[must_use]
    pub const fn rtu(settings: SerialSettings) -> Self {
        Self { settings, protocol: Protocol::Rtu, unpaced: false, delivery: Delivery::Whole }
    }

    /// The wire of a new endpoint.
    pub(crate) fn wire(self, hardware: bool) -> Wire {
        let pacing = match (self.unpaced, hardware) {
            (true, _) => Pacing::None,
            (false, true) => Pacing::Hardware,
            (false, false) => Pacing::Simulated,
        };
        Wire::new(self.dialect(), pacing, self.delivery)
    }

    /// How its slaves speak and listen, unless they are told otherwise.
    const fn dialect(self) -> Dialect {
        Dialect { settings: self.settings, protocol: self.protocol }
    }
}

/// An address that no further drive can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Outside 1 to 247.
    #[error("{0} is no slave address: expected 1 to 247")]
    OutOfRange(u8),
    /// Another drive of this line has it.
    #[error("address {0} is taken by another drive of this line")]
    Taken(u8),
}

/// A simulated line with its drives: a handle that is cheap to clone.
///
/// It is served to a master in memory, on a pty, on a serial port or on TCP; see the methods named `serve_…` and
/// [`in_memory`](Self::in_memory). All endpoints of one line reach the same drives.
///
/// ```
/// use drive_core::SerialSettings;
/// use drive_sim::{SimLine, Wiring, models::atv312::Atv312};
///
/// let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// for address in 1..=3 {
///     line.add(address, Atv312::under_bus_control())?;
/// }
/// assert!(line.add(3, Atv312::under_bus_control()).is_err(), "somebody has that address");
/// assert_eq!(line.slaves().len(), 3);
/// // What a master does wrong is recorded.
/// assert_eq!(line.violations(), []);
/// # Ok::<(), drive_sim::AddressError>(())
/// ```
#[derive(Clone)]
pub struct SimLine {
    wiring: Wiring,
    shared: Arc<Shared>,
}

pub(crate) struct Shared {
    state: Mutex<State>,
    /// Wakes the endpoints: there is something to send that nothing received has caused.
    wake: watch::Sender<()>,
    /// Wakes observers: something was received, sent or ordered.
    changed: watch::Sender<()>,
}

impl Shared {
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        // A model that panicked in a test has failed that test; the others still want their line.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn wakes(&self) -> watch::Receiver<()> {
        self.wake.subscribe()
    }

    pub(crate) fn has_changed(&self) {
        self.changed.send_replace(());
    }
}

impl SimLine {
    /// A line without drives.
    #[must_use]
    pub fn new(wiring: Wiring) -> Self {
        let shared = Shared {
            state: Mutex::new(State::default()),
            wake: watch::Sender::new(()),
            changed: watch::Sender::new(()),
        };
        Self { wiring, shared: Arc::new(shared) }
    }

    /// Puts a drive on the line and powers it up.
    ///
    /// # Errors
    /// [`AddressError`] when the address is no slave's or is taken.
    pub fn add(&self, address: u8, model: impl Model + 'static) -> Result<SimSlave, AddressError> {
        self.add_boxed(address, Box::new(model))
    }

    /// [`add`](Self::add) for a drive whose family is chosen at run time.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn add_boxed(&self, address: u8, model: Box<dyn Model>) -> Result<SimSlave, AddressError> {
        if self.slave(address).is_some() {
            return Err(AddressError::Taken(address));
        }
        self.add_beside(address, model)
    }

    /// [`add_boxed`](Self::add_boxed) where another drive may have the address already: both carry out what is sent to it, and
    /// answer, as on a line where somebody has set it twice. Answers that are equal and begin at the same moment are heard as
    /// one; what differs is damaged where it overlaps. On a UNI-TELWAY line the one that was there first is polled alone.
    ///
    /// # Errors
    /// [`AddressError::OutOfRange`].
    pub fn add_beside(&self, address: u8, model: Box<dyn Model>) -> Result<SimSlave, AddressError> {
        if address == BROADCAST || address > HIGHEST {
            return Err(AddressError::OutOfRange(address));
        }
        let (dialect, mut state) = (self.wiring.dialect(), self.shared.lock());
        let slave = Slave::new(model, address, dialect, Instant::now(), state.counters(dialect));
        let place = state.add(address, slave);
        Ok(SimSlave { line: self.clone(), place })
    }

    /// The drive at an address, the first one where there are several.
    #[must_use]
    pub fn slave(&self, address: u8) -> Option<SimSlave> {
        self.slaves().into_iter().find(|slave| slave.address() == address)
    }

    /// All drives, by rising address.
    #[must_use]
    pub fn slaves(&self) -> Vec<SimSlave> {
        let places = self.shared.lock().places();
        places.into_iter().map(|place: Place| SimSlave { line: self.clone(), place }).collect()
    }

    /// Cuts the cable of every drive, as [`SimSlave::mute`] does of one.
    pub fn cut(&self) {
        self.slaves().iter().for_each(SimSlave::mute);
    }

    /// Joins the cable of every drive again.
    pub fn join(&self) {
        self.slaves().iter().for_each(SimSlave::unmute);
    }

    /// How the line is made.
    #[must_use]
    pub const fn wiring(&self) -> Wiring {
        self.wiring
    }

    /// The numbers recorded so far.
    #[must_use]
    pub fn stats(&self) -> LineStats {
        self.shared.lock().stats
    }

    /// The numbers recorded since the line was made or since this was last called; they begin anew.
    #[must_use]
    pub fn take_stats(&self) -> LineStats {
        std::mem::take(&mut self.shared.lock().stats)
    }

    /// Breaches of the line's rules, the first 1024 of them.
    #[must_use]
    pub fn violations(&self) -> Vec<Violation> {
        self.shared.lock().violations.iter().copied().collect()
    }

    /// Takes other faults from now on; their counts begin anew.
    pub fn set_faults(&self, faults: Faults) {
        self.shared.lock().faults = faults;
    }

    /// Changes the rate of one fault; 0 switches it off.
    pub fn set_fault(&self, fault: Fault, rate: PerMillion) {
        self.shared.lock().faults.set(fault, rate);
    }

    /// Changes by how much a late answer is late.
    pub fn set_lateness(&self, lateness: Duration) {
        self.shared.lock().faults.set_lateness(lateness);
    }

    /// Gives the line these defects from now on, and takes away those that it had.
    pub fn set_defects(&self, defects: Defects) {
        self.shared.lock().defective = Defective::new(defects, Instant::now());
        self.shared.wake.send_replace(());
    }

    /// How often a fault has struck.
    #[must_use]
    pub fn injected(&self, fault: Fault) -> u64 {
        self.shared.lock().faults.injected(fault)
    }

    pub(crate) const fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }
}

impl Default for SimLine {
    fn default() -> Self {
        Self::new(Wiring::default())
    }
}

impl fmt::Debug for SimLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = self.shared.lock().places();
        f.debug_struct("SimLine")
            .field("wiring", &self.wiring)
            .field("slaves", &places)
            .finish_non_exhaustive()
    }
}
