//! What another master's writes ask.

use drive_core::{Direction, Frequency, Intent, Port, Result, Speed, StopMode};

use crate::{
    Atv21,
    registers::address::{COMMAND_WORD, COMMAND_WORD_2, FREQUENCY_REFERENCE, SPEED_REFERENCE},
    words::CommandWord,
};

impl<P: Port> Atv21<P> {
    /// Altivar 21 Modbus §8.2 and §8.4.
    pub(crate) async fn asked_by_another(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match register {
            COMMAND_WORD => Intent::understood(CommandWord::from_bits_retain(word).intent()),
            FREQUENCY_REFERENCE => {
                let frequency = Frequency::from_centihertz(u32::from(word));
                Ok(Some(Intent::Setpoint(frequency.into())))
            }
            SPEED_REFERENCE => Ok(Some(Intent::Setpoint(Speed::from_rpm(word.into()).into()))),
            COMMAND_WORD_2 => Intent::kept(),
            _ => Ok(None),
        }
    }
}

impl CommandWord {
    /// What it asks. An emergency stop, by which the drive trips, is carried out as the fastest stop. A run command that
    /// chooses a preset speed, motor 2, ramp 2 or no PID control is not understood: another reference than that of the bus
    /// might act.
    #[must_use]
    pub fn intent(self) -> Option<Intent> {
        if self.contains(Self::EMERGENCY_STOP) {
            Some(Intent::Stop(StopMode::Fast))
        } else if self.contains(Self::FREEWHEEL) {
            Some(Intent::Stop(StopMode::Freewheel))
        } else if self.contains(Self::DC_BRAKING) {
            Some(Intent::Stop(StopMode::DcInjection))
        } else if !self.contains(Self::RUN) {
            let resets = self.contains(Self::FAULT_RESET);
            Some(if resets { Intent::ResetFaults(StopMode::Ramp) } else { Intent::Stop(StopMode::Ramp) })
        } else {
            let known = Self::PRIORITIES.union(Self::RUN).union(Self::REVERSE);
            let direction =
                if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward };
            known.contains(self).then_some(Intent::Start(direction))
        }
    }
}
