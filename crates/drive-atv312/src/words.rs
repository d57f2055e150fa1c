//! The bits of the control and status words (BBV51701 06/2009, page at each word). Bits without a name are kept.

use bitflags::bitflags;
use drive_core::Control;

/// `CMD` (W8501) and `CMDD` (W8601); `ETI` (W3206); `ETA` (W3201) and `ETAD` (W8603).
pub use drive_drivecom::{ControlWord, ExtendedStatus, StatusWord};

bitflags! {
    /// `CMI` (W8504), p. 20. Bits 2, 5 to 8 and 10 to 12 are reserved.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedControl: u16 {
        /// Recall the factory settings; clears itself, only with the motor stopped.
        const FACTORY_SETTINGS = 1 << 0;
        /// Save the parameters to EEPROM; clears itself.
        const SAVE = 1 << 1;
        /// External fault: trips as `EPL` says.
        const EXTERNAL_FAULT = 1 << 3;
        /// Second ramps.
        const RAMP_SWITCH = 1 << 4;
        /// High resolution: references, output speed and output frequency count 32767 for 600 Hz.
        const HIGH_RESOLUTION = 1 << 9;
        /// Lock the drive on standstill.
        const LOCK = 1 << 13;
        /// No Modbus communication monitoring (NTO).
        const NO_TIMEOUT = 1 << 14;
        /// No parameter consistency check, and the drive locked on standstill.
        const NO_CONSISTENCY_CHECK = 1 << 15;
    }
}

bitflags! {
    /// `LRS1` (W3250), p. 22. Bits 0, 3, 10, 11, 13 and 15 are reserved.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedStatus1: u16 {
        /// Fault.
        const FAULT = 1 << 1;
        /// Motor running.
        const MOTOR_RUNNING = 1 << 2;
        /// Frequency threshold `Ftd` reached.
        const FREQUENCY_THRESHOLD = 1 << 4;
        /// High speed `HSP` reached.
        const HIGH_SPEED = 1 << 5;
        /// Current threshold `Ctd` reached.
        const CURRENT_THRESHOLD = 1 << 6;
        /// Reference reached.
        const REFERENCE_REACHED = 1 << 7;
        /// Motor thermal overload alarm.
        const MOTOR_THERMAL_ALARM = 1 << 8;
        /// Brake released.
        const BRAKE_RELEASED = 1 << 9;
        /// 4-20 mA lost.
        const SIGNAL_LOST = 1 << 12;
        /// Drive thermal overload alarm.
        const DRIVE_THERMAL_ALARM = 1 << 14;
    }
}

bitflags! {
    /// `LRS3` (W3252), p. 23. Bits 4 to 10 and 13 to 15 are reserved.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedStatus3: u16 {
        /// The reference is given by `Fr2`; 0: by `Fr1`.
        const REFERENCE_2 = 1 << 0;
        /// The command is given by `Fr2` or `Cd2`; 0: by `Fr1` or `Cd1`.
        const COMMAND_2 = 1 << 1;
        /// The ramps are `AC2`, `dE2`; 0: `ACC`, `dEC`.
        const RAMPS_2 = 1 << 2;
        /// The current limit is `CL2`; 0: `CLI`.
        const CURRENT_LIMIT_2 = 1 << 3;
        /// Motor 1 is used.
        const MOTOR_1 = 1 << 11;
        /// Motor 2 is used.
        const MOTOR_2 = 1 << 12;
    }
}

bitflags! {
    /// `IOLR` (W5240), p. 20 and 23. Bits 6, 11 to 13 and 15 are reserved; only the outputs can be written, and only
    /// those that no function is assigned to.
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
        /// Keypad present.
        const KEYPAD = 1 << 7;
        /// Relay R1.
        const R1 = 1 << 8;
        /// Relay R2.
        const R2 = 1 << 9;
        /// Logic output LO.
        const LO = 1 << 10;
        /// AOC/AOV is an analog output; 0: a logic one.
        const ANALOG_OUTPUT = 1 << 14;
    }
}

bitflags! {
    /// `EP1` to `EP4` (W7211–W7214), the status at a past fault, p. 25. Bits 3, 8 and 12 are reserved; bits 13 and 14
    /// are the control source as in [`ExtendedStatus`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct FaultState: u16 {
        /// Drive ready (ETA bit 1).
        const READY = 1 << 0;
        /// No emergency stop (ETA bit 5).
        const NO_EMERGENCY_STOP = 1 << 1;
        /// Switch on disabled (ETA bit 6).
        const SWITCH_ON_DISABLED = 1 << 2;
        /// The output turned in reverse (ETA bit 15).
        const REVERSE = 1 << 4;
        /// Motor running (ETI bit 4).
        const MOTOR_RUNNING = 1 << 5;
        /// DC injection (ETI bit 5).
        const DC_INJECTION = 1 << 6;
        /// Motor thermal overload alarm (ETI bit 7).
        const MOTOR_THERMAL_ALARM = 1 << 7;
        /// Accelerating (ETI bit 9).
        const ACCELERATING = 1 << 9;
        /// Decelerating (ETI bit 10).
        const DECELERATING = 1 << 10;
        /// Current limit alarm (ETI bit 11).
        const CURRENT_LIMIT = 1 << 11;
        /// Low bit of the control source (ETI bit 13).
        const SOURCE_LOW = 1 << 13;
        /// High bit of the control source (ETI bit 14).
        const SOURCE_HIGH = 1 << 14;
        /// Reverse requested by the reference (ETI bit 15).
        const REVERSE_REQUESTED = 1 << 15;
    }
}

impl FaultState {
    /// Who commanded at the time.
    #[must_use]
    pub const fn control(self) -> Control {
        ExtendedStatus::from_bits_retain(self.bits()).control()
    }
}

/// The function access level, `LAC` (W3006), p. 35.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AccessLevel {
    /// Standard functions.
    L1,
    /// Advanced functions.
    L2,
    /// Advanced functions and mixed control modes: the channels are chosen by parameters, and the bits 11 to 15 of the
    /// control word can be assigned.
    L3,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl From<u16> for AccessLevel {
    fn from(word: u16) -> Self {
        match word {
            0 => Self::L1,
            1 => Self::L2,
            2 => Self::L3,
            _ => Self::Unknown(word),
        }
    }
}

/// The normal stop mode, `Stt` (W11201), p. 40: what bit 12 of the control word does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StopType {
    /// Stop on ramp.
    Ramp,
    /// Fast stop.
    Fast,
    /// Freewheel stop.
    Freewheel,
    /// DC injection stop.
    DcInjection,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl From<u16> for StopType {
    fn from(word: u16) -> Self {
        match word {
            0 => Self::Ramp,
            1 => Self::Fast,
            2 => Self::Freewheel,
            3 => Self::DcInjection,
            _ => Self::Unknown(word),
        }
    }
}
