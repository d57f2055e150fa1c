//! What a backup keeps of an Altivar 28 and in which order a restore writes it: the rules of the twins on the Altivar 312
//! (BBV51701), as far as the Altivar 28 has the registers.

use drive_core::registers::{Allows, Holds, Limit, Relation, Restoring, Step};

use crate::registers::address::*;

/// A share of the nominal drive current.
const fn of_nominal(registers: &'static [u16], least: i32, most: i32, why: &'static str) -> Limit {
    Limit { registers, by: INV, allows: Allows::Percent(least, most), why }
}

/// See [`Restoring`].
pub(crate) const RESTORING: Restoring = Restoring {
    first: &[
        Step {
            registers: &[TCC],
            why: "it puts the functions of the inputs back on the twin (BBV51701 p. 33)",
        },
        Step { registers: &[BFR], why: "it changes HSP, Ftd, FrS and tFr on the twin (BBV51701 p. 28)" },
        Step { registers: &[LSP, HSP, TFR], why: "LSP ≤ HSP ≤ tFr at every moment (BBV51701 p. 27)" },
        Step { registers: &[CRL3, CRH3], why: "the loss of 4-20 mA depends on them (BBV51701 p. 54)" },
    ],
    last: &[Step {
        registers: &[UNS, FRS],
        why: "a rating of the motor takes back an auto-tuning on the twin (BBV51701 p. 30)",
    }],
    communication: &[ADD],
    ratings: &[INV],
    // LSP, HSP and the ramps in rpm (BBV51701 p. 18, 57), and the code of whoever locked the terminal (p. 56, 57).
    unkept: &[
        SMIL_LOW, SMIL_HIGH, SMAL_LOW, SMAL_HIGH, SPAL_LOW, SPAL_HIGH, SPAT, SPDL_LOW, SPDL_HIGH, SPDT, COD,
    ],
    relations: &[Relation {
        holds: Holds::NotAbove,
        registers: &[LSP, HSP, TFR],
        why: "LSP ≤ HSP ≤ tFr on the twin (BBV51701 p. 27)",
    }],
    limits: &[
        of_nominal(&[ITH], 20, 150, "0.2 to 1.5 In on the twin (BBV51701 p. 27)"),
        of_nominal(&[CTD], 0, 150, "0 to 1.5 In on the twin (BBV51701 p. 28)"),
        of_nominal(&[IDC], 0, 100, "0 to In on the twin (BBV51701 p. 40)"),
    ],
    ..Restoring::NONE
};
