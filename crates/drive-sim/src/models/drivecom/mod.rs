//! The DRIVECOM drive that the Altivar 28, 58 and 312 share, from the drive's side: control word in, status word out,
//! a motor in between (BBV51701 p. 10–13, 19–22).
//!
//! A family keeps its registers; it tells a [`Drivecom`] what was written ([`command`](Drivecom::command),
//! [`set_settings`](Drivecom::set_settings) …) and what is asked from outside ([`situate`](Drivecom::situate)), and
//! reads back [`eta`](Drivecom::eta), [`eti`](Drivecom::eti), the [`motor`](Drivecom::motor) and the
//! [`faults`](Drivecom::faults).
//!
//! A drive that the bus does not command follows the chart by itself: it is in "operation enabled" unless something
//! locks it (p. 11).

mod counts;
pub(super) mod family;
mod faults;
mod orders;
mod readings;
mod settings;
mod situation;
mod surroundings;
mod time;
mod wiring;
mod words;

use std::collections::VecDeque;

pub use faults::PastFault;
pub use settings::{CommandBits, Injection, LinkWatch, Reaction, Restarts, Settings, Standstill, Stop};
pub use situation::{Commander, Run, Situation, StopInputs};
pub use wiring::{RunInputs, Terminals, Wiring};

pub(super) use self::{
    counts::{centihertz, profile_code, rpm, word},
    readings::{
        BUS_REFERENCE, DISABLE_OPERATION, GIVEN_BACK, MOTOR_RUNNING, PRESETS, PRIORITY, RESET, RESTART,
        Readings, STOP_RELEASED, TERMINAL_REFERENCE,
    },
    surroundings::{ANALOG_INPUTS, Around, TERMINALS},
};
use self::{orders::Order, time::Timers};
use crate::{Motor, Nameplate, Observation, Watchdog};

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

/// A drive with the DRIVECOM chart.
#[derive(Debug, Clone)]
pub struct Drivecom {
    settings: Settings,
    readings: Readings,
    situation: Situation,
    state: ChartState,
    /// The last control word; `None` until there is one.
    word: Option<u16>,
    /// Whether the order in the control word is in force: not after somebody else had control.
    obeys: bool,
    /// Whether the run command that stands has to be given anew.
    spent: bool,
    order: Order,
    motor: Motor,
    watchdog: Watchdog,
    no_timeout: bool,
    timers: Timers,
    cause_persists: bool,
    /// The latest first.
    faults: VecDeque<PastFault>,
    stopped_by_key: bool,
}

impl Drivecom {
    /// A drive that was just powered up.
    #[must_use]
    pub fn new(plate: Nameplate, settings: Settings, situation: Situation) -> Self {
        let mut drive = Self {
            settings,
            readings: Readings::default(),
            situation,
            state: ChartState::SwitchOnDisabled,
            word: None,
            obeys: true,
            spent: false,
            order: Order::Nothing,
            motor: Motor::new(plate),
            watchdog: Watchdog::default(),
            no_timeout: false,
            timers: Timers::default(),
            cause_persists: false,
            faults: VecDeque::new(),
            stopped_by_key: false,
        };
        drive.power_up(settings, situation);
        drive
    }

    /// The supply goes: the shaft turns on, the faults are remembered, all else is forgotten.
    pub fn power_off(&mut self) {
        self.motor.freewheel();
        self.state = ChartState::SwitchOnDisabled;
        (self.word, self.obeys, self.spent, self.order) = (None, true, false, Order::Nothing);
        (self.no_timeout, self.cause_persists, self.stopped_by_key) = (false, false, false);
        self.timers = Timers::default();
        self.watchdog.rest();
        self.watchdog.set_timeout(None);
    }

