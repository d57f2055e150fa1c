//! Until when an order may be sent.

use std::time::Duration;

use drive_core::{Class, later};
use tokio::time::Instant;

/// How much longer than its lifetime what a start has to write behind its first word may take, where whoever gave it has said no time: a
/// drive that takes 100 ms for an answer is asked some twenty times before its motor turns.
const FURTHER: Duration = Duration::from_secs(2);

/// When an order is never sent any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Expiry {
    /// Where nothing of it has been sent.
    begun: Instant,
    /// Whatever of it has been.
    sent: Instant,
}

impl Expiry {
    /// Of an order that was given then, by the settings of its drive.
    pub(crate) fn since(given: Instant, lifetime: Duration) -> Self {
        let begun = later(given, lifetime);
        Self { begun, sent: later(begun, FURTHER) }
    }

    /// Where somebody has said when.
    pub(crate) const fn at(time: Instant) -> Self {
        Self { begun: time, sent: time }
    }

    pub(super) const fn of(self, has_begun: bool) -> Instant {
        if has_begun { self.sent } else { self.begun }
    }

    /// What is left of it. Only a start goes on: what is one write is sent in its time or never.
    pub(super) fn left(self, now: Instant, is_start: bool, has_begun: bool) -> Lifetime {
        let left = |until: Instant| Some(until.saturating_duration_since(now));
        let all = if is_start { self.sent } else { self.begun };
        Lifetime { call: left(self.of(has_begun)), all: left(all), ..Lifetime::default() }
    }
}

/// How long what a job asks may take; `None`: as long as it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Lifetime {
    /// Each of its calls, until it is sent.
    pub(crate) call: Option<Duration>,
    /// All of its calls together, until the last is.
    pub(crate) all: Option<Duration>,
    /// Of what waits for what it tells, where something does.
    pub(crate) asked_as: Option<Class>,
}

impl Lifetime {
    /// It waits for as long as a stop does.
    pub(super) const FOR_A_STOP: Self = Self { call: None, all: None, asked_as: Some(Class::Stop) };
    /// An order waits for what it tells.
    pub(super) const FOR_AN_ORDER: Self = Self { call: None, all: None, asked_as: Some(Class::Command) };

    /// A part of it is over already.
    pub(crate) fn without(self, time: Duration) -> Self {
        let less = |left: Option<Duration>| left.map(|left| left.saturating_sub(time));
        Self { call: less(self.call), all: less(self.all), ..self }
    }
}
