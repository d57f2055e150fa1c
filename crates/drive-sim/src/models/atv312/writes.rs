//! What a write does beyond being kept.

use std::time::Duration;

use drive_atv312::{registers::address::*, words::ExtendedControl};
use drive_core::registers::{Access, Storage};

use super::{Atv312, BLF, USF, factory, interlocks, settings};
use crate::Exception;

/// How long the EEPROM is busy with a save. Not printed.
const SAVING: Duration = Duration::from_millis(500);
/// Bit 3 of the control word, enable operation.
const ENABLE_OPERATION: u16 = 0x0008;

impl Atv312 {
    /// Writes a word at the drive's own address.
    pub(super) fn write_word(&mut self, address: u16, value: u16) -> Result<(), Exception> {
        let parameter = self.bank.row(address).is_some_and(|row| row.storage != Storage::Volatile);
        if parameter && self.saving.is_some() {
            return Err(Exception::FAILURE);
        }
        let stopped = !self.drive.motor().is_fed();
        self.bank.check(address, value, stopped)?;
        let value = interlocks::check(&self.bank, address, value)?;
        self.bank.write(address, value, stopped)?;
        self.act(address, value);
        Ok(())
    }

    fn command(&mut self, word: u16) {
        self.bank.set(CMD, word);
        self.commanded = true;
        let commander = self.routing().commander();
        self.drive.handed_over_by_word(commander);
        self.refresh();
        let locked = self.cmi().intersects(ExtendedControl::LOCK | ExtendedControl::NO_CONSISTENCY_CHECK);
        // Locked on standstill: the power stage is not enabled (p. 20).
        let stands = !self.drive.motor().is_fed();
        let obeyed = if locked && stands { word & !ENABLE_OPERATION } else { word };
        self.drive.command(obeyed);
        // A brake that was assigned and never set does not let go (p. 47).
        let brake = self.bank.value(BLC) != 0 && self.bank.value(BEN) == u16::MAX;
        if brake && self.drive.motor().is_fed() {
            self.trip_by(BLF, false);
        }
    }

    fn extended_command(&mut self, word: u16) {
        let mut bits = ExtendedControl::from_bits_retain(word);
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
        self.refresh();
    }

    /// What is left as it is stands on p. 20, 55 and 56.
    fn return_to_factory(&mut self) {
        self.bank
            .restore_factory(|row| row.storage != Storage::Volatile && !factory::KEPT.contains(&row.address));
        interlocks::follow_wiring(&mut self.bank);
        self.drive.configuration_written();
    }

    fn act(&mut self, address: u16, value: u16) {
        match address {
            CMD | CMDD => return self.command(value),
            CMI => return self.extended_command(value),
            LFR => self.bus_reference = settings::frequency(value, self.cmi()),
            LFRD => self.bus_reference = settings::frequency_of_speed(value, self.cmi()),
            RPR if value == 2 => {
                self.bank.set(address, 0);
                self.time_base = self.drive.motor().fed_for();
            }
            RP if value == 1 => {
                self.bank.set(address, 0);
                self.drive.reset();
            }
            SCS if value == 2 => {
                self.bank.set(address, 0);
                self.backup = self.bank.clone();
            }
            FCS if value == 2 => {
                self.bank.set(address, 0);
                interlocks::restore(&mut self.bank, &self.backup);
            }
            FCS if value == 64 => {
                self.bank.set(address, 0);
                self.return_to_factory();
            }
            CFG => {
                self.return_to_factory();
                self.bank.set(address, value);
                interlocks::choose_configuration(&mut self.bank);
            }
            _ => interlocks::follow(&mut self.bank, address),
        }
        let locks = self.bank.row(address).is_some_and(|row| row.access == Access::WriteStopped);
        self.refresh();
        if locks {
            self.drive.configuration_written();
        }
    }
}
