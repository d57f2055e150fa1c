//! From the registers to what acts on chart and motor.

use std::time::Duration;

use drive_atv312::words::ExtendedControl;

use super::{CMI, factory::NOMINAL_CURRENT};
use crate::{
    Bank, Ramp, Ramps,
    models::drivecom::{CommandBits, LinkWatch, Reaction, Settings, Stop, centihertz},
};

/// Access level L3 in `LAC`.
pub(super) const L3: u16 = 2;

/// The settings in force, with this control word.
pub(super) fn settings(bank: &Bank, commanded: bool, word: u16) -> Settings {
    let level_3 = bank.value(3006) == L3;
    let commands = if level_3 { commands_by_modbus(bank, word) } else { commanded && bank.value(64003) == 0 };
    let (acceleration, deceleration) = if second_ramps(bank, word) { (9012, 9013) } else { (9001, 9002) };
    let deceleration = ramp(bank, deceleration);
    // 0 stands for the shortest ramp (p. 40).
    let divided = deceleration.time.checked_div(u32::from(bank.value(11230))).unwrap_or(Duration::ZERO);
    let high_speed = bank.value(3104).min(bank.value(3103));
    Settings {
        starts_enabled: !(level_3 && commands),
        bus_commands: commands,
        bus_reference: !level_3 || reference_channel(bank, word) == 164,
        bits: bits(bank, level_3),
        ramps: Ramps { acceleration: ramp(bank, acceleration), deceleration },
        fast_stop: Ramp { time: divided, ..deceleration },
        stop: match bank.value(11201) {
            1 => Stop::Fast,
            2 => Stop::Freewheel,
            3 => Stop::DcInjection,
            _ => Stop::Ramp,
        },
        injection_current: bank.value(11210).saturating_mul(100) / NOMINAL_CURRENT,
        injection_time: Duration::from_millis(u64::from(bank.value(11211)) * 100),
        low_speed: u32::from(bank.value(3105)) * 10,
        high_speed: u32::from(high_speed) * 10,
        link: LinkWatch {
            timeout: Some(Duration::from_millis(u64::from(bank.value(6005)) * 100)),
            reaction: reaction(bank.value(7010)),
            code: 5,
        },
    }
}

/// `EPL`, `OHL`, `OLL`, `SLL` and `COL` (p. 52–53).
pub(super) const fn reaction(value: u16) -> Reaction {
    match value {
        0 => Reaction::Ignore,
        6 => Reaction::Ramp,
        7 => Reaction::Fast,
        _ => Reaction::Freewheel,
    }
}

/// The preset speed that bits of the control word or logic inputs choose, in hundredths of a hertz (p. 42–44).
pub(super) fn preset(bank: &Bank, word: u16) -> Option<i32> {
    let choice: u16 = [(11401, 1), (11402, 2), (11403, 4), (11404, 8)]
        .into_iter()
        .filter(|&(function, _)| is_on(bank, bank.value(function), word))
        .map(|(_, weight)| weight)
        .sum();
    (choice > 0).then(|| i32::from(bank.value(11409 + choice)) * 10)
}

/// Whether the bit or input of `EtF` reports an external fault (p. 52).
pub(super) fn external_fault(bank: &Bank, word: u16) -> bool {
    let assigned = bank.value(7131);
    assigned != 0 && is_on(bank, assigned, word) == (bank.value(7090) == 1)
}

/// `LFr` as hundredths of a hertz: 0.1 Hz a count, or 32767 for 600 Hz (p. 19).
pub(super) fn frequency(value: u16, cmi: ExtendedControl) -> i32 {
    let count = i32::from(value.cast_signed());
    if cmi.contains(ExtendedControl::HIGH_RESOLUTION) { count * 60_000 / 32_767 } else { count * 10 }
}

/// `LFRD` as hundredths of a hertz: 1 rpm a count, or 32767 for 600 Hz (p. 16).
pub(super) fn frequency_of_speed(value: u16, cmi: ExtendedControl) -> i32 {
    if cmi.contains(ExtendedControl::HIGH_RESOLUTION) {
        return frequency(value, cmi);
    }
    centihertz(i32::from(value.cast_signed()))
}

