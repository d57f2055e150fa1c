//! What a backup keeps of an Altivar 312 and in which order a restore writes it: the interlocks and side effects that
//! BBV51701 prints beside its variables.

use drive_core::registers::{Holds, Relation, Restoring, Scaled, Step, Unit};

use crate::registers::address::*;

const PLATE: &str = "a rating of the motor takes back an auto-tuning: after the settings (BBV51701 p. 30)";
const COMMAND: &str =
    "who commands goes last: a run input that is closed may start the motor (BBV51701 p. 36, 37)";

/// See [`Restoring`].
pub(crate) const RESTORING: Restoring = Restoring {
    first: &[
        Step { registers: &[LAC], why: "L3 puts Fr1, Cd1, CHCF and tCC back (BBV51701 p. 35)" },
        Step {
            registers: &[TCC],
            why: "it puts rrS, tCt and every function of a logic input back (BBV51701 p. 33)",
        },
        Step { registers: &[TCT], why: "Atr and FLr need 2-wire level control (BBV51701 p. 51, 52)" },
        Step { registers: &[BFR], why: "it changes HSP, Ftd, FrS and tFr (BBV51701 p. 28)" },
        Step { registers: &[UFT], why: "it puts UFr back (BBV51701 p. 27)" },
        Step { registers: &[UFT2], why: "it puts UFr2 back (BBV51701 p. 50)" },
        Step { registers: &[RSC], why: "a cold-state resistance forces tnL (BBV51701 p. 53)" },
        Step { registers: &[INR], why: "it is the unit of ACC, dEC, AC2 and dE2 (BBV51701 p. 38)" },
        Step {
            registers: &[BEN, LSP, HSP, TFR],
            why: "bEn ≤ LSP ≤ HSP ≤ tFr at every moment (BBV51701 p. 27, 47)",
        },
        Step { registers: &[TA1, TA2], why: "tA1 + tA2 at most 100 (BBV51701 p. 38)" },
        Step { registers: &[TA3, TA4], why: "tA3 + tA4 at most 100 (BBV51701 p. 38)" },
        Step { registers: &[CRL3, CRH3], why: "LFL depends on them (BBV51701 p. 54)" },
        Step { registers: &[ETF, LET], why: "EtF by a control bit needs LEt = HIG (BBV51701 p. 52)" },
        Step {
            registers: &[DSP, USP, FR2, FR1, PIF, SA3, SA2, PS16, PS8, PS4, PS2],
            why: "of functions that exclude each other the first blocks the other; PS4 needs PS2 (BBV51701 p. 14, 43, 45)",
        },
        Step { registers: &[PR4, PR2], why: "Pr4 needs Pr2 (BBV51701 p. 46)" },
        Step { registers: &[BLC], why: "it forces FLr, brA and OPL (BBV51701 p. 47)" },
    ],
    last: &[
        Step { registers: &[UNS, FRS], why: PLATE },
        Step { registers: &[NCR], why: PLATE },
        Step { registers: &[NSP], why: PLATE },
        Step { registers: &[COS], why: PLATE },
        Step { registers: &[UNS2, FRS2], why: "UnS2/FrS2 is limited (BBV51701 p. 49)" },
        Step { registers: &[CHCF], why: COMMAND },
        Step { registers: &[CD2], why: COMMAND },
        Step { registers: &[CD1], why: COMMAND },
        Step { registers: &[CCS], why: COMMAND },
        Step { registers: &[COP], why: COMMAND },
    ],
    // p. 55.
    communication: &[ADD, TBR, TFO, ADCO, BDCO],
    // p. 26.
    ratings: &[NCV, VCAL, INV, ARE],
    // LSP, HSP and the ramps in rpm (p. 18), and the code of whoever locked the keypad (p. 56).
    unkept: &[SMIL, SMIL_HIGH, SMAL, SMAL_HIGH, SPAL, SPAL_HIGH, SPAT, SPDL, SPDL_HIGH, SPDT, COD],
    by_hand: &[(
        CFG,
        "it loads a whole configuration at once, with other functions of the terminals and with control by them: see that the \
         wiring suits it (DANGER, BBV51701 p. 32), set it at the drive at standstill, then restore",
    )],
    // The manuals do not say when they act (BBV51701 p. 55, BBV52816 p. 9).
    acts_later: &[(
        &[ADD, TBR, TFO, ADCO, BDCO],
        "the manual does not say when it acts: switch the drive off and on to be sure (BBV51701 p. 55)",
    )],
    left: &[(&[TUN], "auto-tuning belongs to the motor on its cable: tune at the drive (BBV51701 p. 30)")],
    relations: &[
        Relation {
            holds: Holds::NotAbove,
            registers: &[LSP, HSP, TFR],
            why: "LSP ≤ HSP ≤ tFr (BBV51701 p. 27)",
        },
        Relation { holds: Holds::NotAbove, registers: &[BEN, LSP], why: "bEn ≤ LSP (BBV51701 p. 47)" },
        Relation {
            holds: Holds::SumAtMost(100),
            registers: &[TA1, TA2],
            why: "tA1 + tA2 ≤ 100 % (BBV51701 p. 38)",
        },
        Relation {
            holds: Holds::SumAtMost(100),
            registers: &[TA3, TA4],
            why: "tA3 + tA4 ≤ 100 % (BBV51701 p. 38)",
        },
        Relation {
            holds: Holds::NotWithoutNext,
            registers: &[PS16, PS8, PS4, PS2],
            why: "PS4 needs PS2, PS8 needs PS4, PS16 needs PS8 (BBV51701 p. 43)",
        },
        Relation {
            holds: Holds::NotWithoutNext,
            registers: &[PR4, PR2],
            why: "Pr4 needs Pr2 (BBV51701 p. 46)",
        },
    ],
    control: &[CHCF, CD2, CD1, CCS, COP],
};

/// The ramps, whose unit `Inr` chooses (p. 38, 39).
pub(crate) const SCALED: &[Scaled] = &[Scaled {
    registers: &[ACC, DEC, AC2, DE2],
    by: INR,
    units: &[(0, Unit::scaled("s", 2)), (1, Unit::scaled("s", 1)), (2, Unit::scaled("s", 0))],
}];
