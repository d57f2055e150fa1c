//! What a caller may do.

use schemars::JsonSchema;
use serde::Serialize;

/// What a caller may do. Each is given by itself: a stop without anything else, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub(crate) struct Rights {
    /// See the plant.
    pub(crate) view: bool,
    /// Stop a motor.
    pub(crate) stop: bool,
    /// Start a motor, change its setpoint, reset a fault, give control back.
    pub(crate) operate: bool,
    /// Change parameters.
    pub(crate) engineer: bool,
}
