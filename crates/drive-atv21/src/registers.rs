//! The registers of the Altivar 21, in the order of its manual.
//!
//! The manual is "Altivar 21 Modbus, guide d'exploitation", 10/2009; sections are its own. It calls an address a
//! communication number (*numéro de communication*) and writes it in hexadecimal. A parameter Fnnn has the number
//! nnn: the manual prints that for F603 and F800 to F879, and rows of other Fnnn rest on it and say so. Addresses
//! marked [`Confidence::Elsewhere`](drive_core::registers::Confidence::Elsewhere) are those of the VF-S11, the drive
//! that Toshiba builds from the same design, as the program `vfs11_vfd` of LinuxCNC uses them.
//!
//! Parameters are written to EEPROM each time; the control registers of §8.2 live in RAM and fall back to 0 at
//! power-off, at a fault reset and at a factory setting.

use drive_core::{
    registers,
    registers::{Choice, Register, access::ReadWrite},
};

const PROTOCOLS: &[Choice] = &[Choice::new(1, "RTU", "Modbus RTU")];
const SPEEDS: &[Choice] = &[Choice::new(0, "9600", "9600 bit/s"), Choice::new(1, "19200", "19200 bit/s")];
const PARITIES: &[Choice] =
    &[Choice::new(0, "NONE", "no parity"), Choice::new(1, "EVEN", "even"), Choice::new(2, "ODD", "odd")];
const COMMAND_MODES: &[Choice] =
    &[Choice::new(0, "terminals", ""), Choice::new(1, "keypad", ""), Choice::new(2, "serial", "serial link")];
const REFERENCE_MODES: &[Choice] = &[
    Choice::new(1, "VIA", "analog input VIA"),
    Choice::new(2, "VIB", "analog input VIB"),
    Choice::new(3, "keypad", ""),
    Choice::new(4, "serial", "serial link"),
    Choice::new(5, "up/down", "up and down inputs"),
];
/// Those that the manual names (§6.2, §8.4, §8.8); the others are in the drive's own.
const INPUT_FUNCTIONS: &[Choice] = &[
    Choice::new(0, "none", "no function"),
    Choice::new(38, "FCHG", "switches to the reference of F207"),
    Choice::new(48, "SC/LC", "forces local control: the terminals command"),
    Choice::new(52, "forced", "forced operation: the terminals may change command and reference"),
    Choice::new(53, "forced run", "forced run: the terminals may change command and reference"),
];
/// The highest number of a word.
const ANY: i32 = 0xFFFF;
const AUTOMATIC_RAMPS: &[Choice] = &[
    Choice::new(0, "off", "by hand"),
    Choice::new(1, "on", "automatic"),
    Choice::new(2, "acc", "automatic in acceleration only"),
];
const TIME_OUT_REACTIONS: &[Choice] = &[
    Choice::new(0, "freewheel", "freewheel stop, Err5"),
    Choice::new(1, "ramp", "stop along the ramp, Err5"),
    Choice::new(2, "DC", "stop by DC injection, Err5"),
    Choice::new(4, "factory", "as the drive is delivered; the manual does not explain it"),
];
const WRITE_SLOTS: &[Choice] = &[
    Choice::new(0, "none", "no selection"),
    Choice::new(1, "FA00", "command word"),
    Choice::new(2, "FA20", "command word 2"),
    Choice::new(3, "FA01", "frequency reference"),
    Choice::new(4, "FA50", "logic outputs"),
    Choice::new(5, "FA51", "analog output"),
    Choice::new(6, "FA13", "speed reference"),
];
const READ_SLOTS: &[Choice] = &[
    Choice::new(0, "none", "no selection"),
    Choice::new(1, "FD01", "status word"),
    Choice::new(2, "FD00", "output frequency"),
    Choice::new(3, "FE03", "output current"),
    Choice::new(4, "FE05", "output voltage"),
    Choice::new(5, "FC91", "alarm code"),
    Choice::new(6, "FE22", "PID feedback"),
    Choice::new(7, "FD06", "logic inputs"),
    Choice::new(8, "FD07", "logic outputs"),
    Choice::new(9, "FE35", "analog input VIA"),
    Choice::new(10, "FE36", "analog input VIB"),
    Choice::new(11, "FE90", "output speed"),
];
const REFERENCE_SOURCES: &[Choice] = &[
    Choice::new(1, "VIA", "analog input VIA"),
    Choice::new(2, "VIB", "analog input VIB"),
    Choice::new(3, "keypad", ""),
    Choice::new(4, "serial", "serial link"),
    Choice::new(5, "up/down", "up and down inputs"),
    Choice::new(255, "preset", "a preset speed"),
];

