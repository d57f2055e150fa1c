//! What a backup keeps of an Altivar 312 and in which order a restore writes it: the interlocks and side effects that
//! BBV51701 prints beside its variables.

use drive_core::registers::{Allows, Holds, Limit, Relation, Restoring, Scaled, Step, Unit};

use crate::registers::address::*;

/// LI1 to LI6.
const INPUTS: [u16; 6] = [129, 130, 131, 132, 133, 134];
/// Cd11 to Cd15.
const BITS: [u16; 5] = [171, 172, 173, 174, 175];
const INPUTS_AND_BITS: [u16; 11] = [129, 130, 131, 132, 133, 134, 171, 172, 173, 174, 175];
/// LAC = L2 and L3.
const FROM_LEVEL_2: &[u16] = &[1, 2];
/// LAC = L3.
const LEVEL_3: &[u16] = &[2];
/// EtF by a bit, and LEt = LO, would trip (p. 52).
const HIG: &[u16] = &[1];
/// UnS in V over FrS in Hz, for VCAL = M2, M3, N4 and S6 (p. 26, 29).
const VOLTS_PER_HERTZ: &[(u16, i32)] = &[(1, 7), (2, 7), (3, 14), (4, 17)];

/// A share of the nominal drive current.
const fn of_nominal(registers: &'static [u16], least: i32, most: i32, why: &'static str) -> Limit {
    Limit { registers, by: INV, allows: Allows::Percent(least, most), why }
}

/// Words that a level does not have.
const fn from_level(
    registers: &'static [u16],
    words: &'static [u16],
    levels: &'static [u16],
    why: &'static str,
) -> Limit {
    Limit { registers, by: LAC, allows: Allows::Words(words, levels), why }
}

const PLATE: &str = "a rating of the motor takes back an auto-tuning: after the settings (BBV51701 p. 30)";
const COMMAND: &str =
    "who commands goes last: a run input that is closed may start the motor (BBV51701 p. 36, 37)";
const LOCAL: &str =
    "an input that is closed takes command in forced local mode: after the settings (BBV51701 p. 55)";

