//! The faults and alarms of the Altivar 21 (Altivar 21 Modbus §8.7, p. 36, 37), with what to do first.

use drive_core::{Fault, FaultEntry};

use crate::words::{Alarms, MaintenanceAlarms};

const CPU: &str = "switch the supply off and on; if it comes back, the drive needs service";

/// FC90, and FE10 to FE13. Code 0, NErr, is no fault and has no entry.
pub const FAULTS: &[FaultEntry] = &[
    FaultEntry::new(1, "OC1", "overcurrent during acceleration", "lengthen ACC, check motor and load"),
    FaultEntry::new(2, "OC2", "overcurrent during deceleration", "lengthen DEC"),
    FaultEntry::new(
        3,
        "OC3",
        "overcurrent at constant speed",
        "look for sudden changes of load, check the machine",
    ),
    FaultEntry::new(
        4,
        "OCL",
        "overcurrent of the load at start",
        "check the insulation of motor and cable, and their connections",
    ),
    FaultEntry::new(
        5,
        "OCA",
        "short circuit in an arm of the output stage",
        "disconnect the motor and try again; if it stays, the drive needs service",
    ),
    FaultEntry::new(8, "EPHI", "input phase missing", "check the supply, its fuses and its terminals"),
    FaultEntry::new(9, "EPHO", "output phase missing", "check the motor cable and its terminals"),
    FaultEntry::new(
        10,
        "OP1",
        "overvoltage during acceleration",
        "check the supply voltage; was the motor still turning at start?",
    ),
    FaultEntry::new(
        11,
        "OP2",
        "overvoltage during deceleration",
        "lengthen DEC, or fit a braking resistor where possible",
    ),
    FaultEntry::new(12, "OP3", "overvoltage at constant speed", "check whether the load drives the motor"),
    FaultEntry::new(
        13,
        "OL1",
        "overload of the drive",
        "reduce the load, lengthen ACC, check the drive's size",
    ),
    FaultEntry::new(
        14,
        "OL2",
        "overload of the motor",
        "reduce the load, check the motor protection against the motor's plate",
    ),
    FaultEntry::new(
        16,
        "OH",
        "overheat",
        "check fan, air flow and ambient temperature; let it cool before the reset",
    ),
    FaultEntry::new(17, "E", "emergency stop", "find who stopped it, make sure that it is safe, then reset"),
    FaultEntry::new(
        18,
        "EEP1",
        "EEPROM fault 1, write error",
        "switch the supply off and on, check what was last written",
    ),
    FaultEntry::new(
        19,
        "EEP2",
        "EEPROM fault 2, read error",
        "switch the supply off and on; if it comes back, the drive needs service",
    ),
    FaultEntry::new(20, "EEP3", "EEPROM fault 3, internal", CPU),
    FaultEntry::new(21, "Err2", "RAM fault", CPU),
    FaultEntry::new(22, "Err3", "ROM fault", CPU),
    FaultEntry::new(23, "Err4", "CPU fault", CPU),
    FaultEntry::new(
        24,
        "Err5",
        "communication error: no Modbus request within F803",
        "check the line and the master, and whether F803 fits the poll period",
    ),
    FaultEntry::new(26, "Err7", "fault of the current detector", CPU),
    FaultEntry::new(27, "Err8", "wrong type of option board", "check the option board and its seat"),
    FaultEntry::new(
        29,
        "UC",
        "undercurrent",
        "check the coupling to the load, and the setting of the undercurrent detection",
    ),
    FaultEntry::new(
        30,
        "UP1",
        "undervoltage of the main circuit",
        "check the supply voltage and what else loads it",
    ),
    FaultEntry::new(32, "Ot", "overtorque", "look for a jam, check the setting of the overtorque detection"),
    FaultEntry::new(
        34,
        "EF2",
        "ground fault, found by hardware",
        "check the insulation of motor and cable to ground",
    ),
    FaultEntry::new(
        37,
        "OC1P",
        "overcurrent in the product during acceleration",
        "lengthen ACC, check motor and cable for a short circuit",
    ),
    FaultEntry::new(
        38,
        "OC2P",
        "overcurrent in the product during deceleration",
        "lengthen DEC, check motor and cable for a short circuit",
    ),
    FaultEntry::new(
        39,
        "OC3P",
        "overcurrent in the product in operation",
        "look for sudden changes of load, check motor and cable for a short circuit",
    ),
    FaultEntry::new(41, "EtYP", "drive type error", "the drive does not know its own type: it needs service"),
    FaultEntry::new(
        46,
        "OH2",
        "external thermal input",
        "check the external thermal sensor and what it guards",
    ),
    FaultEntry::new(47, "SOUt", "cable of VIA broken", "check the cable and the signal at VIA"),
    FaultEntry::new(50, "E-18", "fault of the analog signal cable", "check the cables of the analog inputs"),
    FaultEntry::new(51, "E-19", "CPU fault", CPU),
    FaultEntry::new(
        52,
        "E-20",
        "torque boost too high",
        "lower the torque boost, check the motor's settings",
    ),
    FaultEntry::new(53, "E-21", "CPU fault", CPU),
    FaultEntry::new(
        84,
        "Etn1",
        "auto-tuning error",
        "check the motor's settings and its connection, tune again with the motor at rest",
    ),
];

