//! Simulated drives of any family, for simulators, demos and tests.

use drive_sim::Model;

use crate::{Family, SetUp, options::Options};

/// A family that nobody has simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("nobody has said how a drive of the family {0} is simulated")]
pub struct NoTwin(pub Family);

/// A simulated drive of a family.
///
/// # Errors
/// The family has no [`Twin`](crate::Twin).
pub fn model(family: Family, set_up: SetUp) -> Result<Box<dyn Model>, NoTwin> {
    family.machine(set_up).ok_or(NoTwin(family))
}

/// What the owner of the simulated drives that are set up for the bus says of them.
#[must_use]
pub fn options() -> Options {
    let mut all = Options::default();
    for family in Family::all() {
        all.extend(family.simulated_options());
    }
    all
}
