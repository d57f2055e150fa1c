//! How the simulated Altivar 21 starts up, trips and is reset (§6.4, §8.2, §8.3, §8.7).

use std::time::Duration;

use drive_atv21::{ROWS, registers::address as at};
use drive_core::registers::Storage;

use super::{Atv21, EMERGENCY, TIME_OUT, UNDERVOLTAGE, control::BRAKING_CURRENT};

/// How long the reaction by DC injection brakes.
const TRIP_BRAKING: Duration = Duration::from_secs(1);
/// How long a drive that tries again waits.
const RETRY: Duration = Duration::from_secs(1);
/// The alarms of FC91 for a power circuit without voltage (§8.7 p. 36).
const MAIN_UNDERVOLTAGE: u16 = 1 << 5 | 1 << 13;
/// The history, the latest first.
const HISTORY: [u16; 4] = [at::PAST_FAULT_1, at::PAST_FAULT_2, at::PAST_FAULT_3, at::PAST_FAULT_4];

impl Atv21 {
    /// What happens at power-up and when a trip was reset: the control registers fall back to 0 (§8.2), the block
    /// configuration and the protocol settings take effect, and the drive is mute for a time.
    pub(super) fn start_up(&mut self, duration: Duration) {
        for row in ROWS.iter().filter(|row| row.storage == Storage::Volatile && row.access.is_writable()) {
            self.bank.set(row.address, 0);
        }
        let slots = [at::READ_SLOT_1, at::READ_SLOT_2, at::READ_SLOT_3, at::READ_SLOT_4, at::READ_SLOT_5];
        self.read_slots = slots.map(|slot| self.bank.value(slot));
        self.write_slots = [at::WRITE_SLOT_1, at::WRITE_SLOT_2].map(|slot| self.bank.value(slot));
        (self.trip, self.retry) = (None, None);
        (self.heeds, self.keypad_runs) = (true, false);
        self.stale = if self.readings.closed_inputs_wait { self.bank.value(at::LOGIC_INPUTS) } else { 0 };
        self.starting = duration;
        self.watchdog.rest();
        self.set_time_out();
    }

    pub(super) fn set_time_out(&mut self) {
        let seconds = self.bank.value(at::TIME_OUT);
        self.watchdog.set_timeout((seconds > 0).then(|| Duration::from_secs(seconds.into())));
    }

    pub(super) fn trip_with(&mut self, code: u16) {
        if self.trip.is_some() {
            return;
        }
        let reaction = self.bank.value(at::TIME_OUT_REACTION);
        if code == TIME_OUT && reaction == 4 && self.readings.factory_reaction_runs_on {
            return;
        }
        self.freeze();
        let past = HISTORY.map(|address| self.bank.value(address));
        for (address, code) in HISTORY.into_iter().zip([code].into_iter().chain(past)) {
            self.bank.set(address, code);
        }
        self.trip = Some(code);
        self.retry = (self.readings.retries && code != EMERGENCY).then_some(RETRY);
        match (code, reaction) {
            (TIME_OUT, 1) => self.motor.ramp_to_rest(self.ramps().deceleration),
            (TIME_OUT, 2) => self.motor.brake(BRAKING_CURRENT, Some(TRIP_BRAKING)),
            _ => self.motor.freewheel(),
        }
    }

    /// A fault is cleared by a restart of the drive.
    pub(super) fn reset(&mut self) {
        if self.trip.is_some() {
            self.motor.freewheel();
            self.start_up(self.restart);
        }
    }

    /// The supply of the power circuit comes or goes.
    pub(super) fn supply(&mut self, on: bool) {
        self.supplied = on;
        if !on && self.readings.undervoltage_trips && self.motor.is_fed() {
            self.trip_with(UNDERVOLTAGE);
        }
    }

    /// FC91.
    pub(super) fn alarms(&self) -> u16 {
        let without = if self.supplied { 0 } else { MAIN_UNDERVOLTAGE };
        self.bank.value(at::ALARM_CODE) | without
    }

    /// MOFF.
    pub(super) fn lacks_supply(&self) -> bool {
        self.alarms() & MAIN_UNDERVOLTAGE != 0
    }

    /// The time until something happens by itself.
    pub(super) fn until_change(&self) -> Option<Duration> {
        let starting = (!self.starting.is_zero()).then_some(self.starting);
        [self.watchdog.remaining(), starting, self.retry].into_iter().flatten().min()
    }

    /// Lets time pass up to [`until_change`](Self::until_change).
    pub(super) fn step(&mut self, piece: Duration) {
        self.motor.advance(piece);
        self.powered_for = self.powered_for.saturating_add(piece);
        let starting = self.starting.saturating_sub(piece);
        let has_started = starting.is_zero() && !self.starting.is_zero();
        self.starting = starting;
        if self.watchdog.advance(piece) {
            self.trip_with(TIME_OUT);
        }
        let retry = self.retry.map(|left| left.saturating_sub(piece));
        self.retry = retry.filter(|left| !left.is_zero());
        if retry.is_some_and(|left| left.is_zero()) {
            self.trip = None;
            self.obey();
        }
        if has_started {
            self.obey();
        }
    }
}
