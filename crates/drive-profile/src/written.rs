//! What a step writes.

use crate::format::Space;

/// One register or coil of a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Written {
    pub(crate) space: Space,
    pub(crate) address: u16,
    /// The word; 0 or 1 of a coil.
    pub(crate) value: u16,
}
