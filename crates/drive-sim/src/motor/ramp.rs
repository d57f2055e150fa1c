//! Ramps, and where a steered shaft is on them.

use std::time::Duration;

/// Micro-hertz in a hundredth of a hertz. The shaft is kept finer than any register shows it, so that many short
/// steps of time and one long step end at the same place.
pub(super) const MICRO: i64 = 10_000;
/// How fast a ramp is: the time from standstill to a frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ramp {
    /// The frequency that the time is measured to, in hundredths of a hertz.
    pub full_scale: u32,
    /// From 0 to `full_scale`, or back. 0: at once.
    pub time: Duration,
}

impl Ramp {
    /// The change of frequency in this time.
    pub(super) fn change(self, time: Duration) -> i64 {
        let scale = i128::from(self.full_scale) * i128::from(MICRO);
        let change = (scale * nanos(time)).checked_div(nanos(self.time)).unwrap_or(i128::from(i64::MAX));
        i64::try_from(change).unwrap_or(i64::MAX)
    }

    /// The time that a change of frequency takes, rounded up.
    pub(super) fn duration(self, change: i64) -> Duration {
        let scale = i128::from(self.full_scale.max(1)) * i128::from(MICRO);
        from_nanos((i128::from(change.unsigned_abs()) * nanos(self.time) + scale - 1) / scale)
    }
}

/// Acceleration and deceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ramps {
    /// Away from standstill.
    pub acceleration: Ramp,
    /// Towards standstill.
    pub deceleration: Ramp,
}

/// Where a shaft is that is steered from `from` to `target`, after a time.
pub(super) fn steered(from: i64, target: i64, ramps: Ramps, time: Duration) -> i64 {
    let reverses = from.signum() * target.signum() < 0;
    if reverses || target.abs() < from.abs() {
        let knee = if reverses { 0 } else { target };
        let span = (from - knee).abs();
        let change = ramps.deceleration.change(time);
        if change < span {
            return from - change * from.signum();
        }
        if !reverses {
            return target;
        }
        return steered(0, target, ramps, time.saturating_sub(ramps.deceleration.duration(span)));
    }
    let change = ramps.acceleration.change(time).min((target - from).abs());
    from + change * (target - from).signum()
}

pub(super) fn nanos(time: Duration) -> i128 {
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX >> 64)
}

fn from_nanos(nanos: i128) -> Duration {
    Duration::from_nanos(u64::try_from(nanos.max(0)).unwrap_or(u64::MAX))
}
