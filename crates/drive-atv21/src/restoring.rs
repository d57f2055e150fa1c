//! What a backup keeps of an Altivar 21 and in which order a restore writes it (Altivar 21 Modbus). Each of these writes goes
//! to EEPROM (§8.1).

use drive_core::registers::{Restoring, Step};

use crate::registers::address::*;

const COMMAND: &str =
    "who commands goes last: an input acts by its function as soon as CMOD gives it the command (§6.2)";

/// See [`Restoring`].
pub(crate) const RESTORING: Restoring = Restoring {
    first: &[
        Step { registers: &[AUTOMATIC_RAMP], why: "it sets ACC and DEC by itself (§8.1)" },
        Step { registers: &[VIA_IS_LOGIC], why: "F118 is in force only with it (§8.8)" },
        Step { registers: &[TIME_OUT_REACTION], why: "F803 acts at once, and by this (§6.4)" },
    ],
    last: &[
        Step { registers: &[SECOND_REFERENCE], why: COMMAND },
        Step { registers: &[REFERENCE_MODE], why: COMMAND },
        Step { registers: &[COMMAND_MODE], why: COMMAND },
    ],
    // §6.1.
    communication: &[PROTOCOL_SELECTION, BAUD_RATE, PARITY, ADDRESS],
    // §8.9, and LinuxCNC vfs11_vfd.
    ratings: &[MODEL_CODE, RATED_CURRENT, RATED_VOLTAGE],
    unkept: &[],
    by_hand: &[],
    acts_later: &[
        (
            &[PROTOCOL_SELECTION, BAUD_RATE, PARITY],
            "it acts after a reset or the next power-up (§6, §6.1 p. 11)",
        ),
        (
            &[WRITE_SLOT_1, WRITE_SLOT_2, READ_SLOT_1, READ_SLOT_2, READ_SLOT_3, READ_SLOT_4, READ_SLOT_5],
            "it acts after a reset or the next power-up (§6.3 p. 18)",
        ),
    ],
    left: &[],
    relations: &[],
    limits: &[],
    control: &[SECOND_REFERENCE, REFERENCE_MODE, COMMAND_MODE],
};
