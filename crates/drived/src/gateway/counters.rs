//! What a gateway counts.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// Why a connection was turned away or ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Ended {
    /// Too many were connected.
    Full,
    /// Its address is in no network that may connect.
    NotAllowed,
    /// It asked for nothing for too long.
    Idle,
    /// A frame began and did not end.
    HalfOpen,
    /// What it sent is no Modbus TCP.
    Malformed,
    /// It did not read its answers.
    SlowReader,
}

impl Ended {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::NotAllowed => "not_allowed",
            Self::Idle => "idle",
            Self::HalfOpen => "half_open",
            Self::Malformed => "malformed",
            Self::SlowReader => "slow_reader",
        }
    }
}

/// How a request was answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Result {
    /// As asked.
    Answered,
    /// By an exception of this code.
    Exception(u8),
    /// Not at all, because the slave did not answer and the gateway is told to be silent then.
    Silence,
}

/// The counters of one gateway.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    clients: AtomicU64,
    /// Reads that were answered by the exchange of an equal one.
    joined: AtomicU64,
    counts: Mutex<Counts>,
}

/// What is counted by kind.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counts {
    pub(crate) ended: BTreeMap<Ended, u64>,
    /// By function code and result: how many, and how long they took together.
    pub(crate) requests: BTreeMap<(u8, Result), (u64, Duration)>,
    /// Writes that were refused, by exception.
    pub(crate) refused_writes: BTreeMap<u8, u64>,
}

impl Counters {
    pub(super) fn enter(&self) {
        self.clients.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn leave(&self) {
        self.clients.fetch_sub(1, Ordering::Relaxed);
    }

    /// How many are connected.
    pub(crate) fn clients(&self) -> u64 {
        self.clients.load(Ordering::Relaxed)
    }

    /// Everything in a sentence.
    pub(crate) fn in_words(&self) -> String {
        let Counts { ended, requests, .. } = self.counts();
        let mut words = vec![format!("{} connected", self.clients())];
        let mut results: BTreeMap<Result, u64> = BTreeMap::new();
        for ((_, result), (count, _)) in requests {
            *results.entry(result).or_default() += count;
        }
        words.extend(results.into_iter().map(|(result, count)| match result {
            Result::Answered => format!("{count} answered"),
            Result::Exception(code) => format!("{count} refused by {code:02X}h"),
            Result::Silence => format!("{count} not answered"),
        }));
        words.push(format!("{} by the exchange of another", self.joined()));
        words.extend(ended.into_iter().map(|(why, count)| format!("{count} put out ({})", why.name())));
        words.join(", ")
    }

    pub(super) fn join(&self) {
        self.joined.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn joined(&self) -> u64 {
        self.joined.load(Ordering::Relaxed)
    }

    /// Counts the end of a connection, and says how many ended so.
    pub(super) fn end(&self, why: Ended) -> u64 {
        let mut counts = self.lock();
        let count = counts.ended.entry(why).or_default();
        *count += 1;
        *count
    }

    pub(super) fn answer(&self, function: u8, result: Result, took: Duration) {
        let mut counts = self.lock();
        let (count, together) = counts.requests.entry((function, result)).or_default();
        *count += 1;
        *together += took;
    }

    /// Counts a write that is refused, and says how many were refused so.
    pub(super) fn refuse(&self, code: u8) -> u64 {
        let mut counts = self.lock();
        let count = counts.refused_writes.entry(code).or_default();
        *count += 1;
        *count
    }

    /// What was counted by kind so far.
    pub(crate) fn counts(&self) -> Counts {
        self.lock().clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Counts> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
