//! What decides a reference beside the words of the bus.

use drive_core::Refusal;

/// What decides the reference where the drive follows another one than the bus and does not tell which.
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference (FrH is not the reference of the bus)",
    remedy: "see which inputs and channels are in use (Fr1, Fr2, rFC, SA2, SA3, PS2 to PS16, JOG, PIF)",
};

/// What decides where the drive says that the reference lies beyond its limits (ETA bit 11, BBV51701 p. 21).
pub(crate) const BEYOND_LIMIT: Refusal = Refusal::Overridden {
    by: "a limit of the drive (ETA bit 11: LFRD is below LSP or above HSP)",
    remedy: "see LSP and HSP at the drive, then give a setpoint between them",
};

/// An analog input below this does not change a reference by a count: 20 mV of 10 V, and 20 µA of 20 mA.
pub(crate) const SILENT: u16 = 20;
/// `SA2`, `SA3`: AI1 to AI3.
pub(crate) const ANALOG_INPUTS: core::ops::RangeInclusive<u16> = 1..=3;

/// What decides a reference beside the settings.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Facts {
    /// The logic inputs.
    pub(crate) inputs: Option<u16>,
    /// Whether the second reference is selected.
    pub(crate) second: Option<bool>,
    /// Whether the 4-20 mA are lost.
    pub(crate) lost: Option<bool>,
    /// The analog inputs.
    pub(crate) analog: Option<[u16; 3]>,
}
