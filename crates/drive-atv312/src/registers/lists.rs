//! The values of the list-type registers, each list with its page in BBV51701. Only these values may be written (p. 7).

use drive_core::registers::Choice;

const NO: Choice = Choice::new(0, "nO", "");
const INACTIVE: Choice = Choice::new(0, "nO", "function inactive");
const UNASSIGNED: Choice = Choice::new(0, "nO", "not assigned");
const IGNORED: Choice = Choice::new(0, "nO", "ignored");
const ACTIVE: Choice = Choice::new(1, "YES", "function active");
const FREEWHEEL: Choice = Choice::new(1, "YES", "freewheel stop");
const RAMP: Choice = Choice::new(6, "rMP", "stop on ramp");
const FAST: Choice = Choice::new(7, "FSt", "fast stop");
const LI1: Choice = Choice::new(129, "LI1", "logic input LI1");
const LI2: Choice = Choice::new(130, "LI2", "logic input LI2");
const LI3: Choice = Choice::new(131, "LI3", "logic input LI3");
const LI4: Choice = Choice::new(132, "LI4", "logic input LI4");
const LI5: Choice = Choice::new(133, "LI5", "logic input LI5");
const LI6: Choice = Choice::new(134, "LI6", "logic input LI6");
const CD11: Choice = Choice::new(171, "Cd11", "bit 11 of CMD");
const CD12: Choice = Choice::new(172, "Cd12", "bit 12 of CMD");
const CD13: Choice = Choice::new(173, "Cd13", "bit 13 of CMD");
const CD14: Choice = Choice::new(174, "Cd14", "bit 14 of CMD");
const CD15: Choice = Choice::new(175, "Cd15", "bit 15 of CMD");
const C111: Choice = Choice::new(187, "C111", "bit 11 of CMD by Modbus");
const C112: Choice = Choice::new(188, "C112", "bit 12 of CMD by Modbus");
const C113: Choice = Choice::new(189, "C113", "bit 13 of CMD by Modbus");
const C114: Choice = Choice::new(190, "C114", "bit 14 of CMD by Modbus");
const C115: Choice = Choice::new(191, "C115", "bit 15 of CMD by Modbus");
const C211: Choice = Choice::new(203, "C211", "bit 11 of CMD by CANopen");
const C212: Choice = Choice::new(204, "C212", "bit 12 of CMD by CANopen");
const C213: Choice = Choice::new(205, "C213", "bit 13 of CMD by CANopen");
const C214: Choice = Choice::new(206, "C214", "bit 14 of CMD by CANopen");
const C215: Choice = Choice::new(207, "C215", "bit 15 of CMD by CANopen");
const AI1: Choice = Choice::new(1, "AI1", "analog input AI1");
const AI2: Choice = Choice::new(2, "AI2", "analog input AI2");
const AI3: Choice = Choice::new(3, "AI3", "analog input AI3");
const AIV1: Choice = Choice::new(16, "AIV1", "potentiometer");
const LCC: Choice = Choice::new(163, "LCC", "remote display terminal");
const MDB: Choice = Choice::new(164, "Mdb", "Modbus");
const NET: Choice = Choice::new(167, "nEt", "CANopen");
const FLT: Choice = Choice::new(1, "FLt", "drive detected fault");
const RUN: Choice = Choice::new(2, "rUn", "drive running");
const FTA: Choice = Choice::new(4, "FtA", "frequency threshold Ftd reached");
const FLA: Choice = Choice::new(5, "FLA", "high speed HSP reached");
const CTA: Choice = Choice::new(6, "CtA", "current threshold Ctd reached");
const SRA: Choice = Choice::new(7, "SrA", "frequency reference reached");
const TSA: Choice = Choice::new(8, "tSA", "motor thermal threshold ttd reached");
const BLC: Choice = Choice::new(9, "bLC", "brake sequence, set and cleared only through bLC");
const APL: Choice = Choice::new(12, "APL", "loss of the 4-20 mA signal, also with LFL = nO");

