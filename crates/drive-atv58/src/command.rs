//! Start, stop, reset, setpoint: what is written to `CMD` and `W401`, and how it is seen to act.

use async_trait::async_trait;
use drive_core::{
    Class, Direction, Effect, Error, Frequency, Port, RawWord, Refusal, Result, Setpoint, SetpointProblem,
    SlaveAddress, Status, StopMode,
    drivecom::{self, ChartState, Drivecom},
};

use crate::{
    Atv58, Atv58Map,
    registers::{CMD, W401, W458, W483},
    status::Words,
};

impl<P: Port> Atv58<P> {
    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let bit = match direction {
            Direction::Forward => 0,
            Direction::Reverse if self.map.reverse_command != 0 => self.map.reverse_command,
            Direction::Reverse => {
                return Err(Error::Unsupported {
                    what: "start in reverse",
                    reason: "the drive's map names no bit of the control word for it",
                });
            }
        };
        drivecom::start(self, direction, drivecom::ENABLE_OPERATION | bit).await
    }

    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let word = self.stop_word(mode).ok_or(match mode {
            StopMode::DcInjection => Error::Unsupported {
                what: "stop by DC injection",
                reason: "the manual names no bit of the control word for it",
            },
            _ => Error::Unsupported {
                what: "stop by ramp",
                reason: "the drive's map names no control word for it",
            },
        })?;
        let map = self.map;
        drivecom::stop(self, mode, word, |status| shows_stop(&map, status, mode)).await
    }

    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let Setpoint::Frequency(frequency) = setpoint else {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm",
                reason: "the manual names a frequency reference only",
            });
        };
        let slave = self.registers.slave();
        let scaled = u64::from(frequency.centihertz()) * u64::from(self.map.reference_counts_per_hertz);
        if !scaled.is_multiple_of(100) {
            let problem = SetpointProblem::Resolution("one count of W401");
            return Err(Error::Setpoint { slave, setpoint, problem });
        }
        let count = i16::try_from(scaled / 100);
        let count =
            count.map_err(|_| Error::Setpoint { slave, setpoint, problem: SetpointProblem::TooLarge })?;
        if let Some((low, high)) = self.speed_limits().await?
            && (frequency < low || frequency > high)
        {
            let problem = SetpointProblem::OutsideFrequencyLimits { low, high };
            return Err(Error::Setpoint { slave, setpoint, problem });
        }
        let mut calls = self.registers.at(Class::Command).replacing(W401.address());
        calls.write(W401, count.cast_unsigned()).await
    }

    /// The control word of a stop; `None` where there is none.
    pub(crate) const fn stop_word(&self, mode: StopMode) -> Option<u16> {
        match mode {
            StopMode::Ramp => self.map.ramp_stop,
            StopMode::Fast => Some(drivecom::QUICK_STOP),
            StopMode::Freewheel => Some(drivecom::DISABLE_VOLTAGE),
            StopMode::DcInjection => None,
        }
    }

    async fn speed_limits(&mut self) -> Result<Option<(Frequency, Frequency)>> {
        let Some((low, high)) = self.map.speed_limits else { return Ok(None) };
        if self.limits.is_none() {
            let words = Words::read(&mut self.registers.at(Class::Command), false, &[low, high]).await?;
            let frequency = |address| words.at(Some(address)).map(Frequency::from_decihertz);
            self.limits = frequency(low).zip(frequency(high));
        }
        Ok(self.limits)
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv58<P> {
    const ETA: u16 = W458.address();

    fn status_register(&self) -> u16 {
        self.map.status
    }

    fn address(&self) -> SlaveAddress {
        self.registers.slave()
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        let map = self.map;
        let fast = [Some(map.status), map.output_frequency, map.current];
        let addresses: Vec<u16> = fast.into_iter().flatten().collect();
        let mut calls = self.registers.at(class);
        let mut words = Words::read(&mut calls, map.input_words, &addresses).await?;
        if words.is_tripped(&map) {
            words.append(&mut calls, map.input_words, W483.address(), 1).await?;
        }
        // Whether a drive leaves "operation enabled" at once or at the end of its ramp is not known; the control word
        // that it holds tells the stop from the run.
        if class == Class::Stop && words.chart(&map) == Some(ChartState::OperationEnabled) {
            words.append(&mut calls, false, CMD.address(), 1).await?;
        }
        Ok(words.status(&map))
    }

    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        let calls = self.registers.at(class);
        let mut calls = if effect == Effect::Edge { calls.edge() } else { calls };
        calls.write(CMD, word).await
    }

    async fn refuses_start(&mut self, _: Direction, status: &Status) -> Result<Option<Refusal>> {
        if let Some(control) = status.control {
            return Ok(Some(Refusal::NotInControl(control)));
        }
        // A sign that somebody else left would turn the direction round.
        let negative = self.registers.at(Class::Command).read(W401).await?.cast_signed() < 0;
        Ok(negative.then_some(Refusal::Settings("the reference W401 is negative: give a setpoint first")))
    }

    /// The drive shows a run command by holding it in the state "operation enabled", and not in forced local mode.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<bool> {
        let value = self.registers.at(Class::Command).read(CMD).await?;
        status.raw.push(RawWord { address: CMD.address(), code: CMD.row().code, value });
        Ok(value == word && status.control.is_none())
    }
}

/// Whether the drive itself shows that no run command is in force. In forced local mode the control word that it holds
/// does not act, and tells nothing.
fn shows_stop(map: &Atv58Map, status: &Status, mode: StopMode) -> bool {
    match status.raw(map.status).and_then(ChartState::of) {
        None | Some(ChartState::NotReadyToSwitchOn) => false,
        Some(ChartState::OperationEnabled) => {
            mode == StopMode::Ramp && status.control.is_none() && status.raw(CMD.address()) == map.ramp_stop
        }
        Some(ChartState::QuickStopActive) => mode != StopMode::Freewheel,
        Some(_) => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_held_control_word_shows_no_stop_while_local_control_is_forced() {
        let map = Atv58Map::default();
        let stopping = |eta, control| {
            let raw = |address, value| RawWord { address, code: "", value };
            let raw = vec![raw(map.status, eta), raw(CMD.address(), drivecom::SWITCH_ON)];
            shows_stop(&map, &Status { control, raw, ..Status::default() }, StopMode::Ramp)
        };
        assert!(stopping(0x0227, None));
        assert!(!stopping(0x0027, Some(drive_core::Control::Local)));
        assert!(!stopping(0x0200, None), "initialising");
        assert!(stopping(0x0223, None));
    }
}
