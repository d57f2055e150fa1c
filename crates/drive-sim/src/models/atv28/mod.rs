//! A simulated Altivar 28 (VVDED399092; BBV51701 p. 57 and the pages of the twins on the Altivar 312).
//!
//! It behaves as the Altivar 312 does at access level L1, which is "interchangeable with ATV28" (p. 35): at power-up the
//! terminals command and the drive is in "operation enabled". Where the documents are silent it does the least: `CMI`
//! is a word without effect, `ETI2` and W452 read 0, no silence of the line trips it, and each parameter that is written
//! goes to EEPROM at once.

mod parameters;

use std::time::Duration;

use drive_atv28::{
    FAULTS, ROWS,
    registers::{
        AC2, ACC, ADD, BFR, BRA, CMD, CMDD, COD, CRH3, CRL3, CTD, DE2, DEC, DP1, DP2, DP3, DP4, ERRD, ETA,
        ETAD, ETI, FBS, FRH, FRHD, FRS, FTD, HSP, IDC, INV, IOLR, IPL, ITH, JGF, LCR, LFR, LFRD, LFT, LSP,
        NRD, OPL, OPR, OTR, RFR, RFRD, RIG, RPG, RTH, SFR, SMAL_HIGH, SMAL_LOW, SMIL_HIGH, SMIL_LOW, SP2,
        SP3, SP4, SP5, SP6, SP7, SPAL_LOW, SPAT, SPDL_LOW, SPDT, TFR, THD, THR, TTD, UFT, ULN, UNS,
    },
};
use drive_core::registers::Access;

use super::drivecom::{Drivecom, Reaction, centihertz, profile_code, rpm, word};
use crate::{
    Bank, Cast, Exception, Model, Nameplate, Observation, Panel, Rules, Surroundings,
    models::atv28::parameters::settings,
};

/// What is around it.
const SURROUNDINGS: Surroundings =
    Surroundings { family: "atv28", trips: FAULTS, rows: ROWS, ..Surroundings::NONE };

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

/// Settings as they are when the drive leaves the factory; those of the twins, where they have one.
const FACTORY: &[(u16, u16)] = &[
    (COD.address(), 0),
    (CRL3.address(), 40),
    (CRH3.address(), 200),
    (ADD.address(), 1),
    (BFR.address(), 0),
    (SFR.address(), 40),
    (TFR.address(), 600),
    (FRS.address(), 500),
    (UNS.address(), 400),
    (NRD.address(), 1),
    (UFT.address(), 2),
    (BRA.address(), 1),
    (OPL.address(), 1),
    (IPL.address(), 1),
    (HSP.address(), 500),
    (ACC.address(), 30),
    (DEC.address(), 30),
    (ITH.address(), NOMINAL_CURRENT),
    (AC2.address(), 50),
    (DE2.address(), 50),
    (JGF.address(), 100),
    (SP2.address(), 100),
    (SP3.address(), 150),
    (SP4.address(), 200),
    (SP5.address(), 250),
    (SP6.address(), 300),
    (SP7.address(), 350),
    (IDC.address(), 26),
    (RPG.address(), 100),
    (RIG.address(), 100),
    (FBS.address(), 10),
    (CTD.address(), NOMINAL_CURRENT),
    (TTD.address(), 100),
    (FTD.address(), 500),
    (INV.address(), NOMINAL_CURRENT),
    (SPAL_LOW.address(), 1_500),
    (SPAT.address(), 3),
    (SPDL_LOW.address(), 1_500),
    (SPDT.address(), 3),
];

