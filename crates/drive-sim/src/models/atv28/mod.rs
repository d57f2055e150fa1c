//! A simulated Altivar 28 (VVDED399092; BBV51701 p. 57 and the pages of the twins on the Altivar 312).
//!
//! It behaves as the Altivar 312 does at access level L1, which is "interchangeable with ATV28" (p. 35): at power-up the
//! terminals command and the drive is in "operation enabled". Where the documents are silent it does the least: `CMI`
//! is a word without effect, `ETI2` and W452 read 0, no silence of the line trips it, and each parameter that is written
//! goes to EEPROM at once. The inputs have the twin's factory functions; a standing current, a restart and a summing input
//! that cannot be set over its bus are left out.

mod parameters;

use std::time::Duration;

use drive_atv28::{FAULTS, ROWS, registers::address::*};
use drive_core::registers::Access;

use self::parameters::settings;
use super::drivecom::{
    self, Commander, Settings, centihertz,
    family::{Family, TWO_WIRES, Unit},
    profile_code, rpm, word,
};
use crate::{Bank, Rules, world::Surroundings};

const RULES: Rules = Rules {
    read_holding: 7,
    read_input: 0,
    write_single: true,
    write_multiple: 7,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::from_millis(5),
};

/// Nominal current in tenths of an ampere: an ATV28HU18N4's order of size.
const NOMINAL_CURRENT: u16 = 37;
/// Line voltage in tenths of a volt.
const LINE_VOLTAGE: u16 = 4_000;
/// `ETI` bit 1: parameters are checked against each other.
const CONSISTENCY_CHECK: u16 = 0x0002;
/// `IOLR` bit 8: relay R1, energised without a fault.
const R1: u16 = 0x0100;

/// `IOLR` bits 0 to 5: LI1 to LI6.
const INPUTS: u16 = 0x003F;
/// Line undervoltage.
const USF: u16 = 22;

/// LI1 to LI4 with the functions that the twin has from the factory (p. 15), AI1 and AI2 likewise.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "atv28",
    terminals: &["LI1", "LI2", "LI3", "LI4"],
    analog_inputs: &["AI1", "AI2"],
    switches: &[
        drivecom::PRIORITY,
        drivecom::BUS_REFERENCE,
        drivecom::GIVEN_BACK,
        drivecom::RESET,
        drivecom::MOTOR_RUNNING,
        drivecom::DISABLE_OPERATION,
        drivecom::TERMINAL_REFERENCE,
        TWO_WIRES,
    ],
    trips: FAULTS,
    rows: ROWS,
};

/// Settings as they are when the drive leaves the factory; those of the twins, where they have one.
const FACTORY: &[(u16, u16)] = &[
    (COD, 0),
    (CRL3, 40),
    (CRH3, 200),
    (ADD, 1),
    (BFR, 0),
    (SFR, 40),
    (TFR, 600),
    (FRS, 500),
    (UNS, 400),
    (NRD, 1),
    (UFT, 2),
    (BRA, 1),
    (OPL, 1),
    (IPL, 1),
    (HSP, 500),
    (ACC, 30),
    (DEC, 30),
    (ITH, NOMINAL_CURRENT),
    (AC2, 50),
    (DE2, 50),
    (JGF, 100),
    (SP2, 100),
    (SP3, 150),
    (SP4, 200),
    (SP5, 250),
    (SP6, 300),
    (SP7, 350),
    (IDC, 26),
    (RPG, 100),
    (RIG, 100),
    (FBS, 10),
    (CTD, NOMINAL_CURRENT),
    (TTD, 100),
    (FTD, 500),
    (INV, NOMINAL_CURRENT),
    (SPAL_LOW, 1_500),
    (SPAT, 3),
    (SPDL_LOW, 1_500),
    (SPDT, 3),
];

/// A simulated Altivar 28.
#[derive(Debug, Clone)]
pub struct Atv28 {
    unit: Unit,
    /// Whether the bus commands; the terminals do until it has given a command.
    commanded: bool,
}

impl Atv28 {
    /// A drive from the factory, with a light motor of its own size.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in FACTORY {
            bank.set_factory(address, value);
        }
        let settings = settings(&bank, false);
        Self { unit: Unit::new(bank, NOMINAL_CURRENT, settings), commanded: false }
    }

    /// Whether the keys of the remote terminal command (LCC, p. 38).
    fn by_remote_terminal(&self) -> bool {
        self.unit.bank.value(LCC) == 1
    }

    /// AI1, or the preset speed that LI3 and LI4 choose (p. 15, 42), plus AI2.
    fn first_reference(&self, asked: i32) -> i32 {
        let around = &self.unit.around;
        let preset = u16::from(around.is_on(3)) + 2 * u16::from(around.is_on(4));
        if preset > 0 && !self.three_wires() {
            return i32::from(self.unit.bank.value(SP2 - 1 + preset)) * 10;
        }
        asked + around.analog(2) * i32::from(self.unit.bank.value(HSP)) / 1_000
    }
}

