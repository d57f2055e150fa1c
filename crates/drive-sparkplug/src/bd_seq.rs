//! The number that joins a death to its birth.

use std::{fmt, num::ParseIntError, str::FromStr};

/// `bdSeq`, 0 to 255: the same in the will of a connection and in its births, one more at each CONNECT.
///
/// It has to outlive the program, else the will of an old connection that arrives late kills the new session. Keep what
/// [`Self::next`] gives before each connect, as text, and begin with the default where nothing was kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct BdSeq(u8);

impl BdSeq {
    /// The one after it; 0 after 255.
    #[must_use]
    pub const fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }

    /// Its number.
    pub const fn number(self) -> u8 {
        self.0
    }
}

impl fmt::Display for BdSeq {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for BdSeq {
    type Err = ParseIntError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.trim().parse().map(Self)
    }
}
