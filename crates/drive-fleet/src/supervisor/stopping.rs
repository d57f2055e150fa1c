//! Stops: sent at once, repeated until the drive shows standstill, an alarm when they cannot be confirmed. Here: the stop that is under way,
//! how far the drive is with it, how long it may take, and who waits for it.

mod asked;
mod sent;
mod standstill;
mod unconfirmed;

use std::time::Duration;

use drive_core::{Error, ErrorKind, Frequency, Motion, Refusal, Status, StopMode};
use tokio::time::Instant;

use super::{Asker, shown::who_runs};
use crate::{outcome::StopModes, settings::Times, snapshot::PendingStop, stop_order::StopOrder};

/// The shortest and the longest pause between two attempts of a stop.
pub(super) const REPEAT: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

/// By how much the output has to come down to count as coming down, and how long it may not before it hangs: the slowest ramp of all
/// families, 3200 s from 50 Hz, takes it in 6.4 s.
const PROGRESS: Frequency = Frequency::from_centihertz(10);
const HANGS: Duration = Duration::from_secs(10);

/// Whether its driver does not send it at all.
const fn is_refused(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Refused | ErrorKind::Unsupported)
}

/// A stop under way.
#[derive(Debug)]
pub(super) struct Stopping {
    /// The hardest mode that was asked for.
    asked: StopMode,
    /// The mode that is sent.
    mode: StopMode,
    /// The mode by which the drive says that it stops; that which is sent until it has said so.
    used: StopMode,
    /// By which the drive has said that it stops, and why by another than was asked for.
    shown: Option<(StopMode, Option<&'static str>)>,
    /// For how long direct current is to be held, where somebody has said so.
    injection: Option<Duration>,
    /// For how long the drive's driver has said that it is.
    injects_for: Option<Duration>,
    since: Instant,
    /// When it was asked for last: a status that was read before says nothing of that.
    asked_at: Instant,
    /// Attempts that have ended.
    attempts: u32,
    /// Attempts that have begun.
    begun: u32,
    /// Whose act it is, the last.
    asker: Asker,
    /// Somebody has asked for it who knew that another drive stands there: it is that one which is to stop.
    of_another: bool,
    /// The drive has shown that no run command is in force.
    taken: bool,
    /// It had, before it was not heard or its line was lost: what it shows first decides.
    was_taken: bool,
    /// Since when the drive injects for it.
    injects_since: Option<Instant>,
    /// The lowest output since it was given, and anew since it was taken.
    lowest: Option<Frequency>,
    /// When it is sent next; `None` while the drive has taken it.
    next_try: Option<Instant>,
    pause: Duration,
    error: Option<Error>,
    /// How often the motor ran again behind it.
    undone: u32,
    /// By whose run command it did, as far as the drive told.
    runs_by: Option<Refusal>,
    /// Until when the drive may be without it before that is an alarm.
    patient_until: Instant,
    /// When its lack of confirmation becomes an alarm; `None` when it has.
    alarm_at: Option<Instant>,
    waiters: Vec<Waiter>,
}

#[derive(Debug)]
struct Waiter {
    asker: Asker,
    asked: StopOrder,
    /// When.
    asked_at: Instant,
    until: Instant,
    /// It has heard that no run command is in force any more.
    is_told: bool,
}

impl Stopping {
    /// How a stop was asked for, and how the drive stops.
    fn modes(&self, order: StopOrder) -> StopModes {
        let asked = order.mode;
        let used = self.shown.map(|(used, _)| used);
        let why = self.shown.and_then(|(_, why)| why).filter(|_| used != Some(asked));
        let (injection_asked, injection_used) = (order.injects_for(), self.injects_for);
        StopModes { asked, used, why, injection_asked, injection_used }
    }

    pub(super) const fn pending(&self) -> PendingStop {
        PendingStop {
            mode: self.used,
            since: self.since,
            attempts: self.begun,
            // What is asked for again has yet to be taken.
            taken: self.taken && self.next_try.is_none(),
            alarm: self.alarm_at.is_none(),
            undone: self.undone,
        }
    }

    /// The motor stands, or nearly: what still acts is ended along the ramp.
    fn go_on_by_ramp(&mut self, now: Instant) {
        (self.mode, self.used) = (StopMode::Ramp, StopMode::Ramp);
        self.taken = false;
        self.next_try = Some(now);
    }

