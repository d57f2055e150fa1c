//! Every register of the 3G3EV, in the order of "3G3EV MODBUS" (Omron, French), sections in brackets.
//!
//! The manual names its registers by their addresses; parameters by their numbers on the keypad, n01 to n68, at
//! 0100h plus the number (§5.4). Only some of the parameters are named there: the others are raw words here, with
//! the access that error 22h gives to a constant.
//!
//! What lives where: commands, references and monitors are volatile. A parameter acts in RAM until the drive is
//! switched off, unless ENTER (0900h) saves it (§4.5; VS-606V7 manual p. 12). The parameters of §2.1 act after the
//! next power-up only (its note 3).
//!
//! Reserved, and without a row: 0025h, 0026h, 0029h, 002Ah, 002Eh to 0030h, 0032h to 003Ch, 003Eh to 00FFh. What they
//! answer the manual does not say.

use drive_core::{
    registers,
    registers::{Choice, Row},
};

/// The highest number of a word.
const WORD: i32 = 0xFFFF;
/// The first parameter's address less one (§5.4).
const PARAMETERS: u16 = 0x0100;

/// `n02`: who gives the run command, and who the reference. The manual prints row 3 like row 0.
const MODE: &[Choice] = &[
    Choice::new(0, "panel/panel", "run by the panel, reference by the panel"),
    Choice::new(1, "terminals/panel", "run by the terminals, reference by the panel"),
    Choice::new(2, "bus/panel", "run by the bus, reference by the panel"),
    Choice::new(3, "panel/panel", "run by the panel, reference by the panel"),
    Choice::new(4, "terminals/bus", "run by the terminals, reference by the bus"),
    Choice::new(5, "bus/bus", "run by the bus, reference by the bus"),
];

/// `n05`.
const REVERSE: &[Choice] = &[Choice::new(1, "forbidden", "no run in reverse")];

/// `n09`, `n10`.
const BY_BUS: &[Choice] = &[Choice::new(15, "bus", "commanded by 0009h")];

/// `n39`.
const FREQUENCY_UNIT: &[Choice] = &[
    Choice::new(0, "0.1 Hz", ""),
    Choice::new(1, "0.01 Hz", ""),
    Choice::new(2, "30000 = 100 %", ""),
    Choice::new(3, "0.1 %", ""),
];

/// `n40`.
const TIME_OVER: &[Choice] = &[Choice::new(0, "on", "detection"), Choice::new(1, "off", "no detection")];

/// `n63`.
const BAUD: &[Choice] = &[
    Choice::new(0, "2400", "bit/s"),
    Choice::new(1, "4800", "bit/s"),
    Choice::new(2, "9600", "bit/s"),
    Choice::new(3, "19200", "bit/s"),
];

/// `n64`.
const PARITY: &[Choice] =
    &[Choice::new(0, "even", ""), Choice::new(1, "odd", ""), Choice::new(2, "none", "")];

/// `n66`.
const RTS: &[Choice] = &[
    Choice::new(0, "RTS", "RTS control: RS-485 and RS-422"),
    Choice::new(1, "no RTS", "without RTS: RS-232C"),
];

