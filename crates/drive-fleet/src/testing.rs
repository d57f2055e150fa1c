//! A family that exists only for the tests of this crate.

use std::time::Duration;

use drive_core::{Capabilities, Reaction, StopMode, WatchdogCapability};

/// What it can do: everything, in one exchange each, but no stop by DC injection.
pub(crate) const CAPABILITIES: Capabilities = Capabilities {
    functions: &[3, 6, 16],
    read_words: 16,
    write_words: 16,
    highest_address: 31,
    stop_modes: &[StopMode::Ramp, StopMode::Fast, StopMode::Freewheel],
    fault_reset: "a bit",
    watchdog: Some(WatchdogCapability {
        min: Duration::from_millis(100),
        max: Duration::from_secs(10),
        step: Duration::from_millis(100),
        reactions: &[Reaction::Ignore, Reaction::Ramp, Reaction::Freewheel],
        settable: true,
        wears: false,
    }),
    communication_fault: Some(18),
    identification: Some("function 43/14"),
    release: true,
    persist: Some("a bit"),
    broadcast_stops: &[StopMode::Freewheel],
    fault_history: 4,
    ..Capabilities::least("test", "Test drive")
};
