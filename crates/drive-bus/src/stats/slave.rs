//! What a line knows of one slave.

use std::time::Duration;

use drive_core::PortError;

#[cfg(feature = "unitelway")]
use drive_unitelway::LinkCounters;

#[cfg(all(feature = "serde", feature = "unitelway"))]
use super::json;
use super::{Histogram, Spread};

/// How the calls ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct Outcomes {
    /// With an answer.
    pub answered: u64,
    /// With the slave's exception.
    pub exceptions: u64,
    /// Without an answer in time.
    pub timeouts: u64,
    /// With a damaged answer.
    pub damaged: u64,
    /// With an answer that did not fit the request.
    pub mismatches: u64,
    /// Refused by the slave for as long as its line repeats it (UNI-TELWAY's NAK).
    pub busy: u64,
    /// Expired in the queue.
    pub expired: u64,
    /// Replaced by a later request, in the queue or by a stop that came since its order began.
    pub superseded: u64,
    /// Withdrawn by a caller that did not wait.
    pub withdrawn: u64,
    /// Refused at once: slave off-line, queue full, line down or closed.
    pub refused: u64,
}

impl Outcomes {
    /// One that was never sent, and why.
    pub(crate) const fn never_sent(&mut self, error: &PortError) {
        match error {
            PortError::Expired => self.expired += 1,
            PortError::Superseded => self.superseded += 1,
            _ => self.refused += 1,
        }
    }
}

/// What the line knows of one slave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default))]
#[non_exhaustive]
pub struct SlaveStats {
    /// Requests sent, retries and probes included.
    pub sent: u64,
    /// How exchanges and waiting requests ended; one call with a retry counts each of its exchanges.
    pub outcomes: Outcomes,
    /// Requests sent again.
    pub retries: u64,
    /// Probes while it was off-line.
    pub probes: u64,
    /// Answers that came after their time was over.
    pub late: u64,
    /// Answers that came sooner than a line can carry request and answer: those that come twice, mostly.
    pub early: u64,
    /// Values after which another answer to the same question came, so that they may have been those of an earlier one.
    pub retracted: u64,
    /// Intact frames with another function than was asked for.
    pub wrong_function: u64,
    /// Intact frames with the function that was asked for, and another count, address or value.
    pub wrong_count: u64,
    /// How often it went off-line.
    pub went_offline: u64,
    /// Whether it is off-line now.
    pub offline: bool,
    /// How long it takes until it is asked whether it is back, as far as is known; `None` unless it is off-line.
    #[cfg_attr(feature = "serde", serde(rename = "next_probe_ns", with = "drive_core::serialize::maybe_ns"))]
    pub next_probe: Option<Duration>,
    /// The response timeout that holds now.
    #[cfg_attr(
        feature = "serde",
        serde(rename = "response_timeout_ns", with = "drive_core::serialize::duration_ns")
    )]
    pub response_timeout: Duration,
    /// What its own link had counted when it was last read, by
    /// [`link_counters`](crate::unite::UniTe::link_counters) on a UNI-TELWAY line. Feature `unitelway`.
    #[cfg(feature = "unitelway")]
    #[cfg_attr(feature = "serde", serde(with = "json::link"))]
    pub link: Option<LinkCounters>,
    /// From the end of a request to the first character of its answer, as computed from the answer's end and length.
    pub response: Histogram,
    /// Each exchange, from the first character of its request to the end of its answer, or of the wait for one.
    pub exchanges: Spread,
}

impl SlaveStats {
    /// Whether anything came instead of its answers.
    pub(crate) const fn has_heard_else(&self) -> bool {
        let outcomes = &self.outcomes;
        outcomes.damaged
            + outcomes.mismatches
            + self.late
            + self.early
            + self.wrong_function
            + self.wrong_count
            > 0
    }
}
