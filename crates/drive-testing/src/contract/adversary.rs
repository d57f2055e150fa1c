//! A drive that disobeys, a line that loses an answer, and a witness that counts what was sent: what `Drive` says **must** be
//! is judged here, and each complaint says what was claimed and what was counted.

mod broken_off;
mod lost;
mod obeyed;
mod proof;

use std::time::Duration;

use drive_core::{Direction, Error, Frequency, StopMode};
use drive_sim::Observation;
use tokio::time::{Instant, sleep};

use super::{Contract, is_given};
use crate::{
    recorder::{Habit, Recorder, Witness},
    rig::Rig,
    truth::TOLERANCE,
};

/// What is asked of every drive here.
const SETPOINT: Frequency = Frequency::from_hertz(20);
/// Another one.
const OTHER: Frequency = Frequency::from_hertz(25);
/// More calls than any order to a healthy drive takes.
const CALLS: usize = 40;
/// Longer than every ramp from there, and than a family waits for a confirmation.
const SETTLED: Duration = Duration::from_secs(12);

/// What a family does that its contract forbids.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Complaint {
    /// What it promised.
    pub promise: &'static str,
    /// What was claimed, and what was counted.
    pub seen: String,
}

impl std::fmt::Display for Complaint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.promise, self.seen)
    }
}

/// A drive with a witness, and what it is to be blamed for.
struct Stage {
    rig: Rig,
    witness: Witness,
    promise: &'static str,
    complaints: Vec<Complaint>,
}

impl Stage {
    fn blame(&mut self, seen: impl Into<String>) {
        self.complaints.push(Complaint { promise: self.promise, seen: seen.into() });
    }

    fn seen(&self) -> Observation {
        self.rig.machine.observe()
    }

    fn rests(&self) -> bool {
        let seen = self.seen();
        !seen.running && seen.shaft_frequency.abs() <= TOLERANCE
    }

    /// Lets time pass with the drive asked all the while, so that no watchdog trips.
    async fn live(&mut self, time: Duration) {
        let end = Instant::now() + time;
        while Instant::now() < end {
            // What it says is judged elsewhere.
            let _ = self.rig.drive.status().await;
            sleep(Duration::from_millis(400)).await;
        }
    }

    /// Runs the motor at the setpoint; `None` where even that is not possible.
    async fn run(&mut self) -> Option<()> {
        let given = self.rig.drive.set_setpoint(SETPOINT.into()).await;
        let started = self.rig.drive.start(Direction::Forward).await;
        self.live(SETTLED).await;
        if !is_given(&given) || started.is_err() || !self.seen().running {
            self.blame(format!(
                "a plain start does not run the motor: {given:?}, {started:?}, {:?}",
                self.seen()
            ));
            return None;
        }
        Some(())
    }

    /// Stops it over a line and a drive that do what they are told.
    async fn stop_at_last(&mut self) {
        self.witness.from_now_on(Habit::Obeys);
        let stopped = self.rig.drive.stop(StopMode::Ramp).await;
        self.live(SETTLED).await;
        if !self.rests() {
            let seen = self.seen();
            self.blame(format!("a stop afterwards leaves the motor turning: {stopped:?}, {seen:?}"));
        }
    }
}

impl Contract {
    /// All that an adversary finds: nothing, for a family that keeps its contract.
    pub async fn complaints(&self) -> Vec<Complaint> {
        let mut all = Vec::new();
        all.extend(self.obeyed().await);
        all.extend(self.disobeyed().await);
        all.extend(self.with_lost_answers().await);
        all.extend(self.knows_what_it_has_written().await);
        all.extend(self.proves_what_it_says().await);
        all
    }

    /// Whether there is any, found as soon as it can be: for families that are broken on purpose.
    pub async fn complains(&self) -> bool {
        !self.obeyed().await.is_empty()
            || !self.disobeyed().await.is_empty()
            || !self.with_lost_answers().await.is_empty()
            || !self.knows_what_it_has_written().await.is_empty()
            || !self.proves_what_it_says().await.is_empty()
    }

    /// What [`complaints`](Self::complaints) finds, for a test.
    ///
    /// # Panics
    /// With the complaints, when there are any.
    pub async fn withstands_the_adversary(&self) {
        let complaints: Vec<String> = self.complaints().await.iter().map(ToString::to_string).collect();
        assert!(complaints.is_empty(), "{}:\n{}", self.name(), complaints.join("\n"));
    }

    /// A fresh drive that has been read once, and its witness.
    async fn stage(&self, promise: &'static str) -> Stage {
        let mut witness = Witness::default();
        let mut rig =
            Rig::new(drive_bus::Protocol::Rtu, self.capabilities.factory, (self.machine)(), |port, slave| {
                let (recorder, its) = Recorder::before(port);
                witness = its;
                (self.open)(Box::new(recorder), slave)
            });
        // Whoever says nothing at first is judged by what follows.
        let _ = rig.drive.status().await;
        witness.from_now_on(Habit::Obeys);
        Stage { rig, witness, promise, complaints: Vec::new() }
    }
}

/// Whether an error says that nothing was done.
fn denies(error: &Error) -> bool {
    use drive_core::ErrorKind::{NotSent, Refused, Unsupported};
    matches!(error.kind(), NotSent | Refused | Unsupported)
}
