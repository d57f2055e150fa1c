//! A drive's own communication watchdog: what it has to be, and what it was.

use std::time::Duration;

use drive_core::{Reaction, Watchdog};

/// The drive's own communication watchdog, as it has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct WatchdogContract {
    /// The time without a message after which it acts.
    #[cfg_attr(feature = "serde", serde(rename = "time_ms", with = "drive_core::serialize::duration_ms"))]
    #[cfg_attr(feature = "schemars", schemars(with = "u64"))]
    pub timeout: Duration,
    /// What it does then.
    pub reaction: Reaction,
}

/// What a drive's communication watchdog was before it was armed. Whoever keeps it beyond the life of the program, from
/// [`WatchdogVerified`](crate::EventKind::WatchdogVerified), gives it to the next as
/// [`watchdog_before`](crate::DriveSettings::watchdog_before): a program that was killed cannot put it back itself.
///
/// It is put back only where the drive says that it is the same one and still has the watchdog that was set.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct WatchdogBefore {
    /// Which drive it was, as [`Identity`](drive_core::Identity) is displayed.
    pub identity: String,
    /// What was set.
    pub set: Watchdog,
    /// What was found, and is to be put back.
    pub found: Watchdog,
}
