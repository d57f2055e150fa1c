//! What a slave on a UNI-TELWAY line does where the card's manual says nothing: [`LinkHabits`].

use std::time::Duration;

/// What it does with a reply whose acknowledgement it has not heard. One that was refused (NAK) it says again in any case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Unacknowledged {
    /// It says it again at the next poll, until a new request takes its place.
    #[default]
    Repeats,
    /// It gives it up.
    Forgets,
    /// It says it again at the next poll, and keeps the replies to new requests behind it.
    Queues,
    /// It says it again at the next poll, and refuses (NAK) new requests until it is taken.
    Refuses,
}

/// Which network header it takes; a request with another one it refuses (NAK).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum HeaderForm {
    /// Both, and it answers with the one that the request has.
    #[default]
    Either,
    /// One byte 00h.
    Simplified,
    /// 20h and five bytes.
    Standard,
}

/// The habits of a slave on a UNI-TELWAY line. Every one is lawful, as far as what is public of the protocol says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct LinkHabits {
    /// What becomes of a reply that nobody acknowledges.
    pub unacknowledged: Unacknowledged,
    /// It is silent where it has nothing to say yet, instead of saying so (EOT).
    pub silent: bool,
    /// From the end of a request to its acknowledgement or refusal; `None`: as before any of its words.
    pub acknowledges_after: Option<Duration>,
    /// From the end of a request until its reply is ready.
    pub works_for: Duration,
    /// The header that it takes.
    pub header: HeaderForm,
}
