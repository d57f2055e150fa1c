//! Schneider Altivar 21.

use drive_atv21::{Atv21, Authority, CAPABILITIES};
#[cfg(feature = "sim")]
use drive_sim::models;

#[cfg(feature = "sim")]
use crate::twin::{SetUp, Twin};
use crate::{
    bits,
    definition::Definition,
    options::{OptionEntry, Options},
};

pub(crate) const DEFINITION: &Definition = &{
    let definition = Definition::new(&CAPABILITIES, &|port, slave, options| {
        Box::new(Atv21::new(port, slave).with_authority(of(options)))
    })
    .with_options(&[OptionEntry::new(
        "authority",
        "priority or settings",
        "by what right the bus commands: its priority bits (default), or the drive's settings CMOD = 2 and FMOD = 4 alone",
        &|text| authority(text).is_some(),
    )]).with_bits(&bits::of_atv21);
    #[cfg(feature = "sim")]
    let definition = definition.with_twin(TWIN);
    definition
};

/// Its simulated twin, with a code for an overcurrent or an overload, which a reset clears.
#[cfg(feature = "sim")]
const TWIN: Twin = Twin::new(&|set_up| match set_up {
    SetUp::ForTheBus => Box::new(models::atv21::Atv21::new().with_blocks()),
    SetUp::Factory => Box::new(models::atv21::Atv21::new()),
})
.tripping(3);

fn of(options: &Options) -> Authority {
    options.get("authority").and_then(authority).unwrap_or_default()
}

fn authority(text: &str) -> Option<Authority> {
    match text {
        "priority" => Some(Authority::Priority),
        "settings" => Some(Authority::Settings),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_authority_of_the_bus_is_what_its_owner_says() {
        assert_eq!(of(&Options::default()), Authority::default());
        let mut options = Options::default();
        options.set("authority", "settings").unwrap();
        assert_eq!(of(&options), Authority::Settings);
        assert_ne!(Authority::Settings, Authority::default());
    }
}
