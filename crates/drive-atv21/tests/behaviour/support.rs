//! A drive on a simulated line.

use std::time::Duration;

use drive_atv21::{Atv21, CAPABILITIES, blocks::Blocks};
use drive_bus::{Line, Slave};
use drive_core::{Direction, Drive, Error, Frequency, Refusal, Result, State, Status, StopMode};
use drive_sim::{Observation, SimSlave, models::atv21::Atv21 as Model};
use drive_testing::bench;

pub(crate) const SECOND: Duration = Duration::from_secs(1);
pub(crate) const HALF_SPEED: Frequency = Frequency::from_hertz(25);

/// A drive, each of whose words is held against its machine.
pub(crate) type Judged = drive_testing::truth::Judged<Atv21<Slave>>;

/// A simulated drive, and the line to it.
pub(crate) struct Rig {
    pub(crate) machine: SimSlave,
    pub(crate) line: Line,
}

impl Rig {
    pub(crate) fn new(model: Model) -> (Self, Judged) {
        let (drive, machine, line) = bench::on_a_line(&CAPABILITIES, model, Atv21::new);
        // The time-out would trip a drive that a test leaves alone.
        machine.poke(0x0803, 0);
        (Self { machine, line }, drive)
    }

    /// Another driver of the same machine.
    pub(crate) fn another(&self) -> Judged {
        Judged::new(Atv21::new(self.line.slave(1), bench::address(1)), self.machine.clone())
    }

    pub(crate) fn factory() -> (Self, Judged) {
        Self::new(Model::new())
    }

    /// With the standard blocks in effect.
    pub(crate) async fn with_blocks() -> (Self, Judged) {
        let (rig, mut drive) = Self::factory();
        let _ = drive.set_up_blocks(Blocks::STANDARD).await.unwrap();
        rig.power_cycle().await;
        drive.forget();
        (rig, drive)
    }

    /// With the standard blocks in effect, and the motor at speed: the block has shown what it holds.
    pub(crate) async fn with_blocks_shown() -> (Self, Judged) {
        let (rig, mut drive) = Self::with_blocks().await;
        rig.at_speed(&mut drive).await;
        drive.measurements().await.unwrap();
        drive.status().await.unwrap();
        (rig, drive)
    }

    pub(crate) async fn at_rest(&self, drive: &mut Judged) {
        drive.stop(StopMode::Ramp).await.unwrap();
        self.until(|seen| !seen.running).await;
    }

    pub(crate) async fn power_cycle(&self) {
        self.machine.power_cycle();
        tokio::time::sleep(2 * SECOND).await;
    }

    pub(crate) async fn at_speed(&self, drive: &mut Judged) {
        drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
        drive.start(Direction::Forward).await.unwrap();
        self.until(|seen| seen.output_frequency == 2_500).await;
    }

    /// Waits until the machine is seen to be so, and fails when it never is.
    pub(crate) async fn until(&self, is_so: impl Fn(&Observation) -> bool) {
        let seen = tokio::time::timeout(100 * SECOND, self.machine.wait_until(is_so)).await;
        seen.unwrap_or_else(|_| panic!("{:?}", self.machine.observe()));
    }

    pub(crate) fn count(&self) -> u64 {
        self.machine.all_requests()
    }
}

pub(crate) fn refusal<T: std::fmt::Debug>(result: Result<T>) -> Refusal {
    match result.unwrap_err() {
        Error::Refused { reason, .. } => reason,
        other => panic!("{other}"),
    }
}

pub(crate) fn state(status: &Status) -> (State, Option<Direction>) {
    (status.state, status.direction)
}
