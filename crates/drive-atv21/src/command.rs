//! What moves the motor, stops it, or decides who may.

use drive_core::{
    Class, Command, Control, Direction, Error, ErrorKind, Frequency, Port, PortError, Refusal, Result,
    Setpoint, State, Status, StopMode,
};

use crate::{
    Atv21, Authority,
    blocks::{WRITE_BLOCK, command_and_reference},
    registers as map,
    words::{CommandSource, CommandWord, StatusWord},
};

/// Statuses that are read for a confirmation before it is given up.
const CONFIRMATIONS: usize = 20;
/// How often a stop is written again where another command word has come after it.
const REPEATS: usize = 2;
/// CMOD: the serial link commands.
const SERIAL_COMMAND: u16 = 2;

impl<P: Port> Atv21<P> {
    /// Starts the motor at a frequency. Where the write block holds FA00 and FA01, and its owner says that it is in
    /// effect ([`with_write_block`](Self::with_write_block)), the drive takes both in one exchange; else the setpoint is
    /// given first.
    ///
    /// # Errors
    /// Those of [`set_setpoint`](drive_core::Drive::set_setpoint) and [`start`](drive_core::Drive::start).
    pub async fn start_at(&mut self, direction: Direction, frequency: Frequency) -> Result<Status> {
        let setpoint = Setpoint::Frequency(frequency);
        let reference = self.reference(setpoint).await?;
        let word = self.word(CommandWord::run(direction));
        let slots = self.write_slots().await?;
        let block = slots.and_then(|slots| command_and_reference(slots, word.bits(), reference.1));
        if block.is_none() {
            self.write_setpoint(setpoint).await?;
        }
        let status = self.start_motor(direction, block).await?;
        if block.is_some() {
            self.confirm_reference(setpoint, reference).await.map_err(Error::after_write)?;
        }
        Ok(status)
    }

    /// Gives the drive's emergency stop (FA00 bit 12) once, then a word without it. The drive trips with fault E,
    /// also when it is not commanded by the bus; it needs a reset afterwards. Returns the status that shows it.
    ///
    /// # Errors
    /// [`Error::NotConfirmed`] when no trip and no emergency stop shows: the motor was ordered to stop along its ramp
    /// in any case.
    pub async fn emergency_stop(&mut self) -> Result<Status> {
        let edge = self.word(CommandWord::EMERGENCY_STOP).bits();
        let clear = self.word(CommandWord::empty()).bits();
        let sent = self.registers.at(Class::Stop).edge().write(map::COMMAND_WORD, edge).await;
        // Whatever became of the edge: a word without it clears it, and stops along the ramp.
        let cleared = self.registers.at(Class::Stop).write(map::COMMAND_WORD, clear).await;
        let trips = |status: &Status| status.is_fault() || status.state == State::QuickStop;
        let status = self.read_until(Class::Stop, trips).await.map_err(Error::after_write)?;
        if trips(&status) {
            if cleared.is_err() {
                self.clear_edge(Class::Stop, CommandWord::EMERGENCY_STOP)
                    .await
                    .map_err(Error::after_write)?;
            }
            return Ok(status);
        }
        sent?;
        cleared.map_err(Error::after_write)?;
        Err(self.not_confirmed(Command::Configure("emergency stop"), status))
    }

    pub(crate) async fn start_motor(
        &mut self,
        direction: Direction,
        block: Option<[u16; 2]>,
    ) -> Result<Status> {
        let command = Command::Start(direction);
        self.check_start(command).await?;
        let word = self.word(CommandWord::run(direction));
        let mut calls = self.registers.at(Class::Command);
        let sent = match block {
            Some(words) => calls.write_words(WRITE_BLOCK, &words).await,
            None => calls.write(map::COMMAND_WORD, word.bits()).await,
        };
        match sent {
            // A write of the block that is in doubt is read back by what follows.
            Err(error) if block.is_some() && error.kind() == ErrorKind::OutcomeUnknown => {}
            sent => sent?,
        }
        self.see_start(direction, word).await.map_err(Error::after_write)
    }

