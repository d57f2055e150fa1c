//! What the codes in `LFt` (W7121) and `DP1` to `DP4` (W7201–W7204) mean (BBV51701 p. 24) and what to do first; the CiA
//! 402 error codes of `ERRD` (p. 17); the alarms.

use drive_core::FaultEntry;

use crate::words::FaultState;

/// The fault codes; 0 is "no fault code saved".
pub const FAULTS: &[FaultEntry] = &[
    FaultEntry::new(
        3,
        "CFF",
        "incorrect configuration",
        "check the parameters, or return to factory settings by FCS",
    ),
    FaultEntry::new(
        4,
        "CFI",
        "invalid configuration",
        "load a valid configuration, or return to factory settings by FCS",
    ),
    FaultEntry::new(
        5,
        "SLF",
        "Modbus communication interruption",
        "check line and master; a master that is too slow needs a longer ttO",
    ),
    FaultEntry::new(
        6,
        "ILF",
        "internal communication interruption",
        "switch off and on; check the option card; call service if it returns",
    ),
    FaultEntry::new(
        7,
        "CnF",
        "communication option card",
        "read the detail in W7132; check the card and its network",
    ),
    FaultEntry::new(
        8,
        "EPF",
        "external fault",
        "remove what the input or the bit of EtF, or CMI bit 3, reports",
    ),
    FaultEntry::new(9, "OCF", "overcurrent", "check motor parameters, load and the length of the ramps"),
    FaultEntry::new(10, "CrF", "capacitor pre-charge", "switch off and on; call service if it returns"),
    FaultEntry::new(13, "LFF", "4-20 mA loss", "check the signal and the wiring of input AI3"),
    FaultEntry::new(
        16,
        "OHF",
        "drive overheating",
        "check load, ventilation and ambient temperature; let it cool down",
    ),
    FaultEntry::new(17, "OLF", "motor overload", "check the load and ItH; let the motor cool down"),
    FaultEntry::new(
        18,
        "ObF",
        "DC bus overvoltage",
        "lengthen the deceleration, set brA, or fit a braking resistor",
    ),
    FaultEntry::new(19, "OSF", "line supply overvoltage", "check the supply voltage"),
    FaultEntry::new(
        20,
        "OPF",
        "motor phase loss",
        "check the motor cable; set OPL if a contactor stands behind the drive",
    ),
    FaultEntry::new(
        21,
        "PHF",
        "line phase loss",
        "check fuses and supply; set IPL for a drive that is fed by one phase",
    ),
    FaultEntry::new(22, "USF", "line supply undervoltage", "check the supply for too low a voltage or dips"),
    FaultEntry::new(
        23,
        "OCF",
        "motor short-circuit, phase to phase",
        "check motor and cable for insulation before any reset",
    ),
    FaultEntry::new(
        24,
        "SOF",
        "motor overspeed",
        "check motor parameters and a load that drives; tune gain and stability",
    ),
    FaultEntry::new(
        25,
        "tnF",
        "auto-tuning was unsuccessful",
        "check that the motor is connected and fits the drive, then tune again",
    ),
    FaultEntry::new(26, "IF1", "internal: unknown rating", "call service"),
    FaultEntry::new(27, "IF2", "internal: MMI card", "call service"),
    FaultEntry::new(28, "IF3", "internal: MMI communication", "call service"),
    FaultEntry::new(29, "IF4", "internal: industrial EEPROM", "call service"),
    FaultEntry::new(30, "EEF", "EEPROM memory", "switch off and on; call service if it returns"),
    FaultEntry::new(
        31,
        "OCF",
        "impeding short-circuit",
        "check motor and cable for insulation before any reset",
    ),
    FaultEntry::new(
        32,
        "SCF",
        "motor short-circuit to ground",
        "check motor and cable for insulation before any reset",
    ),
    FaultEntry::new(
        33,
        "OPF",
        "motor phase loss, 3 phases",
        "check that the motor is connected; set OPL if a contactor stands behind the drive",
    ),
    FaultEntry::new(34, "COF", "CANopen communication interruption", "check the CANopen line and its master"),
    FaultEntry::new(35, "bLF", "brake control", "check the brake and its parameters; bEn must be set"),
    FaultEntry::new(
        36,
        "OCF",
        "power module (ATV312·D15·)",
        "check motor and cable; call service if it returns",
    ),
    FaultEntry::new(
        55,
        "SCF",
        "power module or motor short-circuit at power-up",
        "check motor and cable before the next power-up; call service if it returns",
    ),
];

/// The alarms, by a number of their own: the bit of `ETI` (W3206), or 16 and the bit of `LRS1` (W3250). Code 0 is ETA's
/// bit 7 alone, an alarm that these words do not explain.
pub const WARNINGS: &[FaultEntry] = &[
    FaultEntry::new(0, "ETA.7", "an alarm that ETI and LRS1 do not explain", "look at the drive's display"),
    FaultEntry::new(7, "ETI.7", "motor thermal overload alarm", "lower the load before OLF trips"),
    FaultEntry::new(8, "ETI.8", "excessive braking", "lengthen the deceleration before ObF trips"),
    FaultEntry::new(11, "ETI.11", "current limit", "check load, ramps and CLI"),
    FaultEntry::new(24, "LRS1.8", "motor thermal overload alarm", "lower the load before OLF trips"),
    FaultEntry::new(
        28,
        "LRS1.12",
        "loss of the 4-20 mA signal",
        "check the signal and the wiring of input AI3",
    ),
    FaultEntry::new(
        30,
        "LRS1.14",
        "drive thermal overload alarm",
        "check load and ventilation before OHF trips",
    ),
];

/// A past fault with the drive's state at the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PastFault {
    /// `DPn`: the fault, `None` where the drive holds none.
    pub fault: Option<drive_core::Fault>,
    /// `EPn`: the state.
    pub state: FaultState,
}
