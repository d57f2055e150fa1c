//! The parameters of a DRIVECOM drive, as its family's registers give them.

use std::time::Duration;

use crate::{Ramp, Ramps};

/// How a stop that is ordered is carried out (Stt, BBV51701 p. 40).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stop {
    /// Along the deceleration ramp.
    Ramp,
    /// Along the shortened ramp.
    Fast,
    /// The motor coasts.
    Freewheel,
    /// Direct current.
    DcInjection,
}

/// What a fault does to the motor (SLL and its like, BBV51701 p. 52–54).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reaction {
    /// The fault is not watched for.
    Ignore,
    /// The motor coasts.
    Freewheel,
    /// Along the deceleration ramp, then the drive trips.
    Ramp,
    /// Along the shortened ramp, then the drive trips.
    Fast,
}

/// The communication watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LinkWatch {
    /// After how long without a frame (ttO); `None`: never.
    pub timeout: Option<Duration>,
    /// What happens then (SLL).
    pub reaction: Reaction,
    /// The code of the fault (SLF).
    pub code: u16,
}

/// What the bits 11 to 15 of the control word mean; 0 where a meaning is not assigned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CommandBits {
    /// Reverses the direction of the reference.
    pub reverse: u16,
    /// Stops as Stt says.
    pub stop: u16,
    /// Stops by direct current.
    pub injection: u16,
    /// Stops along the shortened ramp.
    pub fast_stop: u16,
}

impl CommandBits {
    /// With the access levels L1 and L2 (BBV51701 p. 19).
    pub const BASIC: Self = Self { reverse: 0x0800, stop: 0x1000, injection: 0x2000, fast_stop: 0x4000 };
    /// With the access level L3, as the factory sets it (BBV51701 p. 19).
    pub const LEVEL_3: Self = Self { injection: 0, fast_stop: 0, ..Self::BASIC };
}

/// The parameters that act on chart and motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Whether the drive comes up in operation enabled, ready to take 000Fh without the chart (LAC = L1 or L2,
    /// BBV51701 p. 11).
    pub starts_enabled: bool,
    /// Whether orders come from the bus; if not, the control word is kept and does nothing.
    pub bus_commands: bool,
    /// Whether the reference comes from the bus; if not, it is 0 here.
    pub bus_reference: bool,
    /// The meanings of the control word's high bits.
    pub bits: CommandBits,
    /// Acceleration and deceleration in force (ACC and dEC, or AC2 and dE2).
    pub ramps: Ramps,
    /// The shortened ramp of fast and quick stop (dEC divided by dCF).
    pub fast_stop: Ramp,
    /// How an ordered stop is carried out (Stt).
    pub stop: Stop,
    /// Current of the DC injection in percent of the motor's nominal current (IdC).
    pub injection_current: u16,
    /// Time of the DC injection (tdC).
    pub injection_time: Duration,
    /// Low speed in hundredths of a hertz (LSP): a smaller reference is raised to it.
    pub low_speed: u32,
    /// High speed in hundredths of a hertz (HSP): a greater reference is lowered to it.
    pub high_speed: u32,
    /// The communication watchdog.
    pub link: LinkWatch,
}
