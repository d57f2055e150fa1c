//! Omron 3G3EV.

use drive_3g3ev::{CAPABILITIES, Drive3g3ev};
#[cfg(feature = "sim")]
use drive_sim::models;

#[cfg(feature = "sim")]
use crate::twin::{SetUp, Twin};
use crate::{bits, definition::Definition, options::OptionEntry, texts::word};

const FAULT_RESET_FUNCTION: &str = "fault-reset-function";
const SAVES: &str = "saves";

pub(crate) const DEFINITION: &Definition = &{
    let definition = Definition::new(&CAPABILITIES, &|port, slave, options| {
        let saves = options.get(SAVES).and_then(|text| text.parse().ok());
        let drive = Drive3g3ev::new(port, slave).with_saves(saves.unwrap_or_default());
        Box::new(match options.get(FAULT_RESET_FUNCTION).and_then(word) {
            Some(number) => drive.with_fault_reset_function(number),
            None => drive,
        })
    })
    .with_options(&[
        OptionEntry::new(
            FAULT_RESET_FUNCTION,
            "a number up to 65535, or hexadecimal such as 01CAh",
            "the number of \"fault reset\" in n06 to n08, from the drive's user manual; without it a fault cannot be reset",
            &|text| word(text).is_some(),
        ),
        OptionEntry::new(
            SAVES,
            "a whole number",
            "how often its EEPROM was saved before; counted on from there (default 0)",
            &|text| text.parse::<u32>().is_ok(),
        ),
    ]).with_bits(&bits::of_3g3ev);
    #[cfg(feature = "sim")]
    let definition = definition.with_twin(TWIN);
    definition
};

/// Its simulated twin, with a code for an overcurrent or an overload, which a reset clears.
#[cfg(feature = "sim")]
const TWIN: Twin =
    // Its n08 holds this number from the factory, which the simulator takes for "fault reset".
    Twin::new(&|set_up| {
        let drive = models::drive_3g3ev::Drive3g3ev::new();
        Box::new(match set_up {
            SetUp::ForTheBus => drive.with_fault_reset_function(3),
            SetUp::Factory => drive,
        })
    })
    .told(&[(FAULT_RESET_FUNCTION, "3")])
    .tripping(0);