impl Default for Atv28 {
    fn default() -> Self {
        Self::new()
    }
}

impl Family for Atv28 {
    const RULES: Rules = RULES;
    const SURROUNDINGS: &'static Surroundings = &SURROUNDINGS;
    const SUPPLY_FAULT: Option<u16> = Some(USF);

    fn unit(&self) -> &Unit {
        &self.unit
    }

    fn unit_mut(&mut self) -> &mut Unit {
        &mut self.unit
    }

    fn computed(&self, address: u16) -> Option<u16> {
        let Unit { bank, drive, around, .. } = &self.unit;
        let motor = drive.motor();
        let fault = |index| drive.faults().nth(index).map_or(0, |fault| fault.code);
        let output = motor.output_frequency();
        let target = drive.target();
        Some(match address {
            FRH => word(target.abs() / 10),
            RFR => word(output / 10),
            LCR => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            ULN if !around.motor_supply => 0,
            ULN => LINE_VOLTAGE,
            // Heat sink and windings warm up together here.
            THR | THD => motor.thermal_state(),
            LFT => fault(0),
            ETA | ETAD => drive.eta(),
            ETI => drive.eti() | CONSISTENCY_CHECK,
            DP1 => fault(1),
            DP2 => fault(2),
            DP3 => fault(3),
            DP4 => fault(4),
            IOLR => {
                let relay = if drive.present_fault().is_none() { R1 } else { 0 };
                bank.value(IOLR) & !INPUTS | around.inputs & INPUTS | relay
            }
            OTR => word(motor.torque()),
            OPR => word(motor.power()),
            RTH => u16::try_from(motor.fed_for().as_secs() / 3_600).unwrap_or(u16::MAX),
            ERRD => profile_code(fault(0)),
            CMDD => bank.value(CMD),
            FRHD => word(rpm(target)),
            RFRD => word(rpm(output)),
            // Low and high speed once more, in rpm: two words each, the high one always 0 here.
            SMIL_LOW => word(rpm(i32::from(bank.value(LSP)) * 10)),
            SMAL_LOW => word(rpm(i32::from(bank.value(HSP)) * 10)),
            SMIL_HIGH | SMAL_HIGH => 0,
            _ => return None,
        })
    }

    fn act(&mut self, address: u16, value: u16) {
        let count = i32::from(value.cast_signed());
        match address {
            CMD | CMDD => {
                self.unit.bank.set(CMD, value);
                self.commanded = true;
                let (commander, _) = self.commander();
                self.unit.drive.handed_over_by_word(commander);
                self.refresh();
                return self.unit.drive.command(value);
            }
            LFR => self.unit.bus_reference = count * 10,
            LFRD => self.unit.bus_reference = centihertz(count),
            SMIL_LOW | SMAL_LOW => {
                let limit = if address == SMIL_LOW { LSP } else { HSP };
                self.unit.bank.set_for_good(limit, word(centihertz(i32::from(value)) / 10));
            }
            _ => {}
        }
        self.refresh();
        if self.unit.bank.row(address).is_some_and(|row| row.access == Access::WriteStopped) {
            self.unit.drive.configuration_written();
        }
    }

    fn settings(&self) -> Settings {
        settings(&self.unit.bank, self.unit.by_level)
    }

    fn commander(&self) -> (Commander, bool) {
        let forced = self.unit.around.forced_local;
        let keypad = self.unit.bank.value(TCC) == 2;
        match (self.by_remote_terminal(), self.commanded && !forced) {
            (true, _) => (Commander::RemoteTerminal, true),
            (_, true) => (Commander::Bus, false),
            (_, false) => (Commander::Terminals, keypad),
        }
    }

    fn reference(&self) -> i32 {
        let Unit { around, bus_reference, .. } = self.unit;
        let readings = self.unit.readings();
        match self.commander().0 {
            Commander::RemoteTerminal if readings.terminal_shares_reference => bus_reference,
            Commander::RemoteTerminal => around.key_reference,
            Commander::Bus if readings.bus_as_reference_1 => self.first_reference(bus_reference),
            Commander::Bus => bus_reference,
            _ if around.forced_local => self.unit.analog_reference(),
            _ => self.first_reference(self.unit.analog_reference()),
        }
    }

    /// It has none of its own.
    fn choose(&mut self, _: &str, _: &str) {}

    fn three_wires(&self) -> bool {
        self.unit.bank.value(TCC) == 1
    }

    fn key_reverses(&self) -> bool {
        self.unit.bank.value(ROT) == 1
    }

    fn powered_up(&mut self) {
        self.commanded = false;
    }

    fn run_by_terminals(&mut self) {
        if self.unit.readings().newest_commands {
            self.commanded = false;
        }
    }
}

#[cfg(test)]
mod tests;
