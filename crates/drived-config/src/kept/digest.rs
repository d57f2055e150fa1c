//! What a file or a secret is known by: its SHA-256.

use sha2::{Digest as _, Sha256};

/// The SHA-256 of something, in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    digits(&Sha256::digest(bytes))
}

/// In hexadecimal digits.
pub fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
