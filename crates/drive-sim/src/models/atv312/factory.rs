//! Factory settings that the manual gives as a rule, as numbers for an ATV312HU15N4; and what a return to them keeps.

/// Nominal drive current, 4.1 A.
pub(super) const NOMINAL_CURRENT: u16 = 41;
/// 0.7 In.
const SEVEN_TENTHS: u16 = NOMINAL_CURRENT * 7 / 10;
/// 1.5 In.
const THREE_HALVES: u16 = NOMINAL_CURRENT * 3 / 2;

/// Address and value.
pub(super) const NUMBERS: &[(u16, u16)] = &[
    (3003, 0),
    // Identification (p. 26): 1.5 kW, N4, V1.2 IE04.
    (3010, 0),
    (3011, 6),
    (3012, 3),
    (3017, NOMINAL_CURRENT),
    (3302, 0x1204),
    (3401, 128),
    // With bFr = 50 Hz (p. 27–31, 49).
    (3103, 600),
    (3104, 500),
    (9602, 500),
    (9702, 500),
    (11003, 500),
    // By the drive's rating (p. 28, 29, 47, 49).
    (9601, 400),
    (9603, 35),
    (9604, 1_430),
    (9606, 79),
    (9622, NOMINAL_CURRENT),
    (9701, 400),
    (9703, 35),
    (9704, 1_430),
    (9706, 79),
    (10002, 25),
    (10006, 35),
    // Shares of In (p. 28, 40, 41, 48).
    (9201, THREE_HALVES),
    (9203, THREE_HALVES),
    (10403, SEVEN_TENTHS),
    (10405, NOMINAL_CURRENT / 2),
    (11001, NOMINAL_CURRENT),
    (11210, SEVEN_TENTHS),
    // A three-phase drive (p. 52).
    (7002, 1),
    // With tCC = 2C (p. 33, 42, 43, 45).
    (11105, 130),
    (11110, 0),
    (11401, 131),
    (11402, 132),
    // The ramps of p. 18, as ACC and dEC have them: to 1500 rpm in 3 s.
    (8611, 1_500),
    (8613, 3),
    (8614, 1_500),
    (8616, 3),
];

/// What a return to factory settings leaves as it is (p. 20, 55, 56): `bFr`, `LCC`, `COd`, `rPr`, the communication
/// parameters, `FLO`, `FLOC`, `rP`.
pub(super) const KEPT: &[u16] =
    &[3015, 64003, 3003, 3120, 6001, 6003, 6004, 6005, 6051, 6053, 8431, 8432, 7128];

/// A drive that the bus commands (p. 11, 35–37, 40): `LAC`, `CHCF`, `Cd1`, `Fr1`, `dCI`, `FSt`.
pub(super) const SET_UP_FOR_THE_BUS: &[(u16, u16)] =
    &[(3006, 2), (8401, 2), (8423, 10), (8413, 164), (11203, 173), (11204, 174)];
