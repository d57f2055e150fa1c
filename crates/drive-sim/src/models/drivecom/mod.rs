//! The DRIVECOM drive that the Altivar 28, 58 and 312 share, from the drive's side: control word in, status word out,
//! a motor in between (BBV51701 p. 10–13, 19–22).
//!
//! A family keeps its registers; it tells a [`Drivecom`] what was written ([`command`](Drivecom::command),
//! [`reference`](Drivecom::reference), [`set_settings`](Drivecom::set_settings) …) and reads back
//! [`eta`](Drivecom::eta), [`eti`](Drivecom::eti), the [`motor`](Drivecom::motor) and the
//! [`faults`](Drivecom::faults).

mod counts;
mod settings;
mod words;

use std::{collections::VecDeque, time::Duration};

pub use settings::{CommandBits, LinkWatch, Reaction, Settings, Stop};

pub(super) use self::counts::{centihertz, profile_code, rpm, word};
use self::words::Order;
use crate::{Motor, Nameplate, Observation, Panel, Watchdog};

/// Faults that a drive remembers: the last and four past ones (LFt, DP1–DP4).
const REMEMBERED: usize = 5;

/// A state of the chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChartState {
    /// Locked, and the way up begins here.
    SwitchOnDisabled,
    /// The first rung.
    ReadyToSwitchOn,
    /// The second rung.
    SwitchedOn,
    /// Run orders act.
    OperationEnabled,
    /// Stopping or stopped by a quick stop.
    QuickStopActive,
    /// On the way to standstill as the fault asks.
    FaultReactionActive,
    /// Tripped.
    Fault,
}

/// A fault as the drive remembers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PastFault {
    /// The family's code.
    pub code: u16,
    /// The state when it came, as the words EP1–EP4 show it (BBV51701 p. 25).
    pub status: u16,
}

/// A drive with the DRIVECOM chart.
#[derive(Debug, Clone)]
pub struct Drivecom {
    settings: Settings,
    state: ChartState,
    /// The last control word; `None` until there is one.
    word: Option<u16>,
    /// Whether the order in the control word is in force: not after somebody at the machine took control.
    obeys: bool,
    order: Order,
    reference: i32,
    motor: Motor,
    watchdog: Watchdog,
    no_timeout: bool,
    cause_persists: bool,
    /// The latest first.
    faults: VecDeque<PastFault>,
    local: bool,
    stopped_by_key: bool,
}

impl Drivecom {
    /// A drive that was just powered up.
    #[must_use]
    pub fn new(plate: Nameplate, settings: Settings) -> Self {
        let mut drive = Self {
            settings,
            state: ChartState::SwitchOnDisabled,
            word: None,
            obeys: true,
            order: Order::Nothing,
            reference: 0,
            motor: Motor::new(plate),
            watchdog: Watchdog::default(),
            no_timeout: false,
            cause_persists: false,
            faults: VecDeque::new(),
            local: false,
            stopped_by_key: false,
        };
        drive.power(true);
        drive
    }

    /// The supply goes or comes: the chart begins anew, the shaft turns on, the faults are remembered.
    pub fn power(&mut self, on: bool) {
        self.motor.freewheel();
        self.state = if self.settings.starts_enabled {
            ChartState::OperationEnabled
        } else {
            ChartState::SwitchOnDisabled
        };
        (self.word, self.obeys, self.order, self.reference) = (None, true, Order::Nothing, 0);
        (self.no_timeout, self.cause_persists) = (false, false);
        (self.local, self.stopped_by_key) = (false, false);
        self.watchdog.rest();
        if on {
            self.watch();
        } else {
            self.state = ChartState::SwitchOnDisabled;
            self.watchdog.set_timeout(None);
        }
    }

    /// Parameters have changed.
    pub fn set_settings(&mut self, settings: Settings) {
        if settings != self.settings {
            self.settings = settings;
            self.watch();
            self.obey();
        }
    }