/// A simulated Altivar 28.
#[derive(Debug, Clone)]
pub struct Atv28 {
    bank: Bank,
    drive: Drivecom,
    /// Whether the line has given a command since power-up; until then the terminals have control.
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
        let plate = Nameplate::light(u32::from(NOMINAL_CURRENT));
        let drive = Drivecom::new(plate, settings(&bank, false));
        Self { bank, drive, commanded: false }
    }

    fn take_settings(&mut self) {
        self.drive.set_settings(settings(&self.bank, self.commanded));
    }

    /// A register that the drive computes; `None` for one that is kept.
    fn computed(&self, address: u16) -> Option<u16> {
        let motor = self.drive.motor();
        let fault = |index| self.drive.faults().nth(index).map_or(0, |fault| fault.code);
        let output = motor.output_frequency();
        let target = self.drive.target();
        Some(match address {
            _ if address == FRH.address() => word(target.abs() / 10),
            _ if address == RFR.address() => word(output / 10),
            _ if address == LCR.address() => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            _ if address == ULN.address() => LINE_VOLTAGE,
            // Heat sink and windings warm up together here.
            _ if address == THR.address() || address == THD.address() => motor.thermal_state(),
            _ if address == LFT.address() => fault(0),
            _ if address == ETA.address() || address == ETAD.address() => self.drive.eta(),
            _ if address == ETI.address() => self.drive.eti() | CONSISTENCY_CHECK,
            _ if address == DP1.address() => fault(1),
            _ if address == DP2.address() => fault(2),
            _ if address == DP3.address() => fault(3),
            _ if address == DP4.address() => fault(4),
            _ if address == OTR.address() => word(motor.torque()),
            _ if address == OPR.address() => word(motor.power()),
            _ if address == RTH.address() => {
                u16::try_from(motor.fed_for().as_secs() / 3_600).unwrap_or(u16::MAX)
            }
            _ if address == ERRD.address() => profile_code(fault(0)),
            _ if address == CMDD.address() => self.bank.value(CMD.address()),
            _ if address == FRHD.address() => word(rpm(target)),
            _ if address == RFRD.address() => word(rpm(output)),
            // Low and high speed once more, in rpm: two words each, the high one always 0 here.
            _ if address == SMIL_LOW.address() => word(rpm(i32::from(self.bank.value(LSP.address())) * 10)),
            _ if address == SMAL_LOW.address() => word(rpm(i32::from(self.bank.value(HSP.address())) * 10)),
            _ if address == SMIL_HIGH.address() || address == SMAL_HIGH.address() => 0,
            _ => return None,
        })
    }

    /// What a write does beyond being kept.
    fn act(&mut self, address: u16, value: u16) {
        if address == CMD.address() || address == CMDD.address() {
            self.bank.set(CMD.address(), value);
            self.commanded = true;
            self.take_settings();
            self.drive.command(value);
        } else if address == LFR.address() {
            self.drive.reference(i32::from(value.cast_signed()) * 10);
        } else if address == LFRD.address() {
            self.drive.reference(centihertz(i32::from(value.cast_signed())));
        } else if address == SMIL_LOW.address() || address == SMAL_LOW.address() {
            let limit = if address == SMIL_LOW.address() { LSP.address() } else { HSP.address() };
            self.bank.set_for_good(limit, word(centihertz(i32::from(value)) / 10));
            self.take_settings();
        } else {
            let locks = self.bank.row(address).is_some_and(|row| row.access == Access::WriteStopped);
            self.take_settings();
            if locks {
                self.drive.configuration_written();
            }
        }
    }
}

impl Default for Atv28 {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Atv28 {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let kept = self.bank.read(address)?;
        let outputs = if self.drive.present_fault().is_none() { R1 } else { 0 };
        Ok(match self.computed(address) {
            Some(computed) => computed,
            None if address == IOLR.address() => kept | outputs,
            None => kept,
        })
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let stopped = !self.drive.motor().is_fed();
        self.bank.write(address, value, stopped)?;
        self.act(address, value);
        Ok(())
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        Ok(self.bank.check(address, value, !self.drive.motor().is_fed())?)
    }

    fn advance(&mut self, elapsed: Duration) {
        self.drive.advance(elapsed);
    }

    fn power(&mut self, on: bool) {
        if !on {
            return self.drive.power(false);
        }
        self.bank.power_cycle();
        self.commanded = false;
        self.take_settings();
        self.drive.power(true);
    }

    fn trip(&mut self, code: u16) {
        self.drive.trip(code, Reaction::Freewheel, false);
    }

    fn set_load(&mut self, percent: u16) {
        self.drive.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        self.drive.panel(action);
    }

    fn observe(&self) -> Observation {
        self.drive.observe(self.bank.eeprom_writes())
    }

    fn frame_seen(&mut self, _: Cast) {
        self.drive.frame_seen();
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        let kept = self.computed(address).is_none() && self.bank.set(address, value);
        if kept {
            self.take_settings();
        }
        kept
    }
}

#[cfg(test)]
mod tests;
