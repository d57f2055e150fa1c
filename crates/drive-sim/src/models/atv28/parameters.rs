//! From the registers of the Altivar 28 to what acts on chart and motor.

use std::time::Duration;

use drive_atv28::registers::{ACC, DEC, FRS, HSP, IDC, INV, LSP};

use crate::{
    Bank, Ramp, Ramps,
    models::drivecom::{CommandBits, LinkWatch, Reaction, Settings, Stop},
};

/// Fault of the Modbus link, SLF.
const LINK_FAULT: u16 = 5;
/// A fast stop takes the deceleration divided by this (dCF of the twin, BBV51701 p. 40).
const FAST_STOP_DIVIDER: u32 = 4;
/// Time of the DC injection (tdC of the twin, p. 40).
const INJECTION_TIME: Duration = Duration::from_millis(500);
/// The settings that the registers make. A count of a ramp is taken for 0.1 s, as on the twin; direct current for a
/// share of the nominal one.
pub(super) fn settings(bank: &Bank, commanded: bool) -> Settings {
    let full_scale = u32::from(bank.value(FRS.address())) * 10;
    let ramp =
        |address| Ramp { full_scale, time: Duration::from_millis(u64::from(bank.value(address)) * 100) };
    let deceleration = ramp(DEC.address());
    let nominal = bank.value(INV.address()).max(1);
    Settings {
        starts_enabled: true,
        bus_commands: commanded,
        bus_reference: true,
        bits: CommandBits::BASIC,
        ramps: Ramps { acceleration: ramp(ACC.address()), deceleration },
        fast_stop: Ramp { time: deceleration.time / FAST_STOP_DIVIDER, ..deceleration },
        stop: Stop::Ramp,
        injection_current: u16::try_from(u32::from(bank.value(IDC.address())) * 100 / u32::from(nominal))
            .unwrap_or(u16::MAX),
        injection_time: INJECTION_TIME,
        low_speed: u32::from(bank.value(LSP.address())) * 10,
        high_speed: u32::from(bank.value(HSP.address())) * 10,
        // No document says that a silent line trips an Altivar 28.
        link: LinkWatch { timeout: None, reaction: Reaction::Ignore, code: LINK_FAULT },
    }
}
