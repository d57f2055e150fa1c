//! Whether the adapter echoes, for the protocols whose answers may equal their requests.

use crate::config::Echo;

/// What is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EchoState {
    Unknown,
    Absent,
    Present,
}

impl From<Echo> for EchoState {
    fn from(echo: Echo) -> Self {
        match echo {
            Echo::Off => Self::Absent,
            Echo::On => Self::Present,
            Echo::Auto => Self::Unknown,
        }
    }
}
