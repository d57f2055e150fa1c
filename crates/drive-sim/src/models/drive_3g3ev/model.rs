//! The simulated 3G3EV as a slave and its world see it.

use std::time::Duration;

use drive_3g3ev::{
    TIME_OVER,
    registers::address as at,
    words::{Errors, LinkError},
};

use super::{
    Drive3g3ev, MAX_FREQUENCY, SURROUNDINGS,
    control::TERMINALS,
    set_up::{self, SetUp},
};
use crate::{
    Act, Cast, Damage, Exception, Model, Observation, Panel, Refusal, Rules, Surroundings, Watchdog,
};

/// Value outside its range (§4.4).
const OUT_OF_RANGE: Exception = Exception(0x21);
/// A constant written during run or undervoltage, or one that can only be read (§4.4).
const NOT_WRITABLE_NOW: Exception = Exception(0x22);

/// Words of a broadcast reference at 100 % (§5.1).
const BROADCAST_FULL: u32 = 30_000;
/// The registers that §5.2 calls reserved.
const RESERVED: &[std::ops::RangeInclusive<u16>] =
    &[0x25..=0x26, 0x29..=0x2A, 0x2E..=0x30, 0x32..=0x3C, 0x3E..=0xFF];

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

impl Drive3g3ev {
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
