//! A motor with its load: ramps, coasting, braking, current, heat. Integers only, so every run is the same.

mod heat;
mod ramp;

use std::time::Duration;

pub use ramp::{Ramp, Ramps};

use self::{
    heat::Heat,
    ramp::{MICRO, nanos, steered},
};

/// Torque that bearings and fan take, in percent of nominal.
const FRICTION: i64 = 5;
/// Magnetising current, in percent of nominal.
const MAGNETISING: i64 = 30;
/// Share of the nominal current that makes torque: with [`MAGNETISING`] it adds up to 100 % at nominal torque.
const ACTIVE: i64 = 95;

/// What is on the motor's plate, and how heavy the machine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Nameplate {
    /// Nominal frequency in hundredths of a hertz.
    pub nominal_frequency: u32,
    /// Nominal current in tenths of an ampere.
    pub nominal_current: u32,
    /// The time in which nominal torque, with nothing to drive, takes motor and machine from standstill to nominal
    /// speed.
    pub inertia: Duration,
    /// The time in which the windings reach 63 % of the heat that a current ends at.
    pub heating: Duration,
}

impl Nameplate {
    /// A 50 Hz motor of this current with a light machine: 0.5 s to nominal speed, 10 minutes to heat.
    #[must_use]
    pub const fn light(nominal_current: u32) -> Self {
        Self {
            nominal_frequency: 5_000,
            nominal_current,
            inertia: Duration::from_millis(500),
            heating: Duration::from_secs(600),
        }
    }
}

/// What the output stage does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Blocked: the motor coasts or stands.
    Off,
    /// Steers for a frequency, and blocks itself once it stands there if `then_off`.
    Steers { target: i64, ramps: Ramps, then_off: bool },
    /// Injects direct current, for ever or for this time.
    Brakes { percent: u16, remaining: Option<Duration> },
}

/// A motor, its load, and the output stage that feeds it.
///
/// ```
/// use std::time::Duration;
/// use drive_sim::{Motor, Nameplate, Ramp, Ramps};
///
/// let three_seconds = Ramp { full_scale: 5_000, time: Duration::from_secs(3) };
/// let mut motor = Motor::new(Nameplate::light(20));
/// motor.run(5_000, Ramps { acceleration: three_seconds, deceleration: three_seconds });
/// motor.advance(Duration::from_millis(1_500));
/// assert_eq!(motor.output_frequency(), 2_500);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Motor {
    plate: Nameplate,
    stage: Stage,
    load: i64,
    /// Shaft at the last change of stage or load, in micro-hertz, and the time since.
    anchor: i64,
    since: Duration,
    heat: Heat,
    fed: Duration,
}

impl Motor {
    /// A motor at rest, cold, without a load.
    #[must_use]
    pub const fn new(plate: Nameplate) -> Self {
        Self {
            plate,
            stage: Stage::Off,
            load: 0,
            anchor: 0,
            since: Duration::ZERO,
            heat: Heat::COLD,
            fed: Duration::ZERO,
        }
    }

    /// Steers for a frequency in hundredths of a hertz, negative in reverse; through standstill where the direction
    /// changes. A motor that still coasts is caught at its speed.
    pub fn run(&mut self, target: i32, ramps: Ramps) {
        self.set_stage(Stage::Steers { target: i64::from(target) * MICRO, ramps, then_off: false });
    }

    /// Brings the motor to rest along a ramp and blocks the output there. A motor that is not fed coasts on.
    pub fn ramp_to_rest(&mut self, deceleration: Ramp) {
        if matches!(self.stage, Stage::Steers { .. }) {
            let ramps = Ramps { acceleration: deceleration, deceleration };
            self.set_stage(Stage::Steers { target: 0, ramps, then_off: true });
        }
    }

    /// Blocks the output: the motor coasts.
    pub fn freewheel(&mut self) {
        self.set_stage(Stage::Off);
    }

    /// Injects direct current of `percent` of the nominal current, for a time or until something else is ordered.
    pub fn brake(&mut self, percent: u16, time: Option<Duration>) {
        self.set_stage(Stage::Brakes { percent, remaining: time });
    }

