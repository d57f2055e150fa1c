//! Start, stop, reset: what is written to `CMD`, and how it is seen to act.

use drive_core::{
    BroadcastWrite, Calls, Class, Command, Control, Direction, Error, ErrorKind, Port, Refusal, Result,
    State, Status, StopMode,
    drivecom::{self, ChartState, Goal, Step},
};

use crate::{
    Atv28,
    registers::CMD,
    status::{FastWords, raw_command},
    words::{ControlWord, ExtendedStatus, StatusWord},
};

/// How often the status is read for a command to show, before it counts as not confirmed.
const READS: usize = 20;

impl<P: Port> Atv28<P> {
    /// Climbs the chart and gives the run command. The drive shows it by "operation enabled" and by holding the
    /// control word; "operation enabled" alone would also be the state of a drive that its terminals have just
    /// powered up in.
    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let command = Command::Start(direction);
        let run = ControlWord::run(direction);
        let mut words = self.fast_words(Class::Command).await?;
        self.check_start(&words, command)?;
        let mut given = false;
        for _ in 0..READS {
            let chart = words.chart().ok_or_else(|| self.refused(command, Refusal::State(State::Unknown)))?;
            match drivecom::next_step(chart, Goal::OperationEnabled) {
                Step::Faulted => return Err(self.refused(command, tripped(&words))),
                Step::Wait => {}
                Step::Reached if given && self.held_command(Class::Command).await? == run => {
                    let mut status = words.status(self.command);
                    status.raw.push(raw_command(run.bits()));
                    return Ok(status);
                }
                Step::Reached | Step::Write(drivecom::ENABLE_OPERATION) => {
                    self.give_command(Class::Command, run).await?;
                    given = true;
                }
                Step::Write(word) => {
                    self.give_command(Class::Command, ControlWord::from_bits_retain(word)).await?;
                }
            }
            words = self.fast_words(Class::Command).await?;
        }
        Err(self.not_confirmed(command, &words))
    }

    /// Writes the stop first, whatever the drive's state, and then reads until the drive shows it.
    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let command = Command::Stop(mode);
        let stop = stop_word(mode);
        self.give_command(Class::Stop, stop).await?;
        let mut words = self.fast_words(Class::Stop).await?;
        for _ in 1..READS {
            if shows_stop(&words, mode) {
                break;
            }
            words = self.fast_words(Class::Stop).await?;
        }
        if shows_stop(&words, mode) {
            Ok(words.status(self.command))
        } else {
            Err(self.not_confirmed(command, &words))
        }
    }

    /// One rising edge of the reset bit, cleared at once. A drive without a fault is left alone.
    pub(crate) async fn reset_once(&mut self) -> Result<Status> {
        let mut words = self.fast_words(Class::Command).await?;
        if !is_tripped(&words) {
            return Ok(words.status(self.command));
        }
        let edge = self.registers.at(Class::Command).edge().write(CMD, drivecom::FAULT_RESET).await;
        // An edge that may have arrived is cleared as well, so that the next one rises; the status tells the outcome.
        if let Err(error) = edge
            && error.kind() != ErrorKind::OutcomeUnknown
        {
            return Err(error);
        }
        self.give_command(Class::Command, ControlWord::empty()).await?;
        for _ in 0..READS {
            words = self.fast_words(Class::Command).await?;
            if words.chart().is_some() && !is_tripped(&words) {
                return Ok(words.status(self.command));
            }
        }
        Err(self.not_confirmed(Command::ResetFaults, &words))
    }

    fn check_start(&self, words: &FastWords, command: Command) -> Result<()> {
        let turning = words.eti().contains(ExtendedStatus::MOTOR_RUNNING);
        let forced_local = !words.eta().contains(StatusWord::REMOTE);
        // At power-up the terminals command and the motor stands; the first command of the line takes over then. A
        // motor that somebody else has running is not taken away from him.
        let taken = turning && words.control() != Control::Bus;
        match words.chart() {
            None => Err(self.refused(command, Refusal::State(State::Unknown))),
            Some(ChartState::Fault | ChartState::FaultReactionActive) => {
                Err(self.refused(command, tripped(words)))
            }
            _ if forced_local || taken => Err(self.refused(command, Refusal::NotInControl(words.control()))),
            Some(ChartState::QuickStopActive) if turning => {
                Err(self.refused(command, Refusal::State(State::QuickStop)))
            }
            Some(_) => Ok(()),
        }
    }

    /// Writes the control word and remembers it; not known while the outcome is not known.
    async fn give_command(&mut self, class: Class, word: ControlWord) -> Result<()> {
        self.command = None;
        self.registers.at(class).write(CMD, word.bits()).await?;
        self.command = Some(word);
        Ok(())
    }

    async fn held_command(&mut self, class: Class) -> Result<ControlWord> {
        let mut calls: Calls<'_, P> = self.registers.at(class);
        let held = ControlWord::from_bits_retain(calls.read(CMD).await?);
        self.command = Some(held);
        Ok(held)
    }

    const fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    fn not_confirmed(&self, command: Command, words: &FastWords) -> Error {
        let status = Box::new(words.status(self.command));
        Error::NotConfirmed { slave: self.registers.slave(), command, status }
    }
}

/// The write that stops all drives on a line.
pub(crate) const fn broadcast(mode: StopMode) -> BroadcastWrite {
    BroadcastWrite { function: 0x06, register: CMD.address(), value: stop_word(mode).bits() }
}

/// The stops by bits 12 to 14 keep operation enabled; without voltage the motor coasts (BBV51701 p. 11, 12, 19).
const fn stop_word(mode: StopMode) -> ControlWord {
    let enabled = ControlWord::from_bits_retain(drivecom::ENABLE_OPERATION);
    match mode {
        StopMode::Ramp => enabled.union(ControlWord::STOP),
        StopMode::Fast => enabled.union(ControlWord::FAST_STOP),
        StopMode::DcInjection => enabled.union(ControlWord::DC_INJECTION),
        StopMode::Freewheel => ControlWord::from_bits_retain(drivecom::DISABLE_VOLTAGE),
    }
}

/// Whether the drive itself shows that no run command acts: it has left "operation enabled", or there the motor stands,
/// slows down or is braked.
fn shows_stop(words: &FastWords, mode: StopMode) -> bool {
    const BRAKES: ExtendedStatus =
        ExtendedStatus::DECELERATING.union(ExtendedStatus::FAST_STOP).union(ExtendedStatus::DC_INJECTION);
    match words.chart() {
        None => false,
        Some(ChartState::OperationEnabled) => {
            let turning = words.eti().contains(ExtendedStatus::MOTOR_RUNNING);
            mode != StopMode::Freewheel && (!turning || words.eti().intersects(BRAKES))
        }
        Some(ChartState::QuickStopActive) => mode != StopMode::Freewheel,
        Some(_) => true,
    }
}

fn is_tripped(words: &FastWords) -> bool {
    matches!(words.chart(), Some(ChartState::Fault | ChartState::FaultReactionActive))
}

fn tripped(words: &FastWords) -> Refusal {
    match words.status(None).fault_code {
        Some(code) if code != 0 => Refusal::Fault(code),
        _ => Refusal::Tripped,
    }
}
