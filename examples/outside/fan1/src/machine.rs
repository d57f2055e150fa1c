//! The simulated FAN1, written from its manual alone.

use std::time::Duration;

use drive_core::{Frequency, registers::Access};
use drive_sim::{
    Act, Bank, Cast, Exception, Model, Motor, Nameplate, Observation, Panel, Ramp, Ramps, Rules, Surroundings,
};

use crate::{
    FAULTS,
    registers::{ControlWord, ROWS, StatusWord, address as at},
};

const RULES: Rules = Rules {
    read_holding: 7,
    read_input: 0,
    write_single: true,
    write_multiple: 0,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[],
    turnaround: Duration::from_millis(4),
};

const SURROUNDINGS: Surroundings =
    Surroundings { family: "fan1", trips: FAULTS, rows: ROWS, ..Surroundings::NONE };

/// What its ramps are measured to, in hundredths of a hertz.
const FULL: u32 = 6_000;

/// A FAN1 as somebody beside it sees it.
#[derive(Debug, Clone)]
pub struct Machine {
    bank: Bank,
    motor: Motor,
    fault: u16,
    /// The motor turns, or turned last, in reverse.
    reverse: bool,
    /// The run command acts again when it was 0 once.
    locked: bool,
    /// The panel commands.
    local: bool,
    local_at_power_up: bool,
    panel_runs: bool,
    panel_reference: Frequency,
    powered: bool,
    supplied: bool,
}

impl Machine {
    /// One that the bus commands.
    #[must_use]
    pub fn new() -> Self {
        Self {
            bank: Bank::new(ROWS),
            motor: Motor::new(Nameplate { nominal_frequency: FULL, ..Nameplate::light(24) }),
            fault: 0,
            reverse: false,
            locked: false,
            local: false,
            local_at_power_up: false,
            panel_runs: false,
            panel_reference: Frequency::ZERO,
            powered: true,
            supplied: true,
        }
    }

    /// One that its panel commands, as it leaves the factory.
    #[must_use]
    pub fn at_the_panel() -> Self {
        Self { local: true, local_at_power_up: true, ..Self::new() }
    }

    fn control(&self) -> ControlWord {
        ControlWord::from_bits_retain(self.bank.value(at::CONTROL))
    }

    /// Whether a run command is in force, and whether it is one in reverse.
    fn ordered(&self) -> Option<bool> {
        let control = self.control();
        if !self.powered || !self.supplied || self.fault != 0 {
            None
        } else if self.local {
            self.panel_runs.then_some(false)
        } else {
            let runs = control.contains(ControlWord::RUN) && !self.locked;
            runs.then_some(control.contains(ControlWord::REVERSE))
        }
    }

    fn target(&self) -> i32 {
        let bus = u32::from(self.bank.value(at::REFERENCE)) * 10;
        let counts = if self.local { self.panel_reference.centihertz() } else { bus };
        let frequency = i32::try_from(counts).unwrap_or(0);
        if self.ordered() == Some(true) { -frequency } else { frequency }
    }

    fn steer(&mut self) {
        let time = Duration::from_millis(u64::from(self.bank.value(at::RAMP)) * 100);
        let ramp = Ramp { full_scale: FULL, time };
        if !self.powered || !self.supplied || self.fault != 0 {
            self.motor.freewheel();
        } else if self.ordered().is_some() {
            self.motor.run(self.target(), Ramps { acceleration: ramp, deceleration: ramp });
        } else {
            self.motor.ramp_to_rest(ramp);
        }
    }

    fn lock(&mut self) {
        self.locked = self.control().contains(ControlWord::RUN);
    }

    fn computed(&self, address: u16) -> Option<u16> {
        let output = self.motor.output_frequency();
        Some(match address {
            at::STATUS => {
                let mut word = StatusWord::empty();
                word.set(StatusWord::READY, self.supplied);
                word.set(StatusWord::RUNNING, self.ordered().is_some());
                word.set(StatusWord::REVERSE, if output == 0 { self.reverse } else { output < 0 });
                word.set(StatusWord::FAULT, self.fault != 0);
                word.set(StatusWord::REMOTE, !self.local);
                word.bits()
            }
            // What turns at less than a tenth is shown as turning.
            at::OUTPUT => u16::try_from(output.unsigned_abs().div_ceil(10)).unwrap_or(u16::MAX),
            at::FAULT => self.fault,
            at::CURRENT => u16::try_from(self.motor.current()).unwrap_or(u16::MAX),
            _ => return None,
        })
    }
}

impl Default for Machine {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Machine {
    fn rules(&self) -> &Rules {
        &RULES
    }

    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let kept = self.bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let before = self.control();
        self.bank.write(address, value, !self.motor.is_fed())?;
        let control = self.control();
        if !control.contains(ControlWord::RUN) {
            self.locked = false;
        }
        if control.contains(ControlWord::RESET) && !before.contains(ControlWord::RESET) {
            self.fault = 0;
        }
        self.steer();
        Ok(())
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        Ok(self.bank.check(address, value, !self.motor.is_fed())?)
    }

    fn advance(&mut self, elapsed: Duration) {
        self.motor.advance(elapsed);
        match self.motor.output_frequency() {
            0 => {}
            output => self.reverse = output < 0,
        }
    }

    fn power(&mut self, on: bool) {
        self.powered = on;
        self.motor.freewheel();
        if on {
            self.bank.power_cycle();
            (self.fault, self.locked, self.panel_runs) = (0, false, false);
            self.local = self.local_at_power_up;
            self.steer();
        }
    }

    fn trip(&mut self, code: u16) {
        self.fault = code;
        self.panel_runs = false;
        self.lock();
        self.steer();
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => self.local = true,
            Panel::ReleaseControl => {
                (self.local, self.panel_runs) = (false, false);
                self.lock();
            }
            Panel::Stop => {
                self.panel_runs = false;
                self.lock();
            }
            Panel::Run => self.panel_runs = self.local && self.fault == 0,
            Panel::Reset => self.fault = 0,
            Panel::Reference(frequency) => self.panel_reference = frequency,
        }
        self.steer();
    }

    fn world(&mut self, act: Act) {
        if let Act::MotorSupply(on) = act {
            self.supplied = on;
            self.panel_runs &= on;
            self.lock();
            self.steer();
        }
    }

    fn observe(&self) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: if self.ordered().is_some() { self.target() } else { 0 },
            current: self.motor.current(),
            trip: (self.fault != 0).then_some(self.fault),
            local: self.local,
            eeprom_writes: self.bank.eeprom_writes(),
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        // What it measures is nobody's to set.
        if self.bank.row(address).is_none_or(|row| row.access == Access::Read) {
            return false;
        }
        let kept = if address == at::RAMP {
            self.bank.set_for_good(address, value)
        } else {
            self.bank.set(address, value)
        };
        self.steer();
        kept
    }
}
