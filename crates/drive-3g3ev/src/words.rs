//! The bits of the command and monitor words (manual §5.1, §5.2). Bits without a name are kept.

use bitflags::bitflags;
use drive_core::Direction;

bitflags! {
    /// 0001h to one slave, §5.1.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct Command: u16 {
        /// Run; 0 stops.
        const RUN = 1 << 0;
        /// Reverse; 0 is forward.
        const REVERSE = 1 << 1;
        /// The function that n06 selects.
        const INPUT_1 = 1 << 4;
        /// The function that n07 selects.
        const INPUT_2 = 1 << 5;
        /// The function that n08 selects.
        const INPUT_3 = 1 << 6;
    }
}

impl Command {
    /// The inputs, which order no motion by themselves; what they do is set by n06 to n08.
    pub const INPUTS: Self = Self::INPUT_1.union(Self::INPUT_2).union(Self::INPUT_3);

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
    /// 0001h to all slaves at once, §5.1: bits 4 and 5 mean something else than to one slave.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct BroadcastCommand: u16 {
        /// Run; 0 stops.
        const RUN = 1 << 0;
        /// Reverse; 0 is forward.
        const REVERSE = 1 << 1;
        /// External fault EF0: every drive trips.
        const EXTERNAL_FAULT = 1 << 4;
        /// Fault reset.
        const FAULT_RESET = 1 << 5;
    }
}

bitflags! {
    /// 0009h, §5.1.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct Outputs: u16 {
        /// Output 1, when n09 is 15.
        const OUTPUT_1 = 1 << 0;
        /// Output 2, when n10 is 15.
        const OUTPUT_2 = 1 << 1;
    }
}

bitflags! {
    /// 0020h, §5.2.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct Signals: u16 {
        /// Run; 0 is stop.
        const RUN = 1 << 0;
        /// Reverse; 0 is forward.
        const REVERSE = 1 << 1;
        /// Drive ready.
        const READY = 1 << 2;
        /// Fault.
        const FAULT = 1 << 3;
        /// Error in the setting of data (printed as their "selection").
        const DATA_ERROR = 1 << 4;
        /// Multi-function output 1 is on.
        const OUTPUT_1 = 1 << 5;
        /// Multi-function output 2 is on.
        const OUTPUT_2 = 1 << 6;
    }
}

bitflags! {
    /// 0021h, §5.2. Their texts are in [`FAULTS`](crate::FAULTS).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct Errors: u16 {
        /// Overcurrent.
        const OC = 1 << 0x0;
        /// Overvoltage.
        const OV = 1 << 0x1;
        /// Overload of the drive.
        const OL2 = 1 << 0x2;
        /// Overheating of the drive.
        const OH = 1 << 0x3;
        /// External fault.
        const EF = 1 << 0x7;
        /// Fault of the control board.
        const CPF = 1 << 0x8;
        /// Overload of the motor.
        const OL1 = 1 << 0x9;
        /// Overtorque.
        const OL3 = 1 << 0xA;
        /// Loss of the mains.
        const UV1 = 1 << 0xC;
        /// Fault of the control supply.
        const UV2 = 1 << 0xD;
        /// Transmission error.
        const BUS = 1 << 0xE;
    }
}

bitflags! {
    /// 0022h, §5.2.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct LinkState: u16 {
        /// Data are being written.
        const WRITING = 1 << 0;
        /// A limit was exceeded.
        const LIMIT_EXCEEDED = 1 << 3;
        /// Verification error (printed as "correspondence").
        const VERIFY_ERROR = 1 << 4;
    }
}

bitflags! {
    /// 002Ch, §5.2.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct DriveState: u16 {
        /// Run; 0 is stop.
        const RUN = 1 << 0x0;
        /// Zero speed.
        const ZERO_SPEED = 1 << 0x1;
        /// The output frequency is the reference.
        const AT_REFERENCE = 1 << 0x2;
        /// Frequency OK.
        const FREQUENCY_OK = 1 << 0x3;
        /// Frequency detection 1: the output frequency is n53 or below.
        const BELOW_N53 = 1 << 0x4;
        /// Frequency detection 2: the output frequency is n53 or above.
        const ABOVE_N53 = 1 << 0x5;
        /// Drive ready.
        const READY = 1 << 0x6;
        /// Undervoltage is detected.
        const UNDERVOLTAGE = 1 << 0x7;
        /// The output is off.
        const OUTPUT_OFF = 1 << 0x8;
        /// The reference comes from the terminals or the panel; 0: from the bus.
        const LOCAL_REFERENCE = 1 << 0x9;
        /// The run command comes from the terminals or the panel; 0: from the bus.
        const LOCAL_RUN = 1 << 0xA;
        /// Overtorque, detected or tripped (OL3).
        const OVERTORQUE = 1 << 0xB;
        /// Error of the frequency reference.
        const REFERENCE_ERROR = 1 << 0xC;
        /// Major fault, communication faults included.
        const MAJOR_FAULT = 1 << 0xE;
        /// Communication fault.
        const LINK_FAULT = 1 << 0xF;
    }
}

bitflags! {
    /// 003Dh, §5.2.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct LinkError: u16 {
        /// CRC-16.
        const CRC = 1 << 0;
        /// Length of the data.
        const LENGTH = 1 << 1;
        /// Parity.
        const PARITY = 1 << 3;
        /// Overrun.
        const OVERRUN = 1 << 4;
        /// Framing.
        const FRAMING = 1 << 5;
        /// Time-over: no message for 2 s, where n40 detects it.
        const TIME_OVER = 1 << 6;
    }
}
