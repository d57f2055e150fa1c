//! The faults of 0021h and the alarms of the other words (manual §5.2).

use drive_core::{Fault, FaultEntry};

use crate::{
    registers::{LINK, LINK_ERROR, SIGNALS, STATE},
    words::{DriveState, Errors, LinkError, LinkState, Signals},
};

/// The faults, by the number of their bit in 0021h. Several can be present at once. Bits 4, 5, 6, 11 and 15 are blank
/// in the manual.
pub const FAULTS: &[FaultEntry] = &[
    FaultEntry::new(
        0x0,
        "OC",
        "overcurrent",
        "look for a short circuit or an earth fault at the output and a blocked motor; lengthen the acceleration time n20",
    ),
    FaultEntry::new(
        0x1,
        "OV",
        "overvoltage",
        "lengthen the deceleration time; check the supply voltage and what the load gives back",
    ),
    FaultEntry::new(
        0x2,
        "OL2",
        "overload of the drive",
        "lower the load; check the V/f curve and the size of the drive",
    ),
    FaultEntry::new(
        0x3,
        "OH",
        "overheating of the drive",
        "check ventilation, dust and the temperature around the drive; let it cool",
    ),
    FaultEntry::new(
        0x7,
        "EFx",
        "external fault",
        "find what has ordered it: the input set to external fault, or the broadcast EF0",
    ),
    FaultEntry::new(
        0x8,
        "CPFxx",
        "fault of the control board",
        "switch the drive off and on; replace it if the fault comes back",
    ),
    FaultEntry::new(
        0x9,
        "OL1",
        "overload of the motor",
        "lower the load and let the motor cool; check the current in n31",
    ),
    FaultEntry::new(
        0xA,
        "OL3",
        "overtorque",
        "look for a jam in the machine; check the level of the overtorque detection",
    ),
    FaultEntry::new(0xC, "UV1", "loss of the mains", "check supply, fuses and terminals"),
    FaultEntry::new(
        0xD,
        "UV2",
        "fault of the control supply",
        "switch the drive off and on; replace it if the fault comes back",
    ),
    FaultEntry::new(
        0xE,
        "BUS",
        "transmission error",
        "check line and master: with n40 = 0 a message must come every 2 s; 003Dh says what was wrong",
    ),
];

/// The alarms, which do not trip. The code is the register's address and the number of the bit: 03D6h is bit 6 of
/// 003Dh. The manual gives no mnemonics for them.
pub const WARNINGS: &[FaultEntry] = &[
    FaultEntry::new(
        code(SIGNALS.address(), Signals::DATA_ERROR.bits()),
        "0020h.4",
        "error in the setting of data",
        "compare the parameters with the messages OP1 to OP6 of the keypad",
    ),
    FaultEntry::new(
        code(LINK.address(), LinkState::LIMIT_EXCEEDED.bits()),
        "0022h.3",
        "a written value exceeds its limits",
        "write a value within the limits",
    ),
    FaultEntry::new(
        code(LINK.address(), LinkState::VERIFY_ERROR.bits()),
        "0022h.4",
        "a written value fails its verification",
        "read the parameters back and compare them",
    ),
    FaultEntry::new(
        code(STATE.address(), DriveState::UNDERVOLTAGE.bits()),
        "002Ch.7",
        "undervoltage",
        "check supply, fuses and terminals",
    ),
    FaultEntry::new(
        code(STATE.address(), DriveState::OVERTORQUE.bits()),
        "002Ch.B",
        "overtorque",
        "look for a jam in the machine",
    ),
    FaultEntry::new(
        code(STATE.address(), DriveState::REFERENCE_ERROR.bits()),
        "002Ch.C",
        "error of the frequency reference",
        "check the source of the reference, n02",
    ),
    FaultEntry::new(
        code(STATE.address(), DriveState::LINK_FAULT.bits()),
        "002Ch.F",
        "communication fault",
        "the bits of 003Dh say what was wrong with the received frames",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::CRC.bits()),
        "003Dh.0",
        "CRC error in a received frame",
        "check cable, shield, terminators and a second master",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::LENGTH.bits()),
        "003Dh.1",
        "wrong length of a received frame",
        "check the master: at most 8 registers a frame",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::PARITY.bits()),
        "003Dh.3",
        "parity error in a received character",
        "compare n64 with the parity of the line",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::OVERRUN.bits()),
        "003Dh.4",
        "overrun by received characters",
        "leave more silence between frames",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::FRAMING.bits()),
        "003Dh.5",
        "framing error in a received character",
        "compare n63 with the speed of the line",
    ),
    FaultEntry::new(
        code(LINK_ERROR.address(), LinkError::TIME_OVER.bits()),
        "003Dh.6",
        "time-over: no message for 2 s",
        "poll the drive more often, or see what has silenced the master",
    ),
];

/// The code of an alarm: address and number of the bit.
const fn code(address: u16, bit: u16) -> u16 {
    address << 4 | bit.trailing_zeros() as u16
}

/// The faults of a word 0021h, bit by bit; blank bits keep their number.
pub(crate) fn present(errors: Errors) -> Vec<Fault> {
    (0..16).filter(|bit| errors.bits() >> bit & 1 == 1).map(|bit| Fault::lookup(FAULTS, bit)).collect()
}

/// The alarms of these words.
pub(crate) fn warnings(words: &[(u16, u16)]) -> Vec<Fault> {
    let is_set = |entry: &FaultEntry| {
        let (address, bit) = (entry.code >> 4, entry.code & 0xF);
        words.iter().any(|&(at, word)| at == address && word >> bit & 1 == 1)
    };
    let entries = WARNINGS.iter().filter(|entry| is_set(entry));
    entries.map(|entry| Fault { code: entry.code, entry: Some(entry) }).collect()
}
