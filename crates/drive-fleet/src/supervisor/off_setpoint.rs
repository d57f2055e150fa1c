//! Whether a motor that is driven comes to its setpoint: a drive may count by another full scale than its owner says, and hold a
//! motor below it by a limit that nobody knows of, by its current, or by a direction that it does not turn in.

use std::time::Duration;

use drive_core::{CONFIRMED_WITHIN, Frequency, Motion, Setpoint, Status};
use tokio::time::Instant;

use crate::snapshot::OffSetpoint;

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
}

impl Watch {
    /// By the next status, and by the setpoint that the drive has confirmed before it.
    pub(super) fn see(&mut self, now: Instant, setpoint: Option<Setpoint>, status: &Status) {
        let off = OffSetpoint::of(setpoint, status).filter(|_| status.motion == Motion::Driven);
        let Some(off) = off else { return self.forget() };
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

    /// What was seen tells nothing any more.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    pub(super) const fn off(&self) -> Option<OffSetpoint> {
        self.off
    }
}
