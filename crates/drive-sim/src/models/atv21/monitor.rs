//! What the simulated Altivar 21 shows of itself (§8.3).

use std::time::Duration;

use drive_atv21::registers as map;

use super::{Atv21, RATED_CURRENT, RATED_POWER};

const HOUR: u64 = 3_600;

/// The words that are remarked as "value before the trip" and have no address of their own for it.
const FROZEN: [u16; 11] =
    [0xFE02, 0xFE05, 0xFE15, 0xFE16, 0xFE20, 0xFE21, 0xFE22, 0xFE26, 0xFE27, 0xFE29, 0xFE30];
/// Present words with the address of what they were before the last trip.
const TWINS: [(u16, u16); 6] = [
    (0xFD00, 0xFE00),
    (0xFD01, 0xFE01),
    (0xFD42, 0xFE42),
    (0xFD49, 0xFE49),
    (0xFD06, 0xFE06),
    (0xFD07, 0xFE07),
];

/// The register that a word of the read block shows (F875 to F879).
pub(super) const fn in_slot(slot: u16) -> Option<u16> {
    match slot {
        1 => Some(0xFD01),
        2 => Some(0xFD00),
        3 => Some(0xFE03),
        4 => Some(0xFE05),
        5 => Some(0xFC91),
        6 => Some(0xFE22),
        7 => Some(0xFD06),
        8 => Some(0xFD07),
        9 => Some(0xFE35),
        10 => Some(0xFE36),
        11 => Some(0xFE90),
        _ => None,
    }
}

impl Atv21 {
    /// What stands in a register now.
    pub(super) fn value(&self, address: u16) -> u16 {
        match self.frozen.get(&address) {
            Some(&value) if self.trip.is_some() => value,
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
        let shown = self.pinned.get(&address).copied().or_else(|| self.computed(address));
        shown.unwrap_or_else(|| self.bank.value(address))
    }

    /// What follows from the state of drive and motor; `None` for what stands in the bank.
    pub(super) fn computed(&self, address: u16) -> Option<u16> {
        let motor = &self.motor;
        let frequency = motor.output_frequency().unsigned_abs();
        let percent = |value: u32| word(value * 100);
        let value = match address {
            0xFC90 => self.trip.unwrap_or(0),
            0xFD00 | 0xFE15 => word(frequency),
            0xFD01 => self.status(),
            0xFD07 => self.outputs(),
            0xFD42 => self.status_2(),
            0xFE02 => self.reference(),
            0xFE03 => word(motor.current() * 10_000 / RATED_CURRENT),
            0xFE04 => 10_000,
            0xFE05 => word((frequency * 2).min(10_000)),
            0xFE14 => hours(motor.fed_for()),
            0xFE16 => word(motor.shaft_frequency().unsigned_abs()),
            0xFE18 | 0xFE20 => percent(motor.torque().unsigned_abs()),
            0xFE21 if motor.is_fed() => percent(30),
            0xFE26 | 0xFE27 => word(motor.current() * 100 / RATED_CURRENT),
            0xFE29 => word(self.power() * 105 / 100),
            0xFE30 => word(self.power()),
            0xFE45 => self.source() as u16,
            0xFE46 => self.reference_source(),
            0xFE76 => self.energy(105),
            0xFE77 => self.energy(100),
            0xFE80 => hours(self.powered),
            0xFE90 => {
                let poles = u32::from(self.bank.value(map::MOTOR_POLES.address())).max(1);
                word((frequency * 12 + 5 * poles) / (poles * 10))
            }
            _ => return None,
        };
        Some(value)
    }

    /// FD07: relay RY as FA50 orders it, relay FL at a trip.
    fn outputs(&self) -> u16 {
        let relay = self.bank.value(map::LOGIC_OUTPUT_COMMAND.address()) & 1;
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