    /// The parameters in force.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The control word (CMD) was written. Its levels move the chart at each write; bit 7 resets a fault when it
    /// rises (BBV51701 p. 12).
    pub fn command(&mut self, word: u16) {
        let reset_rises = word & words::FAULT_RESET != 0 && self.word.unwrap_or(0) & words::FAULT_RESET == 0;
        self.word = Some(word);
        self.obeys = true;
        if self.local || !self.settings.bus_commands {
            return;
        }
        if reset_rises && self.state == ChartState::Fault {
            self.reset();
            return;
        }
        self.state = words::next(self.state, word);
        self.obey();
    }

    /// The frequency reference was written, in hundredths of a hertz, negative in reverse.
    pub fn reference(&mut self, centihertz: i32) {
        self.reference = centihertz;
        self.obey();
    }

    /// The bit NTO (no time-out) of the extended control word was written.
    pub fn set_no_timeout(&mut self, no_timeout: bool) {
        self.no_timeout = no_timeout;
        self.watch();
    }

    /// A configuration parameter (R/WS) was written with the motor stopped: the drive locks itself
    /// (BBV51701 p. 11, transitions 7, 9, 10, 12).
    pub fn configuration_written(&mut self) {
        if !matches!(self.state, ChartState::Fault | ChartState::FaultReactionActive) {
            self.state = ChartState::SwitchOnDisabled;
            self.obey();
        }
    }

    /// A valid frame for this drive came.
    pub const fn frame_seen(&mut self) {
        self.watchdog.feed();
    }

    /// The drive trips and does what the fault asks on the way. While `cause_persists`, no reset clears it
    /// ([`cause_gone`](Self::cause_gone)).
    pub fn trip(&mut self, code: u16, reaction: Reaction, cause_persists: bool) {
        if reaction == Reaction::Ignore {
            return;
        }
        let status = self.fault_status();
        self.faults.push_front(PastFault { code, status });
        self.faults.truncate(REMEMBERED);
        self.cause_persists = cause_persists;
        self.state = ChartState::FaultReactionActive;
        match reaction {
            Reaction::Ignore | Reaction::Freewheel => self.motor.freewheel(),
            Reaction::Ramp => self.motor.ramp_to_rest(self.settings.ramps.deceleration),
            Reaction::Fast => self.motor.ramp_to_rest(self.settings.fast_stop),
        }
        self.order = Order::Nothing;
        self.settle();
    }

    /// The cause of the present fault is gone.
    pub const fn cause_gone(&mut self) {
        self.cause_persists = false;
    }

    /// Resets the fault, if its cause is gone; whether it did.
    pub fn reset(&mut self) -> bool {
        let resets = self.is_resettable();
        if resets {
            self.state = ChartState::SwitchOnDisabled;
        }
        resets
    }

    /// Somebody forces the drive to local control, or gives it back to the bus. The order that the bus had given does
    /// not come back with it: the bus has to write it again.
    pub fn force_local(&mut self, local: bool) {
        self.local = local;
        self.obeys = false;
        self.obey();
    }

    /// Somebody presses the STOP key of the terminal (BBV51701 p. 11, transitions 9 and 12).
    pub fn stop_key(&mut self) {
        if matches!(self.state, ChartState::OperationEnabled | ChartState::QuickStopActive) {
            self.state = ChartState::SwitchOnDisabled;
            self.stopped_by_key = true;
            self.obey();
        }
    }

