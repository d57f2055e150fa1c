//! What stands in the way of a command, and what to do about it.

use drive_core::Refusal;

pub(crate) const OTHER_COMMAND: Refusal = Refusal::Overridden {
    by: "the panel or the terminals (run command, bit A of 002Ch)",
    remedy: "give the command back at the panel, or set n02 = 5, save it, and switch the drive off and on",
};
pub(crate) const LOCAL_REFERENCE: Refusal = Refusal::Overridden {
    by: "the panel or the terminals (reference, bit 9 of 002Ch)",
    remedy: "give the reference back at the panel, or set n02 = 5, save it, and switch the drive off and on",
};
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference than the one that was given (0023h shows it)",
    remedy: "see who else writes 0002h and which inputs choose a speed (n06 to n08), then give the setpoint again",
};
pub(crate) const OTHER_WORD: Refusal = Refusal::Overridden {
    by: "another command word in 0001h than was written",
    remedy: "see who else writes to this drive",
};
pub(crate) const OUTPUT_OFF: Refusal = Refusal::Overridden {
    by: "something that keeps the output off (bit 8 of 002Ch)",
    remedy: "see to the inputs (n06 to n08) and to the panel's STOP key",
};
