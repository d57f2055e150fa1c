//! Schneider Altivar 28.

use drive_atv28::{Atv28, CAPABILITIES};
#[cfg(feature = "sim")]
use drive_sim::models;

#[cfg(feature = "sim")]
use crate::twin::Twin;
use crate::{bits, definition::Definition};

pub(crate) const DEFINITION: &Definition = &{
    let definition = Definition::new(&CAPABILITIES, &|port, slave, _| Box::new(Atv28::new(port, slave)))
        .with_bits(&bits::of_atv28);
    #[cfg(feature = "sim")]
    let definition = definition.with_twin(TWIN);
    definition
};

/// Its simulated twin, with a code for an overcurrent or an overload, which a reset clears.
#[cfg(feature = "sim")]
const TWIN: Twin = Twin::new(&|_| Box::new(models::atv28::Atv28::new())).tripping(9);
