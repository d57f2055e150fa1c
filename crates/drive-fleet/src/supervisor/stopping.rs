//! Stops: sent at once, repeated until the drive shows standstill, an alarm when they cannot be confirmed.

use std::time::Duration;

use drive_core::{Capabilities, Error, ErrorKind, Result, State, Status, StopMode};
use tokio::time::Instant;

use super::{Asker, CallId, Job, Output, Supervisor};
use crate::{
    event::EventKind,
    outcome::{Outcome, Refused, Unconfirmed},
    snapshot::PendingStop,
};

/// The shortest and the longest pause between two attempts of a stop.
const REPEAT: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

/// What stands in for a mode that a drive, as it is set up, does not have, the first that it has: better another stop than
/// none.
const STAND_INS: [StopMode; 3] = [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel];

/// Longer than any exit: its own limit ends it.
const EXIT: Duration = Duration::from_secs(86_400);

/// A stop under way.
#[derive(Debug)]
pub(super) struct Stopping {
    mode: StopMode,
    /// The modes that the drive has turned out not to be set up for.
    lacking: Vec<StopMode>,
    since: Instant,
    attempts: u32,
    /// The drive has shown that no run command is in force.
    taken: bool,
    /// When it is sent next; `None` while the drive has taken it.
    next_try: Option<Instant>,
    pause: Duration,
    error: Option<Error>,
    /// When its lack of confirmation becomes an alarm; `None` when it has.
    alarm_at: Option<Instant>,
    waiters: Vec<Waiter>,
}

#[derive(Debug)]
struct Waiter {
    asker: Asker,
    asked: StopMode,
    until: Instant,
}

impl Stopping {
    pub(super) const fn pending(&self) -> PendingStop {
        PendingStop { mode: self.mode, since: self.since, attempts: self.attempts, taken: self.taken }
    }

    pub(super) fn wake_at(&self) -> Option<Instant> {
        self.alarm_at().into_iter().chain(self.next_try).min()
    }

    pub(super) fn alarm_at(&self) -> Option<Instant> {
        let waiters = self.waiters.iter().map(|waiter| waiter.until);
        waiters.chain(self.alarm_at).min()
    }
}

/// The mode that a family uses for a wish: itself, or else the ramp, or else the first that it has.
fn usable(capabilities: &Capabilities, asked: StopMode) -> StopMode {
    if capabilities.stop_modes.contains(&asked) {
        return asked;
    }
    let ramp = capabilities.stop_modes.contains(&StopMode::Ramp).then_some(StopMode::Ramp);
    ramp.or_else(|| capabilities.stop_modes.first().copied()).unwrap_or(asked)
}

impl Supervisor {
    /// Somebody wants the drive stopped, `anyhow` if a stop in another mode that is under way does as well. Gives whether
    /// the job in flight has to be dropped for it.
    pub(crate) fn handle_stop(
        &mut self,
        now: Instant,
        asker: Asker,
        mode: StopMode,
        anyhow: bool,
        patience: Option<Duration>,
    ) -> bool {
        if !self.settings.control {
            self.conclude(asker, drive_core::Command::Stop(mode), Outcome::Refused(Refused::ReadOnly));
            return false;
        }
        let mode = self.stopping.as_ref().filter(|_| anyhow).map_or(mode, |stopping| stopping.mode);
        self.begin_stop(now, asker, mode, patience.unwrap_or(self.settings.times.stop_alarm));
        match self.in_flight {
            Some(Job::Stop(mode)) => self.stopping.as_ref().is_some_and(|stopping| stopping.mode != mode),
            Some(_) => true,
            None => false,
        }
    }

    /// Stops for a policy. A stop that is under way keeps its mode: whoever asked for it may have wanted it faster than
    /// the settings do.
    pub(super) fn stop_by_policy(&mut self, now: Instant, asker: Asker, mode: StopMode) {
        let mode = self.stopping.as_ref().map_or(mode, |stopping| stopping.mode);
        self.begin_stop(now, asker, mode, self.settings.times.stop_alarm);
    }

    pub(super) fn begin_stop(&mut self, now: Instant, asker: Asker, asked: StopMode, patience: Duration) {
        self.end_orders_by_stop();
        self.stops += 1;
        self.changed = true;
        let mode = usable(self.capabilities, asked);
        if mode != asked {
            self.emit(EventKind::StopModeReplaced { asked, used: mode });
        }
        // The exit has its own limit; until then the stop is repeated.
        let until = if asker == Asker::Exit { now + EXIT } else { now + patience };
        let waiter = Waiter { asker, asked, until };
        match &mut self.stopping {
            Some(stopping) => {
                if stopping.mode != mode {
                    stopping.mode = mode;
                    stopping.taken = false;
                }
                if !stopping.taken {
                    stopping.next_try = Some(now);
                    stopping.pause = REPEAT.0;
                }
                stopping.waiters.push(waiter);
            }
            None => {
                self.stopping = Some(Stopping {
                    mode,
                    lacking: Vec::new(),
                    since: now,
                    attempts: 0,
                    taken: false,
                    next_try: Some(now),
                    pause: REPEAT.0,
                    error: None,
                    alarm_at: Some(now + patience),
                    waiters: vec![waiter],
                });
            }
        }
    }

