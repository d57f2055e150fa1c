//! From the registers of the Altivar 28 to what acts on chart and motor.

use std::time::Duration;

use drive_atv28::registers::address::*;

use crate::{
    Bank, Ramp, Ramps,
    models::drivecom::{CommandBits, Injection, LinkWatch, Reaction, Settings, Standstill, Stop},
};

/// Fault of the Modbus link, SLF.
const LINK_FAULT: u16 = 5;
/// A fast stop takes the deceleration divided by this (dCF of the twin, BBV51701 p. 40).
const FAST_STOP_DIVIDER: u32 = 4;
/// Time of the DC injection (tdC of the twin, p. 40).
const INJECTION_TIME: Duration = Duration::from_millis(500);
/// The settings that the registers make. A count of a ramp is taken for 0.1 s, as on the twin; direct current for a
/// share of the nominal one.
pub(super) fn settings(bank: &Bank, runs_by_level: bool) -> Settings {
    let full_scale = u32::from(bank.value(FRS)) * 10;
    let ramp =
        |address| Ramp { full_scale, time: Duration::from_millis(u64::from(bank.value(address)) * 100) };
    let deceleration = ramp(DEC);
    let nominal = bank.value(INV).max(1);
    let percent = |address| bank.value(address).saturating_mul(100) / nominal;
    let low_speed_time = Duration::from_millis(u64::from(bank.value(TLS)) * 100);
    Settings {
        bits: CommandBits::BASIC,
        runs_by_level,
        ramps: Ramps { acceleration: ramp(ACC), deceleration },
        fast_stop: Ramp { time: deceleration.time / FAST_STOP_DIVIDER, ..deceleration },
        stop: Stop::Ramp,
        injection_current: percent(IDC),
        injection_limit: percent(ITH) / 2,
        injection_time: INJECTION_TIME,
        standstill: (Standstill::No, [Injection::default(); 2]),
        low_speed: u32::from(bank.value(LSP)) * 10,
        high_speed: u32::from(bank.value(HSP)) * 10,
        low_speed_time: Some(low_speed_time).filter(|time| !time.is_zero()),
        brake_release: Duration::ZERO,
        restarts: None,
        // No document says that a silent line trips an Altivar 28.
        link: LinkWatch { timeout: None, reaction: Reaction::Ignore, code: LINK_FAULT },
    }
}
