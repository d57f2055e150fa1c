//! The control word: what it commands, and whose run command it is.

use bitflags::bitflags;
use drive_core::{Direction, Intent, Lease, RunWord, StopMode};

use crate::chart::ENABLE_OPERATION;

bitflags! {
    /// `CMD` and `CMDD`, p. 16 and 19. Bits 4 to 6 and 8 to 10 are reserved and stay 0. Bits 11 to 14 have these meanings
    /// at the access levels L1 and L2; at L3 bits 11 and 12 have them in the factory setting, and each of 11 to 15 has
    /// the function that was assigned to it.
    ///
    /// ```
    /// use drive_core::Direction;
    /// use drive_drivecom::ControlWord;
    ///
    /// assert!(ControlWord::run(Direction::Forward).is_run());
    /// assert_eq!(ControlWord::run(Direction::Reverse).direction(), Direction::Reverse);
    /// assert!(!ControlWord::from_bits_retain(0x0006).is_run(), "shutdown");
    /// ```
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
        /// Stop as `Stt` says: along the ramp unless changed.
        const STOP = 1 << 12;
        /// Stop by DC injection.
        const DC_INJECTION = 1 << 13;
        /// Fast stop.
        const FAST_STOP = 1 << 14;
    }
}

impl ControlWord {
    /// Enable operation, in a direction: 000Fh and 080Fh.
    #[must_use]
    pub const fn run(direction: Direction) -> Self {
        let enabled = Self::from_bits_retain(ENABLE_OPERATION);
        match direction {
            Direction::Forward => enabled,
            Direction::Reverse => enabled.union(Self::REVERSE),
        }
    }

    /// The stops that keep operation enabled: 100Fh, 400Fh, 200Fh. `None`: freewheel is no such stop.
    #[must_use]
    pub const fn enabled_stop(mode: StopMode) -> Option<Self> {
        let enabled = Self::from_bits_retain(ENABLE_OPERATION);
        match mode {
            StopMode::Ramp => Some(enabled.union(Self::STOP)),
            StopMode::Fast => Some(enabled.union(Self::FAST_STOP)),
            StopMode::DcInjection => Some(enabled.union(Self::DC_INJECTION)),
            StopMode::Freewheel => None,
        }
    }

    /// Whether it holds a run command: operation enabled and no stop.
    #[must_use]
    pub const fn is_run(self) -> bool {
        self.contains(Self::run(Direction::Forward)) && !self.is_stop()
    }

    /// What it asks, by the table of commands on p. 12 and the bits on p. 16 and 19. `None` for a run command with bits
    /// that are reserved, or that act as they were assigned.
    #[must_use]
    pub fn intent(self) -> Option<Intent> {
        const RUN: ControlWord = ControlWord::run(Direction::Reverse);
        let enabled = self.contains(Self::run(Direction::Forward));
        Some(if self.contains(Self::FAULT_RESET) {
            return (!enabled).then_some(Intent::ResetFaults(StopMode::Freewheel));
        } else if !self.contains(Self::ENABLE_VOLTAGE) {
            Intent::Stop(StopMode::Freewheel)
        } else if !self.contains(Self::NO_QUICK_STOP) {
            Intent::QuickStop
        } else if !self.contains(Self::SWITCH_ON) {
            Intent::Prepare(StopMode::Freewheel)
        } else if !enabled {
            Intent::Prepare(StopMode::Ramp)
        } else if self.contains(Self::DC_INJECTION) {
            Intent::Stop(StopMode::DcInjection)
        } else if self.contains(Self::FAST_STOP) {
            Intent::Stop(StopMode::Fast)
        } else if self.contains(Self::STOP) {
            Intent::Stop(StopMode::Ramp)
        } else if RUN.contains(self) {
            let reverse = self.contains(Self::REVERSE);
            Intent::Start(if reverse { Direction::Reverse } else { Direction::Forward })
        } else {
            return None;
        })
    }

    /// Which way it turns the motor, at a reference without a sign.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }

    /// Whether, held by the drive, it is the run command of this lease.
    #[must_use]
    pub fn stands_for(self, lease: Lease) -> RunWord {
        match self.is_run() {
            true if self.direction() == lease.direction => RunWord::Stands,
            true => RunWord::Another,
            false => RunWord::Gone,
        }
    }

    /// Whether it holds one of the stops that keep operation enabled.
    #[must_use]
    pub const fn is_stop(self) -> bool {
        self.intersects(Self::STOP.union(Self::DC_INJECTION).union(Self::FAST_STOP))
    }
}
