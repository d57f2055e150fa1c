//! Who commands the simulated Altivar 21, what is ordered, and what the motor does with it (§6.2, §8.4 to §8.6).

use std::time::Duration;

use drive_atv21::registers::address as at;

use super::{
    Atv21, EMERGENCY,
    inputs::{ANALOG, function},
};
use crate::{Panel, Ramp, Ramps};

/// Bits of FA00.
const PRESET: u16 = 0x0007;
const REGULATOR_OFF: u16 = 1 << 5;
pub(super) const RAMP_2: u16 = 1 << 6;
const DC_BRAKING: u16 = 1 << 7;
const REVERSE: u16 = 1 << 9;
const RUN: u16 = 1 << 10;
const FREEWHEEL: u16 = 1 << 11;
const EMERGENCY_STOP: u16 = 1 << 12;
const FAULT_RESET: u16 = 1 << 13;
const REFERENCE_PRIORITY: u16 = 1 << 14;
pub(super) const COMMAND_PRIORITY: u16 = 1 << 15;
/// What forced DC braking injects, in percent of the rated current.
pub(super) const BRAKING_CURRENT: u16 = 50;
/// The step from one preset speed to the next, in hundredths of a hertz.
const PRESET_STEP: u16 = 500;

/// FE45.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Terminals = 0,
    Keypad = 1,
    Serial = 2,
}

