//! What the families' tests need to know of each family: its machine, its set-up, one of its trips.

use drive_core::{Drive, ErrorKind, Port, SlaveAddress};
use drive_families::{Family, Options};
use drive_sim::{Model, models};

/// The number of "fault reset" in n06 to n08 of these 3G3EV; the manual gives none, so its owner must.
pub const RESET_FUNCTION: u16 = 3;

/// A simulated machine of a family, set up for control by the bus.
#[must_use]
pub fn machine(family: Family) -> Box<dyn Model> {
    match family {
        Family::Atv21 => Box::new(models::atv21::Atv21::new()),
        Family::Atv28 => Box::new(models::atv28::Atv28::new()),
        Family::Atv58 => Box::new(models::atv58::Atv58::new()),
        Family::Atv312 => Box::new(models::atv312::Atv312::under_bus_control()),
        Family::Omron3g3ev => {
            Box::new(models::drive_3g3ev::Drive3g3ev::new().with_fault_reset_function(RESET_FUNCTION))
        }
    }
}

/// What the owner of a drive of these tests says of it.
#[must_use]
pub fn options(family: Family) -> Options {
    match family {
        Family::Omron3g3ev => Options { fault_reset_function: Some(RESET_FUNCTION), ..Options::default() },
        _ => Options::default(),
    }
}

/// A drive of a family as a plant would set it up.
#[must_use]
pub fn drive(family: Family, port: impl Port + 'static, slave: SlaveAddress) -> Box<dyn Drive> {
    family.open_with(port, slave, &options(family))
}

/// A trip that a reset clears, in the family's own code.
#[must_use]
pub const fn a_trip(family: Family) -> u16 {
    match family {
        Family::Atv21 => 0x0E,
        Family::Atv28 | Family::Atv312 => 17,
        Family::Atv58 => 2,
        Family::Omron3g3ev => 9,
    }
}

/// What the drive reports as present after its watchdog has tripped it.
#[must_use]
pub const fn communication_trips(family: Family) -> &'static [u16] {
    match family {
        Family::Atv21 => &[0x18],
        Family::Atv28 | Family::Atv58 | Family::Atv312 => &[5],
        Family::Omron3g3ev => &[14],
    }
}

/// Resets the present fault. An Altivar 21 does not communicate for about 2 s after it, so that nothing can confirm
/// it yet.
///
/// # Panics
/// When the reset fails otherwise.
pub async fn reset(family: Family, drive: &mut Box<dyn Drive>) {
    match drive.reset_faults().await {
        Ok(status) => assert!(!status.is_fault(), "{status}"),
        Err(error) => {
            let unheard =
                matches!(error.kind(), ErrorKind::NoAnswer | ErrorKind::OutcomeUnknown | ErrorKind::NotSent);
            assert!(family == Family::Atv21 && unheard, "{error}");
        }
    }
}