    /// Sets the load at the shaft in percent of nominal torque. It always works against the movement.
    pub fn set_load(&mut self, percent: u16) {
        self.anchor = self.shaft();
        self.since = Duration::ZERO;
        self.load = i64::from(percent);
    }

    /// Lets time pass.
    pub fn advance(&mut self, elapsed: Duration) {
        let mut left = elapsed;
        // Between two changes of slope torque and current are constant, so heat is computed piece by piece. A
        // reversal has four pieces; the loop ends because each turn reaches a later piece.
        while !left.is_zero() {
            let piece = self.until_change().map_or(left, |change| change.min(left));
            self.heat.take(self.current_percent(), piece, self.plate.heating);
            if self.is_fed() {
                self.fed = self.fed.saturating_add(piece);
            }
            self.since = self.since.saturating_add(piece);
            if let Stage::Brakes { remaining: Some(remaining), .. } = &mut self.stage {
                *remaining = remaining.saturating_sub(piece);
            }
            left = left.saturating_sub(piece);
            self.settle();
        }
    }

    /// Frequency at the output in hundredths of a hertz, negative in reverse; 0 when the motor is not steered.
    #[must_use]
    pub fn output_frequency(&self) -> i32 {
        if matches!(self.stage, Stage::Steers { .. }) { self.shaft_frequency() } else { 0 }
    }

    /// Speed of the shaft as a frequency in hundredths of a hertz, negative in reverse.
    #[must_use]
    pub fn shaft_frequency(&self) -> i32 {
        i32::try_from(self.shaft() / MICRO).unwrap_or(0)
    }

    /// Whether the output stage feeds the motor.
    #[must_use]
    pub const fn is_fed(&self) -> bool {
        !matches!(self.stage, Stage::Off)
    }

    /// Whether direct current is injected.
    #[must_use]
    pub const fn is_braking(&self) -> bool {
        matches!(self.stage, Stage::Brakes { .. })
    }

    /// Whether the motor is on its way to rest, after which the output blocks itself.
    #[must_use]
    pub const fn is_stopping(&self) -> bool {
        matches!(self.stage, Stage::Steers { then_off: true, .. })
    }

    /// Whether the motor is steered and runs at the frequency that was ordered.
    #[must_use]
    pub fn is_at_target(&self) -> bool {
        matches!(self.stage, Stage::Steers { target, .. } if self.shaft() == target)
    }

    /// Whether the speed grows.
    #[must_use]
    pub fn is_accelerating(&self) -> bool {
        matches!(self.slope(), Slope::Up)
    }

    /// Whether the steered speed falls.
    #[must_use]
    pub fn is_decelerating(&self) -> bool {
        matches!(self.slope(), Slope::Down)
    }

    /// Torque in percent of nominal, negative while the load is slowed down.
    #[must_use]
    pub fn torque(&self) -> i32 {
        i32::try_from(self.torque_percent()).unwrap_or(0)
    }

    /// Motor current in tenths of an ampere.
    #[must_use]
    pub fn current(&self) -> u32 {
        u32::try_from(self.current_percent() * i64::from(self.plate.nominal_current) / 100).unwrap_or(0)
    }

    /// Mechanical power in percent of nominal, negative while the load is slowed down.
    #[must_use]
    pub fn power(&self) -> i32 {
        let speed = self.shaft().abs() / MICRO;
        i32::try_from(self.torque_percent() * speed / i64::from(self.plate.nominal_frequency.max(1)))
            .unwrap_or(0)
    }

    /// Thermal state in percent: 100 is what nominal current ends at.
    #[must_use]
    pub fn thermal_state(&self) -> u16 {
        self.heat.percent()
    }

    /// How long the motor has been fed in all.
    #[must_use]
    pub const fn fed_for(&self) -> Duration {
        self.fed
    }

    fn set_stage(&mut self, stage: Stage) {
        if stage != self.stage {
            self.anchor = self.shaft();
            self.since = Duration::ZERO;
            self.stage = stage;
            self.settle();
        }
    }

