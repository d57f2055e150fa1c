//! In what state a drive is, and who commands it.

/// The state of a drive, in terms that all families share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum State {
    /// It cannot start now: initialising, undervoltage, or locked by something that is not a fault.
    NotReady,
    /// It stands, without output, and needs its start ladder first; [`Drive::start`](crate::Drive::start) climbs it.
    Disabled,
    /// It stands and takes a start at once.
    Ready,
    /// A run command is in force, whether it accelerates, holds its speed or changes it.
    Running,
    /// It is coming to a stop: no run command is in force and the output still turns the motor.
    Stopping,
    /// It is stopping or has stopped by its quick stop, and holds that state until it is told otherwise.
    QuickStop,
    /// It is reacting to a fault.
    FaultReaction,
    /// It has tripped. Nothing moves until the fault is reset.
    Fault,
    /// The words it sent are none that its manual explains; they stand in [`Status::raw`](crate::Status::raw).
    #[default]
    Unknown,
}

impl State {
    /// Whether it has tripped or is about to.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        matches!(self, Self::Fault | Self::FaultReaction)
    }

    /// Whether a run command is in force or the motor is still being driven.
    #[must_use]
    pub const fn is_moving(self) -> bool {
        matches!(self, Self::Running | Self::Stopping | Self::QuickStop | Self::FaultReaction)
    }
}

crate::named! { State {
    NotReady => "not ready",
    Disabled => "disabled",
    Ready => "ready",
    Running => "running",
    Stopping => "stopping",
    QuickStop => "quick stop",
    FaultReaction => "fault reaction",
    Fault => "fault",
    Unknown => "unknown",
} }

/// Who commands the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Control {
    /// This bus.
    Bus,
    /// The terminal strip.
    Terminals,
    /// The panel, built in or remote.
    Panel,
    /// The terminals or the panel: the drive does not say which.
    Local,
    /// Another bus, through another port of the drive.
    OtherBus,
}

crate::named! { Control {
    Bus => "bus",
    Terminals => "terminals",
    Panel => "panel",
    Local => "local",
    OtherBus => "other bus",
} }
