//! How an exchange ends.

use crate::request::{Refusal, Reply};

/// What a slave said: its reply, or that it refuses.
pub type Answer = Result<Reply, Refusal>;

/// Why an exchange brought no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Failure {
    /// No answer came in time. It may still come.
    Timeout,
    /// What came looks like the answer and is not whole.
    Damaged(&'static str),
    /// No answer came in time, but an intact frame of the slave that does not fit the request.
    Mismatch(String),
    /// The slave has refused the frame for [`busy_timeout`](crate::UniTelwaySettings::busy_timeout): nothing of it was carried out.
    Refused(&'static str),
    /// An answer came that may belong to an earlier request.
    Doubted(&'static str),
}
