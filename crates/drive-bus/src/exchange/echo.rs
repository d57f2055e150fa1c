//! Adapters that echo, and what is known of it, for the protocols whose answers may equal their requests.

/// Whether the adapter gives back what we send (two-wire adapters whose receiver stays on while they transmit).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Echo {
    /// It does not.
    #[default]
    Off,
    /// It does: what we send comes back first and is taken away. An answer that equals its request (functions 05, 06,
    /// 08, 16h) counts only when it comes a second time.
    On,
    /// Found out by the line. Where the first request after opening would have an answer equal to itself, the line
    /// reads one register of that slave first, because only the echo of a read can be told from its answer.
    Auto,
}

/// Why an exchange without an answer failed, when what came could have been the answer or the echo, damaged.
pub(super) const MAYBE_ECHO: &str = "a damaged frame that may have been the echo";

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
