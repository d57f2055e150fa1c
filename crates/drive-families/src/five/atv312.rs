//! Schneider Altivar 312.

use drive_atv312::{Atv312, CAPABILITIES};
#[cfg(feature = "sim")]
use drive_sim::models;

#[cfg(feature = "sim")]
use crate::twin::{SetUp, Twin};
use crate::{bits, definition::Definition};

pub(crate) const DEFINITION: &Definition = &{
    let definition = Definition::new(&CAPABILITIES, &|port, slave, _| Box::new(Atv312::new(port, slave)))
        .with_bits(&bits::of_atv312);
    #[cfg(feature = "sim")]
    let definition = definition.with_twin(TWIN);
    definition
};

/// Its simulated twin, with a code for an overcurrent or an overload, which a reset clears.
#[cfg(feature = "sim")]
const TWIN: Twin = Twin::new(&|set_up| match set_up {
    SetUp::ForTheBus => Box::new(models::atv312::Atv312::under_bus_control()),
    SetUp::Factory => Box::new(models::atv312::Atv312::new()),
})
.tripping(9);
