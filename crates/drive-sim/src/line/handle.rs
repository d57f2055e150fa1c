//! The handle of one drive.

use std::time::Duration;

use drive_core::{Percent, registers};
use tokio::time::Instant;

use super::SimLine;
use crate::{
    habits::LinkHabits,
    model::{Dialect, Exception, Observation},
    slave::{LineCounters, Received, Slave},
    state::Place,
    world::{Act, Intervened, Intervention, Panel, Surroundings, UnknownName},
};

/// How often a waiting observer looks. The time of a model passes only while somebody looks at it.
const LOOK: Duration = Duration::from_millis(1);

/// One drive of a [`SimLine`], as somebody beside the machine reaches it: a handle that is cheap to clone.
///
/// ```
/// use drive_core::SerialSettings;
/// use drive_sim::{SimLine, Wiring, models::atv312::Atv312};
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// let drive = line.add(1, Atv312::under_bus_control())?;
/// // LFr, the reference on the bus, as its registers hold it.
/// assert!(drive.poke(8502, 300));
/// assert_eq!(drive.peek(8502), Some(300));
///
/// drive.trip(9);
/// assert_eq!(drive.wait_until(|seen| seen.trip.is_some()).await.trip, Some(9));
/// // What is only in its RAM goes with its supply.
/// drive.power_cycle();
/// assert_eq!(drive.peek(8502), Some(0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct SimSlave {
    pub(super) line: SimLine,
    pub(super) place: Place,
}

impl SimSlave {
    /// The address at which it was put on the line.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.place.0
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

    /// Changes speed, format and protocol of this drive alone, as somebody at its panel does. It hears a master that has
    /// others as a UART would hear it, and is heard so.
    pub fn set_dialect(&self, dialect: Dialect) {
        let mut state = self.line.shared.lock();
        let counters = state.counters(dialect);
        if let Some(slave) = state.at(self.place) {
            slave.set_dialect(dialect, counters);
        }
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
        self.line.shared.lock().release(self.place);
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

    /// Makes it deaf for this long after each of its answers: a request that begins sooner it does not hear. Zero: it hears
    /// every one.
    pub fn set_deaf_for(&self, pause: Duration) {
        self.order(|slave, _| slave.set_deaf_for(pause));
    }

    /// Changes what it does on a UNI-TELWAY line where the card's manual says nothing; in the other protocols it has no
    /// effect.
    pub fn set_link_habits(&self, habits: LinkHabits) {
        self.order(|slave, _| slave.set_habits(habits));
    }

    /// Keeps it busy for this long: it carries nothing out, refuses (NAK) every request on a UNI-TELWAY line, and answers
    /// exception 06 in the other protocols.
    pub fn keep_busy(&self, time: Duration) {
        self.order(|slave, _| slave.busy_until(Instant::now() + time));
    }

    /// Trips the drive with a code of its family.
    pub fn trip(&self, code: u16) {
        self.intervene(Intervention::Trip(code), |slave, _| slave.at(Instant::now()).trip(code));
    }

    /// Switches the supply of the control, and with it the whole drive, on or off. Nothing happens when it already is
    /// so.
    pub fn power(&self, on: bool) {
        self.intervene(Intervention::Power(on), |slave, line| slave.power(Instant::now(), on, line));
    }

    /// Switches the supply off and on.
    pub fn power_cycle(&self) {
        self.power(false);
        self.power(true);
    }

    /// Switches the supply of the power stage on or off, while the control is supplied all the time.
    pub fn motor_supply(&self, on: bool) {
        self.world(Act::MotorSupply(on));
    }

    /// Somebody at the panel acts.
    pub fn panel(&self, action: Panel) {
        self.intervene(Intervention::Panel(action), |slave, _| slave.at(Instant::now()).panel(action));
    }

    /// What there is around the drive.
    #[must_use]
    pub fn surroundings(&self) -> &'static Surroundings {
        let mut found = &Surroundings::NONE;
        self.with(|slave, _| found = slave.at(Instant::now()).surroundings());
        found
    }

