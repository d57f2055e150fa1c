//! What stands in the way of a command, and what to do about it.

use drive_core::Refusal;

pub(crate) const ST_OFF: Refusal = Refusal::Overridden {
    by: "a freewheel stop that the bus has not ordered (ST = OFF, FD01 bit 11)",
    remedy: "see to the input or the setting that holds it",
};
pub(crate) const OTHER_WORD: Refusal = Refusal::Overridden {
    by: "another command word in FA00 than was written",
    remedy: "see who else writes to this drive",
};
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference than the one that was given (FE02 shows it)",
    remedy: "give the setpoint again, and see to the drive's lower limit",
};
