//! The heat of a motor's windings.

use std::time::Duration;

use super::ramp::nanos;

/// A first-order picture of the windings' heat, in steps of one second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heat {
    /// Thermal state in [`Heat::PERCENT`] of a percent.
    state: i64,
    /// Current squared times nanoseconds in the second that is not yet over, and how much of it is.
    squares: i128,
    part: Duration,
}

impl Heat {
    pub(super) const COLD: Self = Self { state: 0, squares: 0, part: Duration::ZERO };

    const PERCENT: i64 = 1_000_000;
    const STEP: Duration = Duration::from_secs(1);

    pub(super) fn take(&mut self, current: i64, mut time: Duration, constant: Duration) {
        let square = current * current;
        let steps = i64::try_from(constant.as_secs()).unwrap_or(i64::MAX).max(1);
        let rest = Self::STEP - self.part;
        if time < rest {
            self.squares += i128::from(square) * nanos(time);
            self.part += time;
            return;
        }
        let mean = (self.squares + i128::from(square) * nanos(rest)) / nanos(Self::STEP);
        self.step(i64::try_from(mean).unwrap_or(0), steps);
        time -= rest;
        // After ten time constants the heat is where it ends.
        for _ in 0..time.as_secs().min(steps.unsigned_abs().saturating_mul(10).min(100_000)) {
            self.step(square, steps);
        }
        self.part = Duration::from_nanos(u64::from(time.subsec_nanos()));
        self.squares = i128::from(square) * nanos(self.part);
    }

    /// In whole percent.
    pub(super) fn percent(self) -> u16 {
        u16::try_from(self.state / Self::PERCENT).unwrap_or(u16::MAX)
    }

    fn step(&mut self, square: i64, steps: i64) {
        let end = square.saturating_mul(Self::PERCENT) / 100;
        self.state += (end - self.state) / steps;
    }
}
