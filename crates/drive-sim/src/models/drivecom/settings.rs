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

/// Direct current that is injected by itself at standstill (AdC, BBV51701 p. 41).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Standstill {
    /// None.
    #[default]
    No,
    /// At the end of a ramp, for the two times.
    Timed,
    /// As long as the motor stands and operation is enabled, whether or not there ever was a run command.
    Continuous,
}

/// One of the two currents at standstill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Injection {
    /// In percent of the motor's nominal current (SdC1, SdC2).
    pub percent: u16,
    /// For how long (tdC1, tdC2); zero: it is left out.
    pub time: Duration,
}

/// The automatic restart after a fault (Atr, BBV51701 p. 51).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Restarts {
    /// The codes after which it is tried.
    pub after: &'static [u16],
    /// After how long it is given up (tAr); `None`: never.
    pub limit: Option<Duration>,
}

/// The parameters that act on chart and motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Settings {
    /// The meanings of the control word's high bits.
    pub bits: CommandBits,
    /// Whether a run command of the terminals counts by its level (tCC = 2C with tCt = LEL or PFO), so that what
    /// stands runs again when a stop ends (BBV51701 p. 40, 41).
    pub runs_by_level: bool,
    /// Acceleration and deceleration in force (ACC and dEC, or AC2 and dE2).
    pub ramps: Ramps,
    /// The shortened ramp of fast and quick stop (dEC divided by dCF).
    pub fast_stop: Ramp,
    /// How an ordered stop is carried out (Stt).
    pub stop: Stop,
    /// Current of the DC injection in percent of the motor's nominal current (IdC).
    pub injection_current: u16,
    /// What the current is lowered to after 5 s (half of ItH, BBV51701 p. 40), in percent of the nominal current.
    pub injection_limit: u16,
    /// Time of the DC injection as the normal stop (tdC).
    pub injection_time: Duration,
    /// Direct current at standstill (AdC), first and second.
    pub standstill: (Standstill, [Injection; 2]),
    /// Low speed in hundredths of a hertz (LSP): a smaller reference is raised to it.
    pub low_speed: u32,
    /// High speed in hundredths of a hertz (HSP): a greater reference is lowered to it.
    pub high_speed: u32,
    /// The time at low speed after which the motor is stopped until a greater reference comes (tLS).
    pub low_speed_time: Option<Duration>,
    /// How long a brake takes to be released before the motor turns (brt, where bLC is assigned); zero: there is none.
    pub brake_release: Duration,
    /// The automatic restart.
    pub restarts: Option<Restarts>,
    /// The communication watchdog.
    pub link: LinkWatch,
}
