#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub use drive_bus::{self as bus, Endpoint, Line, LineConfig, Slave};
pub use drive_core::{
    self, Capabilities, Class, Control, Current, Direction, Drive, Error, ErrorKind, Fault, Faults,
    Frequency, Identity, Measurements, Percent, Port, Power, Refusal, Result, Row, SerialSettings, Setpoint,
    SlaveAddress, Speed, State, Status, StopMode, Stopped, Voltage, Watchdog,
};
pub use drive_families::{self as families, Family, Options};
pub use drive_fleet::{
    self as fleet, DriveHandle, DriveSettings, Event, EventKind, Events, Fleet, FleetBuilder, FleetError,
    Outcome, Received, Snapshot, StopTicket, Ticket,
};
#[cfg(feature = "sim")]
pub use drive_sim as sim;

// Most of its recipes have a simulated drive: without the feature they are neither shown nor tried.
#[cfg_attr(feature = "sim", doc = include_str!("../COOKBOOK.md"))]
#[cfg_attr(
    not(feature = "sim"),
    doc = "Recipes, in `COOKBOOK.md` of the crate: those with a simulated drive need the feature `sim`."
)]
pub mod cookbook {}
