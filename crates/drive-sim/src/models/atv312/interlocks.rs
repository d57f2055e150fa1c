//! What the manual prints of values that exclude each other, and of settings that a write changes besides its own.

use super::{factory::NOMINAL_CURRENT, settings::L3};
use crate::{Bank, Exception};

/// Outputs of `IOLR` that can be written, with the register of their function: R1, R2, LO (p. 20).
const OUTPUTS: [(u16, u16); 3] = [(1 << 8, 5001), (1 << 9, 5002), (1 << 10, 5031)];
/// Functions that a logic input can be assigned to, and that `tCC` therefore puts back (p. 33).
const INPUT_FUNCTIONS: [u16; 25] = [
    7124, 7125, 7131, 8011, 8411, 8421, 9010, 9202, 9608, 11105, 11110, 11202, 11203, 11204, 11401, 11402,
    11403, 11404, 11501, 11502, 11601, 11602, 11909, 11910, 8431,
];

/// The value as the drive takes it, beyond the range of the row.
pub(super) fn check(bank: &Bank, address: u16, value: u16) -> Result<u16, Exception> {
    let level = bank.value(3006);
    let level_3 = level == L3;
    let level_wire = bank.value(11101) == 0 && matches!(bank.value(11102), 0 | 2);
    if matches!(value, 171..=175) && INPUT_FUNCTIONS.contains(&address) && !level_3 {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let allowed = match address {
        // Back to a lower level only by a factory setting (p. 35).
        3006 => !level_3 || value == L3,
        3104 => (bank.value(3105)..=bank.value(3103)).contains(&value),
        3105 => value <= bank.value(3104),
        8401 | 8402 | 8432 => level_3,
        8413 | 8414 | 11801 | 11802 => match value {
            160 | 161 => level > 0,
            163 | 164 | 167 => level_3,
            _ => true,
        },
        7131 if value >= 171 => bank.value(7090) == 1,
        8411 | 8421 if value >= 187 => level_3,
        // Brake, second current limit, second motor, limit switches (p. 47–50).
        10001 | 9202 | 8011 | 11601 | 11602 if level == 0 => value == 0,
        11402 => value == 0 || bank.value(11401) != 0,
        11403 => value == 0 || bank.value(11402) != 0,
        11404 => value == 0 || bank.value(11403) != 0,
        11910 => value == 0 || bank.value(11909) != 0,
        11501 | 11502 => value == 0 || (level > 0 && [8413, 8414].iter().any(|&fr| bank.value(fr) == 160)),
        64003 => value == 0 || !level_3,
        11101 => value != 2 || !level_3,
        // Automatic restart and catching a spinning motor need 2-wire level control (p. 14, 51, 52).
        7122 => value == 0 || level_wire,
        3110 => value == 0 || (level_wire && bank.value(10401) != 2),
        7003 => value != 0 || bank.value(4444) >= bank.value(4434),
        8001 | 8002 => !(11..=14).contains(&value),
        9001 | 9002 | 9012 | 9013 => value >= if bank.value(9020) == 0 { 5 } else { 1 },
        9006 => value <= 100 - bank.value(9005).min(100),
        9008 => value <= 100 - bank.value(9007).min(100),
        9201 | 9203 => shares(25, 150, value),
        9603 | 9703 => shares(25, 150, value),
        9622 => shares(20, 150, value),
        10003 => value == u16::MAX || value <= bank.value(3105),
        10006 => shares(0, 136, value),
        10403 | 10405 => shares(0, 120, value),
        11001 => shares(0, 150, value),
        11210 => shares(0, 100, value),
        // An N4: 100 to 500 V, and at most 14 V/Hz (p. 28, 29).
        9601 => value <= 500 && volts_per_hertz(value, bank.value(9602)),
        9602 => volts_per_hertz(bank.value(9601), value),
        9701 => value <= 500 && volts_per_hertz(value, bank.value(9702)),
        9702 => volts_per_hertz(bank.value(9701), value),
        11410..=11424 => value <= bank.value(3104),
        5261 => bank.value(5031) == 0,
        _ => true,
    };
    if !allowed {
        return Err(Exception::ILLEGAL_VALUE);
    }
    Ok(if address == 5240 { outputs(bank, value) } else { value })
}

/// What a write changes besides its own register.
pub(super) fn follow(bank: &mut Bank, address: u16) {
    let value = bank.value(address);
    let set: &[(u16, u16)] = match (address, value) {
        (3006, L3) => &[(8413, 1), (8423, 1), (8401, 1), (11101, 0)],
        (3015, 0) => &[(3103, 600), (3104, 500), (9602, 500), (11003, 500)],
        (3015, _) => &[(3103, 720), (3104, 600), (9602, 600), (11003, 600)],
        (9607, _) => &[(9623, 20)],
        (9707, _) => &[(9723, 20)],
        (9643, 0) => &[],
        (9643, 1) => &[(9608, 115), (7012, 1)],
        (9643, _) => &[(7012, 1)],
        // A motor parameter after auto-tuning (p. 30).
        (9601 | 9602 | 9603 | 9604 | 9606, _) => &[(9608, 0)],
        (10001, 1..) => &[(3110, 0), (9003, 0), (9611, 1)],
        (9611, 2) => &[(10001, 0)],
        _ => &[],
    };
    for &(other, value) in set {
        bank.set(other, value);
    }
    match address {
        11101 => follow_wiring(bank),
        // LSP, HSP and tFr stay in this order.
        3103 => {
            bank.set(3104, bank.value(3104).min(value));
            bank.set(3105, bank.value(3105).min(value));
        }
        9020 if value == 0 => {
            for ramp in [9001, 9002, 9012, 9013] {
                bank.set(ramp, bank.value(ramp).max(5));
            }
        }
        4434 | 4444 if bank.value(4444) < bank.value(4434) => {
            bank.set(7003, 1);
        }
        // The limits in rpm are the limits in hertz (p. 18): 3 rpm are 0.1 Hz.
        8607 => {
            bank.set(3105, (value / 3).min(bank.value(3104)));
        }
        8609 => {
            bank.set(3104, (value / 3).max(bank.value(3105)).min(bank.value(3103)));
        }
        _ => {}
    }
}

/// `tCC` puts back every function of a logic input, some of them to a value of its own (p. 33, 42, 43, 45).
pub(super) fn follow_wiring(bank: &mut Bank) {
    let wiring = bank.value(11101);
    bank.restore_factory(|row| INPUT_FUNCTIONS.contains(&row.address) || row.address == 11102);
    let own: &[(u16, u16)] = match wiring {
        1 => &[(11105, 131), (11110, 132), (11401, 0), (11402, 0)],
        2 => &[(11105, 0)],
        _ => &[],
    };
    for &(address, value) in own {
        bank.set(address, value);
    }
}

/// `CFG` = StS differs from the factory configuration in its inputs and outputs (p. 32).
pub(super) fn choose_configuration(bank: &mut Bank) {
    if bank.value(3052) == 0 {
        for (address, value) in
            [(11401, 0), (11402, 0), (5002, 0), (5031, 0), (11801, 0), (11802, 0), (5001, 1)]
        {
            bank.set(address, value);
        }
    }
}

/// The configuration as the backup has it, registers that the drive computes aside.
pub(super) fn restore(bank: &mut Bank, backup: &Bank) {
    use drive_core::registers::Storage;
    let parameters = drive_atv312::ROWS.iter().filter(|row| row.storage != Storage::Volatile);
    for row in parameters {
        bank.set(row.address, backup.value(row.address));
    }
}

/// `IOLR` with those outputs changed that no function is assigned to.
fn outputs(bank: &Bank, value: u16) -> u16 {
    let free = OUTPUTS.into_iter().filter(|&(_, function)| bank.value(function) == 0);
    let mask = free.fold(0, |mask, (bit, _)| mask | bit);
    (bank.value(5240) & !mask) | (value & mask)
}

/// Whether a current lies between two percentages of the nominal drive current.
fn shares(from: u32, to: u32, value: u16) -> bool {
    let hundredfold = u32::from(value) * 100;
    (u32::from(NOMINAL_CURRENT) * from..=u32::from(NOMINAL_CURRENT) * to).contains(&hundredfold)
}

const fn volts_per_hertz(volts: u16, decihertz: u16) -> bool {
    volts as u32 * 10 <= decihertz as u32 * 14
}