/// A function that is off or on.
pub(crate) const NO_YES: &[Choice] = &[INACTIVE, ACTIVE];
/// A function on a logic input.
pub(crate) const INPUTS: &[Choice] = &[UNASSIGNED, LI1, LI2, LI3, LI4, LI5, LI6];
/// A function on a logic input or, with LAC = L3, on a bit of the control word.
pub(crate) const INPUTS_AND_BITS: &[Choice] =
    &[UNASSIGNED, LI1, LI2, LI3, LI4, LI5, LI6, CD11, CD12, CD13, CD14, CD15];
/// What a detected fault does: p. 52–53.
pub(crate) const REACTIONS: &[Choice] = &[IGNORED, FREEWHEEL, RAMP, FAST];

/// `COd`, p. 56; above 1 the value is the code.
pub(crate) const LOCKING: &[Choice] =
    &[Choice::new(0, "OFF", "no locking code"), Choice::new(1, "On", "access is locked by a code")];
/// `LAC`, p. 35.
pub(crate) const ACCESS_LEVELS: &[Choice] = &[
    Choice::new(0, "L1", "standard functions, interchangeable with ATV28"),
    Choice::new(1, "L2", "advanced functions"),
    Choice::new(2, "L3", "advanced functions and mixed control modes"),
];
/// `ARE`, p. 26.
pub(crate) const DRIVE_TYPES: &[Choice] = &[
    Choice::new(0, "ATV312", ""),
    Choice::new(1, "ATV312 Europe", "without built-in keypad"),
    Choice::new(3, "ATV312 Asia", "with built-in keypad"),
];
/// `NCV`, p. 26.
pub(crate) const RATINGS: &[Choice] = &[
    Choice::new(0, "?", "unknown"),
    Choice::new(1, "018", "0.18 kW"),
    Choice::new(2, "037", "0.37 kW"),
    Choice::new(3, "055", "0.55 kW"),
    Choice::new(4, "075", "0.75 kW"),
    Choice::new(5, "U11", "1.1 kW"),
    Choice::new(6, "U15", "1.5 kW"),
    Choice::new(7, "U22", "2.2 kW"),
    Choice::new(8, "U30", "3 kW"),
    Choice::new(9, "U40", "4 kW"),
    Choice::new(10, "U55", "5.5 kW"),
    Choice::new(11, "U75", "7.5 kW"),
    Choice::new(12, "D11", "11 kW"),
    Choice::new(13, "D15", "15 kW"),
];
/// `VCAL`, p. 26.
pub(crate) const VOLTAGES: &[Choice] = &[
    Choice::new(0, "?", "unknown"),
    Choice::new(1, "M2", "200-240 V single phase"),
    Choice::new(2, "M3", "200-240 V 3-phase"),
    Choice::new(3, "N4", "380-500 V 3-phase"),
    Choice::new(4, "S6", "525-600 V 3-phase"),
];
/// `TSP`, p. 26.
pub(crate) const FIRMWARE_TYPES: &[Choice] = &[Choice::new(128, "ATV312", "")];
/// `O1Ct`, p. 23.
pub(crate) const OPTION_CARDS: &[Choice] = &[
    Choice::new(0, "nO", "no option"),
    Choice::new(15, "PbS", "Profibus"),
    Choice::new(18, "dnt", "DeviceNet"),
];
/// `bFr`, p. 28.
pub(crate) const MAINS: &[Choice] =
    &[Choice::new(0, "50", "50 Hz, IEC"), Choice::new(1, "60", "60 Hz, NEMA")];
/// `CFG`, p. 32.
pub(crate) const CONFIGURATIONS: &[Choice] =
    &[Choice::new(0, "StS", "run/stop configuration"), Choice::new(1, "Std", "factory configuration")];
/// `nrd`, p. 31.
pub(crate) const MODULATION: &[Choice] =
    &[Choice::new(0, "nO", "fixed frequency"), Choice::new(1, "YES", "random modulation")];
