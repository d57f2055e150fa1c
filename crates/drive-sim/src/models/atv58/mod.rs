//! A simulated Altivar 58 with the card VW3-A58303 (VVDED397054).
//!
//! The drive's own manual is not public. The card is simulated as its manual says: functions, limits, sub-codes of
//! function 08 (they are the slave's), the words that it names, the watch for messages. What lies behind is the chart
//! of DRIVECOM with the words where the Altivar 28 has them, which nobody has confirmed; any drive of the field may
//! differ. Of the control word's bits above the chart bit 11 is reverse; a drive that loses the supply of its power stage
//! is locked without a fault.

use std::time::Duration;

use drive_atv58::{ROWS, registers::address::*};

use super::drivecom::{
    self, CommandBits, Commander, Injection, LinkWatch, Reaction, Settings, Standstill, Stop,
    family::{Family, TWO_WIRES, Unit},
    word,
};
use crate::{
    Bank, Model, Protocol, Ramp, Ramps, Rules, UniTe,
    world::{Surroundings, Switch},
};

/// What a count of the reference W401 is.
const COUNTS: Switch = Switch {
    name: "W401",
    readings: &["tenths", "hundredths"],
    question: "a count of W401 is 0.1 Hz or 0.01 Hz: the sample writes 500 and names no unit (VVDED397054 p. 21/45)",
};
/// What the control word's bits 12 to 14 do.
const STOP_BITS: Switch = Switch {
    name: "CMD.12-14",
    readings: &["nothing", "stops"],
    question: "bits 12, 13 and 14 of the control word do nothing, or stop as those of the Altivar 28 and 312 (VVDED397054                leaves them to a manual that is not public)",
};
/// The terminals of the drive's own manual, which is not public: LI1 forward, LI2 in reverse, AI1 the reference while
/// local control is forced.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "atv58",
    terminals: &["LI1", "LI2"],
    analog_inputs: &["AI1"],
    switches: &[
        COUNTS,
        STOP_BITS,
        drivecom::GIVEN_BACK,
        drivecom::RESET,
        drivecom::MOTOR_RUNNING,
        drivecom::DISABLE_OPERATION,
        TWO_WIRES,
    ],
    trips: &[],
    rows: ROWS,
};

const RULES: Rules = Rules {
    read_holding: 63,
    read_input: 63,
    write_single: true,
    write_multiple: 60,
    diagnostics: &[0x00, 0x01, 0x03, 0x04, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x11, 0x12],
    event_counter: true,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::from_millis(5),
};

/// The card's watch for messages on the bus (p. 24/48).
const MESSAGE_WATCH: Duration = Duration::from_secs(10);
/// The same in Modbus ASCII (note on the lamps, p. 24/48).
const MESSAGE_WATCH_ASCII: Duration = Duration::from_secs(1);
/// The card's answers to UNI-TE (p. 11–13). That the reference FRH of request F2h is W401, and that its report shows the
/// status and current words of the Altivar 28, nobody has confirmed.
const UNITE: UniTe = UniTe {
    product: [0x18, 0x58, 0x21],
    name: "ATV58U18N4",
    command: [CMD, W401, ACC, W253],
    report: [W401, W458, W483, W453],
};
/// The fault bit of the link. Which one it is on a real drive is not public.
const LINK_FAULT: u16 = 5;
/// Nominal current in tenths of an ampere: an ATV58HU18N4's order of size.
const NOMINAL_CURRENT: u16 = 23;
/// Line voltage in tenths of a volt.
const LINE_VOLTAGE: u16 = 4_000;
/// Injection current in percent of the nominal one, where there is any.
const INJECTION: u16 = 70;
/// Nominal frequency in hundredths of a hertz.
const NOMINAL_FREQUENCY: u32 = 5_000;
/// High speed and ramps in the words' own counts.
const FACTORY: &[(u16, u16)] = &[(W250, 500), (W251, 0), (ACC, 30), (W253, 30)];

/// A simulated Altivar 58.
#[derive(Debug, Clone)]
pub struct Atv58 {
    unit: Unit,
    protocol: Protocol,
    /// Hundredths of a hertz in a count of the reference.
    count: i32,
    stop_bits: bool,
}

