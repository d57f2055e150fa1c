//! Trips, their memory, and how they are reset.

use std::time::Duration;

use super::{ChartState, Commander, Drivecom, Reaction, orders::Order, words};

/// Faults that a drive remembers: the last and four past ones (LFt, DP1–DP4).
const REMEMBERED: usize = 5;

/// A fault as the drive remembers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PastFault {
    /// The family's code.
    pub code: u16,
    /// The state when it came, as the words EP1–EP4 show it (BBV51701 p. 25).
    pub status: u16,
}

/// The attempts of an automatic restart (BBV51701 p. 51).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Attempts {
    made: usize,
    /// Until the next one.
    pub(super) next: Duration,
    since_trip: Duration,
}

impl Attempts {
    /// The pauses before the first attempts; the last is the one before all others.
    const PAUSES: [Duration; 4] =
        [Duration::from_secs(1), Duration::from_secs(5), Duration::from_secs(10), Duration::from_secs(60)];
    const FIRST: Self = Self { made: 0, next: Self::PAUSES[0], since_trip: Duration::ZERO };

    /// The ones after an attempt that did not succeed.
    fn after_one(self) -> Self {
        let made = self.made + 1;
        let next = Self::PAUSES[made.min(Self::PAUSES.len() - 1)];
        Self { made, next, ..self }
    }

    pub(super) fn pass(&mut self, time: Duration) {
        self.next = self.next.saturating_sub(time);
        self.since_trip = self.since_trip.saturating_add(time);
    }
}

impl Drivecom {
    /// The drive trips and does what the fault asks on the way. While `cause_persists`, no reset clears it
    /// ([`cause_gone`](Self::cause_gone)).
    pub fn trip(&mut self, code: u16, reaction: Reaction, cause_persists: bool) {
        if reaction == Reaction::Ignore {
            return;
        }
        let status = self.fault_status();
        self.faults.push_front(PastFault { code, status });
        self.faults.truncate(REMEMBERED);
        self.cause_persists = cause_persists;
        self.state = ChartState::FaultReactionActive;
        match reaction {
            Reaction::Ignore | Reaction::Freewheel => self.motor.freewheel(),
            Reaction::Ramp => self.ramp_down(self.settings.ramps.deceleration),
            Reaction::Fast => self.ramp_down(self.settings.fast_stop),
        }
        self.order = Order::Nothing;
        self.timers.forget();
        let restarts = self.settings.restarts.filter(|restarts| restarts.after.contains(&code));
        self.timers.attempts = restarts.map(|_| Attempts::FIRST);
        self.settle();
    }

    /// The cause of the present fault is gone.
    pub const fn cause_gone(&mut self) {
        self.cause_persists = false;
    }

    /// Resets the fault, if its cause is gone; whether it did. A run command of the terminals that stands runs again
    /// where it counts by its level (BBV51701 p. 52).
    pub fn reset(&mut self) -> bool {
        let resets = self.is_resettable();
        if resets {
            self.state = ChartState::SwitchOnDisabled;
            self.timers.attempts = None;
            self.spent = self.situation.run.is_some() && !self.settings.runs_by_level;
            self.follow();
        }
        resets
    }

    /// The code of the fault that is present.
    #[must_use]
    pub fn present_fault(&self) -> Option<u16> {
        let present = matches!(self.state, ChartState::Fault | ChartState::FaultReactionActive);
        self.faults.front().filter(|_| present).map(|fault| fault.code)
    }

    /// The remembered faults, the latest first.
    pub fn faults(&self) -> impl Iterator<Item = PastFault> {
        self.faults.iter().copied()
    }

    /// Whether an automatic restart is under way.
    #[must_use]
    pub const fn is_restarting(&self) -> bool {
        self.timers.attempts.is_some()
    }

    pub(super) const fn is_resettable(&self) -> bool {
        matches!(self.state, ChartState::Fault) && !self.cause_persists && !self.timers.gave_up
    }

    /// An attempt of the automatic restart is due. A drive that gives up stays locked until its supply was off.
    pub(super) fn attempt_restart(&mut self, attempts: Attempts) {
        let limit = self.settings.restarts.map(|restarts| restarts.limit);
        let gives_up = limit.is_none_or(|limit| limit.is_some_and(|limit| attempts.since_trip >= limit));
        if gives_up {
            (self.timers.attempts, self.timers.gave_up) = (None, true);
        } else if !self.reset() {
            self.timers.attempts = Some(attempts.after_one());
        } else if self.situation.commander == Commander::Bus && !self.readings.restart_locks {
            self.state = words::next(ChartState::OperationEnabled, self.word.unwrap_or(0));
            self.follow();
        }
    }
}
