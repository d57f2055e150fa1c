//! What only its owner knows of a drive: [`Owner`].

use std::time::Duration;

use drive_core::Frequency;

/// What only its owner knows of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Owner {
    /// What 100 % of its setpoint is, where the drive counts in percent and does not tell.
    pub full_scale: Option<Frequency>,
    /// The highest setpoint, where the drive does not tell.
    pub highest: Option<Frequency>,
    /// That nothing but this bus commands it, neither terminals nor panel: taken for true where the drive does not tell, for a
    /// reset alone. No run command is told in force by it.
    pub commands_alone: bool,
    /// The time of its communication watchdog as it is set at the drive, of one that any request feeds: so that it is asked often enough.
    pub watchdog: Option<Duration>,
}

impl Owner {
    /// What 100 % of its setpoint is.
    #[must_use]
    pub const fn with_full_scale(self, full_scale: Frequency) -> Self {
        Self { full_scale: Some(full_scale), ..self }
    }

    /// The highest setpoint.
    #[must_use]
    pub const fn with_highest(self, highest: Frequency) -> Self {
        Self { highest: Some(highest), ..self }
    }

    /// The time of its communication watchdog.
    #[must_use]
    pub const fn with_watchdog(self, time: Duration) -> Self {
        Self { watchdog: Some(time), ..self }
    }

    /// That nothing but this bus commands it.
    #[must_use]
    pub const fn commanding_alone(self) -> Self {
        Self { commands_alone: true, ..self }
    }
}
