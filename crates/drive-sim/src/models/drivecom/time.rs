//! What happens by itself when time passes.

use std::time::Duration;

use super::{ChartState, Drivecom, LinkWatch, faults::Attempts, orders::Order};

/// After this time the injection current is lowered (BBV51701 p. 40).
const FULL_INJECTION: Duration = Duration::from_secs(5);

/// Where the brake of a hoist is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Brake {
    /// It holds.
    #[default]
    Engaged,
    /// It is being released, for so long.
    Releasing(Duration),
    /// It lets the motor turn.
    Released,
}

/// What is being waited for.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Timers {
    /// Until an injection that is held by a level is lowered.
    injection: Option<Duration>,
    /// Whether the motor came to rest, or will, along a ramp.
    pub(super) ramped: bool,
    /// The current at standstill that flows, from 1; 0: none.
    pub(super) held: usize,
    /// Until the motor has run at low speed for too long.
    low_speed: Option<Duration>,
    /// Whether it was stopped for that, and waits for a greater reference.
    pub(super) is_asleep: bool,
    /// The brake, of a drive that has one to release.
    pub(super) brake: Brake,
    /// The automatic restart that is under way.
    pub(super) attempts: Option<Attempts>,
    /// Whether one was given up: nothing resets the fault before the supply was off.
    pub(super) gave_up: bool,
}

impl Timers {
    /// Something else was ordered.
    pub(super) const fn forget(&mut self) {
        (self.injection, self.ramped, self.held, self.low_speed) = (None, false, 0, None);
    }

    pub(super) const fn begin_injection(&mut self) {
        self.injection = Some(FULL_INJECTION);
    }
}

impl Drivecom {
    /// Lets time pass. What happens within it happens at its own moment.
    pub fn advance(&mut self, elapsed: Duration) {
        let mut left = elapsed;
        loop {
            let piece = self.until_event().map_or(left, |event| event.min(left));
            self.pass(piece);
            left -= piece;
            if left.is_zero() {
                return;
            }
        }
    }

    /// The time until something happens by itself; never zero.
    fn until_event(&self) -> Option<Duration> {
        let timers = &self.timers;
        let waited = [
            self.watchdog.remaining(),
            timers.injection,
            timers.low_speed,
            if let Brake::Releasing(left) = timers.brake { Some(left) } else { None },
            timers.attempts.map(|attempts| attempts.next),
            self.motor.until_change(),
        ];
        waited.into_iter().flatten().filter(|time| !time.is_zero()).min()
    }

    /// Lets a time pass in which nothing happens before its end.
    fn pass(&mut self, time: Duration) {
        self.motor.advance(time);
        if self.watchdog.advance(time) && self.present_fault().is_none() {
            let LinkWatch { code, reaction, .. } = self.settings.link;
            // Nothing but a frame takes the cause away.
            self.trip(code, reaction, true);
        }
        for waited in [&mut self.timers.injection, &mut self.timers.low_speed].into_iter().flatten() {
            *waited = waited.saturating_sub(time);
        }
        if let Brake::Releasing(left) = &mut self.timers.brake {
            *left = left.saturating_sub(time);
        }
        if self.timers.injection == Some(Duration::ZERO) {
            self.timers.injection = None;
            let lowered = self.settings.injection_current.min(self.settings.injection_limit);
            self.motor.brake(lowered, None);
        }
        if let Some(attempts) = &mut self.timers.attempts {
            attempts.pass(time);
            let attempts = *attempts;
            if attempts.next.is_zero() {
                self.attempt_restart(attempts);
            }
        }
        self.settle();
    }

    /// Follows what has happened by itself at this moment.
    pub(super) fn settle(&mut self) {
        if self.state == ChartState::FaultReactionActive && !self.motor.is_fed() {
            self.state = ChartState::Fault;
        }
        self.hold_at_standstill();
        self.watch_low_speed();
        self.watch_brake();
    }

    /// A run command releases the brake first, and the motor turns once it is (brt, BBV51701 p. 47).
    fn watch_brake(&mut self) {
        let (runs, turns) = (self.is_told_to_run(), self.motor.is_fed());
        let next = match self.timers.brake {
            _ if !runs && !turns => Brake::Engaged,
            Brake::Engaged if runs && !turns => Brake::Releasing(self.settings.brake_release),
            Brake::Engaged | Brake::Releasing(Duration::ZERO) => Brake::Released,
            stays => stays,
        };
        let is_released = next == Brake::Released && self.timers.brake != next;
        self.timers.brake = next;
        if is_released {
            self.obey();
        }
    }

    /// After a time at low speed the motor is stopped; a greater reference runs it again, as long as the run command
    /// stands (BBV51701 p. 28).
    fn watch_low_speed(&mut self) {
        let above = self.situation.reference.unsigned_abs() > self.settings.low_speed;
        if self.timers.is_asleep {
            if above || !self.is_told_to_run() {
                self.timers.is_asleep = false;
                self.obey();
            }
            return;
        }
        let is_slow = self.order == Order::Run && !above && self.motor.is_at_target();
        let Some(limit) = self.settings.low_speed_time.filter(|_| is_slow) else {
            self.timers.low_speed = None;
            return;
        };
        let left = *self.timers.low_speed.get_or_insert(limit);
        if left.is_zero() {
            self.timers.is_asleep = true;
            self.obey();
        }
    }
}
