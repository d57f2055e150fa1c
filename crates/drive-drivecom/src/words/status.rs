//! The status word and the extended status word, bit by bit.

use bitflags::bitflags;
use drive_core::{Control, Direction};

bitflags! {
    /// `ETA` and `ETAD`, p. 13, 17 and 21. The states are in [`ChartState`](crate::ChartState). Bits 8, 12 and 13 are reserved, bit 4 is
    /// always 0.
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
        /// Voltage disabled; always 0.
        const VOLTAGE_DISABLED = 1 << 4;
        /// No quick stop: 0 while one is active.
        const NO_QUICK_STOP = 1 << 5;
        /// Switch on disabled.
        const SWITCH_ON_DISABLED = 1 << 6;
        /// Alarm.
        const ALARM = 1 << 7;
        /// No forced local mode: 0 while it is in progress.
        const NOT_FORCED_LOCAL = 1 << 9;
        /// Reference reached.
        const REFERENCE_REACHED = 1 << 10;
        /// `LFRD` below `LSP` or above `HSP`.
        const REFERENCE_EXCEEDED = 1 << 11;
        /// Stopped by the STOP key.
        const STOP_KEY = 1 << 14;
        /// The output turns in reverse.
        const REVERSE = 1 << 15;
    }
}

impl StatusWord {
    /// Direction of the output.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }
}

bitflags! {
    /// `ETI`, p. 22. Bit 3 is reserved; bits 13 and 14 are told by [`ExtendedStatus::control`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedStatus: u16 {
        /// The EEPROM is being written: no parameter can be written now.
        const EEPROM_BUSY = 1 << 0;
        /// Parameters are checked for consistency; 0: no check, and the drive locked on standstill.
        const CONSISTENCY_CHECK = 1 << 1;
        /// A fault reset is authorised.
        const RESET_AUTHORISED = 1 << 2;
        /// Motor running.
        const MOTOR_RUNNING = 1 << 4;
        /// DC injection.
        const DC_INJECTION = 1 << 5;
        /// Transient state.
        const TRANSIENT = 1 << 6;
        /// Motor thermal overload alarm.
        const MOTOR_THERMAL_ALARM = 1 << 7;
        /// Alarm: excessive braking.
        const BRAKING_ALARM = 1 << 8;
        /// Accelerating.
        const ACCELERATING = 1 << 9;
        /// Decelerating.
        const DECELERATING = 1 << 10;
        /// Current limit alarm.
        const CURRENT_LIMIT = 1 << 11;
        /// Fast stop in progress.
        const FAST_STOP = 1 << 12;
        /// Low bit of the control source.
        const SOURCE_LOW = 1 << 13;
        /// High bit of the control source.
        const SOURCE_HIGH = 1 << 14;
        /// Reverse requested by the reference.
        const REVERSE_REQUESTED = 1 << 15;
    }
}

impl ExtendedStatus {
    /// Who commands, by bits 14 and 13. Terminals and the built-in keypad have one pattern.
    #[must_use]
    pub const fn control(self) -> Control {
        match (self.contains(Self::SOURCE_HIGH), self.contains(Self::SOURCE_LOW)) {
            (false, false) => Control::Local,
            (false, true) => Control::Panel,
            (true, false) => Control::Bus,
            (true, true) => Control::OtherBus,
        }
    }
}
