//! What a withdrawal of the run command came to.

use crate::status::Status;

/// What became of a withdrawal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Withdrawn {
    /// A run command of this side stood, and the drive shows that it stands no more.
    Ended(Status),
    /// None of this side's stood: nothing was written.
    Nothing(Status),
}

impl Withdrawn {
    /// The status that shows it.
    #[must_use]
    pub const fn status(&self) -> &Status {
        match self {
            Self::Ended(status) | Self::Nothing(status) => status,
        }
    }

    /// The same, as a value.
    #[must_use]
    pub fn into_status(self) -> Status {
        match self {
            Self::Ended(status) | Self::Nothing(status) => status,
        }
    }
}