    /// Somebody does something at the panel.
    pub fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => self.force_local(true),
            Panel::ReleaseControl => self.force_local(false),
            Panel::Stop => self.stop_key(),
            Panel::Run | Panel::Reset | Panel::Reference(_) => {}
        }
    }

    /// Sets the load at the shaft in percent of nominal torque.
    pub fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    /// Lets time pass. A watchdog that runs out within it trips the drive at its own moment.
    pub fn advance(&mut self, elapsed: Duration) {
        let first = self.watchdog.remaining().map_or(elapsed, |remaining| remaining.min(elapsed));
        self.motor.advance(first);
        if self.watchdog.advance(first) {
            let LinkWatch { code, reaction, .. } = self.settings.link;
            self.trip(code, reaction, false);
        }
        self.motor.advance(elapsed - first);
        self.settle();
    }

    /// The state of the chart.
    #[must_use]
    pub const fn state(&self) -> ChartState {
        self.state
    }

    /// The motor.
    #[must_use]
    pub const fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The code of the fault that is present.
    #[must_use]
    pub fn present_fault(&self) -> Option<u16> {
        let present = matches!(self.state, ChartState::Fault | ChartState::FaultReactionActive);
        self.faults.front().filter(|_| present).map(|fault| fault.code)
    }

    /// The remembered faults, the latest first.
    pub fn faults(&self) -> impl Iterator<Item = PastFault> {
        self.faults.iter().copied()
    }

    /// The reference in force in hundredths of a hertz, negative in reverse: what was asked within LSP and HSP.
    #[must_use]
    pub fn target(&self) -> i32 {
        let settings = &self.settings;
        let asked = if settings.bus_reference { self.reference } else { 0 };
        let reversed = self.word.is_some_and(|word| word & settings.bits.reverse != 0);
        let size =
            asked.unsigned_abs().clamp(settings.low_speed.min(settings.high_speed), settings.high_speed);
        let size = i32::try_from(size).unwrap_or(i32::MAX);
        if (asked < 0) ^ reversed { -size } else { size }
    }

    /// What an observer sees of it; what belongs to the family's memory is the family's to add.
    #[must_use]
    pub fn observe(&self, eeprom_writes: u32) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: self.target(),
            current: self.motor.current(),
            trip: self.present_fault(),
            local: self.local,
            eeprom_writes,
        }
    }

    const fn is_resettable(&self) -> bool {
        matches!(self.state, ChartState::Fault) && !self.cause_persists
    }

    /// Carries out what state and control word ask of the motor. A stop acts once, when it is ordered: an injection
    /// that is over does not begin again because the same word is written again.
    fn obey(&mut self) {
        let order = self.ordered();
        let is_new = order != self.order;
        self.order = order;
        match order {
            Order::Nothing => {}
            Order::Run => {
                self.stopped_by_key = false;
                self.motor.run(self.target(), self.settings.ramps);
            }
            Order::Lock => self.motor.freewheel(),
            Order::Stop(_) if !is_new => {}
            Order::Stop(Stop::Ramp) => self.motor.ramp_to_rest(self.settings.ramps.deceleration),
            Order::Stop(Stop::Fast) => self.motor.ramp_to_rest(self.settings.fast_stop),
            Order::Stop(Stop::Freewheel) => self.motor.freewheel(),
            Order::Stop(Stop::DcInjection) => {
                self.motor.brake(self.settings.injection_current, Some(self.settings.injection_time));
            }
        }
    }

    fn ordered(&self) -> Order {
        match self.state {
            ChartState::Fault | ChartState::FaultReactionActive => Order::Nothing,
            ChartState::SwitchOnDisabled | ChartState::ReadyToSwitchOn => Order::Lock,
            // From operation enabled, 0007h stops as Stt says; the manual does not tell.
            ChartState::SwitchedOn => Order::Stop(self.settings.stop),
            ChartState::QuickStopActive => Order::Stop(Stop::Fast),
            ChartState::OperationEnabled => match self.word {
                Some(word) if self.obeys && self.settings.bus_commands && !self.local => {
                    Order::of(word, &self.settings)
                }
                _ => Order::Stop(self.settings.stop),
            },
        }
    }

    /// Follows what happens by itself once the motor stands.
    fn settle(&mut self) {
        if self.state == ChartState::FaultReactionActive && !self.motor.is_fed() {
            self.state = ChartState::Fault;
        }
    }

    fn watch(&mut self) {
        let LinkWatch { timeout, reaction, .. } = self.settings.link;
        let watches = reaction != Reaction::Ignore && !self.no_timeout;
        self.watchdog.set_timeout(timeout.filter(|_| watches));
    }
}

#[cfg(test)]
mod tests;