/// What is added to the number of a bit of FE79.
const MAINTENANCE: u16 = 16;

/// FC91 and FE79 as a list (§8.7 p. 36): the code of an alarm is the number of its bit, from FE79 with 16 more, its mnemonic what the
/// keypad blinks, or the bit of FE79.
pub const ALARMS: &[FaultEntry] = &[
    FaultEntry::new(0, "C", "overcurrent alarm", "lengthen the ramp or reduce the load"),
    FaultEntry::new(1, "L", "overload of the drive", "reduce the load"),
    FaultEntry::new(2, "L", "overload of the motor", "reduce the load"),
    FaultEntry::new(3, "H", "overheat alarm", "check fan, air flow and ambient temperature"),
    FaultEntry::new(4, "P", "overvoltage alarm", "lengthen DEC, check the supply"),
    FaultEntry::new(5, "-", "undervoltage of the main circuit", "check the supply"),
    FaultEntry::new(7, "-", "undercurrent", "check the coupling to the load"),
    FaultEntry::new(8, "-", "overtorque", "look for a jam"),
    FaultEntry::new(
        10,
        "-",
        "cumulative hours of operation reached",
        "plan the maintenance; FE79 says of what",
    ),
    FaultEntry::new(
        13,
        "MOFF",
        "undervoltage of the main circuit, as the relay MS shows it",
        "check the supply",
    ),
    FaultEntry::new(14, "-", "forced deceleration and stop at power loss", "check the supply"),
    FaultEntry::new(
        15,
        "-",
        "automatic stop after falling to the lower limit again and again",
        "check reference and lower limit",
    ),
    FaultEntry::new(16, "FE79.0", "the life of the fan is over", "replace the fan"),
    FaultEntry::new(17, "FE79.1", "the life of the circuit board is over", "have the board replaced"),
    FaultEntry::new(18, "FE79.2", "the life of the main capacitors is over", "have the capacitors replaced"),
    FaultEntry::new(19, "FE79.3", "the alarm that the user has set up", "see what it was set up for"),
];

/// The alarms of a word FC91 and those of FE79, also the bits that the manual calls reserved.
#[must_use]
pub(crate) fn alarms(word: Alarms, maintenance: MaintenanceAlarms) -> Vec<Fault> {
    let set = |word: u16| (0..16).filter(move |bit| word & (1 << bit) != 0);
    set(word.bits())
        .chain(set(maintenance.bits()).map(|bit| MAINTENANCE + bit))
        .map(|code| Fault::lookup(ALARMS, code))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_bit_without_a_meaning_keeps_its_number() {
        let found = alarms(Alarms::from_bits_retain(0b0000_0000_0100_0001), MaintenanceAlarms::empty());
        assert_eq!(found.iter().map(|alarm| alarm.code).collect::<Vec<_>>(), [0, 6]);
        assert!(found[0].entry.is_some() && found[1].entry.is_none());
    }
}
