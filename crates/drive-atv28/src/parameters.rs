//! Setpoints and parameters.

use drive_core::{
    Class, Error, Frequency, Port, Result, Row, Setpoint, SetpointProblem, Speed, Written, drivecom,
    registers::refuse_commands,
};

use crate::{
    Atv28,
    registers::{CMD, CMDD, CMI, HSP, LFR, LFRD, SMIL_LOW},
};

/// The drive's own limits, read when the first setpoint needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Limits {
    frequency: Option<(Frequency, Frequency)>,
    speed: Option<(Speed, Speed)>,
}

impl<P: Port> Atv28<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let (register, word) = match setpoint {
            Setpoint::Frequency(frequency) => (LFR, self.frequency_word(frequency).await?),
            Setpoint::Speed(speed) => (LFRD, self.speed_word(speed).await?),
        };
        let mut calls = self.registers.at(Class::Command).replacing(register.address());
        calls.write(register, word).await
    }

    async fn frequency_word(&mut self, frequency: Frequency) -> Result<u16> {
        let setpoint = Setpoint::Frequency(frequency);
        if !frequency.centihertz().is_multiple_of(10) {
            return Err(self.setpoint(setpoint, SetpointProblem::Resolution("0.1 Hz")));
        }
        let word = frequency.exact_decihertz();
        let word = word.ok_or_else(|| self.setpoint(setpoint, SetpointProblem::TooLarge))?;
        let (low, high) = self.frequency_limits().await?;
        if frequency < low || frequency > high {
            return Err(self.setpoint(setpoint, SetpointProblem::OutsideFrequencyLimits { low, high }));
        }
        Ok(word)
    }

    async fn speed_word(&mut self, speed: Speed) -> Result<u16> {
        let setpoint = Setpoint::Speed(speed);
        let limits = self.speed_limits().await?;
        drivecom::speed_word(speed, limits).map_err(|problem| self.setpoint(setpoint, problem))
    }

    /// HSP and LSP, which follow each other.
    async fn frequency_limits(&mut self) -> Result<(Frequency, Frequency)> {
        if let Some(limits) = self.limits.frequency {
            return Ok(limits);
        }
        let words: [u16; 2] = self.registers.at(Class::Command).read_array(HSP.address()).await?;
        let [high, low] = words.map(Frequency::from_decihertz);
        let limits = (low, high);
        self.limits.frequency = Some(limits);
        Ok(limits)
    }

    /// SMIL and SMAL, the same limits in rpm.
    async fn speed_limits(&mut self) -> Result<(Speed, Speed)> {
        if let Some(limits) = self.limits.speed {
            return Ok(limits);
        }
        let limits = drivecom::speed_limits(&mut self.registers.at(Class::Command), SMIL_LOW).await?;
        self.limits.speed = Some(limits);
        Ok(limits)
    }

    pub(crate) async fn change_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        let commands = [CMD.address(), CMDD.address(), LFR.address(), LFRD.address()];
        refuse_commands(row, &commands)?;
        if row.address == CMI.address() {
            return Err(Error::Unsupported {
                what: "writing CMI as a parameter",
                reason: "its bits are not confirmed; on the Altivar 312 they recall factory settings and write the EEPROM",
            });
        }
        // HSP, LSP, nominal values: limits that were read once may change with it.
        self.limits = Limits::default();
        self.registers.at(Class::Background).change_row(row, word).await
    }

    const fn setpoint(&self, setpoint: Setpoint, problem: SetpointProblem) -> Error {
        Error::Setpoint { slave: self.registers.slave(), setpoint, problem }
    }
}
