//! What the families' tests need to know of each family: its machine, its set-up, one of its trips.

use drive_core::{Drive, ErrorKind, Port, SlaveAddress};
use drive_families::{Family, Options};
use drive_sim::{Model, models};
pub use drive_testing::referee::Family as Five;

/// The number of "fault reset" in n06 to n08 of these 3G3EV; the manual gives none, so its owner must.
pub const RESET_FUNCTION: u16 = 3;

/// Which of the five manuals is this family's.
#[must_use]
pub fn five(family: Family) -> Five {
    Five::by_key(family.capabilities().key).expect("a family of one of the five manuals")
}

/// A simulated machine of a family, set up for control by the bus.
#[must_use]
pub fn machine(family: Family) -> Box<dyn Model> {
    match five(family) {
        Five::Atv21 => Box::new(models::atv21::Atv21::new()),
        Five::Atv28 => Box::new(models::atv28::Atv28::new()),
        Five::Atv58 => Box::new(models::atv58::Atv58::new()),
        Five::Atv312 => Box::new(models::atv312::Atv312::under_bus_control()),
        Five::Omron3g3ev => {
            Box::new(models::drive_3g3ev::Drive3g3ev::new().with_fault_reset_function(RESET_FUNCTION))
        }
    }
}

/// What the owner of a drive of these tests says of it.
#[must_use]
pub fn options(family: Family) -> Options {
    match five(family) {
        Five::Omron3g3ev => said("fault-reset-function", &RESET_FUNCTION.to_string()),
        _ => Options::default(),
    }
}

/// What is said by one option.
#[must_use]
pub fn said(name: &str, value: &str) -> Options {
    let mut options = Options::default();
    options.set(name, value).expect("an option and a value of it");
    options
}

/// A drive of a family as a plant would set it up.
#[must_use]
pub fn drive(family: Family, port: impl Port + 'static, slave: SlaveAddress) -> Box<dyn Drive> {
    family.open_with(port, slave, &options(family))
}

/// A trip that a reset clears, in the family's own code.
#[must_use]
pub fn a_trip(family: Family) -> u16 {
    match five(family) {
        Five::Atv21 => 0x0E,
        Five::Atv28 | Five::Atv312 => 17,
        Five::Atv58 => 2,
        Five::Omron3g3ev => 9,
    }
}

/// What the drive reports as present after its watchdog has tripped it.
#[must_use]
pub fn communication_trips(family: Family) -> &'static [u16] {
    match five(family) {
        Five::Atv21 => &[0x18],
        Five::Atv28 | Five::Atv58 | Five::Atv312 => &[5],
        Five::Omron3g3ev => &[14],
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
            assert!(family == Family::ATV21 && unheard, "{error}");
        }
    }
}
