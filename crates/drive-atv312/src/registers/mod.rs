//! Every register of the communication variables manual BBV51701 06/2009, in its order, and the high words of its 32-bit
//! values. Its access letters are R, R/WS (written only with the motor stopped) and R/W (p. 7).
//!
//! A parameter that is written lives in RAM until [`persist`](drive_core::Drive::persist) saves all of them to EEPROM:
//! the manual speaks of saving "the current parameters from the RAM to the EEPROM" (p. 20, 22). W3102 to W3105, W9001 and
//! W9002 are printed in the Modbus manual BBV52816 04/2009 too.

mod lists;

use drive_core::registers;

use lists::*;

const HZ: registers::Unit = registers::Unit::scaled("Hz", 1);
const AMPERE: registers::Unit = registers::Unit::scaled("A", 1);
const PERCENT: registers::Unit = registers::Unit::scaled("%", 0);
const RPM: registers::Unit = registers::Unit::scaled("rpm", 0);
/// The high word of a 32-bit speed: SPAL and SPDL end at 65535 rpm, SMIL and SMAL at the speeds of 500 Hz, so it is 0 (p. 18, 27).
const HIGH: registers::Unit = registers::Unit::scaled("× 65536 rpm", 0);
const SECOND: registers::Unit = registers::Unit::scaled("s", 1);
/// The manual prints 0.1 s, which is the factory's `Inr` (p. 38, 39); a count is whatever `Inr` says.
const RAMP: registers::Unit = registers::Unit::scaled("× Inr", 0);

/// `bFr` chooses it (p. 27–29, 49).
const MAINS_FREQUENCY: registers::Factory =
    registers::Factory::Chosen(address::BFR, &[(0, 500), (1, 600)], "50.0 Hz, with bFr = 60: 60.0 Hz");