    /// The drive shows that no run command is in force: from here the motor comes down by itself and needs its time, which counts
    /// from when the stop was given, however often it is taken.
    fn takes(&mut self, now: Instant, standstill: Duration) {
        self.taken = true;
        self.lowest = None;
        self.alarm_at = self.alarm_at.map(|at| at.max(self.since + standstill));
        for waiter in &mut self.waiters {
            waiter.until = match waiter.asker.is_exit() {
                true => waiter.until.min(now + standstill),
                false => waiter.until.max(waiter.asked_at + standstill),
            };
        }
    }

    /// Nobody has seen whether it acts still.
    pub(super) const fn doubt(&mut self) {
        self.was_taken |= std::mem::replace(&mut self.taken, false);
    }

    /// What the drive shows first behind a time in which nobody saw it. A motor that is driven may be on its ramp still, where its words do not
    /// tell a stop from a run: the stop is given anew, and nobody is blamed but where the output has risen, which no ramp down does.
    fn see_again(&mut self, now: Instant, status: &Status, standstill: Duration) {
        if !std::mem::replace(&mut self.was_taken, false) || self.taken {
            return;
        }
        let hundredths = |output: Frequency| output.centihertz();
        let rises = |(lowest, output)| hundredths(output) > hundredths(lowest) + hundredths(PROGRESS);
        match status.motion {
            Motion::Driven if self.lowest.zip(status.output_frequency).is_some_and(rises) => {
                self.is_undone(now, status, standstill);
            }
            Motion::Driven => self.next_try = Some(now),
            _ => self.taken = true,
        }
    }

    /// A run command has come behind it, kept back on its way or from somebody else: it is written again at once, and has no more time
    /// than from when it was given, whatever its ramp had gained.
    fn is_undone(&mut self, now: Instant, status: &Status, standstill: Duration) {
        self.taken = false;
        (self.undone, self.runs_by) = (self.undone.saturating_add(1), who_runs(status));
        self.next_try = Some(now);
        self.alarm_at = self.alarm_at.map(|at| at.min(self.patient_until));
        for waiter in self.waiters.iter_mut().filter(|waiter| !waiter.asker.is_exit()) {
            waiter.until = waiter.until.min(waiter.asked_at + standstill);
        }
    }

    /// The motor comes down by itself. As long as it does, its time begins anew: a long ramp is no alarm, a ramp that hangs is. Not
    /// behind a stop that was undone: what sinks between two run commands would have all the time that there is.
    fn comes_down(&mut self, now: Instant, output: Option<Frequency>, standstill: Duration) {
        let Some(output) = output.filter(|_| self.undone == 0) else { return };
        let Some(lowest) = self.lowest else {
            self.lowest = Some(output);
            self.alarm_at = self.alarm_at.map(|at| at.min(now + HANGS));
            return;
        };
        if output.centihertz() + PROGRESS.centihertz() <= lowest.centihertz() {
            self.lowest = Some(output);
            self.alarm_at = self.alarm_at.map(|_| now + standstill.min(HANGS));
            for waiter in &mut self.waiters {
                waiter.until = waiter.until.max(now + standstill);
            }
        }
    }

    /// The output sinks, and nothing tells whether by this stop or by a lower setpoint that was given before: it is waited for as long as
    /// it does, for that ends at the setpoint, and below it the motor obeys. Not where something is known to keep the stop from the motor,
    /// and for no longer than a stop has that was taken.
    fn sinks(&mut self, now: Instant, output: Option<Frequency>, times: &Times) {
        let is_denied = match &self.error {
            None | Some(Error::NotConfirmed { because: None, .. }) => false,
            Some(_) => true,
        };
        let Some(output) = output.filter(|_| !is_denied && self.undone == 0) else { return };
        let Some(lowest) = self.lowest else {
            self.lowest = Some(output);
            return;
        };
        if output.centihertz() + PROGRESS.centihertz() <= lowest.centihertz() {
            self.lowest = Some(output);
            let until = (now + times.stop_alarm).min(self.since + times.standstill);
            self.alarm_at = self.alarm_at.map(|at| at.max(until));
            for waiter in &mut self.waiters {
                waiter.until = waiter.until.max(until);
            }
        }
    }

    pub(super) fn wake_at(&self) -> Option<Instant> {
        self.alarm_at().into_iter().chain(self.next_try).min()
    }

    pub(super) fn alarm_at(&self) -> Option<Instant> {
        let waiters = self.waiters.iter().map(|waiter| waiter.until);
        waiters.chain(self.alarm_at).min()
    }

    /// Whether its time is not over yet, for whoever waits for it or until its lack of confirmation is an alarm.
    pub(super) fn has_time(&self) -> bool {
        self.alarm_at().is_some()
    }
}
