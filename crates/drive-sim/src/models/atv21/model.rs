//! The simulated Altivar 21 as a slave and its world see it.

use std::time::Duration;

use drive_atv21::{blocks, registers::address as at};
use drive_core::registers::Storage;

use super::{Atv21, MAXIMUM_FREQUENCY, POWER_UP, RULES, SURROUNDINGS, monitor};
use crate::{
    Act, Block, Cast, Exception, Model, Observation, Panel, Protocol, Rules, Surroundings, identification,
};

/// The words that show what is at the terminals, with or without supply.
const AT_THE_TERMINALS: [u16; 3] = [at::LOGIC_INPUTS, at::ANALOG_INPUT_VIA, at::ANALOG_INPUT_VIB];

impl Model for Atv21 {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &RULES
    }

    fn check_read(&self, block: Block) -> Result<(), Exception> {
        let in_block = (blocks::READ_BLOCK..blocks::READ_BLOCK + 5).contains(&block.first);
        match block.quantity {
            1 if in_block => Err(Exception::ILLEGAL_ADDRESS),
            1 => Ok(()),
            _ if block.first == blocks::READ_BLOCK => Ok(()),
            _ => Err(Exception::ILLEGAL_VALUE),
        }
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let place = address.checked_sub(blocks::READ_BLOCK).map(usize::from);
        if let Some(&slot) = place.and_then(|place| self.read_slots.get(place)) {
            return Ok(monitor::in_slot(slot).map_or(0, |address| self.value(address)));
        }
        self.bank.read(address)?;
        Ok(self.value(address))
    }

    fn check_write(&self, block: Block, values: &[u16], _: Cast) -> Result<(), Exception> {
        let in_block = (blocks::WRITE_BLOCK..blocks::WRITE_BLOCK + 2).contains(&block.first);
        match block.quantity {
            1 if in_block => Err(Exception::ILLEGAL_ADDRESS),
            1 => Ok(()),
            2 if block.first == blocks::WRITE_BLOCK && values.len() == 2 => match self.write_slots {
                [0, _] => Err(Exception::FAILURE),
                _ => Ok(()),
            },
            _ => Err(Exception::ILLEGAL_VALUE),
        }
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let Some(address) = self.target_of(address) else { return Ok(()) };
        self.bank.check(address, value, !self.motor.is_fed())?;
        let too_fast = address == at::FREQUENCY_REFERENCE && value > MAXIMUM_FREQUENCY;
        if too_fast { Err(Exception::ILLEGAL_VALUE) } else { Ok(()) }
    }

    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        self.check_word(address, value, cast)?;
        self.target_of(address).map_or(Ok(()), |address| self.take(address, value))
    }

    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        match *request {
            [0x2B, 0x0E, code @ 1..=3, 0x00] => {
                Ok(identification(code, 0x01, &["Telemecanique", self.reference, "0201"]))
            }
            [0x2B, 0x0E, ..] => Err(Exception::ILLEGAL_VALUE),
            _ => Err(Exception::ILLEGAL_FUNCTION),
        }
    }

    fn frame_seen(&mut self, cast: Cast) {
        if cast == Cast::Unicast {
            self.watchdog.feed();
        }
    }

    fn join(&mut self, address: u8, _: Protocol) {
        self.bank.set_factory(at::ADDRESS, address.into());
    }

    /// F802 acts at once (§6.1 p. 11).
    fn own_address(&self) -> Option<u8> {
        u8::try_from(self.bank.value(at::ADDRESS)).ok()
    }

    fn listens(&self) -> bool {
        self.starting.is_zero()
    }

    fn advance(&mut self, elapsed: Duration) {
        let mut left = elapsed;
        while !left.is_zero() {
            if !self.powered {
                return self.motor.advance(left);
            }
            let piece = self.until_change().map_or(left, |change| change.min(left));
            self.step(piece);
            left = left.saturating_sub(piece);
        }
    }

    fn power(&mut self, on: bool) {
        self.powered = on;
        self.motor.freewheel();
        if on {
            let terminals = AT_THE_TERMINALS.map(|address| (address, self.bank.value(address)));
            self.bank.power_cycle();
            for (address, value) in terminals {
                self.bank.set(address, value);
            }
            self.pinned.clear();
            (self.local, self.forced_run) = (false, false);
            self.start_up(POWER_UP);
            self.look_at_inputs();
        }
    }

    fn trip(&mut self, code: u16) {
        self.trip_with(code);
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        self.keypad(action);
        self.follow();
    }

    fn world(&mut self, act: Act) {
        match act {
            Act::Terminal(name, closed) => self.terminal(name, closed),
            Act::Analog(name, level) => self.analog(name, level),
            Act::MotorSupply(on) => self.supply(on),
            Act::Reading(name, reading) => self.readings.choose(name, reading),
        }
        self.follow();
    }

    fn observe(&self) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: self.target(),
            current: self.motor.current(),
            trip: self.trip,
            local: self.local || self.is_forced_local() || self.forced_run,
            eeprom_writes: self.bank.eeprom_writes(),
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|_| self.value(address))
    }

    /// A monitored word that the drive computes keeps showing what is set here until the next power cycle.
    fn poke(&mut self, address: u16, value: u16) -> bool {
        if self.computed(address).is_some() {
            self.pinned.insert(address, value);
            return true;
        }
        let kept = self.bank.row(address).is_some_and(|row| row.storage == Storage::Eeprom);
        let found = if kept { self.bank.set_for_good(address, value) } else { self.bank.set(address, value) };
        self.set_time_out();
        self.follow();
        found
    }
}
