//! The drive as a line asks it.

use std::time::Duration;

use drive_core::registers::Place;
use drive_sim::{Act, Cast, Exception, Model, Observation, Panel, Rules, Surroundings};

use super::{
    Machine, NO_CODE,
    bits::{self, Places},
};
use crate::{
    format::{Access, Space},
    written::Written,
};

impl Places for Machine {
    fn has_function(&self, function: u8) -> bool {
        self.profile.capabilities().functions.contains(&function)
    }

    fn most_bits(&self) -> (u16, u16) {
        let link = self.profile.file().link.get_ref();
        let most = |limit: &crate::format::Answer<u16>| limit.given().copied().unwrap_or(1);
        (most(&link.read_coils), most(&link.write_coils))
    }

    fn most_words(&self) -> u16 {
        self.profile.capabilities().read_words
    }

    fn most_written(&self) -> u16 {
        self.profile.capabilities().write_words
    }

    fn read_at(&self, place: (Space, u16)) -> Result<u16, Exception> {
        let readable = self.register(place).is_some_and(|register| register.access != Access::Write);
        if readable {
            Ok(self.shown().get(&place).copied().unwrap_or(0))
        } else {
            Err(Exception::ILLEGAL_ADDRESS)
        }
    }

    fn takes(&self, place: (Space, u16)) -> Result<(), Exception> {
        match self.register(place).map(|register| register.access) {
            None | Some(Access::Read) => Err(Exception::ILLEGAL_ADDRESS),
            Some(Access::WriteStopped) if self.motor.is_fed() => Err(Exception::FAILURE),
            Some(_) => Ok(()),
        }
    }

    fn write_at(&mut self, written: Written) -> Result<(), Exception> {
        self.takes((written.space, written.address))?;
        self.kept.insert((written.space, written.address), written.value);
        self.obey(written);
        self.steer();
        Ok(())
    }
}

impl Model for Machine {
    fn rules(&self) -> &Rules {
        &self.rules
    }

    fn surroundings(&self) -> &'static Surroundings {
        self.surroundings
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        self.read_at((Space::HoldingRegister, address))
    }

    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        self.check_word(address, value, cast)?;
        self.write_at(Written { space: Space::HoldingRegister, address, value })
    }

    fn check_word(&self, address: u16, _: u16, _: Cast) -> Result<(), Exception> {
        self.takes((Space::HoldingRegister, address))
    }

    /// Coils, inputs, and the registers that only read: the functions beside those of holding registers.
    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        bits::answer(self, request)
    }

    fn advance(&mut self, elapsed: Duration) {
        self.motor.advance(elapsed);
    }

    fn power(&mut self, on: bool) {
        self.powered = on;
        self.motor.freewheel();
        if on {
            self.kept.clear();
            (self.order, self.fault, self.panel_runs) = (None, None, false);
            self.steer();
        }
    }

    fn trip(&mut self, code: u16) {
        let tells = self.profile.file().faults.present.given().is_some();
        self.fault = Some(if tells { code } else { NO_CODE });
        (self.order, self.panel_runs) = (None, false);
        self.steer();
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => (self.local, self.order) = (true, None),
            Panel::ReleaseControl => (self.local, self.panel_runs, self.order) = (false, false, None),
            Panel::Stop => (self.panel_runs, self.order) = (false, None),
            Panel::Run => self.panel_runs = self.local && self.fault.is_none(),
            Panel::Reset => self.fault = None,
            Panel::Reference(frequency) => self.panel_reference = frequency,
        }
        self.steer();
    }

    fn world(&mut self, act: Act) {
        if let Act::MotorSupply(on) = act {
            (self.supplied, self.order) = (on, None);
            self.panel_runs &= on;
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
            trip: self.fault,
            local: self.local,
            eeprom_writes: 0,
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.peek_at(address.into())
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        self.poke_at(address.into(), value)
    }

    fn peek_at(&self, Place { space, address }: Place) -> Option<u16> {
        self.register((space, address))?;
        Some(self.shown().get(&(space, address)).copied().unwrap_or(0))
    }

    /// What is only read is what something beside the drive makes it, an input or a temperature, unless the twin itself says what stands there.
    fn poke_at(&mut self, Place { space, address }: Place, value: u16) -> bool {
        let place = (space, address);
        let Some(access) = self.register(place).map(|register| register.access) else { return false };
        if space.is_bit() && value > 1 {
            return false;
        }
        let before = self.kept.insert(place, value);
        if access == Access::Read && self.shown().get(&place) != Some(&value) {
            match before {
                Some(before) => self.kept.insert(place, before),
                None => self.kept.remove(&place),
            };
            return false;
        }
        self.steer();
        true
    }
}
