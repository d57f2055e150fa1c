//! The bits of `CMD` and `ETA` that DRIVECOM gives them, and the fault register.
//!
//! The card's manual writes 6 to `CMD` (VVDED397054 p. 21/45), which is DRIVECOM's "shutdown", and a user's report has 7
//! for stop and 15 for run, so the drive follows the chart that the Altivar 28 and 312 follow too (BBV51701 p. 10–13,
//! 19, 21). Only the chart's bits are named here; what the drive has beyond them is a setting,
//! [`Atv58Map`](crate::Atv58Map). Bits without a name are kept.

use bitflags::bitflags;

bitflags! {
    /// `CMD` (W400).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ControlWord: u16 {
        /// Switch on.
        const SWITCH_ON = 1 << 0;
        /// Enable voltage: 0 disables it.
        const ENABLE_VOLTAGE = 1 << 1;
        /// No quick stop: 0 is a quick stop.
        const NO_QUICK_STOP = 1 << 2;
        /// Enable operation.
        const ENABLE_OPERATION = 1 << 3;
        /// Fault reset, on the rising edge.
        const FAULT_RESET = 1 << 7;
    }
}

bitflags! {
    /// `ETA`. The states are in [`drive_core::drivecom::ChartState`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct StatusWord: u16 {
        /// Ready to switch on.
        const READY = 1 << 0;
        /// Switched on.
        const SWITCHED_ON = 1 << 1;
        /// Operation enabled.
        const OPERATION_ENABLED = 1 << 2;
        /// Fault.
        const FAULT = 1 << 3;
        /// Voltage disabled.
        const VOLTAGE_DISABLED = 1 << 4;
        /// No quick stop: 0 while one is active.
        const NO_QUICK_STOP = 1 << 5;
        /// Switch on disabled.
        const SWITCH_ON_DISABLED = 1 << 6;
    }
}

/// The fault register `FLT` (W483): 16 fault bits whose meanings are not public, kept as their numbers, which the manual
/// writes as `W483,2` (VVDED397054 p. 10/34).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FaultRegister(pub u16);

impl FaultRegister {
    /// The numbers of the bits that are set, the lowest first.
    pub fn bits(self) -> impl Iterator<Item = u16> {
        (0..16).filter(move |bit| self.0 >> bit & 1 == 1)
    }
}
