//! What is counted of one receiver.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use drived_plant::counts::{Id, Samples};

/// Why a message was not taken at an attempt, or was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Why {
    /// There is no connection, or it broke.
    Unreachable,
    /// It took too long.
    Timeout,
    /// It answered by another status than 2xx, and may take it later.
    Status,
    /// It will never take this one: 400, 413 or another that says so.
    Refused,
    /// There was no room for it.
    NoRoom,
}

const ATTEMPTS: [Why; 4] = [Why::Unreachable, Why::Timeout, Why::Status, Why::Refused];
const LOSSES: [Why; 2] = [Why::Refused, Why::NoRoom];

impl Why {
    const fn name(self) -> &'static str {
        match self {
            Self::Unreachable => "unreachable",
            Self::Timeout => "timeout",
            Self::Status => "status",
            Self::Refused => "refused",
            Self::NoRoom => "no_room",
        }
    }
}

/// The counters of one receiver.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) waiting: AtomicU64,
    taken: AtomicU64,
    failed: [AtomicU64; 5],
    lost: [AtomicU64; 5],
    is_away: AtomicBool,
}

impl Counters {
    /// One was taken. Gives whether the receiver had been away.
    pub(crate) fn take(&self) -> bool {
        self.taken.fetch_add(1, Relaxed);
        self.is_away.swap(false, Relaxed)
    }

    /// An attempt was in vain. Gives whether the receiver had been well before.
    pub(crate) fn fail(&self, why: Why) -> bool {
        self.failed[why as usize].fetch_add(1, Relaxed);
        !self.is_away.swap(true, Relaxed)
    }

    /// So many messages were lost.
    pub(crate) fn lose(&self, why: Why, count: u64) {
        self.lost[why as usize].fetch_add(count, Relaxed);
    }

    pub(crate) fn collect(&self, name: &str, samples: &mut Samples) {
        samples.add(Id::WebhookWaiting, &[name], self.waiting.load(Relaxed) as f64);
        samples.count(Id::WebhookTaken, &[name], self.taken.load(Relaxed));
        for why in ATTEMPTS {
            samples.count(Id::WebhookFailed, &[name, why.name()], self.failed[why as usize].load(Relaxed));
        }
        for why in LOSSES {
            samples.count(Id::WebhookLost, &[name, why.name()], self.lost[why as usize].load(Relaxed));
        }
    }

    pub(crate) fn in_words(&self) -> String {
        let sum = |all: &[AtomicU64]| all.iter().map(|one| one.load(Relaxed)).sum::<u64>();
        format!(
            "{} taken, {} wait, {} attempts in vain, {} lost",
            self.taken.load(Relaxed),
            self.waiting.load(Relaxed),
            sum(&self.failed),
            sum(&self.lost)
        )
    }
}