    /// Reads until the drive runs and holds the run command `word`: RUN may be that of a motor that still turns from
    /// before, and the direction the old one while it reverses.
    async fn see_start(&mut self, direction: Direction, word: CommandWord) -> Result<Status> {
        let mut status = Status::default();
        for _ in 0..CONFIRMATIONS {
            status = self.read_status(Class::Command).await?;
            let runs = status_word(&status).contains(StatusWord::RUN) && !status.is_fault();
            if runs && self.holds(word, Class::Command).await? {
                let directed = status.direction == Some(direction);
                if directed || self.source(Class::Command).await? == CommandSource::Serial {
                    return Ok(status);
                }
            }
        }
        Err(self.not_confirmed(Command::Start(direction), status))
    }

    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let word = self.stop_word(mode)?;
        self.registers.at(Class::Stop).write(map::COMMAND_WORD, word.bits()).await?;
        self.see_stop(mode, word).await.map_err(Error::after_write)
    }

    /// Reads until the drive holds the stop `word` after all that it shows, and either does not run, or obeys the bus: the
    /// manual does not say whether FD01 shows "run" until the motor stands. Where another word has come after the stop,
    /// such as that of a start that was late, the stop is written again.
    async fn see_stop(&mut self, mode: StopMode, word: CommandWord) -> Result<Status> {
        let mut repeats = 0;
        let mut status = Status::default();
        for _ in 0..CONFIRMATIONS {
            status = self.read_status(Class::Stop).await?;
            if !self.holds(word, Class::Stop).await? {
                if repeats == REPEATS {
                    break;
                }
                self.registers.at(Class::Stop).write(map::COMMAND_WORD, word.bits()).await?;
                repeats += 1;
            } else if !status_word(&status).contains(StatusWord::RUN) {
                return Ok(status);
            } else if self.source(Class::Stop).await? == CommandSource::Serial {
                if status.state == State::Running {
                    status.state = State::Stopping;
                }
                return Ok(status);
            }
        }
        Err(self.not_confirmed(Command::Stop(mode), status))
    }

    /// Reads the status until it shows something, and gives the last one.
    async fn read_until(&mut self, class: Class, shows: impl Fn(&Status) -> bool + Send) -> Result<Status> {
        let mut status = self.read_status(class).await?;
        for _ in 1..CONFIRMATIONS {
            if shows(&status) {
                break;
            }
            status = self.read_status(class).await?;
        }
        Ok(status)
    }

    /// Clears an edge that may still be set because the write that cleared it was lost. A drive that has started up anew
    /// has cleared it by itself, and is not commanded again.
    async fn clear_edge(&mut self, class: Class, edge: CommandWord) -> Result<()> {
        let present = CommandWord::from_bits_retain(self.registers.at(class).read(map::COMMAND_WORD).await?);
        if !present.contains(edge) {
            return Ok(());
        }
        let clear = self.word(CommandWord::empty()).bits();
        self.registers.at(class).write(map::COMMAND_WORD, clear).await
    }

    /// The word that stops in this mode.
    pub(crate) fn stop_word(&self, mode: StopMode) -> Result<CommandWord> {
        match mode {
            StopMode::Ramp => Ok(self.word(CommandWord::empty())),
            StopMode::Freewheel => Ok(self.word(CommandWord::FREEWHEEL)),
            StopMode::DcInjection => Ok(self.word(CommandWord::DC_BRAKING)),
            StopMode::Fast => Err(Error::Unsupported {
                what: "fast stop",
                reason: "the drive's emergency stop trips it; ask for emergency_stop, or stop by ramp",
            }),
        }
    }

    pub(crate) async fn reset_trip(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if !status.is_fault() && status.state != State::QuickStop {
            return Ok(status);
        }
        let edge = self.word(CommandWord::FAULT_RESET).bits();
        let sent = self.registers.at(Class::Command).edge().write(map::COMMAND_WORD, edge).await;
        match &sent {
            Err(error) if error.kind() != ErrorKind::OutcomeUnknown => return sent.map(|()| status),
            _ => {}
        }
        // A drive that starts up anew takes other blocks into effect, if they were changed.
        self.forget_blocks();
        // The edge is cleared whether or not the drive is already starting up again and hears nothing: then it clears
        // the word by itself.
        let clear = self.word(CommandWord::empty()).bits();
        let cleared = self.registers.at(Class::Command).write(map::COMMAND_WORD, clear).await;
        let mut last = None;
        for _ in 0..CONFIRMATIONS {
            // The drive is mute while it starts up, so a read without an answer is one more reason to read again.
            let Ok(status) = self.read_status(Class::Command).await else { continue };
            if !status.is_fault() && status.state != State::QuickStop {
                if cleared.is_err() {
                    let edge = CommandWord::FAULT_RESET;
                    self.clear_edge(Class::Command, edge).await.map_err(Error::after_write)?;
                }
                return Ok(status);
            }
            last = Some(status);
        }
        match last {
            Some(status) => {
                sent.and(cleared).map_err(Error::after_write)?;
                Err(self.not_confirmed(Command::ResetFaults, status))
            }
            None => Err(Error::Port {
                slave: self.registers.slave(),
                exchange: drive_core::Exchange {
                    function: 0x06,
                    register: Some(map::COMMAND_WORD.address()),
                },
                problem: PortError::OutcomeUnknown(
                    "the drive is mute after the fault reset; read its status in 2 s",
                ),
            }),
        }
    }

    pub(crate) async fn give_control_back(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Command).await?;
        if status.state.is_moving() {
            return Err(self.refused(Command::Release, Refusal::MotorRunning));
        }
        let mode = self.registers.at(Class::Command).read(map::COMMAND_MODE).await?;
        if mode == SERIAL_COMMAND {
            let reason = Refusal::Settings("CMOD = 2 leaves the command with the bus");
            return Err(self.refused(Command::Release, reason));
        }
        self.registers.at(Class::Command).write(map::COMMAND_WORD, 0).await?;
        self.see_release().await.map_err(Error::after_write)
    }

    async fn see_release(&mut self) -> Result<Status> {
        let mut status = Status::default();
        for _ in 0..CONFIRMATIONS {
            status = self.read_status(Class::Command).await?;
            let source = self.source(Class::Command).await?;
            if source != CommandSource::Serial {
                status.control = status_control(&status, source);
                return Ok(status);
            }
        }
        Err(self.not_confirmed(Command::Release, status))
    }

    /// The command word with what this drive's owner has chosen.
    fn word(&self, order: CommandWord) -> CommandWord {
        let authority = match self.authority {
            Authority::Priority => CommandWord::PRIORITIES,
            Authority::Settings => CommandWord::empty(),
        };
        authority | self.selections | order
    }

    /// Refuses a start that the drive is not ready for.
    async fn check_start(&mut self, command: Command) -> Result<()> {
        let status = self.read_status(Class::Command).await?;
        if status.is_fault() {
            let reason = match self.fault_code(Class::Command).await? {
                0 => Refusal::Tripped,
                code => Refusal::Fault(code),
            };
            return Err(self.refused(command, reason));
        }
        if matches!(status.state, State::NotReady | State::QuickStop | State::Unknown) {
            return Err(self.refused(command, Refusal::State(status.state)));
        }
        let source = self.source_of(&status).await?;
        let word = status_word(&status);
        let foreign = source != CommandSource::Serial
            && (word.contains(StatusWord::RUN) || self.authority == Authority::Settings);
        if word.contains(StatusWord::LOCAL) || foreign {
            let control = status_control(&status, source).unwrap_or(Control::Local);
            return Err(self.refused(command, Refusal::NotInControl(control)));
        }
        self.check_preset(command).await
    }

    /// Whether this is the command word that the drive holds.
    async fn holds(&mut self, word: CommandWord, class: Class) -> Result<bool> {
        Ok(self.registers.at(class).read(map::COMMAND_WORD).await? == word.bits())
    }

    async fn source(&mut self, class: Class) -> Result<CommandSource> {
        self.registers.at(class).read(map::COMMAND_SOURCE).await.map(CommandSource::from)
    }

    /// Who commands, from the status if it tells.
    async fn source_of(&mut self, status: &Status) -> Result<CommandSource> {
        match status.raw(map::COMMAND_SOURCE.address()) {
            Some(word) => Ok(word.into()),
            None => self.source(Class::Command).await,
        }
    }
}

fn status_word(status: &Status) -> StatusWord {
    StatusWord::from_bits_retain(status.raw(map::STATUS_WORD.address()).unwrap_or(0))
}

fn status_control(status: &Status, source: CommandSource) -> Option<Control> {
    crate::status::control(status_word(status), Some(source))
}