    /// A caller does not wait any more.
    pub(crate) fn forget_callers(&mut self, gone: impl Fn(CallId) -> bool) {
        if let Some(stopping) = &mut self.stopping {
            let is_gone = |asker: &Asker| matches!(asker, Asker::Caller { id, .. } if gone(*id));
            stopping.waiters.retain(|waiter| !is_gone(&waiter.asker));
        }
    }

    pub(super) fn stop_job(&mut self, now: Instant) -> Option<Job> {
        let stopping = self.stopping.as_mut()?;
        if stopping.next_try? > now {
            return None;
        }
        stopping.attempts = stopping.attempts.saturating_add(1);
        Some(Job::Stop(stopping.mode))
    }

    pub(super) fn handle_stopped(&mut self, now: Instant, result: Result<Status>) {
        let standstill = self.settings.times.standstill;
        let Some(stopping) = &mut self.stopping else { return };
        match result {
            Ok(status) => {
                stopping.next_try = None;
                stopping.error = None;
                stopping.pause = REPEAT.0;
                if !stopping.taken {
                    stopping.taken = true;
                    // From here the motor comes down by itself and needs its time.
                    stopping.alarm_at = Some(now + standstill);
                    for waiter in &mut stopping.waiters {
                        waiter.until = now + standstill;
                    }
                }
                self.accept_status(now, status);
            }
            Err(error) => {
                stopping.next_try = Some(now + stopping.pause);
                stopping.pause = (stopping.pause * 2).min(REPEAT.1);
                stopping.taken = false;
                let unsupported = error.kind() == ErrorKind::Unsupported;
                let status = match &error {
                    Error::NotConfirmed { status, .. } => Some(Status::clone(status)),
                    _ => None,
                };
                stopping.error = Some(error);
                if unsupported {
                    let asked = stopping.mode;
                    if !stopping.lacking.contains(&asked) {
                        stopping.lacking.push(asked);
                    }
                    let has = |mode: &StopMode| {
                        self.capabilities.stop_modes.contains(mode) && !stopping.lacking.contains(mode)
                    };
                    if let Some(used) = STAND_INS.into_iter().find(has) {
                        stopping.mode = used;
                        stopping.next_try = Some(now);
                        self.emit(EventKind::StopModeReplaced { asked, used });
                    }
                }
                if let Some(status) = status {
                    self.accept_status(now, status);
                }
            }
        }
    }

    /// What a new status says of a stop under way.
    pub(super) fn judge_stop(&mut self, now: Instant) {
        let Some(status) = self.status.as_ref().map(|status| &*status.value) else { return };
        let (stands, runs) = (status.is_standstill(), status.state == State::Running);
        let Some(stopping) = &mut self.stopping else { return };
        if stands && stopping.attempts > 0 {
            let Some(stopping) = self.stopping.take() else { return };
            self.given = None;
            for waiter in stopping.waiters {
                self.conclude(waiter.asker, drive_core::Command::Stop(waiter.asked), Outcome::Confirmed);
            }
            self.emit(EventKind::StopConfirmed);
        } else if runs && stopping.taken {
            stopping.taken = false;
            stopping.next_try = Some(now);
        }
    }

    pub(super) fn check_stop_times(&mut self, now: Instant) {
        let status = self.status.as_ref().map(|status| status.value.clone());
        let Some(stopping) = &mut self.stopping else { return };
        let alarm = stopping.alarm_at.is_some_and(|at| at <= now);
        let since = now.saturating_duration_since(stopping.since);
        let (attempts, error) = (stopping.attempts, stopping.error.clone());
        if alarm {
            stopping.alarm_at = None;
        }
        if alarm && stopping.taken && stopping.mode == StopMode::DcInjection {
            // Some drives inject for as long as they are told to; their ramp ends it.
            stopping.mode = StopMode::Ramp;
            stopping.taken = false;
            stopping.next_try = Some(now);
        }
        let (over, waiting): (Vec<_>, Vec<_>) =
            stopping.waiters.drain(..).partition(|waiter| waiter.until <= now);
        stopping.waiters = waiting;
        if alarm {
            self.emit(EventKind::StopUnconfirmed { since, attempts, error: error.clone() });
        }
        for waiter in over {
            let outcome = match &error {
                Some(error) if !matches!(error, Error::NotConfirmed { .. }) => {
                    Outcome::OutcomeUnknown(error.clone())
                }
                _ => Outcome::NotConfirmed(Unconfirmed::TimeOver { after: since, status: status.clone() }),
            };
            self.conclude(waiter.asker, drive_core::Command::Stop(waiter.asked), outcome);
        }
    }

    /// Tells everybody how a command ended, and its caller first.
    pub(super) fn conclude(&mut self, asker: Asker, command: drive_core::Command, outcome: Outcome) {
        let commander = asker.name();
        match asker {
            Asker::Caller { id, .. } => self.outputs.push_back(Output::Answer(id, outcome.clone())),
            Asker::Policy(_) => {}
            Asker::Exit => self.exit_concluded(&outcome),
        }
        self.emit(EventKind::Command { command, commander, outcome });
    }
}