    /// Follows the changes that happen by themselves at this very moment.
    fn settle(&mut self) {
        let over = match self.stage {
            Stage::Off => return,
            Stage::Steers { then_off, .. } => then_off && self.shaft() == 0,
            Stage::Brakes { remaining, .. } => remaining == Some(Duration::ZERO),
        };
        if over {
            self.anchor = self.shaft();
            self.since = Duration::ZERO;
            self.stage = Stage::Off;
        }
    }

    /// The shaft's speed in micro-hertz now.
    fn shaft(&self) -> i64 {
        let towards_zero = |ramp: Ramp| {
            let left = self.anchor.abs().saturating_sub(ramp.change(self.since)).max(0);
            left * self.anchor.signum()
        };
        match self.stage {
            Stage::Off => towards_zero(self.coasting(0)),
            Stage::Brakes { .. } => towards_zero(self.coasting(100)),
            Stage::Steers { target, ramps, .. } => steered(self.anchor, target, ramps, self.since),
        }
    }

    /// The slope of a shaft that is slowed down by load, friction and this braking torque.
    fn coasting(&self, braking: i64) -> Ramp {
        let torque = u32::try_from(self.load + FRICTION + braking).unwrap_or(u32::MAX);
        Ramp { full_scale: self.plate.nominal_frequency, time: self.plate.inertia * 100 / torque.max(1) }
    }

    /// The time until slope, torque or stage change by themselves.
    pub(crate) fn until_change(&self) -> Option<Duration> {
        let shaft = self.shaft();
        let later = |time: Duration| (!time.is_zero()).then_some(time);
        match self.stage {
            Stage::Off => later(self.coasting(0).duration(shaft)),
            Stage::Brakes { remaining, .. } => {
                let stands = later(self.coasting(100).duration(shaft));
                stands.into_iter().chain(remaining.and_then(later)).min()
            }
            Stage::Steers { target, ramps, .. } if shaft != target => {
                let up = shaft.signum() * target.signum() >= 0 && target.abs() > shaft.abs();
                let time = if up {
                    ramps.acceleration.duration(target - shaft)
                } else {
                    let knee = if shaft.signum() == target.signum() { target } else { 0 };
                    ramps.deceleration.duration(shaft - knee)
                };
                // A ramp of no time changes at the next moment that there is.
                Some(time.max(Duration::from_nanos(1)))
            }
            Stage::Steers { .. } => None,
        }
    }

    fn slope(&self) -> Slope {
        let Stage::Steers { target, .. } = self.stage else { return Slope::Level };
        let shaft = self.shaft();
        if shaft == target {
            Slope::Level
        } else if shaft.signum() * target.signum() >= 0 && target.abs() > shaft.abs() {
            Slope::Up
        } else {
            Slope::Down
        }
    }

    fn torque_percent(&self) -> i64 {
        let Stage::Steers { ramps, target, .. } = self.stage else { return 0 };
        let inertia = |ramp: Ramp| {
            let full = i128::from(ramp.full_scale) * nanos(self.plate.inertia) * 100;
            let slope = i128::from(self.plate.nominal_frequency.max(1)) * nanos(ramp.time).max(1);
            // A drive gives no more than about twice the nominal torque, however short the ramp.
            i64::try_from(full / slope).unwrap_or(i64::MAX).min(200)
        };
        let moves = if self.shaft() == 0 && target == 0 { 0 } else { self.load + FRICTION };
        match self.slope() {
            Slope::Up => moves + inertia(ramps.acceleration),
            Slope::Level => moves,
            Slope::Down => moves - inertia(ramps.deceleration),
        }
    }

    fn current_percent(&self) -> i64 {
        match self.stage {
            Stage::Off => 0,
            Stage::Brakes { percent, .. } => i64::from(percent),
            Stage::Steers { .. } => {
                let active = self.torque_percent() * ACTIVE / 100;
                (MAGNETISING * MAGNETISING + active * active).isqrt()
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slope {
    Up,
    Level,
    Down,
}

#[cfg(test)]
mod tests;
