//! Whether a motor that is driven comes to its setpoint: a drive may count by another full scale than its owner says, and hold a
//! motor below it by a limit that nobody knows of, by its current, or by a direction that it does not turn in.

use std::time::Duration;

use drive_core::{CONFIRMED_WITHIN, Frequency, Measurements, Motion, Setpoint, Status};
use tokio::time::Instant;

use crate::snapshot::{OffSetpoint, Timed};

/// How long an output has to stay where it is. With [`STEADY`] the slowest ramp that is not taken for none takes 4000 s from 50 Hz.
const STAYS_FOR: Duration = Duration::from_secs(20);
const STEADY: Frequency = Frequency::from_centihertz(25);

/// By how much an output that is above its setpoint has to rise, to be one that goes away from it.
const RISES: Frequency = Frequency::from_centihertz(50);

/// What is seen of an output that is not at its setpoint.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// Since when the drive says all the same that it is at its reference.
    said_since: Option<Instant>,
    /// The lowest and the highest output since it stays where it is, and since when.
    stays: Option<(Frequency, Frequency, Instant)>,
    /// The lowest and the highest output since it is above its setpoint and does not come down, and since when it rises.
    above: Option<(Frequency, Frequency, Option<Instant>)>,
    off: Option<OffSetpoint>,
    /// The reference that the drive was measured to follow, and the output then.
    measured: Option<(Frequency, Frequency)>,
}

impl Watch {
    /// By the next status, and by the setpoint that the drive has confirmed before it. Where nobody knows what was `given`, as behind a
    /// lost line and a restart of the program, the drive's own reference is what a motor has to come to that runs by a command of this side
    /// (`ours`).
    pub(super) fn see(&mut self, now: Instant, given: Option<Setpoint>, ours: bool, status: &Status) {
        let is_given = given.is_some();
        let own = || self.own_reference(status).filter(|_| ours).map(Setpoint::Frequency);
        let off = OffSetpoint::of(given.or_else(own), is_given, status);
        let Some(off) = off.filter(|_| status.motion == Motion::Driven) else { return self.come_to() };
        let says_so = status.at_reference == Some(true);
        self.said_since = says_so.then(|| self.said_since.unwrap_or(now));
        let (low, high, since) = self.stays.unwrap_or((off.output, off.output, now));
        let (low, high) = (low.min(off.output), high.max(off.output));
        let is_steady = high.centihertz().abs_diff(low.centihertz()) <= STEADY.centihertz();
        let stays = if is_steady { (low, high, since) } else { (off.output, off.output, now) };
        self.stays = Some(stays);
        self.above = (off.output > off.setpoint).then(|| {
            let (low, high, since) = self.above.unwrap_or((off.output, off.output, None));
            let (low, high) = (low.min(off.output), high.max(off.output));
            let rises = off.output.saturating_sub(low) > RISES;
            match high.saturating_sub(off.output) > RISES {
                true => (off.output, off.output, None),
                false => (low, high, rises.then(|| since.unwrap_or(now))),
            }
        });
        let lasts = |since: Option<Instant>, time| {
            since.is_some_and(|since| now.saturating_duration_since(since) >= time)
        };
        let rises_since = self.above.and_then(|(.., since)| since);
        let is_off = lasts(self.said_since, CONFIRMED_WITHIN)
            || lasts(rises_since, CONFIRMED_WITHIN)
            || lasts(Some(stays.2), STAYS_FOR);
        self.off = is_off.then_some(off);
    }

    /// The reference that the drive tells with its status; else as it was measured, for as long as the motor has not left the output of
    /// then: another may have been given since.
    fn own_reference(&self, status: &Status) -> Option<Frequency> {
        let stays = |output: Frequency, then: Frequency| {
            output.centihertz().abs_diff(then.centihertz()) <= STEADY.centihertz()
        };
        let measured = || {
            let (reference, then) = self.measured?;
            status.output_frequency.is_some_and(|output| stays(output, then)).then_some(reference)
        };
        status.reference.or_else(measured)
    }

    /// What the drive was measured to follow, at the output that its status before has told.
    pub(super) fn measure(&mut self, measurements: &Measurements, status: Option<&Timed<Status>>) {
        let output = status.and_then(|status| status.value.output_frequency);
        self.measured = match measurements.reference {
            Some(Setpoint::Frequency(reference)) => output.map(|output| (reference, output)),
            _ => None,
        };
    }

    /// It is there, or is not asked to be.
    fn come_to(&mut self) {
        *self = Self { measured: self.measured, ..Self::default() };
    }

    /// What was seen tells nothing any more.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    pub(super) const fn off(&self) -> Option<OffSetpoint> {
        self.off
    }
}
