//! Simulated drives, for `sim` and `demo`, and for the tests of what stands on drives.

#![forbid(unsafe_code)]

use drive_bus::Protocol;
pub use drive_families::SetUp;
use drive_families::{Family, Options};
use drive_sim::Model;

/// A family that nobody has simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("nobody has said how a drive of the family {0} is simulated")]
pub struct NoTwin(pub Family);

/// A simulated drive of a family.
pub fn model(family: Family, set_up: SetUp) -> Result<Box<dyn Model>, NoTwin> {
    family.machine(set_up).ok_or(NoTwin(family))
}

/// What the owner of the simulated drives that are set up for the bus says of them.
pub fn options() -> Options {
    let mut all = Options::default();
    for family in Family::all() {
        all.extend(family.simulated_options());
    }
    all
}

/// The simulator's name of a protocol.
pub const fn protocol(protocol: Protocol) -> drive_sim::Protocol {
    match protocol {
        Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
        Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
        _ => drive_sim::Protocol::Rtu,
    }
}