/// An output of `IOLR`.
const fn free_output(bit: u16, function: u16) -> Limit {
    Limit {
        registers: &[IOLR],
        by: function,
        allows: Allows::BitsOfUnassigned(bit),
        why: "a write only while no function has the output (BBV51701 p. 20)",
    }
}

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
        Step { registers: &[BLC], why: "it forces FLr, brA and OPL (BBV51701 p. 47)" },
    ],
    last: &[
        Step { registers: &[UNS, FRS], why: PLATE },
        Step { registers: &[NCR], why: PLATE },
        Step { registers: &[NSP], why: PLATE },
        Step { registers: &[COS], why: PLATE },
        Step { registers: &[UNS2, FRS2], why: "UnS2/FrS2 is limited (BBV51701 p. 49)" },
        // With CHCF = SIM who gives the reference commands, and +/- speed needs Fr1 or Fr2.
        Step {
            registers: &[DSP, USP, FR2, FR1, PIF, SA3, SA2, PS16, PS8, PS4, PS2],
            why: "who gives the reference goes behind the limits, with CHCF = SIM it commands; of functions that exclude each other the first \
                 blocks the other; PS4 needs PS2 (BBV51701 p. 14, 35, 36, 43, 45)",
        },
        Step { registers: &[PR4, PR2], why: "Pr4 needs Pr2 (BBV51701 p. 46)" },
        Step { registers: &[RFC], why: COMMAND },
        Step { registers: &[LCC_KEYS], why: COMMAND },
        Step { registers: &[FLOC], why: LOCAL },
        Step { registers: &[FLO], why: LOCAL },
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
        Relation {
            holds: Holds::NotAbove,
            registers: &[SMIL, SMAL],
            why: "SMIL, which is LSP, ≤ SMAL, which is HSP (BBV51701 p. 18)",
        },
        Relation {
            holds: Holds::RatioAtMost(VOLTS_PER_HERTZ),
            registers: &[UNS, FRS, VCAL],
            why: "UnS/FrS of at most 7 V/Hz for M2 and M3, 14 for N4, 17 for S6 (BBV51701 p. 29)",
        },
        Relation {
            holds: Holds::RatioAtMost(VOLTS_PER_HERTZ),
            registers: &[UNS2, FRS2, VCAL],
            why: "UnS2/FrS2 of at most 7 V/Hz for M2 and M3, 14 for N4, 17 for S6 (BBV51701 p. 49)",
        },
        Relation {
            holds: Holds::WordsOnlyWith(&BITS, HIG),
            registers: &[ETF, LET],
            why: "EtF by a bit of CMD needs LEt = HIG: with LO it is an external fault, which only switching off ends (BBV51701 p. 52)",
        },
    ],
    limits: &[
        of_nominal(&[ITH], 20, 150, "0.2 to 1.5 In (BBV51701 p. 27)"),
        of_nominal(&[CLI, CL2, NCR, NCR2], 25, 150, "0.25 to 1.5 In (BBV51701 p. 28, 29, 48, 49)"),
        of_nominal(&[CTD], 0, 150, "0 to 1.5 In (BBV51701 p. 28)"),
        of_nominal(&[IDC], 0, 100, "0 to In (BBV51701 p. 40)"),
        of_nominal(&[SDC1, SDC2], 0, 120, "0 to 1.2 In (BBV51701 p. 41)"),
        of_nominal(&[IBR], 0, 136, "0 to 1.36 In (BBV51701 p. 47)"),
        Limit {
            registers: &[UNS, UNS2],
            by: VCAL,
            allows: Allows::Between(&[(1, 100, 240), (2, 100, 240), (3, 100, 500), (4, 100, 600)]),
            why: "the voltage of the drive (BBV51701 p. 28, 49)",
        },
        Limit {
            registers: &[ACC, DEC, AC2, DE2],
            by: INR,
            allows: Allows::Between(&[(0, 5, 32_760), (1, 1, 32_760), (2, 1, 32_760)]),
            why: "the range of Inr (BBV51701 p. 38)",
        },
        from_level(&[FR1, FR2], &[160, 161], FROM_LEVEL_2, "+/- speed from LAC = L2 on (BBV51701 p. 35, 36)"),
        from_level(
            &[FR1, FR2, SA2, SA3],
            &[163, 164, 167],
            LEVEL_3,
            "LCC, Mdb and nEt with LAC = L3 (BBV51701 p. 35, 36, 42)",
        ),
        from_level(
            &[RFC],
            &[187, 188, 189, 190, 191, 203, 205, 206, 207],
            LEVEL_3,
            "a bit of CMD with LAC = L3 (BBV51701 p. 36)",
        ),
        from_level(
            &[RPS, FST, DCI, PS2, PS4, PS8, PS16, PR2, PR4, LC2, CHP, ETF],
            &BITS,
            LEVEL_3,
            "a bit of CMD with LAC = L3 (BBV51701 p. 39 to 52)",
        ),
        from_level(&[USP, DSP], &INPUTS, FROM_LEVEL_2, "+/- speed from LAC = L2 on (BBV51701 p. 35, 45)"),
        from_level(&[BLC], &[2, 64], FROM_LEVEL_2, "brake control from LAC = L2 on (BBV51701 p. 35, 47)"),
        from_level(
            &[LC2],
            &INPUTS_AND_BITS,
            FROM_LEVEL_2,
            "a second current limit from LAC = L2 on (BBV51701 p. 35, 48)",
        ),
        from_level(
            &[CHP],
            &INPUTS_AND_BITS,
            FROM_LEVEL_2,
            "a second motor from LAC = L2 on (BBV51701 p. 35, 48)",
        ),
        from_level(
            &[LAF, LAR],
            &INPUTS,
            FROM_LEVEL_2,
            "limit switches from LAC = L2 on (BBV51701 p. 35, 50)",
        ),
        free_output(1 << 8, R1),
        free_output(1 << 9, R2),
        free_output(1 << 10, DO),
        Limit {
            registers: &[AO1R],
            by: DO,
            allows: Allows::Unassigned,
            why: "a write only while dO is not assigned (BBV51701 p. 20)",
        },
    ],
    // Whoever gives the reference commands with CHCF = SIM (p. 36); a summing input and PI have the motor follow another one (p. 42, 45).
    control: &[FR1, FR2, RFC, SA2, SA3, PIF, LCC_KEYS, FLO, FLOC, CHCF, CD2, CD1, CCS, COP],
};

/// Bit 9 of `CMI`.
const HIGH_RESOLUTION: u16 = 1 << 9;
/// 32767 points are 600 Hz, of a speed too: how many poles the motor has is no register.
const POINTS: Unit = Unit::points("Hz", 2, 600).signed();

/// The ramps, whose unit `Inr` chooses (p. 38, 39); what bit 9 of `CMI` makes points (p. 16, 17, 19 to 21), with its images (p. 25,
/// 26: "identical").
pub(crate) const SCALED: &[Scaled] = &[
    Scaled {
        registers: &[ACC, DEC, AC2, DE2],
        by: INR,
        mask: u16::MAX,
        units: &[(0, Unit::scaled("s", 2)), (1, Unit::scaled("s", 1)), (2, Unit::scaled("s", 0))],
    },
    Scaled {
        registers: &[LFR, RFR, LFR1, LFR2, LFRD, RFRD, LFD1, LFD2],
        by: CMI,
        mask: HIGH_RESOLUTION,
        units: &[(HIGH_RESOLUTION, POINTS)],
    },
];
