//! What the codes in `LFt` and `DP1` to `DP4` mean (BBV51701 p. 24, of the Altivar 312 twins W7121 and W7201 to W7204)
//! and what to do first.

use drive_core::FaultEntry;

/// The fault codes, without those of what an Altivar 28 does not have: option card (7), CANopen (34), brake control
/// (35, beyond the twin's access level L1) and the ATV312HD15's power module (36).
pub const FAULTS: &[FaultEntry] = &[
    fault(3, "CFF", "incorrect configuration", "return to the factory setting or load a valid configuration"),
    fault(
        4,
        "CFI",
        "invalid configuration loaded over the link",
        "check the configuration and load it again, or return to the factory setting",
    ),
    fault(
        5,
        "SLF",
        "Modbus communication interrupted",
        "check cable, address and settings of the line, and that the master polls often enough",
    ),
    fault(6, "ILF", "internal communication interrupted", "switch off and on; have the drive repaired"),
    fault(8, "EPF", "external fault", "find and remove what caused the external signal"),
    fault(9, "OCF", "overcurrent", "check motor and load, and take longer ramps"),
    fault(10, "CrF", "capacitor pre-charge failed", "switch off and on; have the drive repaired"),
    fault(13, "LFF", "4-20 mA reference lost", "check the wiring and source of input AI3"),
    fault(
        16,
        "OHF",
        "drive overheating",
        "check load, ventilation and ambient temperature, and let it cool down",
    ),
    fault(
        17,
        "OLF",
        "motor overload",
        "check the load and the thermal current ItH, and let the motor cool down",
    ),
    fault(
        18,
        "ObF",
        "DC bus overvoltage while braking",
        "take a longer deceleration or add a braking resistor",
    ),
    fault(19, "OSF", "line overvoltage", "check the line voltage"),
    fault(20, "OPF", "motor phase loss", "check the motor connections, and OPL if a contactor is in between"),
    fault(21, "PHF", "line phase loss", "check line connections and fuses"),
    fault(22, "USF", "line undervoltage", "check the line voltage and for dips of the supply"),
    fault(
        23,
        "OCF",
        "motor short circuit between phases",
        "check cable and motor insulation before any new start",
    ),
    fault(24, "SOF", "motor overspeed", "check for a driving load and tune the stability of the drive"),
    fault(25, "tnF", "auto-tuning failed", "check that motor and drive fit and that the motor is connected"),
    fault(26, "IF1", "internal: unknown rating", "have the drive repaired"),
    fault(27, "IF2", "internal: MMI card", "have the drive repaired"),
    fault(28, "IF3", "internal: MMI communication", "have the drive repaired"),
    fault(29, "IF4", "internal: industrial EEPROM", "have the drive repaired"),
    fault(30, "EEF", "EEPROM", "switch off and on; have the drive repaired"),
    fault(31, "OCF", "impeding short circuit", "check cable and motor insulation before any new start"),
    fault(
        32,
        "SCF",
        "motor short circuit to ground",
        "check cable and motor insulation before any new start",
    ),
    fault(33, "OPF", "loss of all three motor phases", "check the motor connections and contactor"),
    fault(
        55,
        "SCF",
        "power module or motor short circuit, found at power-up",
        "disconnect the motor and try again; have the drive repaired if it stays",
    ),
];

/// The alarms of `ETI` (W459, twin W3206, BBV51701 p. 22); the code is the bit's number.
pub const WARNINGS: &[FaultEntry] = &[
    fault(7, "ETI.7", "motor thermal alarm", "lower the load and check the thermal current ItH"),
    fault(8, "ETI.8", "excessive braking", "take a longer deceleration"),
    fault(11, "ETI.11", "current limit", "lower the load or take a longer acceleration"),
];

const fn fault(code: u16, mnemonic: &'static str, meaning: &'static str, remedy: &'static str) -> FaultEntry {
    FaultEntry::new(code, mnemonic, meaning, remedy)
}
