//! What a gateway counts.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use drive_bus::stats::Spread;

use drived_plant::counts::{Id, Samples};

/// Why a connection was turned away or ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ended {
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
    pub const fn name(self) -> &'static str {
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
pub enum Result {
    /// As asked.
    Answered,
    /// By an exception of this code.
    Exception(u8),
    /// Not at all, because the slave did not answer and the gateway is told to be silent then.
    Silence,
}

/// A function that clients make up is none of ours: 0.
fn named(function: u8) -> u8 {
    if [0x03, 0x04, 0x06, 0x08, 0x10, 0x2B].contains(&function) { function } else { 0 }
}

/// The counters of one gateway.
#[derive(Debug, Default)]
pub struct Counters {
    clients: AtomicU64,
    /// Reads that were answered by the exchange of an equal one.
    joined: AtomicU64,
    /// Reads that were answered by what was kept.
    kept: AtomicU64,
    counts: Mutex<Counts>,
}

/// What is counted by kind.
#[derive(Debug, Clone, Default)]
pub struct Counts {
    pub ended: BTreeMap<Ended, u64>,
    /// By function code and result.
    pub requests: BTreeMap<(u8, Result), u64>,
    /// How long they took.
    pub took: Spread,
    /// Writes that were refused, by exception.
    pub refused_writes: BTreeMap<u8, u64>,
}

/// A client that is connected.
#[derive(Debug)]
pub(super) struct Present(Arc<Counters>);

impl Drop for Present {
    fn drop(&mut self) {
        self.0.clients.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Counters {
    /// Counts a client, however its task ends, until what this gives is dropped.
    pub(super) fn enter(self: &Arc<Self>) -> Present {
        self.clients.fetch_add(1, Ordering::Relaxed);
        Present(Arc::clone(self))
    }

    /// How many are connected.
    pub fn clients(&self) -> u64 {
        self.clients.load(Ordering::Relaxed)
    }

    /// Everything in a sentence.
    pub fn in_words(&self) -> String {
        let Counts { ended, requests, .. } = self.counts();
        let mut words = vec![format!("{} connected", self.clients())];
        let mut results: BTreeMap<Result, u64> = BTreeMap::new();
        for ((_, result), count) in requests {
            *results.entry(result).or_default() += count;
        }
        words.extend(results.into_iter().map(|(result, count)| match result {
            Result::Answered => format!("{count} answered"),
            Result::Exception(code) => format!("{count} refused by {code:02X}h"),
            Result::Silence => format!("{count} not answered"),
        }));
        words.push(format!(
            "{} by the exchange of another, {} from what was kept",
            self.joined(),
            self.kept()
        ));
        words.extend(ended.into_iter().map(|(why, count)| format!("{count} put out ({})", why.name())));
        words.join(", ")
    }

    pub(super) fn join(&self) {
        self.joined.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn keep(&self) {
        self.kept.fetch_add(1, Ordering::Relaxed);
    }

    pub fn kept(&self) -> u64 {
        self.kept.load(Ordering::Relaxed)
    }

    pub fn joined(&self) -> u64 {
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
        *counts.requests.entry((named(function), result)).or_default() += 1;
        counts.took.record(took);
    }

    /// Counts a write that is refused, and says how many were refused so.
    pub(super) fn refuse(&self, code: u8) -> u64 {
        let mut counts = self.lock();
        let count = counts.refused_writes.entry(code).or_default();
        *count += 1;
        *count
    }

    /// What was counted by kind so far.
    pub fn counts(&self) -> Counts {
        self.lock().clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Counts> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds what was counted to a scrape, under the gateway's name.
    pub(super) fn collect(&self, name: &str, samples: &mut Samples) {
        samples.count(Id::GatewayClients, &[name], self.clients());
        samples.count(Id::GatewaySaved, &[name, "joined"], self.joined());
        samples.count(Id::GatewaySaved, &[name, "kept"], self.kept());
        let Counts { ended, requests, took, refused_writes } = self.counts();
        for ((function, result), count) in requests {
            let function = if function == 0 { "other".to_owned() } else { format!("{function:02X}h") };
            let result = match result {
                Result::Answered => "answered".to_owned(),
                Result::Exception(code) => format!("exception_{code:02X}h"),
                Result::Silence => "silence".to_owned(),
            };
            samples.count(Id::GatewayRequests, &[name, &function, &result], count);
        }
        samples.add_histogram(Id::GatewayDuration, &[name], took.up_to(), took.sum().as_secs_f64());
        for (code, count) in refused_writes {
            samples.count(Id::GatewayRefused, &[name, &format!("{code:02X}h")], count);
        }
        for (why, count) in ended {
            samples.count(Id::GatewayEnded, &[name, why.name()], count);
        }
    }
}