impl Atv58 {
    /// A drive from the factory, with a light motor of its own size.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in FACTORY {
            bank.set_factory(address, value);
        }
        let protocol = Protocol::default();
        let settings = settings(&bank, protocol, false, false);
        let mut drive =
            Self { unit: Unit::new(bank, NOMINAL_CURRENT, settings), protocol, count: 10, stop_bits: false };
        drive.power(true);
        drive
    }
}

impl Default for Atv58 {
    fn default() -> Self {
        Self::new()
    }
}

impl Family for Atv58 {
    const RULES: Rules = RULES;
    const SURROUNDINGS: &'static Surroundings = &SURROUNDINGS;
    const SUPPLY_FAULT: Option<u16> = None;

    fn unit(&self) -> &Unit {
        &self.unit
    }

    fn unit_mut(&mut self) -> &mut Unit {
        &mut self.unit
    }

    fn computed(&self, address: u16) -> Option<u16> {
        let drive = &self.unit.drive;
        let motor = drive.motor();
        Some(match address {
            W450 => word(drive.target().abs() / 10),
            W451 => word(motor.output_frequency() / 10),
            W453 => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            W454 if !self.unit.around.motor_supply => 0,
            W454 => LINE_VOLTAGE,
            W455 | W456 => motor.thermal_state(),
            W457 => drive.faults().next().map_or(0, |fault| fault.code),
            W458 => drive.eta(),
            W459 => drive.eti(),
            W483 => drive.present_fault().map_or(0, |bit| 1_u16.checked_shl(u32::from(bit)).unwrap_or(0)),
            _ => return None,
        })
    }

    fn act(&mut self, address: u16, value: u16) {
        match address {
            CMD => return self.unit.drive.command(value),
            W401 => self.unit.bus_reference = i32::from(value.cast_signed()) * self.count,
            _ => {}
        }
        self.refresh();
    }

    fn settings(&self) -> Settings {
        settings(&self.unit.bank, self.protocol, self.unit.by_level, self.stop_bits)
    }

    fn commander(&self) -> (Commander, bool) {
        let local = self.unit.around.forced_local;
        (if local { Commander::Terminals } else { Commander::Bus }, false)
    }

    fn reference(&self) -> i32 {
        if self.unit.around.forced_local { self.unit.analog_reference() } else { self.unit.bus_reference }
    }

    fn choose(&mut self, name: &str, reading: &str) {
        let is_second = |switch: &Switch| switch.name == name && switch.readings.get(1) == Some(&reading);
        match name {
            _ if name == COUNTS.name => self.count = if is_second(&COUNTS) { 1 } else { 10 },
            _ if name == STOP_BITS.name => self.stop_bits = is_second(&STOP_BITS),
            _ => {}
        }
    }

    fn joined(&mut self, protocol: Protocol) {
        self.protocol = protocol;
    }

    fn unite_words(&self) -> Option<UniTe> {
        Some(UNITE)
    }
}

/// Ramps in tenths of a second (A for W252, p. 20/44), speeds in tenths of a hertz.
fn settings(bank: &Bank, protocol: Protocol, runs_by_level: bool, stop_bits: bool) -> Settings {
    let ramp = |address| Ramp {
        full_scale: NOMINAL_FREQUENCY,
        time: Duration::from_millis(u64::from(bank.value(address)) * 100),
    };
    let deceleration = ramp(W253);
    let watch = match protocol {
        Protocol::Ascii => MESSAGE_WATCH_ASCII,
        Protocol::Rtu | Protocol::UniTelway => MESSAGE_WATCH,
    };
    let reverse_only = CommandBits { stop: 0, injection: 0, fast_stop: 0, ..CommandBits::BASIC };
    Settings {
        bits: if stop_bits { CommandBits::BASIC } else { reverse_only },
        runs_by_level,
        ramps: Ramps { acceleration: ramp(ACC), deceleration },
        fast_stop: Ramp { time: deceleration.time / 4, ..deceleration },
        stop: Stop::Ramp,
        injection_current: INJECTION,
        injection_limit: INJECTION,
        injection_time: Duration::ZERO,
        standstill: (Standstill::No, [Injection::default(); 2]),
        low_speed: u32::from(bank.value(W251)) * 10,
        high_speed: u32::from(bank.value(W250)) * 10,
        low_speed_time: None,
        brake_release: Duration::ZERO,
        restarts: None,
        link: LinkWatch { timeout: Some(watch), reaction: Reaction::Freewheel, code: LINK_FAULT },
    }
}

#[cfg(test)]
mod tests;
