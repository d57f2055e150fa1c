//! Every register of the Altivar 28 that a public document names, by ascending address.
//!
//! The kit's own manual (VVDED399092) prints only W400, W401 and the block W450 to W456; the drive's "internal
//! communication variables" are not public. The map is the table "Replacing an ATV28 with an ATV312" (BBV51701 p. 57),
//! which gives each address and its twin on the Altivar 312, "most of the variables used in the ATV28 are found in the
//! ATV312". Name, unit, access, list and range of a row are those of the twin named in its source; ranges in numbers
//! are therefore [`Range::Described`]: the drive has the last word. Lists leave out what the twin has only beyond its
//! access level L1, which is the one "interchangeable with ATV28" (p. 35). Factory settings are not known. Nor is it
//! known whether a written parameter goes to EEPROM at once: treat each such write as one.
//!
//! [`Range::Described`]: drive_core::registers::Range::Described

use drive_core::registers;

use crate::lists;

/// Where the number of a range comes from.
const TWIN: &str = "as on the Altivar 312";

registers! {
    /// Every register of the Altivar 28, by ascending address.
    pub const ROWS;

    COD: ReadWrite(2, "COd", "terminal locking code", Unknown, Unit::COUNT, Range::Described(0, 9999, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3003, p. 56");
    CRL3: WriteStopped(4, "CrL3", "current on AI3 for low speed", Unknown, Unit::scaled("mA", 1), Range::Described(0, 200, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W4434, p. 33");
    CRH3: WriteStopped(5, "CrH3", "current on AI3 for high speed", Unknown, Unit::scaled("mA", 1), Range::Described(40, 200, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W4444, p. 33");
    TCC: WriteStopped(6, "tCC", "2-wire or 3-wire control", Unknown, Unit::CODE, Range::OneOf(lists::TCC), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11101, p. 33");
    ADD: WriteStopped(10, "Add", "Modbus address", Unknown, Unit::COUNT, Range::Within(1, 31), Factory::None, Elsewhere, "VVDED399092, Modbus mode RTU: 1 to 31; BBV51701 p. 57; twin W6001, p. 55");
    BFR: WriteStopped(40, "bFr", "standard motor frequency", Unknown, Unit::CODE, Range::OneOf(lists::BFR), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3015, p. 28");
    SFR: ReadWrite(51, "SFr", "switching frequency", Unknown, Unit::scaled("kHz", 1), Range::Described(20, 160, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3102, p. 31");
    TFR: WriteStopped(52, "tFr", "maximum output frequency", Unknown, Unit::scaled("Hz", 1), Range::Described(100, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3103, p. 31");
    FRS: WriteStopped(53, "FrS", "nominal motor frequency", Unknown, Unit::scaled("Hz", 1), Range::Described(100, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9602, p. 29");
    UNS: WriteStopped(55, "UnS", "nominal motor voltage", Unknown, Unit::scaled("V", 0), Range::Described(100, 600, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9601, p. 28");
    NRD: WriteStopped(60, "nrd", "noise reduction", Unknown, Unit::CODE, Range::OneOf(lists::NRD), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3107, p. 31");
    UFT: WriteStopped(61, "UFt", "voltage/frequency ratio", Unknown, Unit::CODE, Range::OneOf(lists::UFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9607, p. 31");
    BRA: WriteStopped(64, "brA", "deceleration ramp adaptation", Unknown, Unit::CODE, Range::OneOf(lists::NO_YES), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9003, p. 39");
    FRT: WriteStopped(65, "Frt", "ramp switching threshold", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9011, p. 39");
    R2: WriteStopped(110, "r2", "assignment of relay R2", Unknown, Unit::CODE, Range::OneOf(lists::R2), Factory::None, Elsewhere, "BBV51701 p. 57; twin W5002, p. 35");
    OPL: WriteStopped(151, "OPL", "motor phase loss detection", Unknown, Unit::CODE, Range::OneOf(lists::OPL), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9611, p. 52");
    IPL: WriteStopped(152, "IPL", "line phase loss detection", Unknown, Unit::CODE, Range::OneOf(lists::IPL), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7002, p. 52");
    FLR: WriteStopped(155, "FLr", "catching a spinning motor", Unknown, Unit::CODE, Range::OneOf(lists::NO_YES), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3110, p. 52");
    DRN: WriteStopped(190, "drn", "derated operation at undervoltage", Unknown, Unit::CODE, Range::OneOf(lists::NO_YES), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7007, p. 54");
    HSP: ReadWrite(250, "HSP", "high speed", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, "LSP to tFr"), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3104, p. 27");
    LSP: ReadWrite(251, "LSP", "low speed", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, "0 to HSP"), Factory::None, Elsewhere, "BBV51701 p. 57; twin W3105, p. 27");
    ACC: ReadWrite(252, "ACC", "acceleration time, in counts: 0.1 s on the twin, not confirmed for the Altivar 28", Unknown, Unit::COUNT, Range::Described(1, 32_760, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9001, p. 39");
    DEC: ReadWrite(253, "dEC", "deceleration time, in counts: 0.1 s on the twin, not confirmed for the Altivar 28", Unknown, Unit::COUNT, Range::Described(1, 32_760, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9002, p. 39");
    ITH: ReadWrite(258, "ItH", "motor thermal current", Unknown, Unit::scaled("A", 1), Range::Described(0, 32_767, "0.2 to 1.5 In of the drive"), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9622, p. 27");
    AC2: ReadWrite(260, "AC2", "second acceleration time, in counts: 0.1 s on the twin, not confirmed for the Altivar 28", Unknown, Unit::COUNT, Range::Described(1, 32_760, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9012, p. 39");
    DE2: ReadWrite(261, "dE2", "second deceleration time, in counts: 0.1 s on the twin, not confirmed for the Altivar 28", Unknown, Unit::COUNT, Range::Described(1, 32_760, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W9013, p. 39");
    JGF: ReadWrite(262, "JGF", "jog frequency", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 100, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11111, p. 45");
    SP2: ReadWrite(264, "SP2", "preset speed 2", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11410, p. 44");
    SP3: ReadWrite(265, "SP3", "preset speed 3", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11411, p. 44");
    SP4: ReadWrite(266, "SP4", "preset speed 4", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11412, p. 44");
    SP5: ReadWrite(267, "SP5", "preset speed 5", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11413, p. 44");
    SP6: ReadWrite(268, "SP6", "preset speed 6", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11414, p. 44");
    SP7: ReadWrite(269, "SP7", "preset speed 7", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11415, p. 44");
    IDC: ReadWrite(270, "IdC", "DC injection current", Unknown, Unit::scaled("A", 1), Range::Described(0, 32_767, "0 to In of the drive"), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11210, p. 40");
    TLS: ReadWrite(272, "tLS", "time at low speed; 0: no limit", Unknown, Unit::scaled("s", 1), Range::Described(0, 9999, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11701, p. 28");
    RPG: ReadWrite(279, "rPG", "proportional gain of the PI regulator", Unknown, Unit::scaled("", 2), Range::Described(1, 10_000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11941, p. 45");
    RIG: ReadWrite(280, "rIG", "integral gain of the PI regulator", Unknown, Unit::scaled("", 2), Range::Described(1, 10_000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11942, p. 46");
    FBS: ReadWrite(281, "FbS", "coefficient of the PI feedback", Unknown, Unit::scaled("", 1), Range::Described(1, 1000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11903, p. 46");
    CTD: WriteStopped(282, "Ctd", "motor current threshold", Unknown, Unit::scaled("A", 1), Range::Described(0, 32_767, "0 to 1.5 In of the drive"), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11001, p. 28");
    TTD: WriteStopped(283, "ttd", "motor thermal threshold", Unknown, Unit::scaled("%", 0), Range::Described(0, 118, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11002, p. 28");
    FTD: WriteStopped(284, "Ftd", "motor frequency threshold", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11003, p. 28");
    JPF: ReadWrite(286, "JPF", "skip frequency", Unknown, Unit::scaled("Hz", 1), Range::Described(0, 5000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11301, p. 27");
    PIC: ReadWrite(287, "PIC", "reversed correction of the PI regulator", Unknown, Unit::CODE, Range::OneOf(lists::NO_YES), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11940, p. 46");
    ROT: WriteStopped(340, "rOt", "authorised direction of the RUN key", Unknown, Unit::CODE, Range::OneOf(lists::ROT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W64001, p. 38");
    CMD: ReadWrite(400, "CMD", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "VVDED399092, function 16: W400 = 15; twin W8501, BBV51701 p. 57, 19");
    LFR: ReadWrite(401, "LFr", "frequency reference by the bus, signed", Volatile, Unit::scaled("Hz", 1).signed(), Range::Any, Factory::None, Manual, "VVDED399092, function 16: W401 = 200; twin W8502, BBV51701 p. 57, 19");
    CMI: ReadWrite(402, "CMI", "extended control word; its bits on the Altivar 28 are not confirmed", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8504, p. 20");
    RPI: ReadWrite(440, "rPI", "internal PI reference", Unknown, Unit::scaled("%", 1), Range::Described(0, 1000, TWIN), Factory::None, Elsewhere, "BBV51701 p. 57; twin W11920, p. 47");
    FRH: Read(450, "FrH", "frequency reference before the ramp", Volatile, Unit::scaled("Hz", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3203, p. 21");
    RFR: Read(451, "rFr", "output frequency, signed", Volatile, Unit::scaled("Hz", 1).signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3202, p. 21");
    W452: Read(452, "W452", "a word inside the manual's sample W450 to W456; its content is not known", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED399092, function 03: W450 to W456");
    LCR: Read(453, "LCr", "motor current", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3204, p. 21");
    ULN: Read(454, "ULn", "line voltage", Volatile, Unit::scaled("V", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3207, p. 21");
    THR: Read(455, "tHr", "thermal state of the motor", Volatile, Unit::scaled("%", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W9630, p. 21");
    THD: Read(456, "tHd", "thermal state of the drive", Volatile, Unit::scaled("%", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3209, p. 21");
    LFT: Read(457, "LFt", "last fault", Unknown, Unit::CODE, Range::OneOf(lists::LFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7121, p. 24");
    ETA: Read(458, "ETA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3201, p. 21");
    ETI: Read(459, "ETI", "extended status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3206, p. 22");
    ETI2: Read(460, "ETI2", "second extended status word; its bits are not public", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57, which refers to the ATV28 variables manual");
    DP1: Read(462, "DP1", "past fault 1", Unknown, Unit::CODE, Range::OneOf(lists::LFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7201, p. 24");
    DP2: Read(464, "DP2", "past fault 2", Unknown, Unit::CODE, Range::OneOf(lists::LFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7202, p. 24");
    DP3: Read(466, "DP3", "past fault 3", Unknown, Unit::CODE, Range::OneOf(lists::LFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7203, p. 24");
    DP4: Read(468, "DP4", "past fault 4", Unknown, Unit::CODE, Range::OneOf(lists::LFT), Factory::None, Elsewhere, "BBV51701 p. 57; twin W7204, p. 24");
    IOLR: ReadWrite(478, "IOLR", "logic inputs and outputs", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W5240, p. 23");
    AO1R: ReadWrite(482, "AO1R", "analog output", Volatile, Unit::COUNT, Range::Within(0, 10_000), Factory::None, Elsewhere, "BBV51701 p. 57; twin W5261, p. 23");
    OTR: Read(487, "Otr", "motor torque", Volatile, Unit::scaled("%", 0).sign_not_printed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3205, p. 21");
    OPR: Read(491, "OPr", "motor power", Volatile, Unit::scaled("%", 0).sign_not_printed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3211, p. 21");
    RTH: Read(530, "rtH", "operating time", Unknown, Unit::scaled("h", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3231, p. 21");
    INV: Read(555, "INV", "nominal current of the drive", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W3017, p. 26");
    ERRD: Read(600, "ERRD", "DSP402 error code", Volatile, Unit::CODE, Range::OneOf(lists::ERRD), Factory::None, Elsewhere, "BBV51701 p. 57; twin W8606, p. 17");
    CMDD: ReadWrite(601, "CMDD", "DSP402 control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8601, p. 16");
    ETAD: Read(602, "ETAD", "DSP402 status word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8603, p. 17");
    LFRD: ReadWrite(603, "LFRD", "speed reference by the bus, signed", Volatile, Unit::scaled("rpm", 0).signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8602, p. 16");
    FRHD: Read(604, "FRHD", "speed reference before the ramp, signed", Volatile, Unit::scaled("rpm", 0).signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8605, p. 17");
    RFRD: Read(605, "RFRD", "output speed, signed", Volatile, Unit::scaled("rpm", 0).signed(), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8604, p. 17");
    SMIL_LOW: ReadWrite(606, "SMIL", "minimum speed, low word", Unknown, Unit::scaled("rpm", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8607, p. 18");
    SMIL_HIGH: ReadWrite(607, "SMILh", "minimum speed, high word", Unknown, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8608, p. 18");
    SMAL_LOW: ReadWrite(608, "SMAL", "maximum speed, low word", Unknown, Unit::scaled("rpm", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8609, p. 18");
    SMAL_HIGH: ReadWrite(609, "SMALh", "maximum speed, high word", Unknown, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8610, p. 18");
    SPAL_LOW: ReadWrite(610, "SPAL", "acceleration, change of speed, low word", Unknown, Unit::scaled("rpm", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8611, p. 18");
    SPAL_HIGH: ReadWrite(611, "SPALh", "acceleration, change of speed, high word", Unknown, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8612, p. 18");
    SPAT: ReadWrite(612, "SPAT", "acceleration, time of that change", Unknown, Unit::scaled("s", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8613, p. 18");
    SPDL_LOW: ReadWrite(613, "SPDL", "deceleration, change of speed, low word", Unknown, Unit::scaled("rpm", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8614, p. 18");
    SPDL_HIGH: ReadWrite(614, "SPDLh", "deceleration, change of speed, high word", Unknown, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8615, p. 18");
    SPDT: ReadWrite(615, "SPDT", "deceleration, time of that change", Unknown, Unit::scaled("s", 0), Range::Any, Factory::None, Elsewhere, "BBV51701 p. 57; twin W8616, p. 18");
    LCC: WriteStopped(991, "LCC", "control by the remote terminal", Unknown, Unit::CODE, Range::OneOf(lists::NO_YES), Factory::None, Elsewhere, "BBV51701 p. 57; twin W64003, p. 38");
}
