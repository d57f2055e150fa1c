//! A simulated Omron 3G3EV (3G3EV MODBUS, sections in brackets).
//!
//! What the manual leaves open is chosen here, and any drive of the field may differ:
//! - reserved registers answer 0 ([`Drive3g3ev::refusing_reserved`]: exception 02), and 0 is in the word of inputs and
//!   in every parameter that the manual does not name;
//! - n06 to n08 hold 1, 2 and 3; what the inputs do is said by the switches of the same names, or by
//!   [`Drive3g3ev::with_fault_reset_function`], which says what number resets faults;
//! - 100 % is 60 Hz, both ramps are n20, measured to 60 Hz, n53 counts 0.1 Hz;
//! - a fault cuts the output and the motor coasts; afterwards, and after the STOP key, a run command acts again when it
//!   was 0 once;
//! - RUN stands as long as the output feeds the motor;
//! - bit 7 of 0020h is always 1, as in the only sample (§4.2.2).

mod control;
mod set_up;
mod switches;
#[cfg(test)]
mod tests;
mod words;

use std::time::Duration;

use drive_3g3ev::{
    FAULTS, ROWS, TIME_OVER,
    registers::address as at,
    words::{Errors, LinkError},
};

use self::{
    control::TERMINALS,
    set_up::SetUp,
    switches::{Readings, SWITCHES},
};
use crate::{
    Act, Bank, Cast, Damage, Exception, Model, Motor, Nameplate, Observation, Panel, Refusal, Rules,
    Surroundings, Watchdog,
};

/// What is around it.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "3g3ev",
    terminals: TERMINALS,
    analog_inputs: &[],
    switches: SWITCHES,
    trips: FAULTS,
    rows: ROWS,
};

/// Value outside its range (§4.4).
const OUT_OF_RANGE: Exception = Exception(0x21);
/// A constant written during run or undervoltage, or one that can only be read (§4.4).
const NOT_WRITABLE_NOW: Exception = Exception(0x22);

/// 100 % of the reference, in hundredths of a hertz.
const MAX_FREQUENCY: u32 = 6_000;
/// Words of a broadcast reference at 100 % (§5.1).
const BROADCAST_FULL: u32 = 30_000;
/// Nominal current in tenths of an ampere.
const NOMINAL_CURRENT: u32 = 30;
/// Settings that the manual does not print, and that have to differ from 0.
const FACTORY: &[(u16, u16)] = &[(at::N06, 1), (at::N07, 2), (at::N08, 3), (at::N20, 30), (at::N53, 15)];
/// The registers that §5.2 calls reserved.
const RESERVED: &[std::ops::RangeInclusive<u16>] =
    &[0x25..=0x26, 0x29..=0x2A, 0x2E..=0x30, 0x32..=0x3C, 0x3E..=0xFF];

/// A simulated 3G3EV.
#[derive(Debug, Clone)]
pub struct Drive3g3ev {
    bank: Bank,
    motor: Motor,
    watchdog: Watchdog,
    rules: Rules,
    readings: Readings,
    /// The parameters of §2.1 as they were at power-up.
    set_up: SetUp,
    errors: Errors,
    link_errors: LinkError,
    /// A written value was outside its range (0022h bit 3).
    limit_exceeded: bool,
    /// The run command acts again when it was 0 once.
    locked: bool,
    /// The panel has control.
    local: bool,
    console_runs: bool,
    /// In hundredths of a hertz.
    console_reference: u32,
    terminals: u16,
    /// The inputs of n06 to n08 as they were looked at last.
    inputs_before: [bool; 3],
    /// The control has a supply, and the motor has one.
    powered: bool,
    supplied: bool,
    fault_reset: Option<u16>,
    refuses_reserved: bool,
}

impl Drive3g3ev {
    /// A drive from the factory, with a light motor of its own size.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in FACTORY {
            bank.set_factory(address, value);
        }
        let set_up = SetUp::of(&bank);
        Self {
            bank,
            motor: Motor::new(Nameplate {
                nominal_frequency: MAX_FREQUENCY,
                ..Nameplate::light(NOMINAL_CURRENT)
            }),
            watchdog: Watchdog::new(set_up.detects_time_over.then_some(TIME_OVER)),
            rules: set_up.rules(),
            readings: Readings::default(),
            set_up,
            errors: Errors::empty(),
            link_errors: LinkError::empty(),
            limit_exceeded: false,
            locked: false,
            local: false,
            console_runs: false,
            console_reference: 0,
            terminals: 0,
            inputs_before: [false; 3],
            powered: true,
            supplied: true,
            fault_reset: None,
            refuses_reserved: false,
        }
    }

    /// This drive with a number that stands for "fault reset" in n06 to n08.
    #[must_use]
    pub fn with_fault_reset_function(self, number: u16) -> Self {
        Self { fault_reset: Some(number), ..self }
    }

    /// This drive, answering exception 02 to a read of a reserved register.
    #[must_use]
    pub fn refusing_reserved(self) -> Self {
        Self { refuses_reserved: true, ..self }
    }

    /// Whether the drive would take this word.
    fn check(&self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        if cast == Cast::Broadcast {
            return if address <= at::REFERENCE { Ok(()) } else { Err(Exception::ILLEGAL_ADDRESS) };
        }
        let constant = self.bank.row(address).is_some_and(|row| set_up::is_parameter(row.address));
        if constant && self.errors.intersects(Errors::UV1 | Errors::UV2) {
            return Err(NOT_WRITABLE_NOW);
        }
        self.bank.check(address, value, !self.motor.is_fed()).map_err(|refusal| match refusal {
            Refusal::Unknown => Exception::ILLEGAL_ADDRESS,
            Refusal::ReadOnly | Refusal::Running => NOT_WRITABLE_NOW,
            Refusal::Range => OUT_OF_RANGE,
        })?;
        let too_fast = address == at::REFERENCE && self.set_up.frequency(value) > MAX_FREQUENCY;
        if too_fast { Err(OUT_OF_RANGE) } else { Ok(()) }
    }

    fn is_reserved(address: u16) -> bool {
        RESERVED.iter().any(|range| range.contains(&address))
    }
}

