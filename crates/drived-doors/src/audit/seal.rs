//! The key of a log, by which nobody who has only its file writes a line of it: HMAC-SHA256 (RFC 2104).

use std::io;

use ring::hmac;
use subtle::ConstantTimeEq as _;

use drived_config::kept::{Kept, Readers, digits};

/// What stands behind the name of the log in that of the file of its key.
const KEY: &str = ".key";
/// How a seal stands at the end of a line.
const BEFORE: &str = ",\"seal\":\"";
const BEHIND: &str = "\"}";

/// The key of a log.
#[derive(Clone)]
pub(super) struct Key(hmac::Key);

impl Key {
    /// The key of a log, if it has one.
    pub(super) fn of(log: &Kept) -> io::Result<Option<Self>> {
        let Some((text, _)) = log.beside(KEY).read()? else { return Ok(None) };
        if text.trim_ascii().len() < 32 {
            return Err(io::Error::other("it has no key in it"));
        }
        Ok(Some(Self::from_text(text.trim_ascii())))
    }

    /// The same, made where there is none.
    pub(super) fn of_or_new(log: &Kept) -> io::Result<Self> {
        if let Some(key) = Self::of(log)? {
            return Ok(key);
        }
        let _lock = log.lock()?;
        if let Some(key) = Self::of(log)? {
            return Ok(key);
        }
        let mut bits = [0; 32];
        getrandom::fill(&mut bits).map_err(|error| io::Error::other(error.to_string()))?;
        let text = digits(&bits);
        log.beside(KEY).replace(text.as_bytes(), Readers::Owner)?;
        Ok(Self::from_text(text.as_bytes()))
    }

    fn from_text(text: &[u8]) -> Self {
        Self(hmac::Key::new(hmac::HMAC_SHA256, text))
    }

    fn hmac(&self, text: &[u8]) -> String {
        digits(hmac::sign(&self.0, text).as_ref())
    }

    /// A line with its seal, of an object in JSON.
    pub(super) fn sealed(&self, object: &str) -> String {
        let open = object.strip_suffix('}').unwrap_or(object);
        format!("{open}{BEFORE}{}{BEHIND}", self.hmac(object.as_bytes()))
    }

    /// Whether the seal of a line is that of this key.
    pub(super) fn has_sealed(&self, line: &[u8]) -> bool {
        let whole = || {
            let line = str::from_utf8(line).ok()?;
            let (open, seal) = line.strip_suffix(BEHIND)?.rsplit_once(BEFORE)?;
            Some(self.hmac(format!("{open}}}").as_bytes()).as_bytes().ct_eq(seal.as_bytes()).into())
        };
        whole().unwrap_or(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4231, 4.3 and 4.7.
    #[test]
    fn the_code_of_a_text_is_that_of_the_rfc() {
        let code = Key::from_text(b"Jefe").hmac(b"what do ya want for nothing?");
        assert_eq!(code, "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
        let text = b"Test Using Larger Than Block-Size Key - Hash Key First";
        let code = Key::from_text(&[0xAA; 131]).hmac(text);
        assert_eq!(code, "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54");
    }

    #[test]
    fn a_line_is_sealed_by_one_key_alone() {
        let [one, other] = ["one", "other"].map(|text| Key::from_text(text.as_bytes()));
        let line = one.sealed("{\"a\":1}");
        assert!(line.starts_with("{\"a\":1,\"seal\":\"") && line.ends_with("\"}"), "{line}");
        assert!(one.has_sealed(line.as_bytes()) && !other.has_sealed(line.as_bytes()));
        assert!(!one.has_sealed(line.replace(":1", ":2").as_bytes()) && !one.has_sealed(b"{}"));
    }
}
