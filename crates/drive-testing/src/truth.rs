//! Words against shaft: what a status says, held against the machine as it is seen at the same moment.

use std::ops::{Deref, DerefMut};

use drive_core::{
    Direction, Drive, Error, Frequency, Motion, Result, Status, StopMode, Stopped, Verdict, Withdrawn,
};
use drive_sim::{Observation, SimSlave};

/// What is seen of a motor that stands, or has reached a speed, in hundredths of a hertz.
pub const TOLERANCE: i32 = 20;

/// Below this a ramp may pass zero within one exchange.
const CROSSING: Frequency = Frequency::from_hertz(2);

/// What the status says that the machine contradicts: told at rest or held, and the shaft turns; told to coast, and the output is
/// on; told in force, and nothing drives
/// the motor, or it turns the other way, or at another speed than the reference that it is said to have reached.
#[must_use]
pub fn contradiction(status: &Status, seen: &Observation) -> Option<String> {
    let turns = seen.shaft_frequency.abs() > TOLERANCE;
    let told = |what: &str| Some(format!("told {what} ({status}); {seen:?}"));
    if matches!(status.motion, Motion::AtRest | Motion::Held) && turns {
        return told(&status.motion.to_string());
    }
    if status.motion == Motion::Coasting && seen.running {
        return told(&status.motion.to_string());
    }
    if status.verdict != Some(Verdict::InForce) {
        return None;
    }
    // A reference of zero asks for nothing, and one that is not told may.
    let asks = status.reference.is_some_and(|reference| reference != Frequency::ZERO);
    if asks && !seen.running {
        return told("in force");
    }
    // A motor that is turned round passes zero between its reading and the look; one that has come to its speed does not.
    let is_slow = |frequency: Frequency| frequency < CROSSING;
    let crosses = status.output_frequency.is_some_and(is_slow)
        && is_slow(Frequency::from_centihertz(seen.shaft_frequency.unsigned_abs()))
        && seen.output_frequency.abs_diff(seen.setpoint) > TOLERANCE.unsigned_abs();
    let is_other = |way: Direction| (way == Direction::Reverse) != (seen.shaft_frequency < 0);
    if turns && !crosses && status.direction.is_some_and(is_other) {
        return told("in force in that direction");
    }
    let reached = status.reference.filter(|_| status.at_reference == Some(true));
    let apart = |reference: Frequency| {
        reference.centihertz().cast_signed().abs_diff(seen.output_frequency.abs()) > TOLERANCE.unsigned_abs()
    };
    if reached.is_some_and(apart) { told("in force at its reference") } else { None }
}

/// A drive with the simulated machine that it talks to: what each of its statuses says is held against the machine, whoever asks
/// for it. All else is the drive's.
#[derive(Debug)]
pub struct Judged<D> {
    drive: D,
    machine: SimSlave,
}

impl<D: Drive> Judged<D> {
    /// This drive, before this machine.
    #[must_use]
    pub const fn new(drive: D, machine: SimSlave) -> Self {
        Self { drive, machine }
    }

    /// The same, set up otherwise.
    #[must_use]
    pub fn with(self, change: impl FnOnce(D) -> D) -> Self {
        Self { drive: change(self.drive), ..self }
    }

    /// The drive alone, whose words nobody judges any more.
    #[must_use]
    pub fn into_drive(self) -> D {
        self.drive
    }

    /// See [`Drive::status`].
    ///
    /// # Errors
    /// The drive's.
    ///
    /// # Panics
    /// When the machine contradicts it, as all of these do.
    pub async fn status(&mut self) -> Result<Status> {
        let told = self.drive.status().await;
        self.judge(told, |status| status)
    }

    /// See [`Drive::start`].
    ///
    /// # Errors
    /// The drive's.
    pub async fn start(&mut self, direction: Direction) -> Result<Status> {
        let told = self.drive.start(direction).await;
        self.judge(told, |status| status)
    }

    /// See [`Drive::stop`].
    ///
    /// # Errors
    /// The drive's.
    pub async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        let told = self.drive.stop(mode).await;
        let is_driven = told.as_ref().is_ok_and(|stopped| stopped.status.motion == Motion::Driven);
        assert!(!is_driven, "a stop confirmed of a motor that is told to be driven: {told:?}");
        self.judge(told, |stopped| &stopped.status)
    }

    /// See [`Drive::withdraw`].
    ///
    /// # Errors
    /// The drive's.
    pub async fn withdraw(&mut self) -> Result<Withdrawn> {
        let told = self.drive.withdraw().await;
        self.judge(told, Withdrawn::status)
    }

    /// See [`Drive::reset_faults`].
    ///
    /// # Errors
    /// The drive's.
    pub async fn reset_faults(&mut self) -> Result<Status> {
        let told = self.drive.reset_faults().await;
        self.judge(told, |status| status)
    }

    fn judge<T>(&self, told: Result<T>, status: impl Fn(&T) -> &Status) -> Result<T> {
        let said = match &told {
            Ok(told) => Some(status(told)),
            Err(Error::NotConfirmed { status, .. }) => Some(&**status),
            Err(_) => None,
        };
        let seen = self.machine.observe();
        let against = said.and_then(|status| contradiction(status, &seen));
        assert_eq!(against, None, "the words against the shaft");
        told
    }
}

impl<D> Deref for Judged<D> {
    type Target = D;

    fn deref(&self) -> &D {
        &self.drive
    }
}

impl<D> DerefMut for Judged<D> {
    fn deref_mut(&mut self) -> &mut D {
        &mut self.drive
    }
}
