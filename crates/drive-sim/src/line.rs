//! The line as a test or a program holds it: [`SimLine`], and [`SimSlave`] for one of its drives.

use std::{
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_core::SerialSettings;
use tokio::{sync::watch, time::Instant};

use crate::{
    ascii::Ascii,
    fault::{Fault, Faults, PerMillion},
    framing::Framing,
    model::{Exception, Model, Observation, Panel, Protocol},
    record::{LineStats, Violation},
    rtu::Rtu,
    slave::{LineCounters, Received, Slave},
    state::{BROADCAST, State},
    unitelway::UniTelway,
    wire::{Delivery, Pacing, Wire},
};

/// How often a waiting observer looks. The time of a model passes only while somebody looks at it.
const LOOK: Duration = Duration::from_millis(1);
/// The highest address of a slave (MODBUS over Serial Line V1.02 p. 8).
const HIGHEST: u8 = 247;

/// How a line is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wiring {
    /// Speed and character format.
    pub settings: SerialSettings,
    /// What is spoken.
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
        let framing: Box<dyn Framing> = match self.protocol {
            Protocol::Rtu => Box::new(Rtu::default()),
            Protocol::Ascii => Box::new(Ascii::default()),
            Protocol::UniTelway => Box::new(UniTelway::default()),
        };
        Wire::new(self.settings, pacing, self.delivery, framing)
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
    pub fn add_boxed(&self, address: u8, mut model: Box<dyn Model>) -> Result<SimSlave, AddressError> {
        if address == BROADCAST || address > HIGHEST {
            return Err(AddressError::OutOfRange(address));
        }
        model.join(self.wiring.protocol);
        let mut state = self.shared.lock();
        let slave = Slave::new(model, Instant::now(), state.counters());
        if !state.add(address, slave) {
            return Err(AddressError::Taken(address));
        }
        Ok(SimSlave { line: self.clone(), address })
    }

    /// The drive at an address.
    #[must_use]
    pub fn slave(&self, address: u8) -> Option<SimSlave> {
        let found = self.shared.lock().slave(address).is_some();
        found.then(|| SimSlave { line: self.clone(), address })
    }

    /// All drives, by rising address.
    #[must_use]
    pub fn slaves(&self) -> Vec<SimSlave> {
        let addresses = self.shared.lock().addresses();
        addresses.into_iter().map(|address| SimSlave { line: self.clone(), address }).collect()
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
        let addresses = self.shared.lock().addresses();
        f.debug_struct("SimLine")
            .field("wiring", &self.wiring)
            .field("slaves", &addresses)
            .finish_non_exhaustive()
    }
}

/// One drive of a [`SimLine`], as somebody beside the machine reaches it: a handle that is cheap to clone.
#[derive(Debug, Clone)]
pub struct SimSlave {
    line: SimLine,
    address: u8,
}

impl SimSlave {
    /// Its address.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.address
    }

    /// What an observer of the machine sees now.
    #[must_use]
    pub fn observe(&self) -> Observation {
        self.with(|slave, _| slave.observe(Instant::now()))
    }

    /// Waits until the machine is seen to be so; what was seen.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn wait_until(&self, is_so: impl Fn(&Observation) -> bool) -> Observation {
        self.wait_for(|slave| slave.observe(Instant::now()), is_so).await
    }

    /// Cuts the drive's cable: it hears nothing and says nothing, and goes on doing what it does.
    pub fn mute(&self) {
        self.order(|slave, _| slave.connect(false));
    }

    /// Connects the cable again.
    pub fn unmute(&self) {
        self.order(|slave, _| slave.connect(true));
    }

    /// Holds back the next answer until [`release`](Self::release).
    pub fn hold_next_answer(&self) {
        self.order(|slave, _| slave.hold_next());
    }

    /// Waits until an answer is held back: its request has been carried out.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn wait_until_held(&self) {
        self.wait_for(|slave| slave.is_holding(), |held| *held).await;
    }

    /// Sends the answer that is held back, at once; without one, ends the holding.
    pub fn release(&self) {
        self.line.shared.lock().release(self.address);
        self.line.shared.wake.send_replace(());
        self.line.shared.has_changed();
    }

    /// Answers the next request for this slave alone with an exception, whatever it asks. The request is carried out
    /// nevertheless.
    pub fn refuse_next(&self, exception: Exception) {
        self.order(|slave, _| slave.refuse_next(exception));
    }

    /// Changes the time from the end of a request to the start of its answer; `None`: the family's own.
    pub fn set_turnaround(&self, turnaround: Option<Duration>) {
        self.order(|slave, _| slave.set_turnaround(turnaround));
    }

    /// Trips the drive with a code of its family.
    pub fn trip(&self, code: u16) {
        self.order(|slave, _| slave.at(Instant::now()).trip(code));
    }

    /// Switches the supply off and on.
    pub fn power_cycle(&self) {
        self.order(|slave, state| slave.power_cycle(Instant::now(), state));
    }

    /// Somebody at the machine acts.
    pub fn panel(&self, action: Panel) {
        self.order(|slave, _| slave.at(Instant::now()).panel(action));
    }

    /// Sets the load at the shaft in percent of the motor's nominal torque.
    pub fn set_load(&self, percent: u16) {
        self.order(|slave, _| slave.at(Instant::now()).set_load(percent));
    }

    /// The content of a register, without the rules of the line.
    #[must_use]
    pub fn peek(&self, address: u16) -> Option<u16> {
        self.with(|slave, _| slave.at(Instant::now()).peek(address))
    }

    /// Changes a register, without the rules of the line; `false` when there is none.
    pub fn poke(&self, address: u16, value: u16) -> bool {
        self.order(|slave, _| slave.at(Instant::now()).poke(address, value))
    }

    /// How many requests of a function it took, broadcasts included.
    #[must_use]
    pub fn requests(&self, function: u8) -> u64 {
        self.with(|slave, _| slave.requests(function))
    }

    /// How many requests it took in all, broadcasts included.
    #[must_use]
    pub fn all_requests(&self) -> u64 {
        self.with(|slave, _| slave.all_requests())
    }

    /// Waits until it has taken so many requests in all.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn wait_for_requests(&self, count: u64) {
        self.wait_for(|slave| slave.all_requests(), |taken| *taken >= count).await;
    }

    /// The last 256 requests it took, the oldest first.
    #[must_use]
    pub fn received(&self) -> Vec<Received> {
        self.with(|slave, _| slave.received())
    }

    async fn wait_for<T: Default>(&self, look: impl Fn(&mut Slave) -> T, is_so: impl Fn(&T) -> bool) -> T {
        let mut changed = self.line.shared.changed.subscribe();
        loop {
            let seen = self.with(|slave, _| look(slave));
            if is_so(&seen) {
                return seen;
            }
            // An error would mean that the line is gone, and this handle keeps it.
            let _ = tokio::time::timeout(LOOK, changed.changed()).await;
        }
    }

    /// Looks at the slave. It never leaves its line, so the default is never taken.
    fn with<R: Default>(&self, look: impl FnOnce(&mut Slave, LineCounters) -> R) -> R {
        let mut state = self.line.shared.lock();
        let counters = state.counters();
        state.slave(self.address).map(|slave| look(slave, counters)).unwrap_or_default()
    }

    /// Acts on the slave and tells observers.
    fn order<R: Default>(&self, act: impl FnOnce(&mut Slave, LineCounters) -> R) -> R {
        let result = self.with(act);
        self.line.shared.has_changed();
        result
    }
}
