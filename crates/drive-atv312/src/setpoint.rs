//! Setpoints: `LFr` in hertz, `LFRD` in rpm, both as magnitudes. The direction is the run command's.

use drive_core::{
    Class, Command, Error, Frequency, Port, Result, Setpoint, SetpointProblem, Speed, drivecom,
};

use crate::{
    Atv312,
    registers::{LFR, LFRD},
    status::Resolution,
};

impl<P: Port> Atv312<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let settings = self.control_settings(Class::Command).await?;
        if let Some(reason) = settings.refuses_reference() {
            return Err(self.refused(Command::Setpoint(setpoint), reason));
        }
        let resolution = self.resolution(Class::Command).await?;
        // Both are images of the one reference of the bus, so a later setpoint of either kind takes the place of one
        // that still waits.
        match setpoint {
            Setpoint::Frequency(frequency) => {
                let word = self.frequency_word(frequency, resolution).await?;
                self.registers.at(Class::Command).replacing(LFR.address()).write(LFR, word).await
            }
            Setpoint::Speed(speed) => {
                let word = self.speed_word(speed, resolution).await?;
                self.registers.at(Class::Command).replacing(LFR.address()).write(LFRD, word).await
            }
        }
    }

    async fn frequency_word(&mut self, frequency: Frequency, resolution: Resolution) -> Result<u16> {
        let setpoint = Setpoint::Frequency(frequency);
        let (low, high) = self.frequency_limits().await?;
        if !(low..=high).contains(&frequency) {
            return Err(self.bad_setpoint(setpoint, SetpointProblem::OutsideFrequencyLimits { low, high }));
        }
        let problem = SetpointProblem::Resolution(resolution.step());
        resolution.word(frequency).ok_or_else(|| self.bad_setpoint(setpoint, problem))
    }

    async fn speed_word(&mut self, speed: Speed, resolution: Resolution) -> Result<u16> {
        let setpoint = Setpoint::Speed(speed);
        if resolution == Resolution::High {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm",
                reason: "CMI bit 9 (high resolution) makes LFRD a frequency",
            });
        }
        let limits = self.speed_limits().await?;
        drivecom::speed_word(speed, limits).map_err(|problem| self.bad_setpoint(setpoint, problem))
    }

    const fn bad_setpoint(&self, setpoint: Setpoint, problem: SetpointProblem) -> Error {
        Error::Setpoint { slave: self.registers.slave(), setpoint, problem }
    }
}
