//! A simulated Altivar 312 (BBV52816 04/2009 for the line, BBV51701 06/2009 for the registers; "p." is the latter's).
//!
//! Where the manuals are silent it does this: a refused value is answered by exception 03 and a write that must wait (motor
//! running, EEPROM busy) by 04; a register that the manual does not list by 02, also inside a block; of `LFr` and `LFRD` the
//! last written counts; `DP1` is the newest past fault; saving takes half a second; 0007h stops as `Stt` says. Left out are
//! the automatic standstill injection, the PI regulator, the analog inputs, and the thermal trips.

mod aliases;
mod factory;
mod interlocks;
mod monitor;
mod settings;

use std::time::Duration;

use drive_atv312::{FAULTS, ROWS, words::ExtendedControl};
use drive_core::registers::{Access, Storage};

use super::drivecom::{Drivecom, Reaction};
use crate::{
    Bank, Cast, Exception, Model, Nameplate, Observation, Panel, Rules, Surroundings, identification,
};

/// What is around it.
const SURROUNDINGS: Surroundings =
    Surroundings { family: "atv312", trips: FAULTS, rows: ROWS, ..Surroundings::NONE };

const RULES: Rules = Rules {
    read_holding: 29,
    read_input: 0,
    write_single: true,
    write_multiple: 27,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::from_millis(5),
};

/// How long the EEPROM is busy with a save. Not printed.
const SAVING: Duration = Duration::from_millis(500);
/// Line undervoltage: the one fault with which nothing is saved.
const USF: u16 = 22;
/// External fault.
const EPF: u16 = 8;
/// Brake control fault.
const BLF: u16 = 35;

const CMD: u16 = 8501;
const LFR: u16 = 8502;
const PISP: u16 = 8503;
const CMI: u16 = 8504;
const LFRD: u16 = 8602;

/// A simulated Altivar 312, an ATV312HU15N4.
#[derive(Debug, Clone)]
pub struct Atv312 {
    bank: Bank,
    /// The configuration that `SCS` put aside.
    backup: Bank,
    drive: Drivecom,
    reference: String,
    version: String,
    /// Whether the bus has given a command since power-up; at L1 and L2 the terminals have control until then.
    commanded: bool,
    /// The bus reference in hundredths of a hertz, signed.
    bus_reference: i32,
    /// Until the EEPROM has taken the parameters.
    saving: Option<Duration>,
    hottest: u16,
    /// What `rPr` put the operating time back by.
    time_base: Duration,
}

impl Atv312 {
    /// A drive as it leaves the factory: access level L1, commanded by its terminals until the bus gives a command.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in factory::NUMBERS {
            bank.set_factory(address, value);
        }
        let plate = Nameplate::light(u32::from(factory::NOMINAL_CURRENT));
        let drive = Drivecom::new(plate, settings::settings(&bank, false, 0));
        Self {
            backup: bank.clone(),
            bank,
            drive,
            reference: "ATV312HU15N4".to_owned(),
            version: "0102".to_owned(),
            commanded: false,
            bus_reference: 0,
            saving: None,
            hottest: 0,
            time_base: Duration::ZERO,
        }
    }

    /// A drive as it is set up for command by the bus: access level L3, command and reference by Modbus, and the fast
    /// stop and the DC injection on the bits 14 and 13 of the control word; all of it saved.
    #[must_use]
    pub fn under_bus_control() -> Self {
        let mut drive = Self::new();
        for &(address, value) in factory::SET_UP_FOR_THE_BUS {
            drive.bank.set(address, value);
        }
        drive.bank.save();
        drive.power_cycle();
        drive
    }

    /// The same drive with the reference and the version that function 43 answers.
    #[must_use]
    pub fn identified_as(mut self, reference: &str, version: &str) -> Self {
        (self.reference, self.version) = (reference.to_owned(), version.to_owned());
        self
    }

    fn cmi(&self) -> ExtendedControl {
        ExtendedControl::from_bits_retain(self.bank.value(CMI))
    }

    /// Parameters or the control word have changed what acts on chart and motor.
    fn take_settings(&mut self) {
        let word = self.bank.value(CMD);
        self.drive.set_settings(settings::settings(&self.bank, self.commanded, word));
        self.drive.reference(settings::preset(&self.bank, word).unwrap_or(self.bus_reference));
    }

    fn command(&mut self, before: u16, word: u16) {
        self.bank.set(CMD, word);
        self.commanded = true;
        self.take_settings();
        let locked = self.cmi().intersects(ExtendedControl::LOCK | ExtendedControl::NO_CONSISTENCY_CHECK);
        // Locked on standstill: the power stage is not enabled (p. 20).
        let obeyed = if locked && !self.drive.motor().is_fed() { word & !0x0008 } else { word };
        self.drive.command(obeyed);
        if settings::external_fault(&self.bank, word) && !settings::external_fault(&self.bank, before) {
            self.trip(EPF);
        }
        // A brake that was assigned and never set does not let go (p. 47).
        let brake = self.bank.value(10001) != 0 && self.bank.value(10003) == u16::MAX;
        if brake && self.drive.motor().is_fed() {
            self.trip(BLF);
        }
    }

    fn extended_command(&mut self, before: u16, word: u16) {
        let before = ExtendedControl::from_bits_retain(before);
        let mut bits = ExtendedControl::from_bits_retain(word);
        let rises = |bit| bits.contains(bit) && !before.contains(bit);
        let external_fault = rises(ExtendedControl::EXTERNAL_FAULT);
        if bits.contains(ExtendedControl::FACTORY_SETTINGS) && !self.drive.motor().is_fed() {
            bits -= ExtendedControl::FACTORY_SETTINGS;
            self.return_to_factory();
        }
        if bits.contains(ExtendedControl::SAVE) && self.drive.present_fault() != Some(USF) {
            bits -= ExtendedControl::SAVE;
            self.saving.get_or_insert(SAVING);
        }
        self.bank.set(CMI, bits.bits());
        self.drive.set_no_timeout(bits.contains(ExtendedControl::NO_TIMEOUT));
        self.take_settings();
        if external_fault {
            self.trip(EPF);
        }
    }

    /// What is left as it is stands on p. 20, 55 and 56.
    fn return_to_factory(&mut self) {
        self.bank
            .restore_factory(|row| row.storage != Storage::Volatile && !factory::KEPT.contains(&row.address));
        interlocks::follow_wiring(&mut self.bank);
        self.drive.configuration_written();
    }

    /// What a write does beyond being kept; `before` is what the register held.
    fn act(&mut self, address: u16, before: u16, value: u16) {
        match address {
            8501 | 8601 => return self.command(before, value),
            8504 => return self.extended_command(before, value),
            8502 => self.bus_reference = settings::frequency(value, self.cmi()),
            8602 => self.bus_reference = settings::frequency_of_speed(value, self.cmi()),
            3120 => {
                self.bank.set(address, 0);
                self.time_base = self.drive.motor().fed_for();
            }
            7128 if value == 1 => {
                self.bank.set(address, 0);
                self.drive.reset();
            }
            8001 if value == 2 => {
                self.bank.set(address, 0);
                self.backup = self.bank.clone();
            }
            8002 if value == 2 => {
                self.bank.set(address, 0);
                interlocks::restore(&mut self.bank, &self.backup);
            }
            8002 if value == 64 => {
                self.bank.set(address, 0);
                self.return_to_factory();
            }
            3052 => {
                self.return_to_factory();
                self.bank.set(address, value);
                interlocks::choose_configuration(&mut self.bank);
            }
            _ => interlocks::follow(&mut self.bank, address),
        }
        let locks = self.bank.row(address).is_some_and(|row| row.access == Access::WriteStopped);
        self.take_settings();
        if locks {
            self.drive.configuration_written();
        }
    }
}