/// FE46.
pub(super) mod reference {
    pub(in crate::models::atv21) const VIA: u16 = 1;
    pub(in crate::models::atv21) const VIB: u16 = 2;
    pub(in crate::models::atv21) const KEYPAD: u16 = 3;
    pub(in crate::models::atv21) const SERIAL: u16 = 4;
    pub(in crate::models::atv21) const PRESET: u16 = 255;
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
        let may_reset = !self.readings.only_commander_resets || self.source() == Source::Serial;
        if word & FAULT_RESET != 0 && may_reset {
            self.reset();
        }
    }

    /// Puts into effect what is ordered now. A trip has its own stop, and a drive that starts up does nothing.
    pub(super) fn obey(&mut self) {
        if !self.powered || self.trip.is_some() {
            return;
        }
        if !self.starting.is_zero() || self.lacks_supply() {
            self.motor.freewheel();
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

    /// What is in force: nothing runs without ST.
    pub(super) fn order(&self) -> Order {
        if self.released { self.asked() } else { Order::Freewheel }
    }

    /// What the source asks for.
    pub(super) fn asked(&self) -> Order {
        let word = self.word();
        match self.source() {
            _ if self.forced_run => Order::Run { reverse: false },
            Source::Keypad if self.keypad_runs => Order::Run { reverse: self.keypad_reverse },
            Source::Keypad => Order::Stop,
            Source::Serial if !self.heeds => Order::Stop,
            Source::Serial if word & FREEWHEEL != 0 => Order::Freewheel,
            Source::Serial if word & DC_BRAKING != 0 => Order::Brake,
            Source::Serial if word & RUN != 0 => Order::Run { reverse: word & REVERSE != 0 },
            Source::Serial => Order::Stop,
            Source::Terminals => match [function::FORWARD, function::REVERSE].map(|run| self.runs_by(run)) {
                [true, false] => Order::Run { reverse: false },
                [false, true] => Order::Run { reverse: true },
                _ => Order::Stop,
            },
        }
    }

    /// FE45.
    pub(super) fn source(&self) -> Source {
        if self.local {
            return Source::Keypad;
        }
        if self.is_forced_local() || self.forced_run {
            return Source::Terminals;
        }
        match self.bank.value(at::COMMAND_MODE) {
            _ if self.word() & COMMAND_PRIORITY != 0 || self.leaves_to_bus() => Source::Serial,
            2 => Source::Serial,
            1 => Source::Keypad,
            _ => Source::Terminals,
        }
    }

    /// FE46.
    pub(super) fn reference_source(&self) -> u16 {
        let mode = self.bank.value(at::REFERENCE_MODE);
        let prior = self.word() & REFERENCE_PRIORITY != 0;
        if self.local {
            return reference::KEYPAD;
        }
        if self.is_forced_local() {
            return if mode == reference::SERIAL { reference::VIA } else { mode };
        }
        if self.source() == Source::Serial && self.word() & PRESET != 0 {
            return reference::PRESET;
        }
        let gives_way = prior && self.readings.priority_over_fchg;
        if self.is_on(function::SECOND_REFERENCE) && !gives_way {
            return self.bank.value(at::SECOND_REFERENCE);
        }
        if prior || self.leaves_to_bus() { reference::SERIAL } else { mode }
    }

    /// The reference before the ramp (FE02), in hundredths of a hertz.
    pub(super) fn reference(&self) -> u16 {
        let limit = self.bank.value(at::UPPER_LIMIT);
        if self.forced_run {
            return limit;
        }
        let analog = |address| {
            let counts = u32::from(self.bank.value(address).min(ANALOG));
            u16::try_from(u32::from(limit) * counts / u32::from(ANALOG)).unwrap_or(limit)
        };
        let reference = match self.reference_source() {
            reference::VIA if self.bank.value(at::VIA_IS_LOGIC) == 0 => analog(at::ANALOG_INPUT_VIA),
            reference::VIB => analog(at::ANALOG_INPUT_VIB),
            reference::KEYPAD => self.keypad_reference,
            reference::SERIAL if self.speed_counts() => self.frequency_of_speed(),
            reference::SERIAL => self.bank.value(at::FREQUENCY_REFERENCE),
            reference::PRESET => (self.word() & PRESET) * PRESET_STEP,
            // Up and down inputs, whose functions the manual does not number, stay where they are.
            _ => 0,
        };
        reference.min(limit)
    }

    /// What the drive steers for, negative in reverse.
    pub(super) fn target(&self) -> i32 {
        match self.order() {
            _ if self.trip.is_some() => 0,
            Order::Run { reverse: true } => -i32::from(self.behind_regulator()),
            Order::Run { reverse: false } => i32::from(self.behind_regulator()),
            Order::Stop | Order::Freewheel | Order::Brake => 0,
        }
    }

    /// What regulator and lower limit make of the reference.
    fn behind_regulator(&self) -> u16 {
        let limit = self.bank.value(at::UPPER_LIMIT);
        let switched_off = self.source() == Source::Serial && self.word() & REGULATOR_OFF != 0;
        if self.regulated && !switched_off {
            limit
        } else {
            self.reference().max(self.lower_limit).min(limit)
        }
    }

    pub(super) fn ramps(&self) -> Ramps {
        let (up, down) = if self.source() == Source::Serial && self.word() & RAMP_2 != 0 {
            (at::ACCELERATION_2, at::DECELERATION_2)
        } else {
            (at::ACCELERATION, at::DECELERATION)
        };
        let ramp = |address| Ramp {
            full_scale: super::MAXIMUM_FREQUENCY.into(),
            time: Duration::from_millis(u64::from(self.bank.value(address)) * 100),
        };
        Ramps { acceleration: ramp(up), deceleration: ramp(down) }
    }

    /// Somebody is at the keypad, whose LOC/REM key is always active (§6.2 p. 12).
    pub(super) fn keypad(&mut self, action: Panel) {
        match action {
            Panel::TakeControl if !self.local => {
                let frequency = self.motor.output_frequency();
                self.keypad_runs = self.readings.local_runs_on && frequency != 0;
                if self.keypad_runs {
                    self.keypad_reference = u16::try_from(frequency.unsigned_abs()).unwrap_or(u16::MAX);
                    self.keypad_reverse = frequency < 0;
                }
                self.heeds &= self.readings.remote_resumes;
                self.local = true;
            }
            Panel::TakeControl => {}
            Panel::ReleaseControl => {
                self.heeds &= self.readings.remote_resumes;
                (self.local, self.keypad_runs) = (false, false);
            }
            Panel::Stop => (self.keypad_runs, self.heeds) = (false, false),
            Panel::Run => (self.keypad_runs, self.keypad_reverse) = (self.source() == Source::Keypad, false),
            Panel::Reset => self.reset(),
            Panel::Reference(frequency) => {
                self.keypad_reference = u16::try_from(frequency.centihertz()).unwrap_or(u16::MAX);
            }
        }
    }

    pub(super) fn word(&self) -> u16 {
        self.bank.value(at::COMMAND_WORD)
    }

    /// Whether FA13 counts, and not FA01.
    fn speed_counts(&self) -> bool {
        if self.readings.speed_first {
            self.bank.value(at::SPEED_REFERENCE) != 0
        } else {
            self.speed_is_newest
        }
    }

    /// FA13 as a frequency: poles × rpm / 120 Hz.
    fn frequency_of_speed(&self) -> u16 {
        let rpm = u32::from(self.bank.value(at::SPEED_REFERENCE));
        u16::try_from(rpm * self.poles() * 10 / 12).unwrap_or(u16::MAX)
    }

    /// F856 as a number of poles.
    pub(super) fn poles(&self) -> u32 {
        let counted = u32::from(self.bank.value(at::MOTOR_POLES)).max(1);
        if self.readings.pole_pairs { counted * 2 } else { counted }
    }
}
