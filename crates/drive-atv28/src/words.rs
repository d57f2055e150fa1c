//! The bits of the control and status words. The Altivar 28's own list is not public: these are the bits of the
//! Altivar 312 twins (BBV51701, page at each word) as they act at its access level L1, "interchangeable with ATV28"
//! (p. 35). Bits without a name are kept.

use bitflags::bitflags;
use drive_core::{Control, Direction};

bitflags! {
    /// `CMD` (W400, twin W8501) and `CMDD` (W601, twin W8601), BBV51701 p. 16, 19. Bits 4 to 6, 8 to 10 and 15 are
    /// reserved and stay 0.
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
        /// Reverse.
        const REVERSE = 1 << 11;
        /// Stop, the way the drive is set to stop (`Stt` on the twin: ramp unless changed).
        const STOP = 1 << 12;
        /// Stop by DC injection.
        const DC_INJECTION = 1 << 13;
        /// Fast stop.
        const FAST_STOP = 1 << 14;
    }
}

bitflags! {
    /// `ETA` (W458, twin W3201) and `ETAD` (W602, twin W8603), BBV51701 p. 17, 21. The states are in
    /// [`drive_core::drivecom::ChartState`].
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
        /// Voltage disabled; always 0 on the twin.
        const VOLTAGE_DISABLED = 1 << 4;
        /// No quick stop: 0 while one is active.
        const NO_QUICK_STOP = 1 << 5;
        /// Switch on disabled.
        const SWITCH_ON_DISABLED = 1 << 6;
        /// Alarm.
        const ALARM = 1 << 7;
        /// Controlled by the line: 0 while local control is forced.
        const REMOTE = 1 << 9;
        /// Reference reached.
        const REFERENCE_REACHED = 1 << 10;
        /// `LFRD` below LSP or above HSP.
        const REFERENCE_EXCEEDED = 1 << 11;
        /// Stopped by the STOP key.
        const STOP_KEY = 1 << 14;
        /// Output turns in reverse.
        const REVERSE = 1 << 15;
    }
}

bitflags! {
    /// `ETI` (W459, twin W3206), BBV51701 p. 22. Bits 13 and 14 are told by [`ExtendedStatus::control`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedStatus: u16 {
        /// The EEPROM is being written: no parameter can be written now.
        const EEPROM_BUSY = 1 << 0;
        /// Parameters are checked against each other: 0 while the drive is locked for a load of parameters.
        const CONSISTENCY_CHECK = 1 << 1;
        /// A fault reset would be accepted.
        const RESET_ALLOWED = 1 << 2;
        /// Motor running.
        const MOTOR_RUNNING = 1 << 4;
        /// DC injection.
        const DC_INJECTION = 1 << 5;
        /// Transient state.
        const TRANSIENT = 1 << 6;
        /// Motor thermal alarm.
        const MOTOR_THERMAL = 1 << 7;
        /// Excessive braking alarm.
        const BRAKING = 1 << 8;
        /// Accelerating.
        const ACCELERATING = 1 << 9;
        /// Decelerating.
        const DECELERATING = 1 << 10;
        /// Current limit alarm.
        const CURRENT_LIMIT = 1 << 11;
        /// Fast stop in progress.
        const FAST_STOP = 1 << 12;
        /// Reverse requested by the reference.
        const REVERSE_REQUESTED = 1 << 15;
    }
}

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

impl StatusWord {
    /// Direction of the output.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }
}

impl ExtendedStatus {
    /// Who commands the drive, by bits 13 and 14. `Local`: the terminals or the built-in panel.
    #[must_use]
    pub const fn control(self) -> Control {
        match (self.bits() >> 13) & 0b11 {
            0b00 => Control::Local,
            0b01 => Control::Panel,
            0b10 => Control::Bus,
            _ => Control::OtherBus,
        }
    }
}
