//! The seven registers of a FAN1, and the bits of its words.
//!
//! The drive is made up, and so is its manual, "FAN1 Modbus", whose pages the rows name.

use bitflags::bitflags;
use drive_core::{Direction, registers};

registers! {
    /// Every register of the family.
    pub const ROWS;

    CONTROL: ReadWrite(0x0100, "CTL", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "p. 2");
    REFERENCE: ReadWrite(0x0101, "REF", "frequency reference", Volatile, Unit::scaled("Hz", 1), Range::Within(0, 600), Factory::Value(0), Manual, "p. 2");
    STATUS: Read(0x0102, "STA", "status word", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "p. 3");
    OUTPUT: Read(0x0103, "OUT", "output frequency", Volatile, Unit::scaled("Hz", 1), Range::Any, Factory::None, Manual, "p. 3");
    FAULT: Read(0x0104, "FLT", "code of the present fault, 0 without one", Volatile, Unit::CODE, Range::Any, Factory::None, Manual, "p. 4");
    CURRENT: Read(0x0105, "CUR", "motor current", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Manual, "p. 3");
    RAMP: ReadWrite(0x0106, "RMP", "time of both ramps, measured to 60 Hz", Eeprom, Unit::scaled("s", 1), Range::Within(10, 600), Factory::Value(30), Manual, "p. 5");
}

bitflags! {
    /// `CTL`, p. 2. A run command that stood through a fault, a hand-over or a loss of supply acts when it was 0 once.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ControlWord: u16 {
        /// Run; 0 stops along the ramp.
        const RUN = 1 << 0;
        /// Reverse; 0 is forward.
        const REVERSE = 1 << 1;
        /// Its rising edge resets a fault whose cause is gone.
        const RESET = 1 << 2;
    }
}

impl ControlWord {
    /// Run in a direction.
    #[must_use]
    pub const fn run(direction: Direction) -> Self {
        match direction {
            Direction::Forward => Self::RUN,
            Direction::Reverse => Self::RUN.union(Self::REVERSE),
        }
    }
}

bitflags! {
    /// `STA`, p. 3.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct StatusWord: u16 {
        /// The power part has its supply.
        const READY = 1 << 0;
        /// A run command is in force, whoever gives it. The output may be on without it, on its way down.
        const RUNNING = 1 << 1;
        /// The motor turns, or turned last, in reverse.
        const REVERSE = 1 << 2;
        /// It has tripped.
        const FAULT = 1 << 3;
        /// Run command and reference are those of the bus; 0: those of the panel.
        const REMOTE = 1 << 4;
    }
}