/// `rPr`, p. 55.
pub(crate) const TIME_RESET: &[Choice] = &[NO, Choice::new(2, "rtH", "operating time reset to zero")];
/// `AO1t`, p. 34.
pub(crate) const ANALOG_TYPES: &[Choice] = &[
    Choice::new(1, "10U", "0-10 V on AOV"),
    Choice::new(2, "0A", "0-20 mA on AOC"),
    Choice::new(3, "4A", "4-20 mA on AOC"),
];
/// `r1`, p. 34.
pub(crate) const RELAY_1: &[Choice] =
    &[UNASSIGNED, FLT, RUN, FTA, FLA, CTA, SRA, TSA, APL, LI1, LI2, LI3, LI4, LI5, LI6];
/// `r2`, p. 35.
pub(crate) const RELAY_2: &[Choice] =
    &[UNASSIGNED, FLT, RUN, FTA, FLA, CTA, SRA, TSA, BLC, APL, LI1, LI2, LI3, LI4, LI5, LI6];
/// `dO`, p. 34: logic up to 12, analog above.
pub(crate) const OUTPUT: &[Choice] = &[
    UNASSIGNED,
    FLT,
    RUN,
    FTA,
    FLA,
    CTA,
    SRA,
    TSA,
    BLC,
    APL,
    Choice::new(129, "OCr", "motor current, full scale 2 In"),
    Choice::new(130, "OFr", "motor frequency, full scale tFr"),
    Choice::new(132, "Otr", "motor torque, full scale twice nominal"),
    Choice::new(139, "OPr", "drive power, full scale twice nominal"),
];
/// `tbr`, p. 55.
pub(crate) const SPEEDS: &[Choice] = &[
    Choice::new(24, "4.8", "4800 bit/s"),
    Choice::new(28, "9.6", "9600 bit/s"),
    Choice::new(32, "19.2", "19200 bit/s"),
];
/// `tFO`, p. 55.
pub(crate) const FORMATS: &[Choice] = &[
    Choice::new(2, "8O1", ""),
    Choice::new(3, "8E1", ""),
    Choice::new(4, "8n1", ""),
    Choice::new(5, "8n2", ""),
];
/// `bdCO`, p. 55.
pub(crate) const CANOPEN_SPEEDS: &[Choice] = &[
    Choice::new(30, "10.0", "10 kbit/s"),
    Choice::new(34, "20.0", "20 kbit/s"),
    Choice::new(38, "50.0", "50 kbit/s"),
    Choice::new(52, "125.0", "125 kbit/s"),
    Choice::new(60, "250.0", "250 kbit/s"),
    Choice::new(68, "500.0", "500 kbit/s"),
    Choice::new(76, "1000", "1000 kbit/s"),
];
/// `ErCO`, p. 25.
pub(crate) const CANOPEN_ERRORS: &[Choice] = &[
    Choice::new(0, "no error", ""),
    Choice::new(1, "bus off", ""),
    Choice::new(2, "life time", ""),
    Choice::new(3, "net overrun", ""),
    Choice::new(4, "heartbeat", ""),
];
/// `IPL`, p. 52.
pub(crate) const LINE_PHASE: &[Choice] = &[IGNORED, Choice::new(1, "YES", "fast stop")];
/// `LFL`, p. 54.
pub(crate) const SIGNAL_LOSS: &[Choice] = &[
    IGNORED,
    FREEWHEEL,
    Choice::new(4, "LFF", "fallback speed LFF"),
    Choice::new(5, "rLS", "keeps the speed until the signal is back"),
    RAMP,
    FAST,
];
/// `StP`, p. 54.
pub(crate) const MAINS_BREAK: &[Choice] = &[
    Choice::new(0, "nO", "lock and freewheel"),
    Choice::new(1, "MMS", "uses the inertia to keep the supply up"),
    Choice::new(2, "rMP", "the valid ramp"),
    Choice::new(3, "FSt", "fast stop"),
];
/// `tnL`, p. 53.
pub(crate) const TUNING_FAULT: &[Choice] = &[
    Choice::new(0, "nO", "ignored, back to the factory settings"),
    Choice::new(1, "YES", "locks when auto-tuning fails"),
];
/// `LEt`, p. 52.
pub(crate) const EXTERNAL_FAULT: &[Choice] = &[
    Choice::new(0, "LO", "fault when the input goes to 0"),
    Choice::new(1, "HIG", "fault when the input or bit goes to 1"),
];
/// `tAr`, p. 51.
pub(crate) const RESTART_TIMES: &[Choice] = &[
    Choice::new(0, "5", "5 minutes"),
    Choice::new(1, "10", "10 minutes"),
    Choice::new(2, "30", "30 minutes"),
    Choice::new(3, "1h", "1 hour"),
    Choice::new(4, "2h", "2 hours"),
    Choice::new(5, "3h", "3 hours"),
    Choice::new(6, "Ct", "unlimited (3 hours for OPF and PHF)"),
];
/// `rP`, p. 56.
pub(crate) const RESET_ALL: &[Choice] =
    &[Choice::new(0, "No", ""), Choice::new(1, "Yes", "reset all faults")];
