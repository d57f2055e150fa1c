//! Settings of a drive as they were read: one that is to be kept, and those that are.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A setting of a drive as it was read, or written and read back, a moment ago.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterRead {
    pub drive: Arc<str>,
    pub address: u16,
    /// The manual's mnemonic.
    pub code: &'static str,
    pub word: u16,
    /// With its unit or its meaning.
    pub text: String,
}

/// A value of a parameter that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PastParameterView {
    pub address: u16,
    pub mnemonic: String,
    pub raw: u16,
    pub text: String,
    /// When it was first read so, and when last; between the two nobody has read another value.
    pub first_unix_ms: i64,
    pub last_unix_ms: i64,
    /// How often.
    pub times: i64,
}