registers! {
    /// Every register of the Altivar 21 whose address is known.
    pub const ROWS;

    // §6.1 Communication parameters, p. 11
    /// It takes effect after a reset of the drive.
    PROTOCOL_SELECTION: ReadWrite(0x0829, "F829", "communication protocol", Eeprom, Unit::CODE, Range::OneOfOr(PROTOCOLS, 0, 4), Factory::Value(1), Manual, "Altivar 21 Modbus §6.1 p. 11");
    /// It takes effect after a reset of the drive.
    BAUD_RATE: ReadWrite(0x0800, "F800", "Modbus speed", Eeprom, Unit::CODE, Range::OneOf(SPEEDS), Factory::Value(1), Manual, "Altivar 21 Modbus §6.1 p. 11");
    /// It takes effect after a reset of the drive.
    PARITY: ReadWrite(0x0801, "F801", "parity", Eeprom, Unit::CODE, Range::OneOf(PARITIES), Factory::Value(1), Manual, "Altivar 21 Modbus §6.1 p. 11");
    /// It takes effect at once: the drive answers at the new address. 0 would make it mute.
    ADDRESS: ReadWrite(0x0802, "F802", "Modbus address", Eeprom, Unit::COUNT, Range::Within(0, 247), Factory::Value(1), Manual, "Altivar 21 Modbus §6.1 p. 11");

    // §6.2 Control source, p. 12 to 17
    COMMAND_MODE: ReadWrite(0x0003, "CMOD", "command source", Eeprom, Unit::CODE, Range::OneOf(COMMAND_MODES), Factory::Value(0), Elsewhere, "Altivar 21 Modbus §6.2; address as in LinuxCNC vfs11_vfd");
    REFERENCE_MODE: ReadWrite(0x0004, "FMOD", "reference source", Eeprom, Unit::CODE, Range::OneOf(REFERENCE_MODES), Factory::Value(1), Elsewhere, "Altivar 21 Modbus §6.2; address as in LinuxCNC vfs11_vfd");
    /// The manual names it with the functions of the inputs, and no input that it belongs to: it counts as always on.
    ALWAYS_FUNCTION: ReadWrite(0x0110, "F110", "function that is always on", Eeprom, Unit::CODE, Range::OneOfOr(INPUT_FUNCTIONS, 0, ANY), Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31; address by the rule of Fnnn");
    INPUT_F_FUNCTION: ReadWrite(0x0111, "F111", "function of input F", Eeprom, Unit::CODE, Range::OneOfOr(INPUT_FUNCTIONS, 0, ANY), Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31, §8.8 p. 38; address by the rule of Fnnn");
    INPUT_R_FUNCTION: ReadWrite(0x0112, "F112", "function of input R", Eeprom, Unit::CODE, Range::OneOfOr(INPUT_FUNCTIONS, 0, ANY), Factory::None, Manual, "Altivar 21 Modbus §6.2 p. 15, 16; address by the rule of Fnnn");
    INPUT_RES_FUNCTION: ReadWrite(0x0113, "F113", "function of input RES", Eeprom, Unit::CODE, Range::OneOfOr(INPUT_FUNCTIONS, 0, ANY), Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31, §8.8 p. 38; address by the rule of Fnnn");
    /// In force only where F109 makes VIA a logic input.
    INPUT_VIA_FUNCTION: ReadWrite(0x0118, "F118", "function of input VIA", Eeprom, Unit::CODE, Range::OneOfOr(INPUT_FUNCTIONS, 0, ANY), Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31, §8.8 p. 38; address by the rule of Fnnn");
    /// 0: VIA is an analog input; the manual prints no number for a logic input.
    VIA_IS_LOGIC: ReadWrite(0x0109, "F109", "VIA as a logic input", Eeprom, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.8 p. 38; address by the rule of Fnnn");
    SECOND_REFERENCE: ReadWrite(0x0207, "F207", "reference when FCHG is on", Eeprom, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §6.2 p. 16; address by the rule of Fnnn");

    // §6.3 Indirect blocks, p. 18
    /// It takes effect after a reset of the drive.
    WRITE_SLOT_1: ReadWrite(0x0870, "F870", "write block, word 1", Eeprom, Unit::CODE, Range::OneOf(WRITE_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    WRITE_SLOT_2: ReadWrite(0x0871, "F871", "write block, word 2", Eeprom, Unit::CODE, Range::OneOf(WRITE_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    READ_SLOT_1: ReadWrite(0x0875, "F875", "read block, word 1", Eeprom, Unit::CODE, Range::OneOf(READ_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    READ_SLOT_2: ReadWrite(0x0876, "F876", "read block, word 2", Eeprom, Unit::CODE, Range::OneOf(READ_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    READ_SLOT_3: ReadWrite(0x0877, "F877", "read block, word 3", Eeprom, Unit::CODE, Range::OneOf(READ_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    READ_SLOT_4: ReadWrite(0x0878, "F878", "read block, word 4", Eeprom, Unit::CODE, Range::OneOf(READ_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");
    /// It takes effect after a reset of the drive.
    READ_SLOT_5: ReadWrite(0x0879, "F879", "read block, word 5", Eeprom, Unit::CODE, Range::OneOf(READ_SLOTS), Factory::Value(0), Manual, "Altivar 21 Modbus §6.3 p. 18");

    // §6.4 Communication fault, p. 19
    /// 0: off. It takes effect at once.
    TIME_OUT: ReadWrite(0x0803, "F803", "Modbus time-out", Eeprom, Unit::scaled("s", 0), Range::Within(0, 100), Factory::Value(3), Manual, "Altivar 21 Modbus §6.4 p. 19");
    TIME_OUT_REACTION: ReadWrite(0x0603, "F603", "reaction to a Modbus fault", Eeprom, Unit::CODE, Range::OneOf(TIME_OUT_REACTIONS), Factory::Value(4), Manual, "Altivar 21 Modbus §6.4 p. 19");

    // §8.1 The example of the parameter table, and parameters beside it, p. 27
    AUTOMATIC_RAMP: ReadWrite(0x0000, "AU1", "automatic acceleration and deceleration", Eeprom, Unit::CODE, Range::OneOf(AUTOMATIC_RAMPS), Factory::Value(0), Manual, "Altivar 21 Modbus §8.1 p. 27");
    /// The text below the manual's table counts in 0.01 s; the table itself and LinuxCNC count in 0.1 s.
    ACCELERATION: ReadWrite(0x0009, "ACC", "acceleration time 1", Eeprom, Unit::scaled("s", 1), Range::Within(0, 32_000), Factory::Value(100), Manual, "Altivar 21 Modbus §8.1 p. 27");
    DECELERATION: ReadWrite(0x0010, "DEC", "deceleration time 1", Eeprom, Unit::scaled("s", 1), Range::Any, Factory::None, Elsewhere, "VF-S11 manual E6581222, communication number 0010");
    UPPER_LIMIT: ReadWrite(0x0012, "UL", "upper limit frequency", Eeprom, Unit::scaled("Hz", 2), Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd, REG_UPPERLIMIT");
    /// The manual gives no unit.
    ACCELERATION_2: ReadWrite(0x0500, "F500", "acceleration time 2", Eeprom, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31; address by the rule of Fnnn");
    /// The manual gives no unit.
    DECELERATION_2: ReadWrite(0x0501, "F501", "deceleration time 2", Eeprom, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.4 p. 31; address by the rule of Fnnn");
    /// The manual does not say how the value counts the poles, so nothing is computed from it.
    MOTOR_POLES: ReadWrite(0x0856, "F856", "number of motor poles", Eeprom, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.5 p. 33; address by the rule of Fnnn");

    // §8.2 Control registers, p. 28: RAM only
    /// Its bits are [`crate::CommandWord`].
    COMMAND_WORD: ReadWrite(0xFA00, "FA00", "command word", Volatile, Unit::BITS, Range::Any, Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.4 p. 31");
    /// Its bits are [`crate::CommandWord2`].
    COMMAND_WORD_2: ReadWrite(0xFA20, "FA20", "command word 2", Volatile, Unit::BITS, Range::Any, Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.4 p. 32");
    FREQUENCY_REFERENCE: ReadWrite(0xFA01, "FA01", "frequency reference", Volatile, Unit::scaled("Hz", 2), Range::Described(0, 65_535, "0 to the maximum frequency FH"), Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.5 p. 33");
    SPEED_REFERENCE: ReadWrite(0xFA13, "FA13", "speed reference", Volatile, Unit::scaled("rpm", 0), Range::Within(0, 24_000), Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.5 p. 33");
    /// Bit 0 is relay RY, where F130 or F137 says 38 (or 39, which the manual does not describe).
    LOGIC_OUTPUT_COMMAND: ReadWrite(0xFA50, "FA50", "command of the logic outputs", Volatile, Unit::BITS, Range::Within(0, 255), Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.8 p. 39");
    /// Needs FMSL = 18.
    ANALOG_OUTPUT_COMMAND: ReadWrite(0xFA51, "FA51", "command of the analog output FM", Volatile, Unit::COUNT, Range::Within(0, 1_023), Factory::Value(0), Manual, "Altivar 21 Modbus §8.2 p. 28, §8.8 p. 39");

    // §8.3 State, p. 29
    /// Its bits are [`crate::StatusWord`].
    STATUS_WORD: Read(0xFD01, "FD01", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    STATUS_WORD_2: Read(0xFD42, "FD42", "status word 2", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    STATUS_WORD_3: Read(0xFD49, "FD49", "status word 3", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    TRIP_STATUS_WORD: Read(0xFE01, "FE01", "status word before the last trip", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    TRIP_STATUS_WORD_2: Read(0xFE42, "FE42", "status word 2 before the last trip", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    TRIP_STATUS_WORD_3: Read(0xFE49, "FE49", "status word 3 before the last trip", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 34");
    COMMAND_SOURCE: Read(0xFE45, "FE45", "present command source", Volatile, Unit::CODE, Range::OneOf(COMMAND_MODES), Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 35");
    REFERENCE_SOURCE: Read(0xFE46, "FE46", "present reference source", Volatile, Unit::CODE, Range::OneOf(REFERENCE_SOURCES), Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29, §8.6 p. 35");

    // §8.3 Frequency and speed, p. 29
    OUTPUT_FREQUENCY: Read(0xFD00, "FD00", "output frequency", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    TRIP_OUTPUT_FREQUENCY: Read(0xFE00, "FE00", "output frequency before the last trip", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    /// Computed by the drive from FD00 and the poles P of F856: (12 FD00 + 5 P) / (10 P).
    OUTPUT_SPEED: Read(0xFE90, "FE90", "output speed", Volatile, Unit::scaled("rpm", 0), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    ESTIMATED_SPEED: Read(0xFE16, "FE16", "estimated speed", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    REFERENCE_BEFORE_RAMP: Read(0xFE02, "FE02", "reference before PID and ramp", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    REFERENCE_AFTER_RAMP: Read(0xFE15, "FE15", "reference after PID and ramp", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    PID_FEEDBACK: Read(0xFE22, "FE22", "PID feedback", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");

    // §8.3 Current and torque, p. 29; the manual does not say what 100 % is
    OUTPUT_CURRENT: Read(0xFE03, "FE03", "output current", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    TORQUE: Read(0xFE18, "FE18", "torque", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    TORQUE_CURRENT: Read(0xFE20, "FE20", "torque current", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    EXCITATION_CURRENT: Read(0xFE21, "FE21", "excitation current", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");

    // §8.3 Voltage, p. 29; the manual does not say what 100 % is
    OUTPUT_VOLTAGE: Read(0xFE05, "FE05", "output voltage", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    DC_BUS_VOLTAGE: Read(0xFE04, "FE04", "DC bus voltage", Volatile, Unit::scaled("%", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");

    // §8.3 Power and energy, p. 29
    INPUT_POWER: Read(0xFE29, "FE29", "input power", Volatile, Unit::scaled("kW", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    OUTPUT_POWER: Read(0xFE30, "FE30", "output power", Volatile, Unit::scaled("kW", 2), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    /// The manual gives no unit.
    INPUT_ENERGY: Read(0xFE76, "FE76", "input energy", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    /// The manual gives no unit.
    OUTPUT_ENERGY: Read(0xFE77, "FE77", "output energy", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");

    // §8.3 Maintenance, p. 29
    MOTOR_LOAD: Read(0xFE26, "FE26", "motor load", Volatile, Unit::scaled("%", 0), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    DRIVE_LOAD: Read(0xFE27, "FE27", "drive load", Volatile, Unit::scaled("%", 0), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    RUNNING_TIME: Read(0xFE14, "FE14", "cumulative running time", Volatile, Unit::scaled("h", 0), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");
    POWERED_TIME: Read(0xFE80, "FE80", "cumulative powered time", Volatile, Unit::scaled("h", 0), Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 29");

    // §8.3 Inputs and outputs, p. 30
    /// Its bits are [`crate::LogicInputs`].
    LOGIC_INPUTS: Read(0xFD06, "FD06", "logic inputs", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");
    /// Its bits are [`crate::LogicOutputs`].
    LOGIC_OUTPUTS: Read(0xFD07, "FD07", "logic outputs", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");
    TRIP_LOGIC_INPUTS: Read(0xFE06, "FE06", "logic inputs before the last trip", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");
    TRIP_LOGIC_OUTPUTS: Read(0xFE07, "FE07", "logic outputs before the last trip", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");
    /// 0 to 1023.
    ANALOG_INPUT_VIA: Read(0xFE35, "FE35", "analog input VIA", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");
    /// 0 to 1023.
    ANALOG_INPUT_VIB: Read(0xFE36, "FE36", "analog input VIB", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.8 p. 38");

    // §8.3 Faults and alarms, p. 30
    FAULT_CODE: Read(0xFC90, "FC90", "present fault", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 37");
    /// Its bits are [`crate::Alarms`].
    ALARM_CODE: Read(0xFC91, "FC91", "alarms", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 36");
    /// Its bits are [`crate::MaintenanceAlarms`].
    MAINTENANCE_ALARM: Read(0xFE79, "FE79", "maintenance alarms", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 36");
    PAST_FAULT_1: Read(0xFE10, "FE10", "last fault", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 37");
    PAST_FAULT_2: Read(0xFE11, "FE11", "last fault but one", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 37");
    PAST_FAULT_3: Read(0xFE12, "FE12", "last fault but two", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 37");
    PAST_FAULT_4: Read(0xFE13, "FE13", "last fault but three", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.3 p. 30, §8.7 p. 37");

    // §8.9 Identification, p. 40, 41
    MODEL_CODE: Read(0xFB05, "FB05", "model code", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.9 p. 40");
    /// Bit 7: class B variant.
    MODEL_CLASS: Read(0xFB72, "FB72", "model class", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "Altivar 21 Modbus §8.9 p. 40");

    // Not in the manual: known from the VF-S11
    RATED_CURRENT: Read(0xFE70, "FE70", "rated current of the drive", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd");
    RATED_VOLTAGE: Read(0xFE71, "FE71", "rated voltage of the drive", Volatile, Unit::scaled("V", 1), Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd");
    CPU1_VERSION: Read(0xFE08, "FE08", "version of CPU 1", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd");
    EEPROM_VERSION: Read(0xFE09, "FE09", "version of the EEPROM", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd");
    CPU2_VERSION: Read(0xFE73, "FE73", "version of CPU 2", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "LinuxCNC vfs11_vfd");
}

/// F875 to F879, in the order of the block.
pub(crate) const READ_SLOTS_IN_ORDER: [Register<ReadWrite>; 5] =
    [READ_SLOT_1, READ_SLOT_2, READ_SLOT_3, READ_SLOT_4, READ_SLOT_5];
/// F870 and F871, in the order of the block.
pub(crate) const WRITE_SLOTS_IN_ORDER: [Register<ReadWrite>; 2] = [WRITE_SLOT_1, WRITE_SLOT_2];
