//! A family that exists only for the tests of this crate.

use std::time::Duration;

use drive_core::{
    Capabilities, Reaction, SerialSettings, StopMode, WatchdogCapability, serial::CharacterFormat,
};

/// What it can do: everything, in one exchange each, but no stop by DC injection.
pub(crate) const CAPABILITIES: Capabilities = Capabilities {
    key: "test",
    name: "Test drive",
    functions: &[3, 6, 16],
    read_words: 16,
    blocks: &[],
    write_words: 16,
    highest_address: 31,
    stations: 31,
    speeds: &[9_600, 19_200],
    formats: &[CharacterFormat::F8E1],
    factory: SerialSettings::MODBUS_DEFAULT,
    stop_modes: &[StopMode::Ramp, StopMode::Fast, StopMode::Freewheel],
    speed_setpoint: false,
    frequency_step: "0.1 Hz",
    fault_reset: "a bit",
    watchdog: Some(WatchdogCapability {
        min: Duration::from_millis(100),
        max: Duration::from_secs(10),
        step: Duration::from_millis(100),
        reactions: &[Reaction::Ignore, Reaction::Ramp, Reaction::Freewheel],
        settable: true,
    }),
    identification: Some("function 43/14"),
    release: true,
    persist: Some("a bit"),
    broadcast_stops: &[StopMode::Freewheel],
    fault_history: 4,
    turnaround: Duration::ZERO,
    status_exchanges: 1,
    measurement_exchanges: 1,
};
