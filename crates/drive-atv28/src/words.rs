//! The bits of the control and status words. The Altivar 28's own list is not public: these are the bits of the
//! Altivar 312 twins (BBV51701, page at each word) as they act at its access level L1, "interchangeable with ATV28"
//! (p. 35). Bits without a name are kept.

use bitflags::bitflags;

/// `CMD` (W400, twin W8501) and `CMDD` (W601, twin W8601); `ETI` (W459, twin W3206); `ETA` (W458, twin W3201) and `ETAD`
/// (W602, twin W8603).
pub use drive_drivecom::{ControlWord, ExtendedStatus, StatusWord};

bitflags! {
    /// `IOLR` (W478, twin W5240), BBV51701 p. 23.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct LogicIo: u16 {
        /// Logic input LI1.
        const LI1 = 1 << 0;
        /// Logic input LI2.
        const LI2 = 1 << 1;
        /// Logic input LI3.
        const LI3 = 1 << 2;
        /// Logic input LI4.
        const LI4 = 1 << 3;
        /// Logic input LI5.
        const LI5 = 1 << 4;
        /// Logic input LI6.
        const LI6 = 1 << 5;
        /// Relay R1, written only if it is not assigned.
        const R1 = 1 << 8;
        /// Relay R2, written only if it is not assigned.
        const R2 = 1 << 9;
        /// Logic output LO, written only if it is not assigned.
        const LO = 1 << 10;
    }
}

impl LogicIo {
    /// The bits of the inputs.
    pub const INPUTS: Self = Self::from_bits_retain(0x003F);
    /// The bits of the outputs.
    pub const OUTPUTS: Self = Self::R1.union(Self::R2).union(Self::LO);
}
