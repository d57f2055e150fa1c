//! Codes by which a browser begins a session without a token that somebody types: each is good once, and not for long.
//!
//! They are made over the control socket, or for whoever has started the program on his terminal: for whom has every right anyway. A code is kept as
//! its hash, and is as hard to guess as it has to be where each address is soon made to wait.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::time::Instant;

use super::tokens::{Right, TokenError};
use drived_config::kept::sha256;

/// How long a code is good.
pub(super) const LASTS: Duration = Duration::from_secs(10 * 60);
/// Codes at once; of more, the oldest ends.
const CODES: usize = 16;
/// Letters and digits that nobody takes for others: five bits each.
const LETTERS: &[u8; 32] = b"abcdefghjkmnpqrstuvwxyz123456789";
/// 120 bits.
const LENGTH: usize = 24;

/// For whom a code is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Grant {
    /// The name of a token.
    pub(super) name: String,
    pub(super) right: Right,
}

/// The codes by their hashes. Cheap to clone; the time is an argument.
#[derive(Debug, Clone, Default)]
pub(super) struct Codes(Arc<Mutex<BTreeMap<String, (Grant, Instant)>>>);

impl Codes {
    /// Makes a code.
    ///
    /// # Errors
    /// The system gives no random numbers.
    pub(super) fn make(&self, grant: Grant, now: Instant) -> Result<String, TokenError> {
        let mut bits = [0_u8; LENGTH];
        getrandom::fill(&mut bits).map_err(|error| TokenError::Random(error.to_string()))?;
        let letter =
            |byte: &u8| char::from(LETTERS.get(usize::from(*byte & 31)).copied().unwrap_or_default());
        let code: String = bits.iter().map(letter).collect();
        let mut codes = self.lock();
        codes.retain(|_, (_, ends)| *ends > now);
        if codes.len() >= CODES
            && let Some(first) = codes.iter().min_by_key(|(_, (_, ends))| *ends).map(|(key, _)| key.clone())
        {
            codes.remove(&first);
        }
        codes.insert(sha256(code.as_bytes()), (grant, now + LASTS));
        Ok(code)
    }

    /// Takes a code, which is none from then on.
    pub(super) fn take(&self, code: &str, now: Instant) -> Option<Grant> {
        let (grant, ends) = self.lock().remove(&sha256(code.as_bytes()))?;
        (ends > now).then_some(grant)
    }

    /// Whoever has no right to a name any more, or another one, has none by the codes of before either.
    pub(super) fn drop_of(&self, name: &str) {
        self.lock().retain(|_, (grant, _)| grant.name != name);
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, (Grant, Instant)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drived_config::rights::Role;

    #[test]
    fn a_code_is_good_once_and_for_ten_minutes() {
        let (codes, now) = (Codes::default(), Instant::now());
        let grant = || Grant { name: "anna".to_owned(), right: Right::New(Role::Engineer, 1) };
        let code = codes.make(grant(), now).unwrap();
        assert_eq!(code.len(), 24);
        assert!(code.bytes().all(|letter| LETTERS.contains(&letter)));
        assert_eq!(codes.take("another", now), None);
        assert_eq!(codes.take(&code, now), Some(grant()));
        assert_eq!(codes.take(&code, now), None, "it was used");
        let late = codes.make(grant(), now).unwrap();
        assert_eq!(codes.take(&late, now + LASTS), None);
        let many: Vec<String> = (0..=CODES as u64)
            .map(|at| codes.make(grant(), now + Duration::from_secs(at)).unwrap())
            .collect();
        assert_eq!(codes.take(&many[0], now + Duration::from_secs(20)), None, "more than are kept");
        assert!(codes.take(&many[CODES], now + Duration::from_secs(20)).is_some());
    }
}
