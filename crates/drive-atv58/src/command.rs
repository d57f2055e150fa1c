//! Start, stop, reset, setpoint: what is written to `CMD` and `W401`, and how it is seen to act.

use drive_core::{
    Class, Command, Direction, Error, ErrorKind, Frequency, Port, Refusal, Result, Setpoint, SetpointProblem,
    State, Status, StopMode,
    drivecom::{self, ChartState, Goal, Step},
};

use crate::{
    Atv58,
    registers::{CMD, W401},
    status::Words,
};

/// How often the status is read for a command to show, before it counts as not confirmed.
const READS: usize = 20;

impl<P: Port> Atv58<P> {
    /// Climbs the chart and gives the run command. The drive shows it by "operation enabled" and by holding the control
    /// word.
    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let command = Command::Start(direction);
        let run = drivecom::ENABLE_OPERATION | self.direction_bit(direction)?;
        let mut words = self.read_words(Class::Command).await?;
        self.check_start(&words, command)?;
        let mut given = false;
        for _ in 0..READS {
            let chart = words.chart(&self.map);
            let chart = chart.ok_or_else(|| self.refused(command, Refusal::State(State::Unknown)))?;
            match drivecom::next_step(chart, Goal::OperationEnabled) {
                Step::Faulted => return Err(self.refused(command, self.tripped(&words))),
                Step::Wait => {}
                Step::Reached if given => {
                    words.append(&mut self.registers.at(Class::Command), CMD.address(), 1).await?;
                    if words.at(Some(CMD.address())) == Some(run) {
                        return Ok(words.status(&self.map));
                    }
                    self.give_command(Class::Command, run).await?;
                }
                Step::Reached | Step::Write(drivecom::ENABLE_OPERATION) => {
                    self.give_command(Class::Command, run).await?;
                    given = true;
                }
                Step::Write(word) => self.give_command(Class::Command, word).await?,
            }
            words = self.read_words(Class::Command).await?;
        }
        Err(self.not_confirmed(command, &words))
    }

    /// Writes the stop first, whatever the drive's state, and then reads until the drive shows it.
    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let command = Command::Stop(mode);
        let stop = self.stop_word(mode).ok_or(match mode {
            StopMode::DcInjection => Error::Unsupported {
                what: "stop by DC injection",
                reason: "the manual names no bit of the control word for it",
            },
            _ => Error::Unsupported {
                what: "stop by ramp",
                reason: "the drive's map names no control word for it",
            },
        })?;
        self.give_command(Class::Stop, stop).await?;
        let mut words = self.read_words(Class::Stop).await?;
        for _ in 1..READS {
            if self.shows_stop(&mut words, mode).await? {
                return Ok(words.status(&self.map));
            }
            words = self.read_words(Class::Stop).await?;
        }
        if self.shows_stop(&mut words, mode).await? {
            return Ok(words.status(&self.map));
        }
        Err(self.not_confirmed(command, &words))
    }

    /// One rising edge of the reset bit, cleared at once. A drive without a fault is left alone.
    pub(crate) async fn reset_once(&mut self) -> Result<Status> {
        let mut words = self.read_words(Class::Command).await?;
        if !words.is_tripped(&self.map) {
            return Ok(words.status(&self.map));
        }
        let edge = self.registers.at(Class::Command).edge().write(CMD, drivecom::FAULT_RESET).await;
        // An edge that may have arrived is cleared as well, so that the next one rises; the status tells the outcome.
        if let Err(error) = edge
            && error.kind() != ErrorKind::OutcomeUnknown
        {
            return Err(error);
        }
        self.give_command(Class::Command, drivecom::DISABLE_VOLTAGE).await?;
        for _ in 0..READS {
            words = self.read_words(Class::Command).await?;
            if words.chart(&self.map).is_some() && !words.is_tripped(&self.map) {
                return Ok(words.status(&self.map));
            }
        }
        Err(self.not_confirmed(Command::ResetFaults, &words))
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
            let words = Words::read(&mut self.registers.at(Class::Command), &[low, high]).await?;
            let frequency = |address| words.at(Some(address)).map(Frequency::from_decihertz);
            self.limits = frequency(low).zip(frequency(high));
        }
        Ok(self.limits)
    }

    fn direction_bit(&self, direction: Direction) -> Result<u16> {
        match direction {
            Direction::Forward => Ok(0),
            Direction::Reverse if self.map.reverse_command != 0 => Ok(self.map.reverse_command),
            Direction::Reverse => Err(Error::Unsupported {
                what: "start in reverse",
                reason: "the drive's map names no bit of the control word for it",
            }),
        }
    }

    fn check_start(&self, words: &Words, command: Command) -> Result<()> {
        if let Some(control) = words.control(&self.map) {
            return Err(self.refused(command, Refusal::NotInControl(control)));
        }
        match words.chart(&self.map) {
            None => Err(self.refused(command, Refusal::State(State::Unknown))),
            Some(ChartState::Fault | ChartState::FaultReactionActive) => {
                Err(self.refused(command, self.tripped(words)))
            }
            // To leave a quick stop the voltage must go, and the motor would coast out of its fastest stop.
            Some(ChartState::QuickStopActive) if words.is_turning(&self.map) => {
                Err(self.refused(command, Refusal::State(State::QuickStop)))
            }
            Some(_) => Ok(()),
        }
    }

    /// Whether the drive itself shows that no run command is in force. Whether it leaves "operation enabled" at once or at
    /// the end of its ramp is not known, so a ramp stop also shows by the control word that the drive holds.
    async fn shows_stop(&mut self, words: &mut Words, mode: StopMode) -> Result<bool> {
        Ok(match words.chart(&self.map) {
            None => false,
            Some(ChartState::OperationEnabled) if mode == StopMode::Ramp => {
                words.append(&mut self.registers.at(Class::Stop), CMD.address(), 1).await?;
                words.at(Some(CMD.address())) == self.map.ramp_stop
            }
            Some(ChartState::OperationEnabled) => false,
            Some(ChartState::QuickStopActive) => mode != StopMode::Freewheel,
            Some(_) => true,
        })
    }

    async fn give_command(&mut self, class: Class, word: u16) -> Result<()> {
        self.registers.at(class).write(CMD, word).await
    }

    fn tripped(&self, words: &Words) -> Refusal {
        words.status(&self.map).fault_code.map_or(Refusal::Tripped, Refusal::Fault)
    }

    const fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    fn not_confirmed(&self, command: Command, words: &Words) -> Error {
        let status = Box::new(words.status(&self.map));
        Error::NotConfirmed { slave: self.registers.slave(), command, status }
    }
}