impl Atv312 {
    /// What the drive would make of this word, if it takes it.
    fn check(&self, address: u16, value: u16) -> Result<u16, Exception> {
        let parameter = self.bank.row(address).is_some_and(|row| row.storage != Storage::Volatile);
        if parameter && self.saving.is_some() {
            return Err(Exception::FAILURE);
        }
        self.bank.check(address, value, !self.drive.motor().is_fed())?;
        interlocks::check(&self.bank, address, value)
    }
}

impl Default for Atv312 {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Atv312 {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let address = aliases::resolve(address);
        let kept = self.bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        self.check(aliases::resolve(address), value).map(|_| ())
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let address = aliases::resolve(address);
        let value = self.check(address, value)?;
        let before = self.peek(address).unwrap_or(0);
        self.bank.write(address, value, !self.drive.motor().is_fed())?;
        self.act(address, before, value);
        Ok(())
    }

    fn advance(&mut self, elapsed: Duration) {
        self.drive.advance(elapsed);
        self.hottest = self.hottest.max(self.drive.motor().thermal_state());
        if let Some(left) = self.saving {
            self.saving = left.checked_sub(elapsed).filter(|left| !left.is_zero());
            if self.saving.is_none() {
                self.bank.save();
            }
        }
    }

    fn power(&mut self, on: bool) {
        if !on {
            return self.drive.power(false);
        }
        self.bank.power_cycle();
        (self.commanded, self.bus_reference, self.saving, self.hottest) = (false, 0, None, 0);
        self.take_settings();
        self.drive.power(true);
    }

    fn trip(&mut self, code: u16) {
        let reaction = match code {
            8 => settings::reaction(self.bank.value(7006)),
            16 => settings::reaction(self.bank.value(7008)),
            17 => settings::reaction(self.bank.value(7009)),
            5 => settings::reaction(self.bank.value(7010)),
            34 => settings::reaction(self.bank.value(7011)),
            _ => Reaction::Freewheel,
        };
        self.drive.trip(code, reaction, false);
    }

    fn set_load(&mut self, percent: u16) {
        self.drive.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        // The STOP key has priority over every channel as long as PSt says so (p. 38).
        if action != Panel::Stop || self.bank.value(64002) == 1 {
            self.drive.panel(action);
        }
    }

    fn observe(&self) -> Observation {
        self.drive.observe(self.bank.eeprom_writes())
    }

    /// Function 43 and, for everything else, exception 01. A refused identification has a form of its own, with the MEI
    /// type before the code (BBV52816 p. 14).
    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        match *request {
            [0x2B, 0x0E, 0x01, 0x00] => {
                Ok(identification(0x01, 0x02, &["TELEMECANIQUE", &self.reference, &self.version]))
            }
            [0x2B, 0x0E, 0x01, _] => Ok(vec![0xAB, 0x0E, 0x02]),
            [0x2B, ..] => Ok(vec![0xAB, 0x0E, 0x01]),
            _ => Err(Exception::ILLEGAL_FUNCTION),
        }
    }

    fn frame_seen(&mut self, _: Cast) {
        self.drive.frame_seen();
    }

    fn peek(&self, address: u16) -> Option<u16> {
        let address = aliases::resolve(address);
        self.bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        let address = aliases::resolve(address);
        let kept = (address == 5240 || self.computed(address).is_none()) && self.bank.set(address, value);
        if kept {
            self.take_settings();
        }
        kept
    }
}

#[cfg(test)]
mod tests;