/// `LFt` and `DP1` to `DP4`, p. 24; meanings and remedies stand in [`FAULTS`](crate::FAULTS).
pub(crate) const FAULT_CODES: &[Choice] = &[
    Choice::new(0, "nOF", "no fault code saved"),
    Choice::new(3, "CFF", "incorrect configuration"),
    Choice::new(4, "CFI", "invalid configuration"),
    Choice::new(5, "SLF", "Modbus communication interruption"),
    Choice::new(6, "ILF", "internal communication interruption"),
    Choice::new(7, "CnF", "communication option card"),
    Choice::new(8, "EPF", "external fault"),
    Choice::new(9, "OCF", "overcurrent"),
    Choice::new(10, "CrF", "capacitor pre-charge"),
    Choice::new(13, "LFF", "4-20 mA loss"),
    Choice::new(16, "OHF", "drive overheating"),
    Choice::new(17, "OLF", "motor overload"),
    Choice::new(18, "ObF", "DC bus overvoltage"),
    Choice::new(19, "OSF", "line supply overvoltage"),
    Choice::new(20, "OPF", "motor phase loss"),
    Choice::new(21, "PHF", "line phase loss"),
    Choice::new(22, "USF", "line supply undervoltage"),
    Choice::new(23, "OCF", "motor short-circuit, phase to phase"),
    Choice::new(24, "SOF", "motor overspeed"),
    Choice::new(25, "tnF", "auto-tuning was unsuccessful"),
    Choice::new(26, "IF1", "unknown rating"),
    Choice::new(27, "IF2", "MMI card"),
    Choice::new(28, "IF3", "MMI communication"),
    Choice::new(29, "IF4", "industrial EEPROM"),
    Choice::new(30, "EEF", "EEPROM memory"),
    Choice::new(31, "OCF", "impeding short-circuit"),
    Choice::new(32, "SCF", "motor short-circuit to ground"),
    Choice::new(33, "OPF", "motor phase loss, 3 phases"),
    Choice::new(34, "COF", "CANopen communication interruption"),
    Choice::new(35, "bLF", "brake control"),
    Choice::new(36, "OCF", "power module, ATV312·D15· only"),
    Choice::new(55, "SCF", "power module or motor short-circuit at power-up"),
];
/// `SCS`, p. 31.
pub(crate) const SAVE_CONFIGURATION: &[Choice] = &[
    INACTIVE,
    Choice::new(2, "Str1", "save to the EEPROM backup"),
    Choice::new(11, "FIL1", "file of the remote terminal"),
    Choice::new(12, "FIL2", "file of the remote terminal"),
    Choice::new(13, "FIL3", "file of the remote terminal"),
    Choice::new(14, "FIL4", "file of the remote terminal"),
];
/// `FCS`, p. 32.
pub(crate) const RESTORE_CONFIGURATION: &[Choice] = &[
    INACTIVE,
    Choice::new(2, "rEC1", "restore the backup of SCS"),
    Choice::new(11, "FIL1", "file of the remote terminal"),
    Choice::new(12, "FIL2", "file of the remote terminal"),
    Choice::new(13, "FIL3", "file of the remote terminal"),
    Choice::new(14, "FIL4", "file of the remote terminal"),
    Choice::new(64, "InI", "the configuration of CFG"),
];
/// `CHCF`, p. 36.
pub(crate) const CHANNEL_MODES: &[Choice] =
    &[Choice::new(1, "SIM", "combined"), Choice::new(2, "SEP", "separate")];
