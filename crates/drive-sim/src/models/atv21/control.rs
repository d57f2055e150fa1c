//! Who commands the simulated Altivar 21, what is ordered, and what the motor does with it (§6.2, §8.4 to §8.6).

use std::time::Duration;

use drive_atv21::registers as map;

use super::{Atv21, EMERGENCY};
use crate::{Ramp, Ramps};

/// F112: input R reverses; its factory setting.
pub(super) const R_IS_REVERSE: u16 = 3;
/// F112: input R forces local control (SC/LC).
const R_FORCES_LOCAL: u16 = 48;
/// F112: input R switches to the second reference (FCHG).
const R_SWITCHES_REFERENCE: u16 = 38;
/// Inputs of FD06.
const F: u16 = 1 << 0;
const R: u16 = 1 << 1;
/// Bits of FA00.
const PRESET: u16 = 0x0007;
const RAMP_2: u16 = 1 << 6;
const DC_BRAKING: u16 = 1 << 7;
const REVERSE: u16 = 1 << 9;
const RUN: u16 = 1 << 10;
const FREEWHEEL: u16 = 1 << 11;
const EMERGENCY_STOP: u16 = 1 << 12;
const FAULT_RESET: u16 = 1 << 13;
const REFERENCE_PRIORITY: u16 = 1 << 14;
const COMMAND_PRIORITY: u16 = 1 << 15;
/// What forced DC braking injects, in percent of the rated current.
pub(super) const BRAKING_CURRENT: u16 = 50;
/// The step from one preset speed to the next, in hundredths of a hertz.
const PRESET_STEP: u16 = 500;
/// The highest count of an analog input.
const ANALOG: u32 = 1_023;

/// FE45.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Terminals = 0,
    Keypad = 1,
    Serial = 2,
}

/// What the source orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Stop,
    Run { reverse: bool },
    Freewheel,
    Brake,
}

impl Atv21 {
    /// FA00 was written: what acts whoever commands.
    pub(super) fn command(&mut self, word: u16) {
        if word & EMERGENCY_STOP != 0 {
            self.trip_with(EMERGENCY);
        }
        if word & FAULT_RESET != 0 && self.trip.is_some() {
            self.motor.freewheel();
            self.start_up(self.restart);
        }
    }

    /// Puts into effect what is ordered now. A trip has its own stop, and a drive that starts up does nothing.
    pub(super) fn obey(&mut self) {
        if self.trip.is_some() {
            return;
        }
        match self.order() {
            Order::Run { .. } => self.motor.run(self.target(), self.ramps()),
            Order::Freewheel => self.motor.freewheel(),
            Order::Brake => self.motor.brake(BRAKING_CURRENT, None),
            // The end of an injection leaves the motor to itself.
            Order::Stop if self.motor.is_braking() => self.motor.freewheel(),
            Order::Stop => self.motor.ramp_to_rest(self.ramps().deceleration),
        }
    }

    pub(super) fn order(&self) -> Order {
        let word = self.word();
        match self.source() {
            Source::Keypad => Order::Stop,
            Source::Serial if !self.heeds => Order::Stop,
            Source::Serial if word & FREEWHEEL != 0 => Order::Freewheel,
            Source::Serial if word & DC_BRAKING != 0 => Order::Brake,
            Source::Serial if word & RUN != 0 => Order::Run { reverse: word & REVERSE != 0 },
            Source::Serial => Order::Stop,
            Source::Terminals => {
                let reverse = self.is_on(R) && self.function_of_r() == R_IS_REVERSE;
                match (self.is_on(F), reverse) {
                    (true, false) => Order::Run { reverse: false },
                    (false, true) => Order::Run { reverse: true },
                    _ => Order::Stop,
                }
            }
        }
    }

    /// FE45.
    pub(super) fn source(&self) -> Source {
        if self.local {
            return Source::Keypad;
        }
        if self.is_forced_local() {
            return Source::Terminals;
        }
        match self.bank.value(map::COMMAND_MODE.address()) {
            _ if self.word() & COMMAND_PRIORITY != 0 => Source::Serial,
            2 => Source::Serial,
            1 => Source::Keypad,
            _ => Source::Terminals,
        }
    }

    /// FE46.
    pub(super) fn reference_source(&self) -> u16 {
        let mode = self.bank.value(map::REFERENCE_MODE.address());
        if self.local {
            return 3;
        }
        if self.is_forced_local() {
            return mode;
        }
        if self.source() == Source::Serial && self.word() & PRESET != 0 {
            return 255;
        }
        if self.function_of_r() == R_SWITCHES_REFERENCE && self.is_on(R) {
            return self.bank.value(map::SECOND_REFERENCE.address());
        }
        if self.word() & REFERENCE_PRIORITY != 0 { 4 } else { mode }
    }

