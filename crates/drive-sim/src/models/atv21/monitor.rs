//! What the simulated Altivar 21 shows of itself (§8.3, §8.6).

use std::time::Duration;

use drive_atv21::registers::address as at;

use super::{
    Atv21, EMERGENCY, RATED_CURRENT, RATED_POWER,
    control::{COMMAND_PRIORITY, Order, RAMP_2, Source},
};

const HOUR: u64 = 3_600;
/// Bits of FA00 that FD01 shows: motor, regulator, ramp.
const CHOSEN: u16 = 0x0070;
/// Bits of FA20.
const ENERGY_RESET: u16 = 1 << 1;
const STALL_LEVEL: u16 = 1 << 12;

/// The words that are remarked as "value before the trip" and have no address of their own for it.
const FROZEN: [u16; 11] = [
    at::REFERENCE_BEFORE_RAMP,
    at::OUTPUT_VOLTAGE,
    at::REFERENCE_AFTER_RAMP,
    at::ESTIMATED_SPEED,
    at::TORQUE_CURRENT,
    at::EXCITATION_CURRENT,
    at::PID_FEEDBACK,
    at::MOTOR_LOAD,
    at::DRIVE_LOAD,
    at::INPUT_POWER,
    at::OUTPUT_POWER,
];
/// Present words with the address of what they were before the last trip.
const TWINS: [(u16, u16); 6] = [
    (at::OUTPUT_FREQUENCY, at::TRIP_OUTPUT_FREQUENCY),
    (at::STATUS_WORD, at::TRIP_STATUS_WORD),
    (at::STATUS_WORD_2, at::TRIP_STATUS_WORD_2),
    (at::STATUS_WORD_3, at::TRIP_STATUS_WORD_3),
    (at::LOGIC_INPUTS, at::TRIP_LOGIC_INPUTS),
    (at::LOGIC_OUTPUTS, at::TRIP_LOGIC_OUTPUTS),
];

/// The register that a word of the read block shows (F875 to F879).
pub(super) const fn in_slot(slot: u16) -> Option<u16> {
    Some(match slot {
        1 => at::STATUS_WORD,
        2 => at::OUTPUT_FREQUENCY,
        3 => at::OUTPUT_CURRENT,
        4 => at::OUTPUT_VOLTAGE,
        5 => at::ALARM_CODE,
        6 => at::PID_FEEDBACK,
        7 => at::LOGIC_INPUTS,
        8 => at::LOGIC_OUTPUTS,
        9 => at::ANALOG_INPUT_VIA,
        10 => at::ANALOG_INPUT_VIB,
        11 => at::OUTPUT_SPEED,
        _ => return None,
    })
}

impl Atv21 {
    /// What stands in a register now.
    pub(super) fn value(&self, address: u16) -> u16 {
        match self.frozen.get(&address) {
            Some(&value) if self.trip.is_some() && !self.readings.live_at_trip => value,
            _ => self.live(address),
        }
    }

    /// Keeps what the words of a trip show.
    pub(super) fn freeze(&mut self) {
        let frozen = FROZEN.map(|address| (address, self.live(address)));
        let twins = TWINS.map(|(present, kept)| (kept, self.live(present)));
        self.frozen.extend(frozen);
        for (address, value) in twins {
            self.bank.set(address, value);
        }
    }

    fn live(&self, address: u16) -> u16 {
        if address == at::ALARM_CODE {
            return self.alarms();
        }
        let shown = self.pinned.get(&address).copied().or_else(|| self.computed(address));
        shown.unwrap_or_else(|| self.bank.value(address))
    }