    /// The supply comes, and finds this: the chart begins anew.
    pub fn power_up(&mut self, settings: Settings, situation: Situation) {
        self.power_off();
        (self.settings, self.situation) = (settings, situation);
        self.watch();
        self.follow();
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

    /// From now on the drive follows these readings of its manual.
    pub(super) fn set_readings(&mut self, readings: Readings) {
        self.readings = readings;
        self.obey();
    }

    pub(super) const fn readings(&self) -> &Readings {
        &self.readings
    }

    /// What is asked from outside has changed.
    pub fn situate(&mut self, situation: Situation) {
        let before = std::mem::replace(&mut self.situation, situation);
        let stops = situation.stops;
        if before.run != situation.run && situation.run.is_none() {
            self.spent = false;
        }
        if before.commander != situation.commander {
            (self.obeys, self.spent) = (self.readings.standing_word_acts, false);
            let enabled = self.state == ChartState::OperationEnabled;
            if let Some(word) =
                self.word.filter(|_| situation.commander == Commander::Bus && enabled && self.obeys)
            {
                self.state = words::next(self.state, word);
            }
        }
        if stops.fast || stops.lock {
            let stands = situation.run.is_some() || situation.commander == Commander::Bus;
            self.spent |= stands && !self.restarts_after_a_stop();
        }
        self.follow();
    }

    /// The control word (CMD) was written. Its levels move the chart at each write; bit 7 resets a fault when it
    /// rises (BBV51701 p. 12).
    pub fn command(&mut self, word: u16) {
        let reset_rises = word & words::FAULT_RESET != 0 && self.word.unwrap_or(0) & words::FAULT_RESET == 0;
        self.word = Some(word);
        let commands = self.situation.commander == Commander::Bus;
        if reset_rises && self.state == ChartState::Fault && (commands || self.readings.any_word_resets) {
            self.reset();
            return;
        }
        if commands {
            (self.obeys, self.spent) = (true, false);
            self.state = words::next(self.state, word);
            self.follow();
        }
    }

    /// The control word that is about to be written makes this channel the commander: no word stands over.
    pub(super) const fn handed_over_by_word(&mut self, commander: Commander) {
        self.situation.commander = commander;
    }

    /// The bit NTO (no time-out) of the extended control word was written.
    pub fn set_no_timeout(&mut self, no_timeout: bool) {
        self.no_timeout = no_timeout;
        self.watch();
    }

    /// A configuration parameter (R/WS) was written with the motor stopped: the drive locks itself
    /// (BBV51701 p. 11, transitions 7, 9, 10, 12).
    pub fn configuration_written(&mut self) {
        self.lock();
    }

    /// A valid frame for this drive came.
    pub fn frame_seen(&mut self) {
        self.watchdog.feed();
        if self.present_fault() == Some(self.settings.link.code) {
            self.cause_gone();
        }
    }

    /// Somebody presses the STOP key, which has priority (BBV51701 p. 11, transitions 9 and 12).
    pub fn stop_key(&mut self) {
        if matches!(self.state, ChartState::OperationEnabled | ChartState::QuickStopActive) {
            self.stopped_by_key = true;
            self.lock();
        }
    }

    /// Sets the load at the shaft in percent of nominal torque.
    pub fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    /// The state of the chart.
    #[must_use]
    pub const fn state(&self) -> ChartState {
        self.state
    }

    /// What acts on the drive.
    #[must_use]
    pub const fn situation(&self) -> &Situation {
        &self.situation
    }

    /// The motor.
    #[must_use]
    pub const fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The reference in force in hundredths of a hertz, negative in reverse: what was asked within LSP and HSP.
    #[must_use]
    pub fn target(&self) -> i32 {
        let (asked, settings) = (self.situation.reference, &self.settings);
        let reversed = match (self.situation.commander, self.situation.run) {
            (Commander::Bus, _) => self.word.is_some_and(|word| word & settings.bits.reverse != 0),
            (_, run) => run == Some(Run::Reverse),
        };
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
            local: self.situation.forced_local,
            eeprom_writes,
        }
    }

    /// Whether a run command that stands acts again when an input no longer stops (BBV51701 p. 8, 40, 41).
    fn restarts_after_a_stop(&self) -> bool {
        let by_bus = self.situation.commander == Commander::Bus;
        self.settings.runs_by_level || by_bus && self.readings.stop_release_restarts
    }

    /// The motor coasts, and the way up the chart begins anew; a run command that stands has to be given anew.
    fn lock(&mut self) {
        if !matches!(self.state, ChartState::Fault | ChartState::FaultReactionActive) {
            self.state = ChartState::SwitchOnDisabled;
            self.motor.freewheel();
            self.spent = self.situation.run.is_some();
            self.follow();
        }
    }

    /// Takes the chart where it goes by itself, and obeys.
    fn follow(&mut self) {
        if !matches!(self.state, ChartState::Fault | ChartState::FaultReactionActive) {
            if self.situation.stops.lock {
                self.state = ChartState::SwitchOnDisabled;
            } else if self.situation.commander != Commander::Bus {
                self.state = ChartState::OperationEnabled;
            }
        }
        self.obey();
    }

    fn watch(&mut self) {
        let LinkWatch { timeout, reaction, .. } = self.settings.link;
        let watches = reaction != Reaction::Ignore && !self.no_timeout;
        self.watchdog.set_timeout(timeout.filter(|_| watches));
    }
}

#[cfg(test)]
mod tests;