/// `COP`, p. 37.
pub(crate) const CHANNEL_COPIES: &[Choice] = &[
    Choice::new(0, "nO", "no copy"),
    Choice::new(1, "SP", "copy reference"),
    Choice::new(2, "Cd", "copy control"),
    Choice::new(3, "ALL", "copy control and reference"),
];
/// `rFC`, p. 36; 204 (C212) is not in the manual's list.
pub(crate) const REFERENCE_SWITCHING: &[Choice] = &[
    Choice::new(96, "Fr1", "reference 1"),
    Choice::new(97, "Fr2", "reference 2"),
    LI1,
    LI2,
    LI3,
    LI4,
    LI5,
    LI6,
    C111,
    C112,
    C113,
    C114,
    C115,
    C211,
    C213,
    C214,
    C215,
];
const UPDT: Choice = Choice::new(160, "UPdt", "+/- speed by logic inputs");
const UPDH: Choice = Choice::new(161, "UPdH", "+/- speed by jog dial");
/// `Fr1`, p. 35: 160 and 161 with LAC = L2 or L3, above that with L3.
pub(crate) const REFERENCE_1: &[Choice] = &[AI1, AI2, AI3, AIV1, UPDT, UPDH, LCC, MDB, NET];
/// `Fr2`, p. 36.
pub(crate) const REFERENCE_2: &[Choice] = &[UNASSIGNED, AI1, AI2, AI3, AIV1, UPDT, UPDH, LCC, MDB, NET];
/// `CCS`, p. 37.
pub(crate) const COMMAND_SWITCHING: &[Choice] = &[
    Choice::new(98, "Cd1", "control channel 1"),
    Choice::new(99, "Cd2", "control channel 2"),
    LI1,
    LI2,
    LI3,
    LI4,
    LI5,
    LI6,
    C111,
    C112,
    C113,
    C114,
    C115,
    C211,
    C212,
    C213,
    C214,
    C215,
];
/// `Cd1` and `Cd2`, p. 37.
pub(crate) const COMMAND_CHANNELS: &[Choice] = &[
    Choice::new(1, "tEr", "terminals"),
    Choice::new(2, "LOC", "keypad"),
    Choice::new(3, "LCC", "remote display terminal"),
    Choice::new(10, "Mdb", "Modbus"),
    Choice::new(20, "nEt", "CANopen"),
];
/// `FLOC`, p. 55.
pub(crate) const LOCAL_CHANNELS: &[Choice] = &[
    Choice::new(1, "AI1", "analog input AI1, logic inputs"),
    Choice::new(2, "AI2", "analog input AI2, logic inputs"),
    Choice::new(3, "AI3", "analog input AI3, logic inputs"),
    Choice::new(16, "AIV1", "potentiometer, RUN and STOP keys"),
    Choice::new(163, "LCC", "remote display terminal"),
];
/// `ERRD`, p. 17.
pub(crate) const CIA_402_ERRORS: &[Choice] = &[
    Choice::new(0x0000, "nOF", "no fault code saved"),
    Choice::new(0x1000, "CrF, OLF or SOF", "capacitor pre-charge, motor overload or overspeed"),
    Choice::new(0x2310, "OCF", "overcurrent"),
    Choice::new(0x2320, "OCF", "impeding short-circuit or power module"),
    Choice::new(0x2330, "SCF", "motor short-circuit to ground"),
    Choice::new(0x2340, "OCF", "motor short-circuit, phase to phase"),
    Choice::new(0x3110, "OSF", "line supply overvoltage"),
    Choice::new(0x3120, "USF", "line supply undervoltage"),
    Choice::new(0x3130, "PHF", "line supply phase loss"),
    Choice::new(0x3310, "ObF or OPF", "DC bus overvoltage or motor phase loss"),
    Choice::new(0x4210, "OHF", "drive overheating"),
    Choice::new(0x5520, "EEF", "EEPROM memory"),
    Choice::new(0x6100, "InF", "internal"),
    Choice::new(0x6300, "CFF or CFI", "incorrect or invalid configuration"),
    Choice::new(0x7300, "LFF", "4-20 mA loss"),
    Choice::new(0x7510, "SLF or CnF", "Modbus or communication card interruption"),
    Choice::new(0x7520, "ILF", "optional internal link"),
    Choice::new(0x8100, "COF", "CANopen communication interruption"),
    Choice::new(0x9000, "EPF", "external fault"),
    Choice::new(0xFF00, "tnF", "auto-tuning was unsuccessful"),
    Choice::new(0xFF01, "bLF", "brake control"),
];
/// `rPt`, p. 38.
pub(crate) const RAMP_TYPES: &[Choice] = &[
    Choice::new(0, "LIn", "linear"),
    Choice::new(1, "S", "S ramp"),
    Choice::new(2, "U", "U ramp"),
    Choice::new(3, "CUS", "customised by tA1 to tA4"),
];
/// `Inr`, p. 38.
pub(crate) const RAMP_INCREMENTS: &[Choice] = &[
    Choice::new(0, "0.01", "ramps of 0.05 to 327.6 s"),
    Choice::new(1, "0.1", "ramps of 0.1 to 3276 s"),
    Choice::new(2, "1", "ramps of 1 to 32760 s"),
];
/// `SrF`, p. 31.
pub(crate) const SPEED_FILTER: &[Choice] =
    &[Choice::new(0, "nO", "filter active"), Choice::new(1, "YES", "filter suppressed")];
