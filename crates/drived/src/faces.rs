//! The faces that this program was built with.

use drived_face::{Face, TableTaken};

/// In the order in which the documents tell of them.
const FACES: &[&dyn Face] = &[
    #[cfg(feature = "gateway")]
    drived_gateway::FACE,
    #[cfg(feature = "history")]
    drived_history::FACE,
    #[cfg(feature = "mqtt")]
    drived_broker::FACE,
    #[cfg(feature = "webhook")]
    drived_webhook::FACE,
];

/// Makes the program know them.
pub(crate) fn add() -> Result<(), TableTaken> {
    FACES.iter().try_for_each(|face| drived_face::add(*face))
}
