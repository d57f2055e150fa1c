//! [`Identity`]: what a drive says it is.

use crate::status::RawWord;

/// What a drive says it is. Two drives that differ in any part are different drives.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Identity {
    /// The vendor's name.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub vendor: Option<String>,
    /// The model or reference.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub model: Option<String>,
    /// The version of its firmware, as it writes it.
    #[cfg_attr(feature = "serde", serde(rename = "firmware", skip_serializing_if = "Option::is_none"))]
    pub version: Option<String>,
    /// Words that tell one model from another, where the family has registers for it.
    pub codes: Vec<RawWord>,
}