/// `UFt` and `UFt2`, p. 31 and 49.
pub(crate) const MOTOR_LAWS: &[Choice] = &[
    Choice::new(0, "L", "constant torque, motors in parallel or special"),
    Choice::new(1, "P", "variable torque, pumps and fans"),
    Choice::new(2, "n", "sensorless flux vector"),
    Choice::new(3, "nLd", "energy saving"),
];
/// `tUn`, p. 30.
pub(crate) const TUNING: &[Choice] = &[
    Choice::new(0, "nO", "not performed"),
    Choice::new(112, "YES", "as soon as possible"),
    Choice::new(113, "dOnE", "uses the last values"),
    Choice::new(114, "rUn", "at every run command"),
    Choice::new(115, "POn", "at every power-up"),
    LI1,
    LI2,
    LI3,
    LI4,
    LI5,
    LI6,
];
/// `tUS`, p. 30.
pub(crate) const TUNING_STATES: &[Choice] = &[
    Choice::new(0, "tAb", "default stator resistance used"),
    Choice::new(1, "PEnd", "requested, not yet performed"),
    Choice::new(2, "PrOG", "in progress"),
    Choice::new(3, "FAIL", "failed"),
    Choice::new(4, "dOnE", "measured value used"),
    Choice::new(5, "Strd", "cold-state resistance rSC used"),
];
/// `OPL`, p. 52.
pub(crate) const MOTOR_PHASE: &[Choice] = &[
    INACTIVE,
    Choice::new(1, "YES", "trips OPF"),
    Choice::new(2, "OAC", "no trip, output voltage managed, flying restart"),
];
/// `rSC`, p. 29; above 1 the value is the resistance.
pub(crate) const COLD_RESISTANCE: &[Choice] = &[INACTIVE, Choice::new(1, "InIt", "measure")];
/// `bLC`, p. 47.
pub(crate) const BRAKE_OUTPUTS: &[Choice] =
    &[UNASSIGNED, Choice::new(2, "r2", "relay R2"), Choice::new(64, "dO", "logic output AOC")];
