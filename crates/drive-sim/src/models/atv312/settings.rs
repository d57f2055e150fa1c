//! From the registers to the parameters of chart and motor.

use std::time::Duration;

use drive_atv312::{registers::address::*, words::ExtendedControl};

use super::{factory::NOMINAL_CURRENT, routing::Routing};
use crate::{
    Bank, Ramp, Ramps,
    models::drivecom::{
        CommandBits, Injection, LinkWatch, Reaction, Restarts, Settings, Standstill, Stop, centihertz,
    },
};

/// The faults after which `Atr` restarts the drive (p. 51): SLF, EPF, LFF, OHF, OLF, ObF, OSF, OPF, PHF, COF.
const RESTARTED: &[u16] = &[5, 8, 13, 16, 17, 18, 19, 20, 21, 33, 34];

/// The parameters in force.
pub(super) fn settings(routing: &Routing<'_>) -> Settings {
    let bank = routing.bank;
    let tenths = |address| Duration::from_millis(u64::from(bank.value(address)) * 100);
    let percent = |address| bank.value(address).saturating_mul(100) / NOMINAL_CURRENT;
    let (acceleration, deceleration) = if routing.second_ramps() { (AC2, DE2) } else { (ACC, DEC) };
    let deceleration = ramp(bank, deceleration);
    // 0 stands for the shortest ramp (p. 40).
    let divided = deceleration.time.checked_div(u32::from(bank.value(DCF))).unwrap_or(Duration::ZERO);
    let standstill = match bank.value(ADC) {
        1 => Standstill::Timed,
        2 => Standstill::Continuous,
        _ => Standstill::No,
    };
    let injections = [(SDC1, TDC1), (SDC2, TDC2)];
    Settings {
        bits: bits(bank, routing.level_3()),
        runs_by_level: by_level(bank),
        ramps: Ramps { acceleration: ramp(bank, acceleration), deceleration },
        fast_stop: Ramp { time: divided, ..deceleration },
        stop: match bank.value(STT) {
            1 => Stop::Fast,
            2 => Stop::Freewheel,
            3 => Stop::DcInjection,
            _ => Stop::Ramp,
        },
        injection_current: percent(IDC),
        injection_limit: percent(ITH) / 2,
        injection_time: tenths(TDC),
        standstill: (
            standstill,
            injections.map(|(current, time)| Injection { percent: percent(current), time: tenths(time) }),
        ),
        low_speed: u32::from(bank.value(LSP)) * 10,
        high_speed: u32::from(bank.value(HSP).min(bank.value(TFR))) * 10,
        low_speed_time: Some(tenths(TLS)).filter(|time| !time.is_zero()),
        brake_release: if bank.value(BLC) == 0 {
            Duration::ZERO
        } else {
            Duration::from_millis(u64::from(bank.value(BRT)) * 10)
        },
        restarts: restarts(bank),
        link: LinkWatch { timeout: Some(tenths(TTO)), reaction: reaction(bank.value(SLL)), code: super::SLF },
    }
}

/// Whether a run command counts by its level: `tCC` = 2C and `tCt` = LEL or PFO.
pub(super) fn by_level(bank: &Bank) -> bool {
    bank.value(TCC) == 0 && bank.value(TCT) != 1
}

/// `Atr` and `tAr` (p. 51).
fn restarts(bank: &Bank) -> Option<Restarts> {
    let minutes = match bank.value(TAR) {
        0 => Some(5),
        1 => Some(10),
        2 => Some(30),
        3 => Some(60),
        4 => Some(120),
        5 => Some(180),
        _ => None,
    };
    let limit = minutes.map(|minutes| Duration::from_secs(minutes * 60));
    (bank.value(ATR) == 1 && by_level(bank)).then_some(Restarts { after: RESTARTED, limit })
}

/// What a fault of this code does (`LFL`, `EPL`, `OHL`, `OLL`, `SLL`, `COL`, `IPL`, `OPL`, `StP`; p. 52–54).
pub(super) fn reaction_to(bank: &Bank, code: u16) -> Reaction {
    match code {
        8 => reaction(bank.value(EPL)),
        13 => reaction(bank.value(LFL)),
        16 => reaction(bank.value(OHL)),
        17 => reaction(bank.value(OLL)),
        5 => reaction(bank.value(SLL)),
        34 => reaction(bank.value(COL)),
        // A fast stop, or nothing.
        21 if bank.value(IPL) == 0 => Reaction::Ignore,
        21 => Reaction::Fast,
        // OAC trips no more than nO does.
        20 | 33 if bank.value(OPL) != 1 => Reaction::Ignore,
        22 => match bank.value(STP) {
            0 => Reaction::Freewheel,
            3 => Reaction::Fast,
            _ => Reaction::Ramp,
        },
        _ => Reaction::Freewheel,
    }
}

/// A loss of the 4–20 mA answered by a speed (`LFL` 4, 5) is no fault.
const fn reaction(value: u16) -> Reaction {
    match value {
        0 | 4 | 5 => Reaction::Ignore,
        6 => Reaction::Ramp,
        7 => Reaction::Fast,
        _ => Reaction::Freewheel,
    }
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

/// At L3 a bit that has got a function has lost its own (p. 19).
fn bits(bank: &Bank, level_3: bool) -> CommandBits {
    if !level_3 {
        return CommandBits::BASIC;
    }
    let of = |function| match bank.value(function) {
        assigned @ 171..=175 => 1 << (assigned - 160),
        assigned @ 187..=191 => 1 << (assigned - 176),
        _ => 0,
    };
    let functions = [RPS, LC2, ETF, CHP, PS2, PS4, PS8, PS16, PR2, PR4, DCI, FST, RFC, CCS];
    let taken = functions.into_iter().fold(0_u16, |taken, function| taken | of(function));
    CommandBits {
        reverse: CommandBits::LEVEL_3.reverse & !taken,
        stop: CommandBits::LEVEL_3.stop & !taken,
        injection: of(DCI),
        fast_stop: of(FST),
    }
}

/// A ramp from 0 to `FrS`, in counts of `Inr` (p. 38, 39).
fn ramp(bank: &Bank, address: u16) -> Ramp {
    let count = match bank.value(INR) {
        0 => 10,
        1 => 100,
        _ => 1_000,
    };
    let time = Duration::from_millis(u64::from(bank.value(address)) * count);
    Ramp { full_scale: u32::from(bank.value(FRS)) * 10, time }
}
