//! A simulated Altivar 312 (BBV52816 04/2009 for the line, BBV51701 06/2009 for the registers; "p." is the latter's).
//!
//! Where the manuals leave a choice that matters to a master there is a switch ([`Surroundings::switches`]). Else, where
//! they are silent, it does this: a refused value is answered by exception 03 and a write that must wait (motor fed,
//! EEPROM busy) by 04; a register that the manual does not list by 02, also inside a block; of `LFr` and `LFRD` the
//! last written counts; `DP1` is the newest past fault; saving takes half a second; bits Cd11 to Cd15 switch their
//! function only while Modbus commands, but for `rPS`; 4–20 mA are lost below 3 mA; a loss of the line supply trips USF
//! in the way of `StP`; the PI regulator follows its error at the speed of the ramp. Left out are jog, +/- speed, limit
//! switches, `COP`, `FLr`, `rSL`, the CANopen side and the thermal trips.

mod aliases;
mod factory;
mod interlocks;
mod monitor;
mod reference;
mod routing;
mod settings;
mod world;
mod writes;

use std::time::Duration;

use drive_atv312::{ROWS, registers::address::*, words::ExtendedControl};

use self::routing::{Giver, Routing};
use super::drivecom::{self, Around, Drivecom, Situation, Terminals};
use crate::{
    Bank, Block, Cast, Exception, Model, Nameplate, Observation, Panel, Rules, identification,
    world::{Act, Surroundings},
};

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

/// The inputs of `IOLR`.
const INPUTS: u16 = 0x003F;
/// Interruption of the link, Modbus or remote terminal.
const SLF: u16 = 5;
/// External fault.
const EPF: u16 = 8;
/// Loss of the 4–20 mA.
const LFF: u16 = 13;
/// Line undervoltage: the one fault with which nothing is saved.
const USF: u16 = 22;
/// Brake control fault.
const BLF: u16 = 35;

/// A simulated Altivar 312, an ATV312HU15N4.
#[derive(Debug, Clone)]
pub struct Atv312 {
    bank: Bank,
    /// The configuration that `SCS` put aside.
    backup: Bank,
    drive: Drivecom,
    around: Around,
    terminals: Terminals,
    reference: String,
    version: String,
    /// Whether the bus commands at L1 and L2; the terminals do until it has given a command.
    commanded: bool,
    /// The bus reference in hundredths of a hertz, signed.
    bus_reference: i32,
    /// What `LFL` = rLS goes on with: the speed at the loss of the signal.
    kept_speed: Option<i32>,
    /// Whether the input of `rSF` was on.
    resets: bool,
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
        let around = Around::default();
        let plate = Nameplate::light(u32::from(factory::NOMINAL_CURRENT));
        let readings = drivecom::Readings::default();
        let routing = Routing { bank: &bank, around: &around, readings: &readings, commanded: false };
        let drive = Drivecom::new(plate, settings::settings(&routing), Situation::default());
        Self {
            backup: bank.clone(),
            bank,
            drive,
            around,
            terminals: Terminals::default(),
            reference: "ATV312HU15N4".to_owned(),
            version: "0102".to_owned(),
            commanded: false,
            bus_reference: 0,
            kept_speed: None,
            resets: false,
            saving: None,
            hottest: 0,
            time_base: Duration::ZERO,
        }
    }

    /// A drive as it is set up for command by the bus: access level L3, command and reference by Modbus, and the fast
    /// stop and the DC injection on the bits 14 and 13 of the control word, no current at standstill; all of it saved.
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
}

impl Default for Atv312 {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Atv312 {
    fn rules(&self) -> &Rules {
        &RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let address = aliases::resolve(address);
        let kept = self.bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        self.write_word(aliases::resolve(address), value)
    }

    /// A block is tried as a whole before its first word is written: one word may allow the next.
    fn check_write(&self, block: Block, values: &[u16], cast: Cast) -> Result<(), Exception> {
        if !(2..=RULES.write_multiple).contains(&block.quantity)
            || values.len() != usize::from(block.quantity)
        {
            return Ok(());
        }
        let mut trial = self.clone();
        let mut words = (block.first..).zip(values);
        words.try_for_each(|(address, &value)| trial.write(address, value, cast))
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
            return self.drive.power_off();
        }
        self.bank.power_cycle();
        self.around.power_up();
        (self.commanded, self.bus_reference, self.saving, self.hottest) = (false, 0, None, 0);
        (self.kept_speed, self.resets) = (None, false);
        let (_, inputs) = self.routing().wiring();
        self.terminals.power_up(inputs);
        let (settings, situation) = self.asked();
        self.drive.power_up(settings, situation);
        self.refresh();
    }

    fn trip(&mut self, code: u16) {
        self.trip_by(code, false);
    }

    fn set_load(&mut self, percent: u16) {
        self.drive.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        let by_keys = matches!(self.routing().giver(), Giver::Keypad | Giver::RemoteTerminal);
        match action {
            Panel::Run if !by_keys => return,
            Panel::Reset => {
                self.drive.reset();
            }
            // The STOP key has priority over every channel as long as PSt says so (p. 38).
            Panel::Stop if !by_keys && self.bank.value(PST) == 1 => self.drive.stop_key(),
            _ => {}
        }
        self.around.panel(action);
        self.refresh();
    }

    fn surroundings(&self) -> &'static Surroundings {
        &world::SURROUNDINGS
    }

    fn world(&mut self, act: Act) {
        if let Act::Reading(name, reading) = act {
            let mut readings = *self.drive.readings();
            readings.choose(name, reading);
            self.drive.set_readings(readings);
        }
        self.around.act(act);
        self.refresh();
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
        if address == IOLR {
            self.around.inputs = value & INPUTS;
        }
        let kept = (address == IOLR || self.computed(address).is_none()) && self.bank.set(address, value);
        if kept {
            self.refresh();
        }
        kept
    }
}

#[cfg(test)]
mod tests;