registers! {
    /// Every register of an Altivar 312.
    pub const ROWS;

    // IEC 61800-7 variables (p. 16–18).
    CMDD: ReadWrite(8601, "CMDD", "IEC 61800-7 control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 16");
    LFRD: ReadWrite(8602, "LFRD", "speed reference via the bus (signed value); with CMI bit 9: 32767 for 600 Hz", Volatile, RPM.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 16");
    ETAD: Read(8603, "ETAD", "IEC 61800-7 status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 17");
    FRHD: Read(8605, "FRHD", "speed reference (signed ramp input)", Volatile, RPM.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 17");
    RFRD: Read(8604, "RFRD", "output speed (signed value); with CMI bit 9: 32767 for 600 Hz", Volatile, RPM.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 17");
    ERRD: Read(8606, "ERRD", "fault code", Volatile, Unit::BITS, Range::OneOf(CIA_402_ERRORS), Factory::None, Elsewhere, "BBV51701 p. 17");
    SMIL: ReadWrite(8607, "SMIL", "min. speed", RamUntilSaved, RPM, Range::Described(0, 65_535, "0 to HSP in rpm"), Factory::None, Elsewhere, "BBV51701 p. 18");
    SMIL_HIGH: ReadWrite(8608, "SMIL high", "min. speed, high word", RamUntilSaved, HIGH, Range::Within(0, 0), Factory::None, Elsewhere, "BBV51701 p. 18");
    SMAL: ReadWrite(8609, "SMAL", "max. speed", RamUntilSaved, RPM, Range::Described(0, 65_535, "LSP to tFr in rpm"), Factory::None, Elsewhere, "BBV51701 p. 18");
    SMAL_HIGH: ReadWrite(8610, "SMAL high", "max. speed, high word", RamUntilSaved, HIGH, Range::Within(0, 0), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPAL: ReadWrite(8611, "SPAL", "acceleration, speed delta", RamUntilSaved, RPM, Range::Within(1, 65_535), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPAL_HIGH: ReadWrite(8612, "SPAL high", "acceleration, speed delta, high word", RamUntilSaved, HIGH, Range::Within(0, 0), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPAT: ReadWrite(8613, "SPAT", "acceleration, time delta", RamUntilSaved, Unit::scaled("s", 0), Range::Within(0, 65_535), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPDL: ReadWrite(8614, "SPDL", "deceleration, speed delta", RamUntilSaved, RPM, Range::Within(1, 65_535), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPDL_HIGH: ReadWrite(8615, "SPDL high", "deceleration, speed delta, high word", RamUntilSaved, HIGH, Range::Within(0, 0), Factory::None, Elsewhere, "BBV51701 p. 18");
    SPDT: ReadWrite(8616, "SPDT", "deceleration, time delta", RamUntilSaved, Unit::scaled("s", 0), Range::Within(0, 65_535), Factory::None, Elsewhere, "BBV51701 p. 18");

    // Control variables (p. 19–20).
    CMD: ReadWrite(8501, "CMD", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 19");
    LFR: ReadWrite(8502, "LFr", "frequency reference via the bus (signed value); with CMI bit 9: 32767 for 600 Hz", Volatile, HZ.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 19");
    PISP: ReadWrite(8503, "PISP", "PI regulator reference via the bus", Volatile, Unit::scaled("%", 1), Range::Within(0, 1000), Factory::None, Elsewhere, "BBV51701 p. 19");
    // Bits 2, 5 to 8 and 10 to 12 are reserved, and never to be written (p. 7, 20).
    CMI: ReadWrite(8504, "CMI", "extended control word", Volatile, Unit::BITS, Range::Bits(0xE21B), Factory::None, Elsewhere, "BBV51701 p. 20");
    // The inputs and bit 14 are only read, bits 11 to 13 and 15 reserved (p. 20).
    IOLR: ReadWrite(5240, "IOLR", "value of logic I/O", Volatile, Unit::BITS, Range::Bits(0x0700), Factory::None, Elsewhere, "BBV51701 p. 20 and 23");
    AO1R: ReadWrite(5261, "AO1R", "value of the analog output", Volatile, Unit::COUNT, Range::Within(0, 10_000), Factory::None, Elsewhere, "BBV51701 p. 20 and 23");

    // Monitoring variables (p. 21–26).
    ETA: Read(3201, "ETA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    RFR: Read(3202, "rFr", "output frequency applied to the motor (signed value); with CMI bit 9: 32767 for 600 Hz", Volatile, HZ.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    FRH: Read(3203, "FrH", "frequency reference before ramp (absolute value)", Volatile, HZ, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    LCR: Read(3204, "LCr", "current in the motor", Volatile, AMPERE, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    OTR: Read(3205, "Otr", "motor torque", Volatile, PERCENT.sign_not_printed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    OPR: Read(3211, "OPr", "motor power", Volatile, PERCENT.sign_not_printed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    ULN: Read(3207, "ULn", "line voltage", Volatile, Unit::scaled("V", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    THD: Read(3209, "tHd", "drive thermal state", Volatile, PERCENT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    TDM: Read(3210, "TDM", "max. thermal state reached by the drive", Volatile, PERCENT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    THR: Read(9630, "tHr", "motor thermal state", Volatile, PERCENT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 21");
    RTH: Read(3231, "rtH", "operating time", Volatile, Unit::scaled("h", 0), Range::Within(0, 65_535), Factory::Value(0), Elsewhere, "BBV51701 p. 21");
    USPL: Read(12002, "USPL", "motor speed in customer units, low order", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 22");
    USPH: Read(12003, "USPH", "motor speed in customer units, high order", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 22");
    ETI: Read(3206, "ETI", "extended status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 22");
    LRS1: Read(3250, "LRS1", "extended status word No. 1", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 22");
    LRS3: Read(3252, "LRS3", "extended status word No. 3", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 23");
    O1CT: Read(3601, "O1Ct", "option board 1 card type", Volatile, Unit::CODE, Range::OneOf(OPTION_CARDS), Factory::None, Elsewhere, "BBV51701 p. 23");
    AI1C: Read(5242, "AI1C", "value of analog input AI1", Volatile, Unit::scaled("mV", 0), Range::Within(0, 10_000), Factory::None, Elsewhere, "BBV51701 p. 23");
    AI2C: Read(5243, "AI2C", "value of analog input AI2", Volatile, Unit::scaled("mV", 0).signed(), Range::Within(-10_000, 10_000), Factory::None, Elsewhere, "BBV51701 p. 23");
    AI3C: Read(5244, "AI3C", "value of analog input AI3", Volatile, Unit::scaled("µA", 0), Range::Within(0, 20_000), Factory::None, Elsewhere, "BBV51701 p. 23");
    // "Unit: %, variation range: 0.1 to 100%": what a count is, is not printed.
    AIV1: Read(5281, "AIV1", "value of the analog input image, 0.1 to 100 % in counts of a size that is not printed", Volatile, registers::Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 23");
    LFT: Read(7121, "LFt", "last detected fault", Volatile, Unit::CODE, Range::OneOf(FAULT_CODES), Factory::None, Elsewhere, "BBV51701 p. 24");
    CNF: Read(7132, "CNF", "communication option detected fault", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 24");
    DP1: Read(7201, "DP1", "past detected fault No. 1", Volatile, Unit::CODE, Range::OneOf(FAULT_CODES), Factory::None, Elsewhere, "BBV51701 p. 24");
    DP2: Read(7202, "DP2", "past detected fault No. 2", Volatile, Unit::CODE, Range::OneOf(FAULT_CODES), Factory::None, Elsewhere, "BBV51701 p. 24");
    DP3: Read(7203, "DP3", "past detected fault No. 3", Volatile, Unit::CODE, Range::OneOf(FAULT_CODES), Factory::None, Elsewhere, "BBV51701 p. 24");
    DP4: Read(7204, "DP4", "past detected fault No. 4", Volatile, Unit::CODE, Range::OneOf(FAULT_CODES), Factory::None, Elsewhere, "BBV51701 p. 24");
    EP1: Read(7211, "EP1", "status of past detected fault No. 1", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    EP2: Read(7212, "EP2", "status of past detected fault No. 2", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    EP3: Read(7213, "EP3", "status of past detected fault No. 3", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    EP4: Read(7214, "EP4", "status of past detected fault No. 4", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    ERCO: Read(6056, "ErCO", "CANopen: error word", Volatile, Unit::CODE, Range::OneOf(CANOPEN_ERRORS), Factory::None, Elsewhere, "BBV51701 p. 25");
    CMI1: Read(8541, "CMI1", "image of Modbus extended control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    CMI2: Read(8542, "CMI2", "image of CANopen extended control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");
    LFR1: Read(8521, "LFR1", "image of Modbus frequency reference", Volatile, HZ.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 25");

    // Identification variables (p. 26).
    LFR2: Read(8522, "LFR2", "image of CANopen frequency reference", Volatile, HZ.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    LFD1: Read(8631, "LFD1", "image of Modbus speed reference", Volatile, RPM.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    LFD2: Read(8632, "LFD2", "image of CANopen speed reference", Volatile, RPM.signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    PIR1: Read(8531, "PIR1", "image of Modbus PI reference", Volatile, Unit::scaled("%", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    PIR2: Read(8532, "PIR2", "image of CANopen PI reference", Volatile, Unit::scaled("%", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    NCV: Read(3011, "NCV", "drive rating", Volatile, Unit::CODE, Range::OneOf(RATINGS), Factory::None, Elsewhere, "BBV51701 p. 26");
    VCAL: Read(3012, "VCAL", "drive voltage", Volatile, Unit::CODE, Range::OneOf(VOLTAGES), Factory::None, Elsewhere, "BBV51701 p. 26");
    INV: Read(3017, "INV", "nominal drive current", Volatile, AMPERE, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");
    ARE: Read(3010, "ARE", "drive type", Volatile, Unit::CODE, Range::OneOf(DRIVE_TYPES), Factory::None, Elsewhere, "BBV51701 p. 26");
    TSP: Read(3401, "TSP", "drive firmware type", Volatile, Unit::CODE, Range::OneOf(FIRMWARE_TYPES), Factory::None, Elsewhere, "BBV51701 p. 26");
    UDP: Read(3302, "UdP", "drive firmware version", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 26");

    // Configuration and adjustment variables (p. 27–56).
    LSP: ReadWrite(3105, "LSP", "low speed", RamUntilSaved, HZ, Range::Described(0, 5_000, "0 to HSP"), Factory::Value(0), Manual, "BBV52816 p. 12 and BBV51701 p. 27");
    HSP: ReadWrite(3104, "HSP", "high speed", RamUntilSaved, HZ, Range::Described(0, 5_000, "LSP to tFr"), MAINS_FREQUENCY, Manual, "BBV52816 p. 12 and BBV51701 p. 27");
    ITH: ReadWrite(9622, "ItH", "motor thermal protection - max. thermal current", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0.2 to 1.5 In"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 27");
    UFR: ReadWrite(9623, "UFr", "IR compensation/Voltage boost", RamUntilSaved, PERCENT, Range::Within(0, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 27");
    FLG: ReadWrite(9620, "FLG", "frequency loop gain", RamUntilSaved, PERCENT, Range::Within(1, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 27");
    STA: ReadWrite(9621, "StA", "frequency loop stability", RamUntilSaved, PERCENT, Range::Within(1, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 27");
    SLP: ReadWrite(9625, "SLP", "slip compensation", RamUntilSaved, PERCENT, Range::Within(0, 150), Factory::Value(100), Elsewhere, "BBV51701 p. 27");
    JPF: ReadWrite(11301, "JPF", "skip frequency", RamUntilSaved, HZ, Range::Within(0, 5000), Factory::Value(0), Elsewhere, "BBV51701 p. 27");
    JF2: ReadWrite(11302, "JF2", "2nd skip frequency", RamUntilSaved, HZ, Range::Within(0, 5000), Factory::Value(0), Elsewhere, "BBV51701 p. 28");
    CLI: ReadWrite(9201, "CLI", "current limit", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0.25 to 1.5 In"), Factory::Percent(address::INV, 150, "1.5 In"), Elsewhere, "BBV51701 p. 28");
    TLS: ReadWrite(11701, "tLS", "low speed operating time", RamUntilSaved, SECOND, Range::Within(0, 9999), Factory::Value(0), Elsewhere, "BBV51701 p. 28");
    FTD: WriteStopped(11003, "Ftd", "motor frequency threshold", RamUntilSaved, HZ, Range::Within(0, 5000), MAINS_FREQUENCY, Elsewhere, "BBV51701 p. 28");
    TTD: WriteStopped(11002, "ttd", "motor thermal state threshold", RamUntilSaved, PERCENT, Range::Within(0, 118), Factory::Value(100), Elsewhere, "BBV51701 p. 28");
    CTD: WriteStopped(11001, "Ctd", "motor current threshold", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0 to 1.5 In"), Factory::Percent(address::INV, 100, "In"), Elsewhere, "BBV51701 p. 28");
    SDS: ReadWrite(12001, "SdS", "USPL/USPH scale factor", RamUntilSaved, Unit::scaled("", 1), Range::Within(1, 2000), Factory::Value(300), Elsewhere, "BBV51701 p. 28");
    BFR: WriteStopped(3015, "bFr", "standard motor frequency", RamUntilSaved, Unit::CODE, Range::OneOf(MAINS), Factory::Value(0), Elsewhere, "BBV51701 p. 28");
    UNS: WriteStopped(9601, "UnS", "nominal motor voltage given on the rating plate", RamUntilSaved, Unit::scaled("V", 0), Range::Described(100, 600, "M2, M3: 100 to 240; N4: 100 to 500; S6: 100 to 600; UnS/FrS at most 7, 14 or 17 V/Hz"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 28 and 29");
    FRS: WriteStopped(9602, "FrS", "nominal motor frequency given on the rating plate", RamUntilSaved, HZ, Range::Within(100, 5000), MAINS_FREQUENCY, Elsewhere, "BBV51701 p. 29");
    NCR: WriteStopped(9603, "nCr", "nominal motor current given on the rating plate", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0.25 to 1.5 In"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 29");
    NSP: WriteStopped(9604, "nSP", "nominal motor speed given on the rating plate", RamUntilSaved, RPM, Range::Within(0, 32_767), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 29");
    COS: WriteStopped(9606, "COS", "motor Cos Phi given on the rating plate", RamUntilSaved, Unit::scaled("", 2), Range::Within(50, 100), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 29");
    RSC: WriteStopped(9643, "rSC", "cold state stator resistance", RamUntilSaved, Unit::scaled("mΩ", 0), Range::OneOfOr(COLD_RESISTANCE, 2, 65_535), Factory::Value(0), Elsewhere, "BBV51701 p. 29");
    // Printed R/WO, which p. 7 does not define: the drive judges.
    TUN: ReadWrite(9608, "tUn", "motor control auto-tuning", RamUntilSaved, Unit::CODE, Range::OneOf(TUNING), Factory::Value(0), Elsewhere, "BBV51701 p. 30");
    TUS: Read(9609, "tUS", "auto-tuning status", Volatile, Unit::CODE, Range::OneOf(TUNING_STATES), Factory::Value(0), Elsewhere, "BBV51701 p. 30");
    UFT: WriteStopped(9607, "UFt", "selection of the type of voltage/frequency ratio", RamUntilSaved, Unit::CODE, Range::OneOf(MOTOR_LAWS), Factory::Value(2), Elsewhere, "BBV51701 p. 31");
    NRD: WriteStopped(3107, "nrd", "noise reduction", RamUntilSaved, Unit::CODE, Range::OneOf(MODULATION), Factory::Value(1), Elsewhere, "BBV51701 p. 31");
    SFR: ReadWrite(3102, "SFr", "switching frequency", RamUntilSaved, Unit::scaled("kHz", 1), Range::Within(20, 160), Factory::Value(40), Manual, "BBV52816 p. 12 and BBV51701 p. 31");
    TFR: WriteStopped(3103, "tFr", "maximum output frequency", RamUntilSaved, HZ, Range::Within(100, 5000), Factory::Chosen(address::BFR, &[(0, 600), (1, 720)], "60.0 Hz, with bFr = 60: 72.0 Hz"), Manual, "BBV52816 p. 12 and BBV51701 p. 31");
    SRF: WriteStopped(9101, "SrF", "suppression of the speed loop filter", RamUntilSaved, Unit::CODE, Range::OneOf(SPEED_FILTER), Factory::Value(0), Elsewhere, "BBV51701 p. 31");
    SCS: WriteStopped(8001, "SCS", "saving the configuration", Volatile, Unit::CODE, Range::OneOf(SAVE_CONFIGURATION), Factory::Value(0), Elsewhere, "BBV51701 p. 31");
    CFG: WriteStopped(3052, "CFG", "source configuration", RamUntilSaved, Unit::CODE, Range::OneOf(CONFIGURATIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 32");
    FCS: WriteStopped(8002, "FCS", "return to factory settings/Restore configuration", Volatile, Unit::CODE, Range::OneOf(RESTORE_CONFIGURATION), Factory::Value(0), Elsewhere, "BBV51701 p. 32");
    TCC: WriteStopped(11101, "tCC", "2-wire/3-wire control", RamUntilSaved, Unit::CODE, Range::OneOf(WIRING), Factory::Value(0), Elsewhere, "BBV51701 p. 33");
    TCT: WriteStopped(11102, "tCt", "type of 2-wire control", RamUntilSaved, Unit::CODE, Range::OneOf(TWO_WIRE), Factory::Value(1), Elsewhere, "BBV51701 p. 33");
    RRS: WriteStopped(11105, "rrS", "reverse operation via logic input", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Chosen(address::TCC, &[(0, 130), (1, 131), (2, 0)], "130, with tCC = 3C: 131, with tCC = LOC: 0"), Elsewhere, "BBV51701 p. 33");
    CRL3: WriteStopped(4434, "CrL3", "value for low speed (LSP) on input AI3", RamUntilSaved, Unit::scaled("mA", 1), Range::Within(0, 200), Factory::Value(40), Elsewhere, "BBV51701 p. 33");
    CRH3: WriteStopped(4444, "CrH3", "value for high speed (HSP) on input AI3", RamUntilSaved, Unit::scaled("mA", 1), Range::Within(40, 200), Factory::Value(200), Elsewhere, "BBV51701 p. 33");
    AO1T: WriteStopped(4601, "AO1t", "configuration of the analog output", RamUntilSaved, Unit::CODE, Range::OneOf(ANALOG_TYPES), Factory::Value(2), Elsewhere, "BBV51701 p. 34");
    DO: WriteStopped(5031, "dO", "analog/logic output AOC/AOV", RamUntilSaved, Unit::CODE, Range::OneOf(OUTPUT), Factory::Value(0), Elsewhere, "BBV51701 p. 34");
    R1: WriteStopped(5001, "r1", "relay r1", RamUntilSaved, Unit::CODE, Range::OneOf(RELAY_1), Factory::Value(1), Elsewhere, "BBV51701 p. 34");
    R2: WriteStopped(5002, "r2", "relay r2", RamUntilSaved, Unit::CODE, Range::OneOf(RELAY_2), Factory::Value(0), Elsewhere, "BBV51701 p. 35");
    LAC: WriteStopped(3006, "LAC", "function access level", RamUntilSaved, Unit::CODE, Range::OneOf(ACCESS_LEVELS), Factory::Value(0), Elsewhere, "BBV51701 p. 35");
    FR1: WriteStopped(8413, "Fr1", "configuration reference 1", RamUntilSaved, Unit::CODE, Range::OneOf(REFERENCE_1), Factory::Value(1), Elsewhere, "BBV51701 p. 35");
    FR2: WriteStopped(8414, "Fr2", "configuration reference 2", RamUntilSaved, Unit::CODE, Range::OneOf(REFERENCE_2), Factory::Value(0), Elsewhere, "BBV51701 p. 36");
    RFC: WriteStopped(8411, "rFC", "reference switching", RamUntilSaved, Unit::CODE, Range::OneOf(REFERENCE_SWITCHING), Factory::Value(96), Elsewhere, "BBV51701 p. 36");
    CHCF: WriteStopped(8401, "CHCF", "mixed mode (control channels separated from reference channels)", RamUntilSaved, Unit::CODE, Range::OneOf(CHANNEL_MODES), Factory::Value(1), Elsewhere, "BBV51701 p. 36");
    CD2: WriteStopped(8424, "Cd2", "configuration of control channel 2", RamUntilSaved, Unit::CODE, Range::OneOf(COMMAND_CHANNELS), Factory::Value(10), Elsewhere, "BBV51701 p. 37");
    CD1: WriteStopped(8423, "Cd1", "configuration of control channel 1", RamUntilSaved, Unit::CODE, Range::OneOf(COMMAND_CHANNELS), Factory::Value(1), Elsewhere, "BBV51701 p. 37");
    CCS: WriteStopped(8421, "CCS", "control channel switching", RamUntilSaved, Unit::CODE, Range::OneOf(COMMAND_SWITCHING), Factory::Value(98), Elsewhere, "BBV51701 p. 37");
    COP: WriteStopped(8402, "COP", "copy channel 1 to channel 2", RamUntilSaved, Unit::CODE, Range::OneOf(CHANNEL_COPIES), Factory::Value(0), Elsewhere, "BBV51701 p. 37");
    LCC_KEYS: WriteStopped(64003, "LCC", "control via remote display terminal", RamUntilSaved, Unit::CODE, Range::OneOf(REMOTE_TERMINAL), Factory::Value(0), Elsewhere, "BBV51701 p. 38");
    PST: WriteStopped(64002, "PSt", "stop priority", RamUntilSaved, Unit::CODE, Range::OneOf(STOP_PRIORITY), Factory::Value(1), Elsewhere, "BBV51701 p. 38");
    ROT: WriteStopped(64001, "rOt", "direction of operation authorized", RamUntilSaved, Unit::CODE, Range::OneOf(DIRECTIONS), Factory::Value(0), Elsewhere, "BBV51701 p. 38");
    RPT: WriteStopped(9004, "rPt", "type of ramp", RamUntilSaved, Unit::CODE, Range::OneOf(RAMP_TYPES), Factory::Value(0), Elsewhere, "BBV51701 p. 38");
    TA1: ReadWrite(9005, "tA1", "start of CUS-type acceleration ramp rounded", RamUntilSaved, PERCENT, Range::Within(0, 100), Factory::Value(10), Elsewhere, "BBV51701 p. 38");
    TA2: ReadWrite(9006, "tA2", "end of CUS-type acceleration ramp rounded", RamUntilSaved, PERCENT, Range::Described(0, 100, "0 to 100 - tA1"), Factory::Value(10), Elsewhere, "BBV51701 p. 38");
    TA3: ReadWrite(9007, "tA3", "start of CUS-type deceleration ramp rounded", RamUntilSaved, PERCENT, Range::Within(0, 100), Factory::Value(10), Elsewhere, "BBV51701 p. 38");
    TA4: ReadWrite(9008, "tA4", "end of CUS-type deceleration ramp rounded", RamUntilSaved, PERCENT, Range::Described(0, 100, "0 to 100 - tA3"), Factory::Value(10), Elsewhere, "BBV51701 p. 38");
    INR: WriteStopped(9020, "Inr", "ramp increment", RamUntilSaved, Unit::CODE, Range::OneOf(RAMP_INCREMENTS), Factory::Value(1), Elsewhere, "BBV51701 p. 38");
    ACC: ReadWrite(9001, "ACC", "acceleration ramp time in steps of Inr (0.01, 0.1 or 1 s)", RamUntilSaved, RAMP, Range::Described(1, 32_760, "with Inr = 0.01: 5 to 32760"), Factory::Value(30), Manual, "BBV52816 p. 12 and BBV51701 p. 39");
    DEC: ReadWrite(9002, "dEC", "deceleration ramp time in steps of Inr (0.01, 0.1 or 1 s)", RamUntilSaved, RAMP, Range::Described(1, 32_760, "with Inr = 0.01: 5 to 32760"), Factory::Value(30), Manual, "BBV52816 p. 12 and BBV51701 p. 39");
    RPS: WriteStopped(9010, "rPS", "ramp switching", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 39");
    FRT: WriteStopped(9011, "Frt", "ramp switching threshold", RamUntilSaved, HZ, Range::Within(0, 5000), Factory::Value(0), Elsewhere, "BBV51701 p. 39");
    AC2: ReadWrite(9012, "AC2", "2nd acceleration ramp time in steps of Inr (0.01, 0.1 or 1 s)", RamUntilSaved, RAMP, Range::Described(1, 32_760, "with Inr = 0.01: 5 to 32760"), Factory::Value(50), Elsewhere, "BBV51701 p. 39");
    DE2: ReadWrite(9013, "dE2", "2nd deceleration ramp time in steps of Inr (0.01, 0.1 or 1 s)", RamUntilSaved, RAMP, Range::Described(1, 32_760, "with Inr = 0.01: 5 to 32760"), Factory::Value(50), Elsewhere, "BBV51701 p. 39");
    BRA: WriteStopped(9003, "brA", "deceleration ramp adaptation", RamUntilSaved, Unit::CODE, Range::OneOf(NO_YES), Factory::Value(1), Elsewhere, "BBV51701 p. 39");
    STT: WriteStopped(11201, "Stt", "normal stop mode", RamUntilSaved, Unit::CODE, Range::OneOf(STOP_TYPES), Factory::Value(0), Elsewhere, "BBV51701 p. 40");
    FST: WriteStopped(11204, "FSt", "fast stop via logic input", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 40");
    DCF: WriteStopped(11230, "dCF", "coefficient for dividing the deceleration ramp time for fast stopping", RamUntilSaved, Unit::COUNT, Range::Within(0, 10), Factory::Value(4), Elsewhere, "BBV51701 p. 40");
    DCI: WriteStopped(11203, "dCI", "DC injection via logic input", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 40");
    IDC: ReadWrite(11210, "IdC", "level of DC injection braking current activated via logic input or selected as stop mode", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0 to In"), Factory::Percent(address::INV, 70, "0.7 In"), Elsewhere, "BBV51701 p. 40");
    TDC: ReadWrite(11211, "tdC", "total DC injection braking time selected as normal stop mode", RamUntilSaved, SECOND, Range::Within(1, 300), Factory::Value(5), Elsewhere, "BBV51701 p. 41");
    NST: WriteStopped(11202, "nSt", "freewheel stop via logic input", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 41");
    ADC: ReadWrite(10401, "AdC", "automatic standstill DC injection", RamUntilSaved, Unit::CODE, Range::OneOf(STANDSTILL_INJECTION), Factory::Value(1), Elsewhere, "BBV51701 p. 41");
    TDC1: ReadWrite(10402, "tdC1", "automatic standstill DC injection time", RamUntilSaved, SECOND, Range::Within(1, 300), Factory::Value(50), Elsewhere, "BBV51701 p. 41");
    SDC1: ReadWrite(10403, "SdC1", "level of automatic standstill DC injection current", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0 to 1.2 In"), Factory::Percent(address::INV, 70, "0.7 In"), Elsewhere, "BBV51701 p. 41");
    TDC2: ReadWrite(10404, "tdC2", "2nd automatic standstill DC injection time", RamUntilSaved, SECOND, Range::Within(0, 300), Factory::Value(0), Elsewhere, "BBV51701 p. 41");
    SDC2: ReadWrite(10405, "SdC2", "2nd level of standstill DC injection current", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0 to 1.2 In"), Factory::Percent(address::INV, 50, "0.5 In"), Elsewhere, "BBV51701 p. 41");
    SA2: WriteStopped(11801, "SA2", "summing input 2", RamUntilSaved, Unit::CODE, Range::OneOf(SUMMING), Factory::Value(2), Elsewhere, "BBV51701 p. 42");
    SA3: WriteStopped(11802, "SA3", "summing input 3", RamUntilSaved, Unit::CODE, Range::OneOf(SUMMING), Factory::Value(0), Elsewhere, "BBV51701 p. 42");
    PS2: WriteStopped(11401, "PS2", "2 preset speeds", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Chosen(address::TCC, &[(0, 131), (1, 0), (2, 131)], "131, with tCC = 3C: 0"), Elsewhere, "BBV51701 p. 42");
    PS4: WriteStopped(11402, "PS4", "4 preset speeds", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Chosen(address::TCC, &[(0, 132), (1, 0), (2, 132)], "132, with tCC = 3C: 0"), Elsewhere, "BBV51701 p. 43");
    PS8: WriteStopped(11403, "PS8", "8 preset speeds", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 43");
    PS16: WriteStopped(11404, "PS16", "16 preset speeds", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 43");
    SP2: ReadWrite(11410, "SP2", "2nd preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(100), Elsewhere, "BBV51701 p. 44");
    SP3: ReadWrite(11411, "SP3", "3rd preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(150), Elsewhere, "BBV51701 p. 44");
    SP4: ReadWrite(11412, "SP4", "4th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(200), Elsewhere, "BBV51701 p. 44");
    SP5: ReadWrite(11413, "SP5", "5th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(250), Elsewhere, "BBV51701 p. 44");
    SP6: ReadWrite(11414, "SP6", "6th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(300), Elsewhere, "BBV51701 p. 44");
    SP7: ReadWrite(11415, "SP7", "7th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(350), Elsewhere, "BBV51701 p. 44");
    SP8: ReadWrite(11416, "SP8", "8th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(400), Elsewhere, "BBV51701 p. 44");
    SP9: ReadWrite(11417, "SP9", "9th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(450), Elsewhere, "BBV51701 p. 44");
    SP10: ReadWrite(11418, "SP10", "10th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(500), Elsewhere, "BBV51701 p. 44");
    SP11: ReadWrite(11419, "SP11", "11th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(550), Elsewhere, "BBV51701 p. 44");
    SP12: ReadWrite(11420, "SP12", "12th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(600), Elsewhere, "BBV51701 p. 44");
    SP13: ReadWrite(11421, "SP13", "13th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(700), Elsewhere, "BBV51701 p. 44");
    SP14: ReadWrite(11422, "SP14", "14th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(800), Elsewhere, "BBV51701 p. 44");
    SP15: ReadWrite(11423, "SP15", "15th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(900), Elsewhere, "BBV51701 p. 44");
    SP16: ReadWrite(11424, "SP16", "16th preset speed", RamUntilSaved, HZ, Range::Within(0, 5_000), Factory::Value(1000), Elsewhere, "BBV51701 p. 44");
    JOG: WriteStopped(11110, "JOG", "jog operation", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Chosen(address::TCC, &[(0, 0), (1, 132), (2, 0)], "0, with tCC = 3C: 132"), Elsewhere, "BBV51701 p. 45");
    JGF: ReadWrite(11111, "JGF", "jog operation reference", RamUntilSaved, HZ, Range::Within(0, 100), Factory::Value(100), Elsewhere, "BBV51701 p. 45");
    USP: WriteStopped(11501, "USP", "+ speed (motorized potentiometer)", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 45");
    DSP: WriteStopped(11502, "dSP", "- speed (motorized potentiometer)", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 45");
    STR: WriteStopped(11503, "Str", "save reference", RamUntilSaved, Unit::CODE, Range::OneOf(REFERENCE_SAVING), Factory::Value(0), Elsewhere, "BBV51701 p. 45");
    PIF: WriteStopped(11901, "PIF", "PI regulator feedback", RamUntilSaved, Unit::CODE, Range::OneOf(PI_FEEDBACK), Factory::Value(0), Elsewhere, "BBV51701 p. 45");
    RPG: ReadWrite(11941, "rPG", "PI regulator proportional gain", RamUntilSaved, Unit::scaled("", 2), Range::Within(1, 10_000), Factory::Value(100), Elsewhere, "BBV51701 p. 45");
    RIG: ReadWrite(11942, "rIG", "PI regulator integral gain", RamUntilSaved, Unit::scaled("", 2), Range::Within(1, 10_000), Factory::Value(100), Elsewhere, "BBV51701 p. 46");
    FBS: ReadWrite(11903, "FbS", "PI feedback multiplication coefficient", RamUntilSaved, Unit::scaled("", 1), Range::Within(1, 1000), Factory::Value(10), Elsewhere, "BBV51701 p. 46");
    PIC: ReadWrite(11940, "PIC", "reversal of the direction of correction of the PI regulator", RamUntilSaved, Unit::CODE, Range::OneOf(PI_DIRECTION), Factory::Value(0), Elsewhere, "BBV51701 p. 46");
    PR2: WriteStopped(11909, "Pr2", "2 preset PI references", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 46");
    PR4: WriteStopped(11910, "Pr4", "4 preset PI references", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 46");
    RP2: ReadWrite(11921, "rP2", "2nd preset PI reference", RamUntilSaved, Unit::scaled("%", 1), Range::Within(0, 1000), Factory::Value(300), Elsewhere, "BBV51701 p. 46");
    RP3: ReadWrite(11922, "rP3", "3rd preset PI reference", RamUntilSaved, Unit::scaled("%", 1), Range::Within(0, 1000), Factory::Value(600), Elsewhere, "BBV51701 p. 46");
    RP4: ReadWrite(11923, "rP4", "4th preset PI reference", RamUntilSaved, Unit::scaled("%", 1), Range::Within(0, 1000), Factory::Value(900), Elsewhere, "BBV51701 p. 46");
    RSL: ReadWrite(11960, "rSL", "restart error threshold (wake-up threshold)", RamUntilSaved, Unit::scaled("", 1), Range::Within(0, 1000), Factory::Value(0), Elsewhere, "BBV51701 p. 47");
    PII: WriteStopped(11908, "PII", "internal PI reference enabled", RamUntilSaved, Unit::CODE, Range::OneOf(PI_REFERENCE), Factory::Value(0), Elsewhere, "BBV51701 p. 47");
    RPI: ReadWrite(11920, "rPI", "internal PI reference", RamUntilSaved, Unit::scaled("%", 1), Range::Within(0, 1000), Factory::Value(0), Elsewhere, "BBV51701 p. 47");
    BLC: WriteStopped(10001, "bLC", "brake control configuration", RamUntilSaved, Unit::CODE, Range::OneOf(BRAKE_OUTPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 47");
    BRL: WriteStopped(10002, "brL", "brake release frequency", RamUntilSaved, HZ, Range::Within(0, 100), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 47");
    IBR: WriteStopped(10006, "Ibr", "motor current threshold for brake release", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0 to 1.36 In"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 47");
    BRT: WriteStopped(10004, "brt", "brake release time", RamUntilSaved, Unit::scaled("s", 2), Range::Within(0, 500), Factory::Value(50), Elsewhere, "BBV51701 p. 47");
    BEN: WriteStopped(10003, "bEn", "brake engage frequency threshold", RamUntilSaved, HZ, Range::OneOfOr(BRAKE_ENGAGE, 0, 5_000), Factory::Value(65_535), Elsewhere, "BBV51701 p. 47");
    BET: WriteStopped(10005, "bEt", "brake engage time", RamUntilSaved, Unit::scaled("s", 2), Range::Within(0, 500), Factory::Value(50), Elsewhere, "BBV51701 p. 47");
    BIP: WriteStopped(10007, "bIP", "brake release pulse", RamUntilSaved, Unit::CODE, Range::OneOf(BRAKE_PULSE), Factory::Value(0), Elsewhere, "BBV51701 p. 47");
    LC2: WriteStopped(9202, "LC2", "switching for second current limit", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 48");
    CL2: ReadWrite(9203, "CL2", "2nd current limit", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0.25 to 1.5 In"), Factory::Percent(address::INV, 150, "1.5 In"), Elsewhere, "BBV51701 p. 48");
    CHP: WriteStopped(8011, "CHP", "switching, motor 2", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 48");
    UNS2: WriteStopped(9701, "UnS2", "nominal motor voltage (motor 2) given on the rating plate", RamUntilSaved, Unit::scaled("V", 0), Range::Described(100, 600, "M2, M3: 100 to 240; N4: 100 to 500; S6: 100 to 600; UnS2/FrS2 at most 7, 14 or 17 V/Hz"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 49");
    FRS2: WriteStopped(9702, "FrS2", "nominal motor frequency (motor 2) given on the rating plate", RamUntilSaved, HZ, Range::Within(100, 5000), MAINS_FREQUENCY, Elsewhere, "BBV51701 p. 49");
    NCR2: WriteStopped(9703, "nCr2", "nominal motor current (motor 2) given on the rating plate", RamUntilSaved, AMPERE, Range::Described(0, 65_535, "0.25 to 1.5 In"), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 49");
    NSP2: WriteStopped(9704, "nSP2", "nominal motor speed (motor 2) given on the rating plate", RamUntilSaved, RPM, Range::Within(0, 32_767), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 49");
    COS2: WriteStopped(9706, "COS2", "motor Cos Phi (motor 2) given on the rating plate", RamUntilSaved, Unit::scaled("", 2), Range::Within(50, 100), Factory::Described("by the drive's rating"), Elsewhere, "BBV51701 p. 49");
    UFT2: ReadWrite(9707, "UFt2", "selection of the type of voltage/frequency ratio for motor 2", RamUntilSaved, Unit::CODE, Range::OneOf(MOTOR_LAWS), Factory::Value(2), Elsewhere, "BBV51701 p. 49");
    STA2: ReadWrite(9721, "StA2", "frequency loop stability, motor 2", RamUntilSaved, PERCENT, Range::Within(1, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 50");
    SLP2: ReadWrite(9725, "SLP2", "slip compensation, motor 2", RamUntilSaved, PERCENT, Range::Within(0, 150), Factory::Value(100), Elsewhere, "BBV51701 p. 50");
    LAF: WriteStopped(11601, "LAF", "forward limit switch", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 50");
    LAR: WriteStopped(11602, "LAr", "reverse limit switch", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 50");
    LAS: WriteStopped(11603, "LAS", "type of limit switch stop", RamUntilSaved, Unit::CODE, Range::OneOf(LIMIT_STOPS), Factory::Value(2), Elsewhere, "BBV51701 p. 50");
    UFR2: ReadWrite(9723, "UFr2", "IR compensation/Voltage boost, motor 2", RamUntilSaved, PERCENT, Range::Within(0, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 50");
    FLG2: ReadWrite(9720, "FLG2", "frequency loop gain, motor 2", RamUntilSaved, PERCENT, Range::Within(1, 100), Factory::Value(20), Elsewhere, "BBV51701 p. 50");
    ATR: WriteStopped(7122, "Atr", "automatic restart", RamUntilSaved, Unit::CODE, Range::OneOf(NO_YES), Factory::Value(0), Elsewhere, "BBV51701 p. 51");
    TAR: WriteStopped(7123, "tAr", "max. duration of restart process", RamUntilSaved, Unit::CODE, Range::OneOf(RESTART_TIMES), Factory::Value(0), Elsewhere, "BBV51701 p. 51");
    RSF: WriteStopped(7124, "rSF", "clearing the current detected fault", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 51");
    FLR: WriteStopped(3110, "FLr", "flying restart (automatic catching a spinning load on ramp)", RamUntilSaved, Unit::CODE, Range::OneOf(NO_YES), Factory::Value(0), Elsewhere, "BBV51701 p. 52");
    ETF: WriteStopped(7131, "EtF", "external fault", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS_AND_BITS), Factory::Value(0), Elsewhere, "BBV51701 p. 52");
    LET: WriteStopped(7090, "LEt", "configuration of external fault detection", RamUntilSaved, Unit::CODE, Range::OneOf(EXTERNAL_FAULT), Factory::Value(1), Elsewhere, "BBV51701 p. 52");
    EPL: WriteStopped(7006, "EPL", "stop mode in the event of an external fault EPF", RamUntilSaved, Unit::CODE, Range::OneOf(REACTIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 52");
    OPL: WriteStopped(9611, "OPL", "configuration of motor phase loss detection", RamUntilSaved, Unit::CODE, Range::OneOf(MOTOR_PHASE), Factory::Value(1), Elsewhere, "BBV51701 p. 52");
    IPL: WriteStopped(7002, "IPL", "configuration of line phase loss detection", RamUntilSaved, Unit::CODE, Range::OneOf(LINE_PHASE), Factory::Chosen(address::VCAL, &[(1, 0), (2, 1), (3, 1), (4, 1)], "1, on ATV312···M2: 0"), Elsewhere, "BBV51701 p. 52");
    OHL: WriteStopped(7008, "OHL", "stop mode in the event of the drive overheating OHF", RamUntilSaved, Unit::CODE, Range::OneOf(REACTIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 53");
    OLL: WriteStopped(7009, "OLL", "stop mode in the event of a motor overload OLF", RamUntilSaved, Unit::CODE, Range::OneOf(REACTIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 53");
    // p. 9: the setting of SLL and COL "is saved if the power supply is disconnected"; by what is not said.
    SLL: WriteStopped(7010, "SLL", "stop mode in the event of a Modbus serial link interruption SLF", Unknown, Unit::CODE, Range::OneOf(REACTIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 53");
    COL: WriteStopped(7011, "COL", "stop mode in the event of a CANopen serial link interruption COF", Unknown, Unit::CODE, Range::OneOf(REACTIONS), Factory::Value(1), Elsewhere, "BBV51701 p. 53");
    TNL: WriteStopped(7012, "tnL", "configuration of auto-tuning status tnF", RamUntilSaved, Unit::CODE, Range::OneOf(TUNING_FAULT), Factory::Value(1), Elsewhere, "BBV51701 p. 53");
    LFL: WriteStopped(7003, "LFL", "stop mode in the event of a loss of 4 - 20 mA signal (LFF)", RamUntilSaved, Unit::CODE, Range::OneOf(SIGNAL_LOSS), Factory::Value(0), Elsewhere, "BBV51701 p. 54");
    LFF: WriteStopped(7080, "LFF", "fallback speed", RamUntilSaved, HZ, Range::Within(0, 5000), Factory::Value(100), Elsewhere, "BBV51701 p. 54");
    DRN: WriteStopped(7007, "drn", "derated operation in the event of an undervoltage (the manual prints overvoltage)", RamUntilSaved, Unit::CODE, Range::OneOf(NO_YES), Factory::Value(0), Elsewhere, "BBV51701 p. 54");
    STP: WriteStopped(7004, "StP", "controlled stop on mains power break", RamUntilSaved, Unit::CODE, Range::OneOf(MAINS_BREAK), Factory::Value(0), Elsewhere, "BBV51701 p. 54");
    INH: WriteStopped(7125, "InH", "fault detection inhibition assignment", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 54");
    RPR: WriteStopped(3120, "rPr", "operating time reset to zero", Volatile, Unit::CODE, Range::OneOf(TIME_RESET), Factory::Value(0), Elsewhere, "BBV51701 p. 55");
    ADD: WriteStopped(6001, "Add", "Modbus: Drive address", RamUntilSaved, Unit::COUNT, Range::Within(1, 247), Factory::Value(1), Elsewhere, "BBV51701 p. 55");
    TBR: WriteStopped(6003, "tbr", "Modbus: Transmission speed", RamUntilSaved, Unit::CODE, Range::OneOf(SPEEDS), Factory::Value(32), Elsewhere, "BBV51701 p. 55");
    TFO: WriteStopped(6004, "tFO", "Modbus: communication format", RamUntilSaved, Unit::CODE, Range::OneOf(FORMATS), Factory::Value(3), Elsewhere, "BBV51701 p. 55");
    TTO: WriteStopped(6005, "ttO", "Modbus: Time-out", RamUntilSaved, SECOND, Range::Within(1, 100), Factory::Value(100), Elsewhere, "BBV51701 p. 55");
    ADCO: WriteStopped(6051, "AdCO", "CANopen: Drive address", RamUntilSaved, Unit::COUNT, Range::Within(0, 127), Factory::Value(0), Elsewhere, "BBV51701 p. 55");
    BDCO: WriteStopped(6053, "bdCO", "CANopen: Transmission speed", RamUntilSaved, Unit::CODE, Range::OneOf(CANOPEN_SPEEDS), Factory::Value(52), Elsewhere, "BBV51701 p. 55");
    FLO: WriteStopped(8431, "FLO", "forced local mode", RamUntilSaved, Unit::CODE, Range::OneOf(INPUTS), Factory::Value(0), Elsewhere, "BBV51701 p. 55");
    FLOC: WriteStopped(8432, "FLOC", "selection of the reference and control channel in forced local mode", RamUntilSaved, Unit::CODE, Range::OneOf(LOCAL_CHANNELS), Factory::Value(1), Elsewhere, "BBV51701 p. 55");
    COD: ReadWrite(3003, "COd", "display terminal locking code", RamUntilSaved, Unit::CODE, Range::OneOfOr(LOCKING, 2, 9_999), Factory::None, Elsewhere, "BBV51701 p. 56");
    RP: ReadWrite(7128, "rP", "reset all the detected faults", Volatile, Unit::CODE, Range::OneOf(RESET_ALL), Factory::Value(0), Elsewhere, "BBV51701 p. 56");
}
