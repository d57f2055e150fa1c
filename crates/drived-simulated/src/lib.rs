//! Simulated drives, for `sim` and `demo`, and for the tests of what stands on drives.

#![forbid(unsafe_code)]

use drive_bus::Protocol;
use drive_families::{Family, Options};
use drive_sim::{Model, models};

/// The number that the simulated 3G3EV takes for "fault reset": its n08 holds it from the factory.
const FAULT_RESET_FUNCTION: u16 = 3;

/// How a simulated drive is set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetUp {
    /// For command by the bus, as far as the family needs settings for it.
    ForTheBus,
    /// As it leaves the factory.
    Factory,
}

/// A simulated drive of a family.
pub fn model(family: Family, set_up: SetUp) -> Box<dyn Model> {
    let for_the_bus = set_up == SetUp::ForTheBus;
    match family {
        Family::Atv21 if for_the_bus => Box::new(models::atv21::Atv21::new().with_blocks()),
        Family::Atv21 => Box::new(models::atv21::Atv21::new()),
        Family::Atv28 => Box::new(models::atv28::Atv28::new()),
        Family::Atv58 => Box::new(models::atv58::Atv58::new()),
        Family::Atv312 if for_the_bus => Box::new(models::atv312::Atv312::under_bus_control()),
        Family::Atv312 => Box::new(models::atv312::Atv312::new()),
        Family::Omron3g3ev => {
            let drive = models::drive_3g3ev::Drive3g3ev::new();
            Box::new(if for_the_bus { drive.with_fault_reset_function(FAULT_RESET_FUNCTION) } else { drive })
        }
    }
}

/// What the owner of the simulated drives that are set up for the bus says of them.
pub fn options() -> Options {
    Options { fault_reset_function: Some(FAULT_RESET_FUNCTION), ..Options::default() }
}

/// The simulator's name of a protocol.
pub const fn protocol(protocol: Protocol) -> drive_sim::Protocol {
    match protocol {
        Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
        Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
        _ => drive_sim::Protocol::Rtu,
    }
}

/// A code of the family's for an overcurrent or an overload, which a reset clears.
pub const fn trip_code(family: Family) -> u16 {
    match family {
        Family::Atv21 => 3,
        Family::Atv28 | Family::Atv312 => 9,
        Family::Atv58 => 5,
        Family::Omron3g3ev => 0,
    }
}