registers! {
    /// Every register of the family.
    pub const ROWS;

    // Commands, §5.1.
    COMMAND: ReadWrite(0x0001, "0001h", "run command and inputs", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.1");
    REFERENCE: ReadWrite(0x0002, "0002h", "frequency reference, in the unit of n39", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.1");
    VF_GAIN: ReadWrite(0x0003, "0003h", "gain of the V/f curve", Volatile, Unit::scaled("%", 1), Range::Within(20, 2_000), Factory::Value(1_000), Manual, "§5.1; factory setting: A1000 manual p. 559");
    OUTPUTS: ReadWrite(0x0009, "0009h", "outputs, where n09 and n10 give them to the bus", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.1");
    ENTER: Write(0x0900, "0900h", "ENTER: saves the parameters to EEPROM, 100 000 times at most", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "§4.5, §5.1");

    // Monitors, §5.2.
    SIGNALS: Read(0x0020, "0020h", "state of the signals", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    ERRORS: Read(0x0021, "0021h", "faults", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    LINK: Read(0x0022, "0022h", "state of the transmission", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    REFERENCE_SEEN: Read(0x0023, "0023h", "frequency reference in force, in the unit of n39", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.2");
    OUTPUT_FREQUENCY: Read(0x0024, "0024h", "output frequency, in the unit of n39", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.2");
    CURRENT: Read(0x0027, "0027h", "output current", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Manual, "§5.2");
    OUTPUT_VOLTAGE: Read(0x0028, "0028h", "output voltage", Volatile, Unit::scaled("V", 0), Range::Any, Factory::None, Manual, "§5.2");
    INPUT_TERMINALS: Read(0x002B, "002Bh", "input terminals; the manual has no list of the bits", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    STATE: Read(0x002C, "002Ch", "state of the drive", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    OUTPUT_CONTACTS: Read(0x002D, "002Dh", "output contacts; the manual has no list of the bits", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");
    DC_BUS: Read(0x0031, "0031h", "voltage of the DC bus", Volatile, Unit::scaled("V", 0), Range::Any, Factory::None, Manual, "§5.2");
    LINK_ERROR: Read(0x003D, "003Dh", "communication error", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "§5.2");

    // Parameters, §2.1, §5.1 to §5.4. §6 changes n20 while the motor runs; error 22h refuses the others then.
    N01: WriteStopped(0x0101, "n01", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N02: WriteStopped(0x0102, "n02", "source of run command and frequency reference", RamUntilSaved, Unit::CODE, Range::OneOf(MODE), Factory::Value(5), Manual, "§2.1");
    N03: WriteStopped(0x0103, "n03", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N04: WriteStopped(0x0104, "n04", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N05: WriteStopped(0x0105, "n05", "reverse rotation", RamUntilSaved, Unit::CODE, Range::OneOfOr(REVERSE, 0, WORD), Factory::None, Manual, "§5.3 OP6");
    N06: WriteStopped(0x0106, "n06", "function of input 1, bit 4 of 0001h", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.1");
    N07: WriteStopped(0x0107, "n07", "function of input 2, bit 5 of 0001h", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.1");
    N08: WriteStopped(0x0108, "n08", "function of input 3, bit 6 of 0001h", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.1");
    N09: WriteStopped(0x0109, "n09", "function of output 1", RamUntilSaved, Unit::COUNT, Range::OneOfOr(BY_BUS, 0, WORD), Factory::None, Manual, "§5.1");
    N10: WriteStopped(0x010A, "n10", "function of output 2", RamUntilSaved, Unit::COUNT, Range::OneOfOr(BY_BUS, 0, WORD), Factory::None, Manual, "§5.1");
    N11: WriteStopped(0x010B, "n11", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N12: WriteStopped(0x010C, "n12", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N13: WriteStopped(0x010D, "n13", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N14: WriteStopped(0x010E, "n14", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N15: WriteStopped(0x010F, "n15", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N16: WriteStopped(0x0110, "n16", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N17: WriteStopped(0x0111, "n17", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N18: WriteStopped(0x0112, "n18", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N19: WriteStopped(0x0113, "n19", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N20: ReadWrite(0x0114, "n20", "acceleration time", RamUntilSaved, Unit::scaled("s", 1), Range::Any, Factory::None, Manual, "§5.4, §6");
    N21: WriteStopped(0x0115, "n21", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N22: WriteStopped(0x0116, "n22", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N23: WriteStopped(0x0117, "n23", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N24: WriteStopped(0x0118, "n24", "V/f curve", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.3 OP2");
    N25: WriteStopped(0x0119, "n25", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N26: WriteStopped(0x011A, "n26", "V/f curve", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.3 OP2");
    N27: WriteStopped(0x011B, "n27", "V/f curve", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.3 OP2");
    N28: WriteStopped(0x011C, "n28", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N29: WriteStopped(0x011D, "n29", "V/f curve", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.3 OP2");
    N30: WriteStopped(0x011E, "n30", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N31: WriteStopped(0x011F, "n31", "current of the thermal protection", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "at most 120 % of the drive's rated current"), Factory::None, Manual, "§5.3 OP3");
    N32: WriteStopped(0x0120, "n32", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N33: WriteStopped(0x0121, "n33", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N34: WriteStopped(0x0122, "n34", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N35: WriteStopped(0x0123, "n35", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N36: WriteStopped(0x0124, "n36", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N37: WriteStopped(0x0125, "n37", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N38: WriteStopped(0x0126, "n38", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N39: WriteStopped(0x0127, "n39", "unit of the frequencies in 0002h, 0023h and 0024h", RamUntilSaved, Unit::CODE, Range::OneOf(FREQUENCY_UNIT), Factory::Value(0), Manual, "§2.1");
    N40: WriteStopped(0x0128, "n40", "time-over detection", RamUntilSaved, Unit::CODE, Range::OneOf(TIME_OVER), Factory::Value(0), Manual, "§2.1");
    N41: WriteStopped(0x0129, "n41", "not below n42", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "not below n42"), Factory::None, Manual, "§5.3 OP4");
    N42: WriteStopped(0x012A, "n42", "not above n41", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "not above n41"), Factory::None, Manual, "§5.3 OP4");
    N43: WriteStopped(0x012B, "n43", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N44: WriteStopped(0x012C, "n44", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N45: WriteStopped(0x012D, "n45", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N46: WriteStopped(0x012E, "n46", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N47: WriteStopped(0x012F, "n47", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N48: WriteStopped(0x0130, "n48", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N49: WriteStopped(0x0131, "n49", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N50: WriteStopped(0x0132, "n50", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N51: WriteStopped(0x0133, "n51", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N52: WriteStopped(0x0134, "n52", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N53: WriteStopped(0x0135, "n53", "level of the frequency detections, bits 4 and 5 of 002Ch", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.2");
    N54: WriteStopped(0x0136, "n54", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N55: WriteStopped(0x0137, "n55", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N56: WriteStopped(0x0138, "n56", "skip frequency 1", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "not below n57"), Factory::None, Manual, "§5.3 OP5");
    N57: WriteStopped(0x0139, "n57", "skip frequency 2", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "n58 to n56"), Factory::None, Manual, "§5.3 OP5");
    N58: WriteStopped(0x013A, "n58", "skip frequency 3", RamUntilSaved, Unit::COUNT, Range::Described(0, WORD, "not above n57"), Factory::None, Manual, "§5.3 OP5");
    N59: WriteStopped(0x013B, "n59", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N60: WriteStopped(0x013C, "n60", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N61: WriteStopped(0x013D, "n61", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N62: WriteStopped(0x013E, "n62", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
    N63: WriteStopped(0x013F, "n63", "speed of the line", RamUntilSaved, Unit::CODE, Range::OneOf(BAUD), Factory::Value(2), Manual, "§2.1");
    N64: WriteStopped(0x0140, "n64", "parity of the line", RamUntilSaved, Unit::CODE, Range::OneOf(PARITY), Factory::Value(0), Manual, "§2.1");
    N65: WriteStopped(0x0141, "n65", "time before an answer", RamUntilSaved, Unit::scaled("ms", 0), Range::Within(5, 40), Factory::Value(5), Manual, "§2.1");
    N66: WriteStopped(0x0142, "n66", "RTS control", RamUntilSaved, Unit::CODE, Range::OneOf(RTS), Factory::Value(0), Manual, "§2.1");
    N67: WriteStopped(0x0143, "n67", "slave address", RamUntilSaved, Unit::COUNT, Range::Within(1, 31), Factory::Value(0), Manual, "§2.1");
    N68: WriteStopped(0x0144, "n68", "raw word, not named in the manual", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Manual, "§5.4, address only");
}

/// The parameter with this number on the keypad, 1 to 68, named in the manual or not. `None` for other numbers.
///
/// ```
/// use drive_3g3ev::registers;
///
/// assert_eq!(registers::parameter(20).unwrap().address, 0x0114);
/// ```
#[must_use]
pub fn parameter(number: u8) -> Option<&'static Row> {
    let address = PARAMETERS + u16::from(number);
    ROWS.iter().find(|row| row.address == address)
}