/// Hundredths of a hertz as a count of `rFr` or `LFr`.
pub(super) fn counts(centihertz: i32, cmi: ExtendedControl) -> i32 {
    if cmi.contains(ExtendedControl::HIGH_RESOLUTION) {
        centihertz * 32_767 / 60_000
    } else {
        centihertz / 10
    }
}

/// Whether `AC2` and `dE2` are in force (p. 20, 39). The threshold `Frt` is left out.
pub(super) fn second_ramps(bank: &Bank, word: u16) -> bool {
    let switched = ExtendedControl::from_bits_retain(bank.value(CMI)).contains(ExtendedControl::RAMP_SWITCH);
    switched || is_on(bank, bank.value(9010), word)
}

/// Whether the reference comes by `Fr2` (p. 36).
pub(super) fn by_reference_2(bank: &Bank, word: u16) -> bool {
    let switch = bank.value(8411);
    switch == 97 || is_on(bank, switch, word)
}

/// Whether the command comes by channel 2: with `CHCF` = SIM the one of the reference (p. 36, 37).
pub(super) fn by_command_2(bank: &Bank, word: u16) -> bool {
    if bank.value(8401) != 2 {
        return by_reference_2(bank, word);
    }
    let switch = bank.value(8421);
    switch == 99 || is_on(bank, switch, word)
}

fn reference_channel(bank: &Bank, word: u16) -> u16 {
    bank.value(if by_reference_2(bank, word) { 8414 } else { 8413 })
}

fn commands_by_modbus(bank: &Bank, word: u16) -> bool {
    match (bank.value(8401), by_command_2(bank, word)) {
        (2, false) => bank.value(8423) == 10,
        (2, true) => bank.value(8424) == 10,
        _ => reference_channel(bank, word) == 164,
    }
}

/// Whether what a function is assigned to is at 1: a logic input (129–134), or a bit of the control word (Cd11–Cd15 are
/// 171–175, C111–C115 are 187–191).
fn is_on(bank: &Bank, assigned: u16, word: u16) -> bool {
    let (source, bit) = match assigned {
        129..=134 => (bank.value(5240), assigned - 129),
        171..=175 => (word, assigned - 160),
        187..=191 => (word, assigned - 176),
        _ => return false,
    };
    source & 1 << bit != 0
}

/// At L3 a bit that has got a function has lost its own (p. 19).
fn bits(bank: &Bank, level_3: bool) -> CommandBits {
    if !level_3 {
        return CommandBits::BASIC;
    }
    let of = |function| match bank.value(function) {
        assigned @ 171..=175 => 1 << (assigned - 160),
        _ => 0,
    };
    let functions = [9010, 9202, 7131, 8011, 11401, 11402, 11403, 11404, 11909, 11910, 11203, 11204];
    let taken = functions.into_iter().fold(0_u16, |taken, function| taken | of(function));
    let switches = [8411, 8421].map(|switch| match bank.value(switch) {
        assigned @ 187..=191 => 1 << (assigned - 176),
        _ => 0,
    });
    let taken = switches.into_iter().fold(taken, |taken: u16, bit: u16| taken | bit);
    CommandBits {
        reverse: CommandBits::LEVEL_3.reverse & !taken,
        stop: CommandBits::LEVEL_3.stop & !taken,
        injection: of(11203),
        fast_stop: of(11204),
    }
}

/// A ramp from 0 to `FrS`, in counts of `Inr` (p. 38, 39).
fn ramp(bank: &Bank, address: u16) -> Ramp {
    let count = match bank.value(9020) {
        0 => 10,
        1 => 100,
        _ => 1_000,
    };
    let time = Duration::from_millis(u64::from(bank.value(address)) * count);
    Ramp { full_scale: u32::from(bank.value(9602)) * 10, time }
}
