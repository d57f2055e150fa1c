//! What a slave is about to say: what the slaves give to a protocol, and a protocol to the wire.

use std::time::Duration;

use tokio::time::Instant;

/// Something that a slave is about to say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Speech {
    pub(crate) slave: u8,
    pub(crate) content: Content,
    /// When the last bit of what it answers was on the wire, and how long the slave waits after it.
    pub(crate) heard: Instant,
    pub(crate) turnaround: Duration,
    /// Whether a second master has asked.
    pub(crate) is_to_another: bool,
}

/// What is said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Content {
    /// A message, still to be put into a frame.
    Message(Vec<u8>),
    /// Characters of the protocol itself, such as an acknowledgement.
    Signal(Vec<u8>),
}
