//! [`Identity`]: what a drive says it is.

use crate::status::RawWord;

/// What a drive says it is. Two drives that differ in any part are different drives.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Identity {
    /// The vendor's name.
    pub vendor: Option<String>,
    /// The model or reference.
    pub model: Option<String>,
    /// The version of its firmware, as it writes it.
    pub version: Option<String>,
    /// Words that tell one model from another, where the family has registers for it.
    pub codes: Vec<RawWord>,
}
