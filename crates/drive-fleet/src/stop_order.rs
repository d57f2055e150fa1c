//! How somebody wants a drive stopped: [`StopOrder`].

use std::{fmt, time::Duration};

use drive_core::StopMode;

/// How a drive is to be stopped: by a mode alone, or for how long direct current is to be injected.
///
/// ```
/// use drive_core::StopMode;
/// use drive_fleet::StopOrder;
/// use std::time::Duration;
///
/// assert_eq!(StopOrder::from(StopMode::Fast).to_string(), "fast stop");
/// let held = StopOrder::injecting(Duration::from_secs(3));
/// assert_eq!(held.to_string(), "DC injection stop held for 3s");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StopOrder {
    /// The mode.
    pub mode: StopMode,
    /// How long direct current takes to bring the motor to rest, for a stop by [`StopMode::DcInjection`]: for so long it is held, at
    /// most for [`INJECTION_AT_MOST`](drive_core::INJECTION_AT_MOST). `None`, or nothing: as the drive's
    /// [settings](crate::DriveSettings::injection) say.
    pub injection: Option<Duration>,
}

impl StopOrder {
    /// A stop by direct current that is held for this time.
    #[must_use]
    pub const fn injecting(time: Duration) -> Self {
        Self { mode: StopMode::DcInjection, injection: Some(time) }
    }

    /// For how long direct current is to be held, where somebody has said so and it is injected.
    pub(crate) fn injects_for(self) -> Option<Duration> {
        self.injection.filter(|time| self.mode == StopMode::DcInjection && !time.is_zero())
    }
}

impl From<StopMode> for StopOrder {
    fn from(mode: StopMode) -> Self {
        Self { mode, injection: None }
    }
}

impl fmt::Display for StopOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} stop", self.mode)?;
        self.injects_for().map_or(Ok(()), |time| write!(f, " held for {time:?}"))
    }
}

/// How hard a mode stops. What stops harder takes the place of what is under way, and nothing else does: disabling the voltage
/// overrides a quick stop, and a quick stop all that goes on in "operation enabled", as in the state chart of the drives.
pub(crate) const fn strength(mode: StopMode) -> u8 {
    match mode {
        StopMode::Ramp => 0,
        StopMode::DcInjection => 1,
        StopMode::Fast => 2,
        StopMode::Freewheel => 3,
    }
}
