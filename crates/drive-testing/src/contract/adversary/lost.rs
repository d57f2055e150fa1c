//! Each answer of each command is lost in turn, and each request.

use drive_core::{Direction, StopMode};

use super::{CALLS, Complaint, SETPOINT, SETTLED, Stage, denies};
use crate::{contract::Contract, recorder::Habit};

#[derive(Debug, Clone, Copy)]
enum Asked {
    Start,
    Setpoint,
    Stop,
}

impl Contract {
    pub(super) async fn with_lost_answers(&self) -> Vec<Complaint> {
        let mut complaints = Vec::new();
        for asked in [Asked::Start, Asked::Setpoint, Asked::Stop] {
            for habit in [Habit::LosesAnswer, Habit::LosesRequest] {
                for number in 0..CALLS {
                    let mut stage = self.stage("what is said holds, whichever answer is lost").await;
                    let calls = stage.lose(asked, habit(number)).await;
                    complaints.append(&mut stage.complaints);
                    if calls <= number {
                        break;
                    }
                }
            }
        }
        complaints
    }
}

impl Stage {
    /// Asks it with one loss, judges what it says, and gives how many calls there were.
    async fn lose(&mut self, asked: Asked, habit: Habit) -> usize {
        let _ = self.rig.drive.set_setpoint(SETPOINT.into()).await;
        if matches!(asked, Asked::Stop) && self.run().await.is_none() {
            return 0;
        }
        self.witness.from_now_on(habit);
        match asked {
            Asked::Start => {
                let started = self.rig.drive.start(Direction::Forward).await;
                let calls = self.witness.heard().len();
                self.live(SETTLED).await;
                let (seen, loss) = (self.seen(), format!("{habit:?}"));
                match started {
                    Ok(status) if !seen.running => {
                        self.blame(format!("{loss}: the start is confirmed ({status}); {seen:?}"));
                    }
                    Err(error) if denies(&error) && !self.rests() => {
                        self.blame(format!("{loss}: the start was not sent ({error}); {seen:?}"));
                    }
                    _ => {}
                }
                self.stop_at_last().await;
                calls
            }
            Asked::Setpoint => {
                let given = self.rig.drive.set_setpoint(super::OTHER.into()).await;
                let calls = self.witness.heard().len();
                self.witness.from_now_on(Habit::Obeys);
                let started = self.rig.drive.start(Direction::Forward).await;
                self.live(SETTLED).await;
                let seen = self.seen();
                let at = i32::try_from(super::OTHER.centihertz()).unwrap_or(i32::MAX);
                if given.is_ok() && started.is_ok() && (seen.output_frequency - at).abs() > super::TOLERANCE {
                    self.blame(format!("{habit:?}: a setpoint of {at} is confirmed; {seen:?}"));
                }
                self.stop_at_last().await;
                calls
            }
            Asked::Stop => {
                let stopped = self.rig.drive.stop(StopMode::Ramp).await;
                let calls = self.witness.heard().len();
                self.live(SETTLED).await;
                let seen = self.seen();
                if let Ok(stopped) = stopped
                    && !self.rests()
                {
                    self.blame(format!("{habit:?}: the stop is confirmed ({stopped}); {seen:?}"));
                }
                self.stop_at_last().await;
                calls
            }
        }
    }
}
