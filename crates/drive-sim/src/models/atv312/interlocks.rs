//! What the manual prints of values that exclude each other, and of settings that a write changes besides its own.

use drive_atv312::registers::address::*;

use super::{factory::NOMINAL_CURRENT, routing::L3};
use crate::{Bank, Exception};

/// Outputs of `IOLR` that can be written, with the register of their function: R1, R2, LO (p. 20).
const OUTPUTS: [(u16, u16); 3] = [(1 << 8, R1), (1 << 9, R2), (1 << 10, DO)];
/// Functions that a logic input can be assigned to, and that `tCC` therefore puts back (p. 33).
const INPUT_FUNCTIONS: [u16; 25] = [
    RSF, INH, ETF, CHP, RFC, CCS, RPS, LC2, TUN, RRS, JOG, NST, DCI, FST, PS2, PS4, PS8, PS16, USP, DSP, LAF,
    LAR, PR2, PR4, FLO,
];

/// The value as the drive takes it, beyond the range of the row.
pub(super) fn check(bank: &Bank, address: u16, value: u16) -> Result<u16, Exception> {
    let level = bank.value(LAC);
    let level_3 = level == L3;
    let level_wire = bank.value(TCC) == 0 && matches!(bank.value(TCT), 0 | 2);
    if matches!(value, 171..=175) && INPUT_FUNCTIONS.contains(&address) && !level_3 {
        return Err(Exception::ILLEGAL_VALUE);
    }
    // The PI regulator excludes summing and preset speeds; who comes first stays (p. 14, 45).
    let excluded = match address {
        PIF => [SA2, SA3, PS2].iter().any(|&other| bank.value(other) != 0),
        SA2 | SA3 | PS2 => bank.value(PIF) != 0,
        _ => false,
    };
    if excluded && value != 0 {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let allowed = match address {
        // Back to a lower level only by a factory setting (p. 35).
        LAC => !level_3 || value == L3,
        HSP => (bank.value(LSP)..=bank.value(TFR)).contains(&value),
        LSP => value <= bank.value(HSP),
        CHCF | COP | FLOC => level_3,
        FR1 | FR2 | SA2 | SA3 => match value {
            160 | 161 => level > 0,
            163 | 164 | 167 => level_3,
            _ => true,
        },
        ETF if value >= 171 => bank.value(LET) == 1,
        RFC | CCS if value >= 187 => level_3,
        // Brake, second current limit, second motor, limit switches (p. 47–50).
        BLC | LC2 | CHP | LAF | LAR if level == 0 => value == 0,
        PS4 => value == 0 || bank.value(PS2) != 0,
        PS8 => value == 0 || bank.value(PS4) != 0,
        PS16 => value == 0 || bank.value(PS8) != 0,
        PR4 => value == 0 || bank.value(PR2) != 0,
        USP | DSP => value == 0 || (level > 0 && [FR1, FR2].iter().any(|&fr| bank.value(fr) == 160)),
        LCC_KEYS => value == 0 || !level_3,
        TCC => value != 2 || !level_3,
        // Automatic restart and catching a spinning motor need 2-wire level control (p. 14, 51, 52).
        ATR => value == 0 || level_wire,
        FLR => value == 0 || (level_wire && bank.value(ADC) != 2),
        LFL => value != 0 || bank.value(CRH3) >= bank.value(CRL3),
        SCS | FCS => !(11..=14).contains(&value),
        ACC | DEC | AC2 | DE2 => value >= if bank.value(INR) == 0 { 5 } else { 1 },
        TA2 => value <= 100 - bank.value(TA1).min(100),
        TA4 => value <= 100 - bank.value(TA3).min(100),
        CLI | CL2 => shares(25, 150, value),
        NCR | NCR2 => shares(25, 150, value),
        ITH => shares(20, 150, value),
        BEN => value == u16::MAX || value <= bank.value(LSP),
        IBR => shares(0, 136, value),
        SDC1 | SDC2 => shares(0, 120, value),
        CTD => shares(0, 150, value),
        IDC => shares(0, 100, value),
        // An N4: 100 to 500 V, and at most 14 V/Hz (p. 28, 29).
        UNS => value <= 500 && volts_per_hertz(value, bank.value(FRS)),
        FRS => volts_per_hertz(bank.value(UNS), value),
        UNS2 => value <= 500 && volts_per_hertz(value, bank.value(FRS2)),
        FRS2 => volts_per_hertz(bank.value(UNS2), value),
        AO1R => bank.value(DO) == 0,
        _ => true,
    };
    if !allowed {
        return Err(Exception::ILLEGAL_VALUE);
    }
    Ok(if address == IOLR { outputs(bank, value) } else { value })
}

/// What a write changes besides its own register.
pub(super) fn follow(bank: &mut Bank, address: u16) {
    let value = bank.value(address);
    let set: &[(u16, u16)] = match (address, value) {
        (LAC, L3) => &[(FR1, 1), (CD1, 1), (CHCF, 1), (TCC, 0)],
        (BFR, 0) => &[(TFR, 600), (HSP, 500), (FRS, 500), (FTD, 500)],
        (BFR, _) => &[(TFR, 720), (HSP, 600), (FRS, 600), (FTD, 600)],
        (UFT, _) => &[(UFR, 20)],
        (UFT2, _) => &[(UFR2, 20)],
        (RSC, 0) => &[],
        (RSC, 1) => &[(TUN, 115), (TNL, 1)],
        (RSC, _) => &[(TNL, 1)],
        // A motor parameter after auto-tuning (p. 30).
        (UNS | FRS | NCR | NSP | COS, _) => &[(TUN, 0)],
        (BLC, 1..) => &[(FLR, 0), (BRA, 0), (OPL, 1)],
        (OPL, 2) => &[(BLC, 0)],
        _ => &[],
    };
    for &(other, value) in set {
        bank.set(other, value);
    }
    match address {
        TCC => follow_wiring(bank),
        // LSP, HSP and tFr stay in this order.
        TFR => {
            bank.set(HSP, bank.value(HSP).min(value));
            bank.set(LSP, bank.value(LSP).min(value));
        }
        INR if value == 0 => {
            for ramp in [ACC, DEC, AC2, DE2] {
                bank.set(ramp, bank.value(ramp).max(5));
            }
        }
        CRL3 | CRH3 if bank.value(CRH3) < bank.value(CRL3) => {
            bank.set(LFL, 1);
        }
        // The limits in rpm are the limits in hertz (p. 18): 3 rpm are 0.1 Hz.
        SMIL => {
            bank.set(LSP, (value / 3).min(bank.value(HSP)));
        }
        SMAL => {
            bank.set(HSP, (value / 3).max(bank.value(LSP)).min(bank.value(TFR)));
        }
        _ => {}
    }
}

/// `tCC` puts back every function of a logic input, some of them to a value of its own (p. 33, 42, 43, 45).
pub(super) fn follow_wiring(bank: &mut Bank) {
    let wiring = bank.value(TCC);
    bank.restore_factory(|row| INPUT_FUNCTIONS.contains(&row.address) || row.address == TCT);
    let own: &[(u16, u16)] = match wiring {
        1 => &[(RRS, 131), (JOG, 132), (PS2, 0), (PS4, 0)],
        2 => &[(RRS, 0)],
        _ => &[],
    };
    for &(address, value) in own {
        bank.set(address, value);
    }
}

/// `CFG` = StS differs from the factory configuration in its inputs and outputs (p. 32).
pub(super) fn choose_configuration(bank: &mut Bank) {
    if bank.value(CFG) == 0 {
        for (address, value) in [(PS2, 0), (PS4, 0), (R2, 0), (DO, 0), (SA2, 0), (SA3, 0), (R1, 1)] {
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
    (bank.value(IOLR) & !mask) | (value & mask)
}

/// Whether a current lies between two percentages of the nominal drive current.
fn shares(from: u32, to: u32, value: u16) -> bool {
    let hundredfold = u32::from(value) * 100;
    (u32::from(NOMINAL_CURRENT) * from..=u32::from(NOMINAL_CURRENT) * to).contains(&hundredfold)
}

const fn volts_per_hertz(volts: u16, decihertz: u16) -> bool {
    volts as u32 * 10 <= decihertz as u32 * 14
}