impl Default for Drive3g3ev {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Drive3g3ev {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &self.rules
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        if Self::is_reserved(address) {
            return if self.refuses_reserved { Err(Exception::ILLEGAL_ADDRESS) } else { Ok(0) };
        }
        let kept = self.bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        let checked = self.check(address, value, cast);
        self.limit_exceeded = checked == Err(OUT_OF_RANGE);
        checked?;
        match (cast, address) {
            (Cast::Broadcast, at::COMMAND) => self.obey_broadcast(value),
            (Cast::Broadcast, at::REFERENCE) => {
                let frequency = u32::from(value) * MAX_FREQUENCY / BROADCAST_FULL;
                self.bank.set(address, self.set_up.word(frequency.min(MAX_FREQUENCY)));
            }
            // 0000h is allowed to a broadcast (§4.4) and described nowhere.
            (Cast::Broadcast, _) => {}
            (Cast::Unicast, at::ENTER) => self.bank.save(),
            (Cast::Unicast, _) => {
                self.bank.set(address, value);
                self.look_at_inputs();
            }
        }
        self.steer();
        Ok(())
    }

    fn check_word(&self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        self.check(address, value, cast)
    }

    fn advance(&mut self, elapsed: Duration) {
        let mut left = elapsed;
        while !left.is_zero() {
            let remaining = self.watchdog.remaining().filter(|_| self.powered);
            let piece = remaining.map_or(left, |remaining| remaining.min(left));
            self.motor.advance(piece);
            if self.powered && self.watchdog.advance(piece) {
                self.link_errors |= LinkError::TIME_OVER;
                self.fault(Errors::BUS);
            }
            left -= piece;
        }
    }

    fn power(&mut self, on: bool) {
        self.powered = on;
        self.motor.freewheel();
        if !on {
            return;
        }
        self.bank.power_cycle();
        self.set_up = SetUp::of(&self.bank);
        self.rules = self.set_up.rules();
        self.watchdog = Watchdog::new(self.set_up.detects_time_over.then_some(TIME_OVER));
        self.errors = Errors::empty();
        self.link_errors = LinkError::empty();
        (self.limit_exceeded, self.locked, self.local, self.console_runs) = (false, false, false, false);
        self.supply(self.supplied);
        self.look_at_inputs();
        self.steer();
    }

    /// The code is the number of the bit of 0021h, 0 to 15.
    fn trip(&mut self, code: u16) {
        let bit = 1_u16.checked_shl(u32::from(code)).unwrap_or(0);
        if bit != 0 {
            self.fault(Errors::from_bits_retain(bit));
        }
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        self.console(action);
        self.steer();
    }

    fn world(&mut self, act: Act) {
        match act {
            Act::Terminal(name, closed) => {
                let bit = TERMINALS.iter().position(|terminal| *terminal == name).unwrap_or(0);
                self.terminals =
                    if closed { self.terminals | 1 << bit } else { self.terminals & !(1 << bit) };
            }
            // It has no analog input that its manual names.
            Act::Analog(..) => {}
            Act::MotorSupply(on) => self.supply(on),
            Act::Reading(name, reading) => self.readings.choose(name, reading),
        }
        self.look_at_inputs();
        self.steer();
    }

    fn observe(&self) -> Observation {
        let trip = (!self.errors.is_empty()).then(|| self.errors.bits().trailing_zeros() as u16);
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: if self.runs() { self.target() } else { 0 },
            current: self.motor.current(),
            trip,
            local: self.is_local(),
            eeprom_writes: self.bank.eeprom_writes(),
        }
    }

    fn frame_seen(&mut self, _: Cast) {
        self.watchdog.feed();
        if self.readings.good_frame_clears {
            self.link_errors = LinkError::empty();
        }
    }

    /// 003Dh (§5.2).
    fn frame_damaged(&mut self, damage: Damage) {
        self.link_errors |= match damage {
            Damage::Check => LinkError::CRC,
            Damage::Length => LinkError::LENGTH,
        };
    }

    fn pause(&self) -> Duration {
        self.set_up.pause()
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    /// A parameter is set as on the keypad, for good. Those of §2.1 act at the next power-up.
    fn poke(&mut self, address: u16, value: u16) -> bool {
        if self.computed(address).is_some() {
            return false;
        }
        let kept = if set_up::is_parameter(address) {
            self.bank.set_for_good(address, value)
        } else {
            self.bank.set(address, value)
        };
        self.look_at_inputs();
        self.steer();
        kept
    }
}
