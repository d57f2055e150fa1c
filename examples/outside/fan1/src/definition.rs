//! What the family consists of, for programs that choose drives by name.

use bitflags::Flags;
use drive_core::Frequency;
use drive_families::{Bit, Definition, OptionEntry, SetUp, Twin};

use crate::{
    CAPABILITIES, Fan1, HIGHEST,
    machine::Machine,
    registers::{ControlWord, StatusWord, address},
};

const HIGHEST_FREQUENCY: &str = "highest-frequency";

/// The family: `Family::new(&FAN1).add()` makes it known by its name.
pub static FAN1: Definition = Definition::new(&CAPABILITIES, &|port, slave, options| {
    let highest = options.get(HIGHEST_FREQUENCY).and_then(frequency);
    Box::new(Fan1::new(port, slave).with_highest(highest.unwrap_or(HIGHEST)))
})
.with_options(&[OptionEntry::new(
    HIGHEST_FREQUENCY,
    "a frequency of 1 Hz to 60 Hz, such as 45Hz",
    "the highest setpoint that its fan bears (default 60 Hz)",
    &|text| frequency(text).is_some(),
)])
.with_bits(&|register| match register {
    address::CONTROL => named::<ControlWord>(),
    address::STATUS => named::<StatusWord>(),
    _ => Vec::new(),
})
.with_twin(
    Twin::new(&|set_up| {
        // From the factory its panel commands.
        Box::new(if set_up == SetUp::Factory { Machine::at_the_panel() } else { Machine::new() })
    })
    .tripping(3),
);

fn frequency(text: &str) -> Option<Frequency> {
    text.parse().ok().filter(|highest| (Frequency::from_hertz(1)..=HIGHEST).contains(highest))
}

fn named<W: Flags<Bits = u16>>() -> Vec<Bit> {
    W::FLAGS.iter().map(|flag| Bit { mask: flag.value().bits(), name: flag.name() }).collect()
}
