//! Which drive somebody has seen before he accepts it.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use drive_core::Identity;

/// What a drive said that it is, as somebody was shown it: whoever accepts it means this one, and no other that has come since.
///
/// It is no more than a mark of it, so that an order stays as small as it is; it holds within one run of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShownIdentity(u64);

impl ShownIdentity {
    /// Whether it is this one.
    #[must_use]
    pub fn is(self, identity: &Identity) -> bool {
        self == Self::from(identity)
    }
}

impl From<&Identity> for ShownIdentity {
    fn from(identity: &Identity) -> Self {
        let mut hasher = DefaultHasher::new();
        identity.hash(&mut hasher);
        Self(hasher.finish())
    }
}