    /// Closes a logic input, or opens it.
    ///
    /// # Errors
    /// [`UnknownName`] with the inputs of the family.
    pub fn terminal(&self, name: &str, closed: bool) -> Result<(), UnknownName> {
        self.surroundings().terminal(name, closed).map(|act| self.world(act))
    }

    /// Puts an analog input on a share of its full scale.
    ///
    /// # Errors
    /// [`UnknownName`] with the inputs of the family.
    pub fn analog(&self, name: &str, level: Percent) -> Result<(), UnknownName> {
        self.surroundings().analog(name, level).map(|act| self.world(act))
    }

    /// Has the drive follow one reading of what its manual leaves open.
    ///
    /// # Errors
    /// [`UnknownName`] with the switches of the family, or the readings of the switch.
    pub fn reading(&self, name: &str, reading: &str) -> Result<(), UnknownName> {
        self.surroundings().reading(name, reading).map(|act| self.world(act))
    }

    /// Another master of the line writes one word to the drive, of which the line's own master sees nothing. A drive
    /// that hears nothing takes nothing.
    ///
    /// # Errors
    /// The exception that the drive answers.
    pub fn written_by_another(&self, register: u16, value: u16) -> Result<(), Exception> {
        self.written_by_another_at(register.into(), value)
    }

    /// The same, of a coil too: any value but 0 is on. An input is written by nobody.
    ///
    /// # Errors
    /// The exception that the drive answers.
    pub fn written_by_another_at(&self, place: registers::Place, value: u16) -> Result<(), Exception> {
        let mut result = Ok(());
        self.intervene(Intervention::Master(place, value), |slave, _| {
            result = slave.written_by_another(Instant::now(), place, value);
        });
        result
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
        self.poke_at(address.into(), value)
    }

    /// The content of a register, a coil or an input, without the rules of the line.
    #[must_use]
    pub fn peek_at(&self, place: registers::Place) -> Option<u16> {
        self.with(|slave, _| slave.at(Instant::now()).peek_at(place))
    }

    /// Changes a register, a coil or an input, without the rules of the line; `false` when there is none, or its drive alone says what
    /// stands there.
    pub fn poke_at(&self, place: registers::Place, value: u16) -> bool {
        self.intervene(Intervention::Set(place, value), |slave, _| {
            slave.at(Instant::now()).poke_at(place, value)
        })
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

    /// Those of them that it took behind this moment.
    #[must_use]
    pub fn received_since(&self, since: Instant) -> Vec<Received> {
        self.with(|slave, _| slave.received_since(since))
    }

    /// The last 256 things that somebody else than the line's master did to it, the oldest first: at its panel, its terminals, its
    /// supplies, its settings, and what another master wrote.
    #[must_use]
    pub fn interventions(&self) -> Vec<Intervened> {
        self.with(|slave, _| slave.interventions())
    }

    pub(crate) fn world(&self, act: Act) {
        self.intervene(Intervention::World(act), |slave, _| slave.at(Instant::now()).world(act));
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
        let dialect = state.at(self.place).map(|slave| slave.dialect()).unwrap_or_default();
        let counters = state.counters(dialect);
        state.at(self.place).map(|slave| look(slave, counters)).unwrap_or_default()
    }

    /// Acts on the slave and tells observers.
    fn order<R: Default>(&self, act: impl FnOnce(&mut Slave, LineCounters) -> R) -> R {
        let result = self.with(act);
        self.line.shared.has_changed();
        result
    }

    /// The same, by somebody else than the line's master.
    fn intervene<R: Default>(
        &self,
        what: Intervention,
        act: impl FnOnce(&mut Slave, LineCounters) -> R,
    ) -> R {
        self.order(|slave, line| {
            slave.note(Instant::now(), what);
            act(slave, line)
        })
    }
}