/// `bEn`, p. 47.
pub(crate) const BRAKE_ENGAGE: &[Choice] = &[Choice::new(65_535, "nO", "not set")];
/// `bIP`, p. 47.
pub(crate) const BRAKE_PULSE: &[Choice] = &[
    Choice::new(0, "nO", "torque in the commanded direction"),
    Choice::new(1, "YES", "torque always forward"),
];
/// `AdC`, p. 41.
pub(crate) const STANDSTILL_INJECTION: &[Choice] = &[
    Choice::new(0, "nO", "no injection"),
    Choice::new(1, "YES", "for an adjustable time"),
    Choice::new(2, "Ct", "continuous"),
];
/// `tCC`, p. 33.
pub(crate) const WIRING: &[Choice] = &[
    Choice::new(0, "2C", "2-wire control"),
    Choice::new(1, "3C", "3-wire control, pulses"),
    Choice::new(2, "LOC", "local RUN, STOP and RESET; inactive with LAC = L3"),
];
/// `tCt`, p. 33.
pub(crate) const TWO_WIRE: &[Choice] = &[
    Choice::new(0, "LEL", "level"),
    Choice::new(1, "trn", "transition"),
    Choice::new(2, "PFO", "level, forward has priority"),
];
/// `Stt`, p. 40.
pub(crate) const STOP_TYPES: &[Choice] = &[
    Choice::new(0, "rMP", "stop on ramp"),
    Choice::new(1, "FSt", "fast stop"),
    Choice::new(2, "nSt", "freewheel stop"),
    Choice::new(3, "dCI", "DC injection stop"),
];
/// `Str`, p. 45.
pub(crate) const REFERENCE_SAVING: &[Choice] = &[
    Choice::new(0, "nO", "no saving"),
    Choice::new(1, "rAM", "saved to RAM"),
    Choice::new(2, "EEP", "saved to EEPROM"),
];
/// `LAS`, p. 50.
pub(crate) const LIMIT_STOPS: &[Choice] = &[
    Choice::new(0, "rMP", "stop on ramp"),
    Choice::new(1, "FSt", "fast stop"),
    Choice::new(2, "nSt", "freewheel stop"),
];
/// `SA2` and `SA3`, p. 42.
pub(crate) const SUMMING: &[Choice] = &[UNASSIGNED, AI1, AI2, AI3, AIV1, LCC, MDB, NET];
/// `PIF`, p. 45.
pub(crate) const PI_FEEDBACK: &[Choice] = &[UNASSIGNED, AI1, AI2, AI3];
/// `PII`, p. 47.
pub(crate) const PI_REFERENCE: &[Choice] =
    &[Choice::new(0, "nO", "the reference is Fr1"), Choice::new(1, "YES", "the internal reference rPI")];
/// `PIC`, p. 46.
pub(crate) const PI_DIRECTION: &[Choice] =
    &[Choice::new(0, "nO", "normal"), Choice::new(1, "YES", "reverse")];
/// `rOt`, p. 38.
pub(crate) const DIRECTIONS: &[Choice] = &[
    Choice::new(0, "dFr", "forward"),
    Choice::new(1, "drS", "reverse"),
    Choice::new(2, "bOt", "both directions"),
];
/// `PSt`, p. 38.
pub(crate) const STOP_PRIORITY: &[Choice] =
    &[INACTIVE, Choice::new(1, "YES", "the STOP key has priority over every channel")];
/// `LCC`, p. 38.
pub(crate) const REMOTE_TERMINAL: &[Choice] =
    &[INACTIVE, Choice::new(1, "YES", "control by the keys of the remote terminal")];
