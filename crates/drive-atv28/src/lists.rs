//! The values of the Altivar 28's list-type registers, as on their Altivar 312 twins (BBV51701, page at each list),
//! without what the twin has only beyond access level L1.

use drive_core::registers::Choice;

/// No and yes (p. 39, 46, 52, 54).
pub(crate) const NO_YES: &[Choice] = &[Choice::new(0, "nO", "inactive"), Choice::new(1, "YES", "active")];

/// `tCC` (p. 33).
pub(crate) const TCC: &[Choice] = &[
    Choice::new(0, "2C", "2-wire control"),
    Choice::new(1, "3C", "3-wire control"),
    Choice::new(2, "LOC", "local control by the panel"),
];

/// `bFr` (p. 28).
pub(crate) const BFR: &[Choice] = &[Choice::new(0, "50", "50 Hz"), Choice::new(1, "60", "60 Hz")];

/// `nrd` (p. 31).
pub(crate) const NRD: &[Choice] =
    &[Choice::new(0, "nO", "fixed frequency"), Choice::new(1, "YES", "random modulation")];

/// `UFt` (p. 31).
pub(crate) const UFT: &[Choice] = &[
    Choice::new(0, "L", "constant torque, motors in parallel or special"),
    Choice::new(1, "P", "variable torque, pumps and fans"),
    Choice::new(2, "n", "sensorless flux vector"),
    Choice::new(3, "nLd", "energy saving"),
];

/// `r2` (p. 34, 35).
pub(crate) const R2: &[Choice] = &[
    Choice::new(0, "nO", "not assigned"),
    Choice::new(1, "FLt", "no fault present"),
    Choice::new(2, "rUn", "drive running"),
    Choice::new(4, "FtA", "frequency threshold Ftd reached"),
    Choice::new(5, "FLA", "high speed HSP reached"),
    Choice::new(6, "CtA", "current threshold Ctd reached"),
    Choice::new(7, "SrA", "reference reached"),
    Choice::new(8, "tSA", "motor thermal threshold ttd reached"),
    Choice::new(12, "APL", "4-20 mA lost"),
    Choice::new(129, "LI1", "copies logic input LI1"),
    Choice::new(130, "LI2", "copies logic input LI2"),
    Choice::new(131, "LI3", "copies logic input LI3"),
    Choice::new(132, "LI4", "copies logic input LI4"),
    Choice::new(133, "LI5", "copies logic input LI5"),
    Choice::new(134, "LI6", "copies logic input LI6"),
];

/// `OPL` (p. 52).
pub(crate) const OPL: &[Choice] = &[
    Choice::new(0, "nO", "inactive"),
    Choice::new(1, "YES", "trips OPF"),
    Choice::new(2, "OAC", "no trip, for a downstream contactor"),
];

/// `IPL` (p. 52).
pub(crate) const IPL: &[Choice] =
    &[Choice::new(0, "nO", "ignored"), Choice::new(1, "YES", "trips with a fast stop")];

/// `rOt` (p. 38).
pub(crate) const ROT: &[Choice] = &[
    Choice::new(0, "dFr", "forward"),
    Choice::new(1, "drS", "reverse"),
    Choice::new(2, "bOt", "both directions"),
];

/// `LFt` and `DP1` to `DP4` (p. 24); meanings and remedies are in [`crate::FAULTS`].
pub(crate) const LFT: &[Choice] = &[
    Choice::new(0, "nOF", "no fault code saved"),
    Choice::new(3, "CFF", "incorrect configuration"),
    Choice::new(4, "CFI", "invalid configuration"),
    Choice::new(5, "SLF", "Modbus communication interrupted"),
    Choice::new(6, "ILF", "internal communication interrupted"),
    Choice::new(8, "EPF", "external fault"),
    Choice::new(9, "OCF", "overcurrent"),
    Choice::new(10, "CrF", "capacitor pre-charge"),
    Choice::new(13, "LFF", "4-20 mA lost"),
    Choice::new(16, "OHF", "drive overheating"),
    Choice::new(17, "OLF", "motor overload"),
    Choice::new(18, "ObF", "DC bus overvoltage"),
    Choice::new(19, "OSF", "line overvoltage"),
    Choice::new(20, "OPF", "motor phase loss"),
    Choice::new(21, "PHF", "line phase loss"),
    Choice::new(22, "USF", "line undervoltage"),
    Choice::new(23, "OCF", "motor short circuit between phases"),
    Choice::new(24, "SOF", "motor overspeed"),
    Choice::new(25, "tnF", "auto-tuning failed"),
    Choice::new(26, "IF1", "unknown rating"),
    Choice::new(27, "IF2", "MMI card"),
    Choice::new(28, "IF3", "MMI communication"),
    Choice::new(29, "IF4", "industrial EEPROM"),
    Choice::new(30, "EEF", "EEPROM"),
    Choice::new(31, "OCF", "impeding short circuit"),
    Choice::new(32, "SCF", "motor short circuit to ground"),
    Choice::new(33, "OPF", "motor phase loss, three phases"),
    Choice::new(55, "SCF", "power module or motor short circuit, found at power-up"),
];

/// `ERRD` (p. 17).
pub(crate) const ERRD: &[Choice] = &[
    Choice::new(0x0000, "nOF", "no fault code saved"),
    Choice::new(0x1000, "CrF OLF SOF", "capacitor pre-charge, motor overload or motor overspeed"),
    Choice::new(0x2310, "OCF", "overcurrent"),
    Choice::new(0x2320, "OCF", "impeding short circuit"),
    Choice::new(0x2330, "SCF", "motor short circuit to ground"),
    Choice::new(0x2340, "OCF", "motor short circuit between phases"),
    Choice::new(0x3110, "OSF", "line overvoltage"),
    Choice::new(0x3120, "USF", "line undervoltage"),
    Choice::new(0x3130, "PHF", "line phase loss"),
    Choice::new(0x3310, "ObF OPF", "DC bus overvoltage or motor phase loss"),
    Choice::new(0x4210, "OHF", "drive overheating"),
    Choice::new(0x5520, "EEF", "EEPROM"),
    Choice::new(0x6100, "InF", "internal fault"),
    Choice::new(0x6300, "CFF CFI", "incorrect or invalid configuration"),
    Choice::new(0x7300, "LFF", "4-20 mA lost"),
    Choice::new(0x7510, "SLF", "Modbus communication interrupted"),
    Choice::new(0x7520, "ILF", "internal communication interrupted"),
    Choice::new(0x9000, "EPF", "external fault"),
    Choice::new(0xFF00, "tnF", "auto-tuning failed"),
];
