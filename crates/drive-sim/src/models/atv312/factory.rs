//! Factory settings that the manual gives as a rule, as numbers for an ATV312HU15N4; and what a return to them keeps.

use drive_atv312::registers::address::*;

/// Nominal drive current, 4.1 A.
pub(super) const NOMINAL_CURRENT: u16 = 41;
/// 0.7 In.
const SEVEN_TENTHS: u16 = NOMINAL_CURRENT * 7 / 10;
/// 1.5 In.
const THREE_HALVES: u16 = NOMINAL_CURRENT * 3 / 2;

/// Address and value.
pub(super) const NUMBERS: &[(u16, u16)] = &[
    (COD, 0),
    // Identification (p. 26): 1.5 kW, N4, V1.2 IE04.
    (ARE, 0),
    (NCV, 6),
    (VCAL, 3),
    (INV, NOMINAL_CURRENT),
    (UDP, 0x1204),
    (TSP, 128),
    // With bFr = 50 Hz (p. 27–31, 49).
    (TFR, 600),
    (HSP, 500),
    (FRS, 500),
    (FRS2, 500),
    (FTD, 500),
    // By the drive's rating (p. 28, 29, 47, 49).
    (UNS, 400),
    (NCR, 35),
    (NSP, 1_430),
    (COS, 79),
    (ITH, NOMINAL_CURRENT),
    (UNS2, 400),
    (NCR2, 35),
    (NSP2, 1_430),
    (COS2, 79),
    (BRL, 25),
    (IBR, 35),
    // Shares of In (p. 28, 40, 41, 48).
    (CLI, THREE_HALVES),
    (CL2, THREE_HALVES),
    (SDC1, SEVEN_TENTHS),
    (SDC2, NOMINAL_CURRENT / 2),
    (CTD, NOMINAL_CURRENT),
    (IDC, SEVEN_TENTHS),
    // A three-phase drive (p. 52).
    (IPL, 1),
    // With tCC = 2C (p. 33, 42, 43, 45).
    (RRS, 130),
    (JOG, 0),
    (PS2, 131),
    (PS4, 132),
    // The ramps of p. 18, as ACC and dEC have them: to 1500 rpm in 3 s.
    (SPAL, 1_500),
    (SPAT, 3),
    (SPDL, 1_500),
    (SPDT, 3),
];

/// What a return to factory settings leaves as it is (p. 20, 55, 56): `bFr`, `LCC`, `COd`, `rPr`, the communication
/// parameters, `FLO`, `FLOC`, `rP`.
pub(super) const KEPT: &[u16] = &[BFR, LCC_KEYS, COD, RPR, ADD, TBR, TFO, TTO, ADCO, BDCO, FLO, FLOC, RP];

/// A drive that the bus commands (p. 11, 35–37, 40): `LAC`, `CHCF`, `Cd1`, `Fr1`, `dCI`, `FSt`; without a current at
/// standstill (`AdC`, p. 41).
pub(super) const SET_UP_FOR_THE_BUS: &[(u16, u16)] =
    &[(LAC, 2), (CHCF, 2), (CD1, 10), (FR1, 164), (DCI, 173), (FST, 174), (ADC, 0)];
