//! Setpoints: FA01 in hertz and FA13 in rpm, and the preset speed that may override both.

use drive_core::{
    Class, Command, Error, ExceptionMeaning, Frequency, Port, Refusal, Result, Setpoint, SetpointProblem,
    Speed,
    registers::{Register, access::ReadWrite},
};

use crate::{
    Atv21, registers as map,
    words::{CommandWord, ReferenceSource},
};

/// FA13 takes no more (Altivar 21 Modbus §8.2).
const HIGHEST_SPEED: Speed = Speed::from_rpm(24_000);

/// What a setpoint is written to.
pub(crate) type Reference = (Register<ReadWrite>, u16);

impl<P: Port> Atv21<P> {
    pub(crate) async fn write_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let reference @ (register, word) = self.reference(setpoint).await?;
        let command = Command::Setpoint(setpoint);
        self.check_preset(command).await?;
        let mut calls = self.registers.at(Class::Command).replacing(register.address());
        calls.write(register, word).await?;
        self.confirm_reference(setpoint, reference).await.map_err(Error::after_write)
    }

    /// The register and the word of a setpoint, if the drive's limits allow it.
    pub(crate) async fn reference(&mut self, setpoint: Setpoint) -> Result<Reference> {
        let slave = self.registers.slave();
        let refuse = |problem| Error::Setpoint { slave, setpoint, problem };
        match setpoint {
            Setpoint::Frequency(frequency) => {
                let high = self.upper_limit().await?;
                if frequency > high {
                    let low = Frequency::ZERO;
                    return Err(refuse(SetpointProblem::OutsideFrequencyLimits { low, high }));
                }
                let word =
                    u16::try_from(frequency.centihertz()).map_err(|_| refuse(SetpointProblem::TooLarge))?;
                Ok((map::FREQUENCY_REFERENCE, word))
            }
            Setpoint::Speed(speed) => {
                let low = Speed::default();
                let outside = SetpointProblem::OutsideSpeedLimits { low, high: HIGHEST_SPEED };
                match u16::try_from(speed.rpm()) {
                    Ok(word) if speed <= HIGHEST_SPEED => Ok((map::SPEED_REFERENCE, word)),
                    _ => Err(refuse(outside)),
                }
            }
        }
    }

    /// The drive's UL, read once. A drive that has no such register judges the setpoint by itself.
    async fn upper_limit(&mut self) -> Result<Frequency> {
        if let Some(limit) = self.upper_limit {
            return Ok(limit);
        }
        let limit = match self.registers.at(Class::Command).read(map::UPPER_LIMIT).await {
            Ok(word) => Frequency::from_centihertz(word.into()),
            Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => {
                Frequency::from_centihertz(u16::MAX.into())
            }
            Err(error) => return Err(error),
        };
        self.upper_limit = Some(limit);
        Ok(limit)
    }

    /// Reads a reference back.
    pub(crate) async fn confirm_reference(
        &mut self,
        setpoint: Setpoint,
        (register, word): Reference,
    ) -> Result<()> {
        if self.registers.at(Class::Command).read(register).await? == word {
            return Ok(());
        }
        let status = self.read_status(Class::Command).await?;
        Err(self.not_confirmed(Command::Setpoint(setpoint), status))
    }

    /// Refuses what a preset speed from elsewhere would override. One that stands in FA00 is overwritten by the next
    /// command word, and one of our own choice is meant.
    pub(crate) async fn check_preset(&mut self, command: Command) -> Result<()> {
        let is_start = matches!(command, Command::Start(_));
        if is_start && self.selections.preset_speed() != 0 {
            return Ok(());
        }
        let mut calls = self.registers.at(Class::Command);
        if ReferenceSource::from(calls.read(map::REFERENCE_SOURCE).await?) != ReferenceSource::PresetSpeed {
            return Ok(());
        }
        if is_start {
            let present = CommandWord::from_bits_retain(calls.read(map::COMMAND_WORD).await?);
            if present.preset_speed() != 0 {
                return Ok(());
            }
        }
        let reason = Refusal::Settings("a preset speed overrides the reference (FE46 = 255)");
        Err(self.refused(command, reason))
    }
}
