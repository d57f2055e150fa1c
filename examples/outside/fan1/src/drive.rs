//! The drive as every family is one: [`Drive`] over what the other modules do.

use async_trait::async_trait;
use drive_core::{
    Class, Command, Direction, Drive, Faults, Frequency, Intent, Lease, Measurements, Port, Refusal, Result,
    Row, Setpoint, Status, StopMode, Stopped, Withdrawn, Written, registers::refuse_commands,
};

use crate::{
    Fan1,
    registers::{ControlWord, address as at},
};

#[async_trait]
impl<P: Port> Drive for Fan1<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        Some(ControlWord::run(direction).bits())
    }

    fn adopt(&mut self, lease: Lease) {
        self.watch.adopt(lease);
        self.agreed = None;
    }

    fn forget(&mut self) {
        self.watch.lose_sight();
    }

    async fn status(&mut self) -> Result<Status> {
        let mut status = self.read_status(Class::Status).await?;
        self.judge(&mut status);
        Ok(status)
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        self.start_motor(direction).await
    }

    async fn may_start(&mut self, direction: Direction, _: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        self.may_be_started(direction).await.map(drop)
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await
    }

    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.withdraw_run().await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.pulse_reset().await
    }

    /// One word: the drive has no cheaper request.
    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read_word(at::STATUS).await.map(drop)
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match register {
            at::CONTROL => Intent::understood(match ControlWord::from_bits_retain(word) {
                ControlWord::RESET => Some(Intent::ResetFaults(StopMode::Ramp)),
                control if !control.contains(ControlWord::RUN) => Some(Intent::Stop(StopMode::Ramp)),
                control => {
                    let mut directions = [Direction::Forward, Direction::Reverse].into_iter();
                    directions.find(|&direction| control == ControlWord::run(direction)).map(Intent::Start)
                }
            }),
            at::REFERENCE => {
                Intent::understood(Some(Intent::Setpoint(Frequency::from_decihertz(word).into())))
            }
            _ => Ok(None),
        }
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// The ramp is taken at standstill only: no motor that runs is to stop otherwise than it was said.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &[at::CONTROL, at::REFERENCE])?;
        if self.read_status(Class::Background).await?.state.is_moving() {
            let command = Command::WriteParameter(row.address);
            return Err(self.refused(command, Refusal::MotorRunning));
        }
        self.registers.at(Class::Background).change_row(row, word).await
    }
}
