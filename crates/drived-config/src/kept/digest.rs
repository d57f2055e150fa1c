//! What a file or a secret is known by: its SHA-256.

use ring::digest::{SHA256, digest};

/// The SHA-256 of something, in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    digits(digest(&SHA256, bytes).as_ref())
}

/// In hexadecimal digits.
pub fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