    /// What follows from the state of drive and motor; `None` for what stands in the bank.
    pub(super) fn computed(&self, address: u16) -> Option<u16> {
        let motor = &self.motor;
        let frequency = motor.output_frequency().unsigned_abs();
        let percent = |value: u32| word(value * 100);
        Some(match address {
            at::FAULT_CODE => self.trip.unwrap_or(0),
            at::OUTPUT_FREQUENCY | at::REFERENCE_AFTER_RAMP => word(frequency),
            at::STATUS_WORD => self.status(),
            at::LOGIC_OUTPUTS => self.outputs(),
            at::STATUS_WORD_2 => self.status_2(),
            at::REFERENCE_BEFORE_RAMP => self.reference(),
            at::OUTPUT_CURRENT => word(motor.current() * 10_000 / RATED_CURRENT),
            at::DC_BUS_VOLTAGE => {
                if self.supplied {
                    10_000
                } else {
                    0
                }
            }
            at::OUTPUT_VOLTAGE => word((frequency * 2).min(10_000)),
            at::RUNNING_TIME => hours(motor.fed_for()),
            at::ESTIMATED_SPEED => word(motor.shaft_frequency().unsigned_abs()),
            at::TORQUE | at::TORQUE_CURRENT => percent(motor.torque().unsigned_abs()),
            at::EXCITATION_CURRENT if motor.is_fed() => percent(30),
            at::MOTOR_LOAD | at::DRIVE_LOAD => word(motor.current() * 100 / RATED_CURRENT),
            at::INPUT_POWER => word(self.power() * 105 / 100),
            at::OUTPUT_POWER => word(self.power()),
            at::COMMAND_SOURCE => self.source() as u16,
            at::REFERENCE_SOURCE => self.reference_source(),
            at::INPUT_ENERGY => self.energy(105),
            at::OUTPUT_ENERGY => self.energy(100),
            at::POWERED_TIME => hours(self.powered_for),
            at::OUTPUT_SPEED => {
                let poles = self.poles();
                word((frequency * 12 + 5 * poles) / (poles * 10))
            }
            _ => return None,
        })
    }

    /// FD01 (§8.6 p. 34).
    fn status(&self) -> u16 {
        let order = self.order();
        let tripped = self.trip.is_some();
        let is_run = |order| matches!(order, Order::Run { .. }) && !tripped;
        let ordered = is_run(if self.readings.run_needs_st { order } else { self.asked() });
        let turns = self.readings.run_until_standstill && self.motor.output_frequency() != 0;
        let standby = !tripped && !self.lacks_supply() && self.starting.is_zero();
        let reverse = match self.motor.output_frequency() {
            0 => matches!(order, Order::Run { reverse: true }),
            frequency => frequency < 0,
        };
        let by_terminals = (self.is_forced_local() || self.forced_run) && !self.readings.local_is_keypad;
        let chosen = if self.source() == Source::Serial { self.word() & CHOSEN } else { 0 };
        let bits = [
            (0, tripped),
            (1, tripped),
            (2, self.alarms() != 0),
            (3, self.lacks_supply()),
            (7, order == Order::Brake && !tripped),
            (9, reverse),
            (10, ordered || turns),
            (11, order == Order::Freewheel),
            (12, self.trip == Some(EMERGENCY)),
            (13, standby && self.released && (is_run(order) || turns)),
            (14, standby),
            (15, self.local || by_terminals),
        ];
        bits.into_iter().filter(|(_, set)| *set).fold(chosen, |word, (bit, _)| word | 1 << bit)
    }

    /// FD42 (§8.6 p. 34).
    fn status_2(&self) -> u16 {
        let second = self.bank.value(at::COMMAND_WORD_2);
        let level = if self.word() & COMMAND_PRIORITY != 0 { second & STALL_LEVEL } else { 0 };
        let ramp = if self.word() & RAMP_2 != 0 { 0x0100 } else { 0 };
        (second & ENERGY_RESET) | level | ramp
    }

    /// FD07: relay RY as FA50 orders it, relay FL at a trip.
    fn outputs(&self) -> u16 {
        let relay = self.bank.value(at::LOGIC_OUTPUT_COMMAND) & 1;
        relay | if self.trip.is_some() { 1 << 2 } else { 0 }
    }

    /// In 0.01 kW.
    fn power(&self) -> u32 {
        self.motor.power().unsigned_abs() * RATED_POWER / 100
    }

    /// Counts of energy since the last reset.
    fn energy(&self, percent: u64) -> u16 {
        let seconds = self.motor.fed_for().saturating_sub(self.energy_base).as_secs();
        let counts = seconds * u64::from(RATED_POWER) * percent / 100 / HOUR;
        u16::try_from(counts & 0xFFFF).unwrap_or(0)
    }
}

fn hours(time: Duration) -> u16 {
    u16::try_from(time.as_secs() / HOUR).unwrap_or(u16::MAX)
}

fn word(value: u32) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}
