//! What a line records: numbers for the arithmetic of its use, and every breach of its rules.

use std::time::Duration;

use tokio::time::Instant;

/// Violations that are kept; later ones are only counted.
pub(crate) const KEPT: usize = 1_024;

/// A breach of the line's rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// When the offending character began.
    pub at: Instant,
    /// What happened.
    pub breach: Breach,
}

/// What rule was broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breach {
    /// The master began a frame before the line had been silent for t3.5.
    Silence {
        /// How long it had been silent.
        kept: Duration,
        /// t3.5.
        required: Duration,
    },
    /// The master began a request that concerns a slave before the pause that this needs after its answer or after a
    /// request to all.
    Pause {
        /// The slave.
        slave: u8,
        /// What was left.
        kept: Duration,
        /// What it needs.
        required: Duration,
    },
    /// The master left more than t1.5 between two characters of a frame.
    Gap {
        /// How long it paused.
        paused: Duration,
        /// t1.5.
        allowed: Duration,
    },
    /// The master sent while a slave did. Both frames are damaged where they overlap.
    Collision {
        /// The slave that was sending.
        slave: u8,
        /// Whether the answer was late by an injected fault, so that the master could not know.
        late: bool,
    },
}

/// The numbers of a line since it was made, or since they were last taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineStats {
    /// Intact frames from the master.
    pub requests: u64,
    /// Intact frames to all slaves.
    pub broadcasts: u64,
    /// Frames from the master that were damaged, cut or without sense.
    pub bad_frames: u64,
    /// Answers that began.
    pub answers: u64,
    /// Characters that the master sent.
    pub characters_in: u64,
    /// Characters that slaves sent.
    pub characters_out: u64,
    /// Characters that nobody on the other side took in time; a wire keeps nothing.
    pub undelivered: u64,
    /// The shortest time that these exchanges can take: for each, request, turnaround, answer and t3.5; for a
    /// broadcast or an unanswered request, its characters and t3.5.
    pub ideal: Duration,
    /// When the first character began.
    pub first: Option<Instant>,
    /// When the last character ended, the master's or a slave's.
    pub last: Option<Instant>,
    /// The shortest silence that the master kept before a frame.
    pub shortest_silence: Option<Duration>,
    /// By how much in all this simulator delivered its answers after their last bit was due. The master cannot help
    /// this part of the time it took.
    pub lag: Duration,
    /// Breaches of the rules, also those that are no longer kept.
    pub violations: u64,
    /// Answers of two slaves that overlapped.
    pub slave_collisions: u64,
}

impl LineStats {
    /// Ideal time per time taken, in parts per million; `None` before anything was sent. Above a million the master
    /// broke silences.
    ///
    /// The time taken runs from the first character to t3.5 after the last one.
    #[must_use]
    pub fn utilisation(&self, t3_5: Duration) -> Option<u64> {
        let taken = self.last?.saturating_duration_since(self.first?) + t3_5;
        let parts = self.ideal.as_nanos().saturating_mul(1_000_000).checked_div(taken.as_nanos())?;
        u64::try_from(parts).ok()
    }
}