    /// The reference before the ramp (FE02), in hundredths of a hertz.
    pub(super) fn reference(&self) -> u16 {
        let limit = self.bank.value(map::UPPER_LIMIT.address());
        let analog = |address| {
            let counts = u32::from(self.bank.value(address)).min(ANALOG);
            u16::try_from(u32::from(limit) * counts / ANALOG).unwrap_or(limit)
        };
        let reference = match self.reference_source() {
            1 => analog(map::ANALOG_INPUT_VIA.address()),
            2 => analog(map::ANALOG_INPUT_VIB.address()),
            4 if self.speed_is_reference => self.frequency_of_speed(),
            4 => self.bank.value(map::FREQUENCY_REFERENCE.address()),
            255 => (self.word() & PRESET) * PRESET_STEP,
            _ => 0,
        };
        reference.min(limit)
    }

    /// What the drive steers for, negative in reverse.
    pub(super) fn target(&self) -> i32 {
        match self.order() {
            _ if self.trip.is_some() => 0,
            Order::Run { reverse: true } => -i32::from(self.reference()),
            Order::Run { reverse: false } => i32::from(self.reference()),
            Order::Stop | Order::Freewheel | Order::Brake => 0,
        }
    }

    pub(super) fn ramps(&self) -> Ramps {
        let (up, down) = if self.source() == Source::Serial && self.word() & RAMP_2 != 0 {
            (map::ACCELERATION_2.address(), map::DECELERATION_2.address())
        } else {
            (map::ACCELERATION.address(), map::DECELERATION.address())
        };
        let ramp = |address| Ramp {
            full_scale: super::MAXIMUM_FREQUENCY.into(),
            time: Duration::from_millis(u64::from(self.bank.value(address)) * 100),
        };
        Ramps { acceleration: ramp(up), deceleration: ramp(down) }
    }

    /// FD01.
    pub(super) fn status(&self) -> u16 {
        let order = self.order();
        let tripped = self.trip.is_some();
        let undervoltage = self.bank.value(map::ALARM_CODE.address()) & 0x2020 != 0;
        let freewheel = order == Order::Freewheel;
        let ordered = matches!(order, Order::Run { .. }) && !tripped;
        let runs = ordered || (self.run_until_standstill && self.motor.output_frequency() != 0);
        let standby = !tripped && !undervoltage && self.starting.is_zero();
        let reverse = match self.motor.output_frequency() {
            0 => matches!(order, Order::Run { reverse: true }),
            frequency => frequency < 0,
        };
        let chosen = if self.source() == Source::Serial { self.word() & 0x0070 } else { 0 };
        let bits = [
            (0, tripped),
            (1, tripped),
            (2, self.bank.value(map::ALARM_CODE.address()) != 0),
            (3, undervoltage),
            (7, order == Order::Brake && !tripped),
            (9, reverse),
            (10, runs),
            (11, freewheel),
            (12, self.trip == Some(EMERGENCY)),
            (13, standby && !freewheel && runs),
            (14, standby),
            (15, self.local || self.is_forced_local()),
        ];
        bits.into_iter().filter(|(_, set)| *set).fold(chosen, |word, (bit, _)| word | 1 << bit)
    }

    /// FD42.
    pub(super) fn status_2(&self) -> u16 {
        let second = self.bank.value(map::COMMAND_WORD_2.address());
        let level = if self.word() & COMMAND_PRIORITY != 0 { second & 0x1000 } else { 0 };
        let ramp = if self.word() & RAMP_2 != 0 { 0x0100 } else { 0 };
        (second & 0x0002) | level | ramp
    }

    fn word(&self) -> u16 {
        self.bank.value(map::COMMAND_WORD.address())
    }

    fn is_on(&self, input: u16) -> bool {
        self.bank.value(map::LOGIC_INPUTS.address()) & input != 0
    }

    fn function_of_r(&self) -> u16 {
        self.bank.value(map::INPUT_R_FUNCTION.address())
    }

    fn is_forced_local(&self) -> bool {
        self.function_of_r() == R_FORCES_LOCAL && self.is_on(R)
    }

    /// FA13 as a frequency: poles × rpm / 120 Hz.
    fn frequency_of_speed(&self) -> u16 {
        let rpm = u32::from(self.bank.value(map::SPEED_REFERENCE.address()));
        let poles = u32::from(self.bank.value(map::MOTOR_POLES.address()));
        u16::try_from(rpm * poles * 10 / 12).unwrap_or(u16::MAX)
    }
}
