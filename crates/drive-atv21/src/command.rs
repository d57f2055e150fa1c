//! What moves the motor and what stops it.

use drive_core::{
    Class, Command, Confirming, Control, Direction, Error, ErrorKind, Frequency, Lease, Port, Refusal,
    Result, SETTLED_WITHIN, Setpoint, State, Status, StopMode, Stopped,
};
use tokio::time::Instant;

use crate::{
    Atv21, Authority,
    blocks::{WRITE_BLOCK, WriteSlot, command_and_reference},
    control::{
        BY_SERIAL_LINK, REFERENCE_BY_SERIAL_LINK, commanded_by_other, is_falling, not_in_force, source,
        status_word, who,
    },
    proof::withheld,
    refusals::{OTHER_REFERENCE, OTHER_WORD, ST_OFF},
    registers as map,
    setpoint::is_same,
    words::{CommandSource, CommandWord, StatusWord},
};

impl<P: Port> Atv21<P> {
    /// Starts the motor at a frequency. Where the write block holds FA00 and FA01, and its owner says that it is in
    /// effect ([`with_write_block`](Self::with_write_block)), the drive takes both in one exchange; else the setpoint is
    /// given first.
    ///
    /// # Errors
    /// Those of [`set_setpoint`](drive_core::Drive::set_setpoint) and [`start`](drive_core::Drive::start).
    pub async fn start_at(&mut self, direction: Direction, frequency: Frequency) -> Result<Status> {
        let setpoint = Setpoint::Frequency(frequency);
        self.registers.begin_order();
        let reference = self.reference(setpoint).await?;
        let slots = self.write_slots().await?;
        let block = slots.filter(|slots| command_and_reference(*slots, 0, 0).is_some());
        self.judge_start(direction).await?;
        let Some(slots) = block else {
            self.write_setpoint(setpoint).await?;
            self.registers.begin_order();
            return self.start_motor(direction, None).await;
        };
        let has_cleared = self.clear_other_reference(reference.0).await?;
        let started = self.start_motor(direction, Some((slots, reference.1))).await;
        let status = started.map_err(|error| if has_cleared { error.after_write() } else { error })?;
        self.confirm_reference(setpoint, reference).await.map_err(Error::after_write)?;
        Ok(status)
    }

    pub(crate) async fn start_motor(
        &mut self,
        direction: Direction,
        block: Option<([WriteSlot; 2], u16)>,
    ) -> Result<Status> {
        let (held, word) = self.judge_start(direction).await?;
        let takes = Self::takes(held, word);
        if takes {
            self.take_command(Command::Start(direction), held, word).await?;
        }
        // The lease is there before the word is on its way: a call that is dropped here leaves somebody who withdraws
        // it.
        self.watch.run.give(Lease::new(direction, word.bits()));
        self.watch.run.sends(word.bits());
        let both = block.and_then(|(slots, reference)| command_and_reference(slots, word.bits(), reference));
        let mut calls = self.registers.at(Class::Command);
        let sent = match both {
            Some(words) => calls.write_words(WRITE_BLOCK, &words).await,
            None => calls.write(map::COMMAND_WORD, word.bits()).await,
        };
        self.registers.owe_judgement();
        match sent {
            Ok(()) => self.watch.run.was_written(),
            // What was refused may be a repetition of what was carried out, and a block in doubt is read back.
            Err(error) if error.kind() == ErrorKind::Exception => {
                if self.command_word(Class::Command).await.map_err(Error::after_write)? != word {
                    self.watch.run.was_not_written();
                    return Err(error);
                }
            }
            Err(error) if both.is_some() && error.kind() == ErrorKind::OutcomeUnknown => {}
            Err(error) if error.kind() == ErrorKind::NotSent => {
                self.watch.run.was_not_written();
                // Command was taken before.
                return Err(if takes { error.after_write() } else { error });
            }
            Err(error) => return Err(error),
        }
        self.see_start(direction, word).await.map_err(Error::after_write)
    }

    /// Refuses a start that would not come into force, as far as that is known before anything is written. Else what FA00 holds, and
    /// the run command. Where FA00 has to take command first, only that shows who decides then.
    pub(crate) async fn judge_start(&mut self, direction: Direction) -> Result<(CommandWord, CommandWord)> {
        let command = Command::Start(direction);
        self.check_itself(command).await?;
        let (status, held) = self.check_start(command).await?;
        let word = self.run_word(direction, held);
        if !Self::takes(held, word)
            && let Some(reason) = self.decides_instead(&status, held).await?
        {
            return Err(self.refused(command, reason));
        }
        Ok((held, word))
    }

    /// Whether `word` makes the bus the active source by what it holds besides its run command, and FA00 does not yet.
    fn takes(held: CommandWord, word: CommandWord) -> bool {
        let run = CommandWord::RUN | CommandWord::REVERSE;
        held - run != word - run && !held.contains(CommandWord::RUN)
    }

    /// What decides instead of the bus, or keeps the output off, with this word in FA00.
    async fn decides_instead(&mut self, status: &Status, word: CommandWord) -> Result<Option<Refusal>> {
        let st_off = status_word(status).contains(StatusWord::FREEWHEEL).then_some(ST_OFF);
        let because = match commanded_by_other(status) {
            None => not_in_force(word, self.active_reference().await?),
            other => other,
        };
        Ok(because.or(st_off))
    }

    /// Refuses a start that the drive is not ready for, and reads what FA00 holds.
    async fn check_start(&mut self, command: Command) -> Result<(Status, CommandWord)> {
        let status = self.read_briefly().await?;
        let word = status_word(&status);
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
        let foreign = source(&status) != CommandSource::Serial
            && (word.contains(StatusWord::RUN) || self.authority == Authority::Settings);
        if word.contains(StatusWord::LOCAL) || foreign {
            return Err(self.refused(command, Refusal::NotInControl(who(word, source(&status)))));
        }
        let held = self.command_word(Class::Command).await?;
        if self.authority == Authority::Priority
            && (self.modes.is_none() || source(&status) != CommandSource::Serial)
        {
            self.read_modes(Class::Command).await?;
        }
        if word.contains(StatusWord::FREEWHEEL) && !held.contains(CommandWord::FREEWHEEL) {
            return Err(self.refused(command, ST_OFF));
        }
        Ok((status, held))
    }

    /// Makes the bus the active source of command and reference by what `word` holds besides its run command, and sees
    /// that it is, before a run command is written. Where something else decides, FA00 gets back what it held.
    async fn take_command(&mut self, command: Command, held: CommandWord, word: CommandWord) -> Result<()> {
        self.write_command_word(word - CommandWord::RUN - CommandWord::REVERSE).await?;
        let mut settling = Confirming::within(SETTLED_WITHIN);
        let reason = loop {
            let status = self.read_briefly().await.map_err(Error::after_write)?;
            match self.decides_instead(&status, word).await.map_err(Error::after_write)? {
                None => return Ok(()),
                Some(reason) if !settling.again().await => break reason,
                Some(_) => {}
            }
        };
        // What acts once has acted: written again it would trip or reset the drive once more.
        let before = CommandWord::from_bits_truncate(held.bits()) - CommandWord::EDGES;
        self.write_command_word(before).await.map_err(Error::after_write)?;
        Err(self.refused(command, reason))
    }

    /// Writes FA00, but for a stop; what may stand there then is remembered.
    pub(crate) async fn write_command_word(&mut self, word: CommandWord) -> Result<()> {
        self.held = None;
        self.watch.run.sends(word.bits());
        self.registers.at(Class::Command).write(map::COMMAND_WORD, word.bits()).await?;
        self.held = Some(word);
        Ok(())
    }

    /// Reads until the drive shows that the run command is in force: FA00 holds it, FE45 and FE46 name the bus, FD01 runs
    /// with ST on (bits 10, 11, 13), and FE02 is the reference of the bus. A motor that turned the other way slows down
    /// first: it is on its way, and the status tells the direction in which it still turns.
    async fn see_start(&mut self, direction: Direction, word: CommandWord) -> Result<Status> {
        // Whether UL bounds FE02 no manual says; it bounds the output. Read before: nothing is behind the last look, which shows a stop of
        // somebody else's.
        let high = self.upper_limit().await.ok();
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let mut first = None;
        loop {
            let (status, because, runs) = match self.look_at_start(word).await {
                Ok(seen) => seen,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            let directed = status.direction == Some(direction) || is_falling(first, status.output_frequency);
            if because.is_none() && runs && directed {
                let verdict = self.verdict(&status);
                let reference = status.reference.map(|told| high.map_or(told, |high| high.min(told)));
                return Ok(Status { verdict, reference, ..status });
            }
            first = first.or(status.output_frequency);
            let over = because.is_some() && (status.is_fault() || Instant::now() >= settled);
            if over || !confirming.again().await {
                let because = because.or_else(|| withheld(status_word(&status)));
                let verdict = self.verdict(&status);
                let status = Status { verdict, ..status };
                return Err(self.not_confirmed(Command::Start(direction), status, because));
            }
        }
    }

    /// What the drive shows of the run command `word`: its status, what decides instead, and whether it runs. FA00 is read
    /// after all else, so that no stop of somebody else's is hidden.
    async fn look_at_start(&mut self, word: CommandWord) -> Result<(Status, Option<Refusal>, bool)> {
        let mut status = self.read_status(Class::Command).await?;
        let shown = status_word(&status);
        let runs = shown.contains(StatusWord::RUN | StatusWord::STANDBY_RUN);
        let mut because = commanded_by_other(&status);
        if because.is_none() {
            because = not_in_force(word, self.active_reference().await?);
        }
        if because.is_none() && runs && word.preset_speed() == 0 {
            because = self.other_than_fa01(&mut status).await?;
        }
        if status.is_fault() {
            because = Some(Refusal::Tripped);
        } else if self.command_word(Class::Command).await? != word {
            because = Some(OTHER_WORD);
        } else if shown.contains(StatusWord::FREEWHEEL) {
            because = Some(ST_OFF);
        }
        Ok((status, because, runs))
    }

    /// Whether the reference before the ramp is another one than that of FA01, and none that FA13 explains. The status is
    /// told the one that the motor follows.
    async fn other_than_fa01(&mut self, status: &mut Status) -> Result<Option<Refusal>> {
        let mut calls = self.registers.at(Class::Command);
        let in_force = calls.read(map::REFERENCE_BEFORE_RAMP).await?;
        status.reference = Some(Frequency::from_centihertz(in_force.into()));
        if let Some(agreed @ (register, word)) = self.proof.agreed
            && register.address() == map::FREQUENCY_REFERENCE.address()
            && is_same(in_force, word)
        {
            self.proof.agree(agreed, in_force);
            return Ok(None);
        }
        let frequency = calls.read(map::FREQUENCY_REFERENCE).await?;
        if is_same(in_force, frequency) {
            self.proof.agree((map::FREQUENCY_REFERENCE, frequency), in_force);
            return Ok(None);
        }
        let speed = if frequency == 0 { calls.read(map::SPEED_REFERENCE).await? } else { 0 };
        if speed == 0 {
            self.proof.agree((map::FREQUENCY_REFERENCE, frequency), in_force);
            return Ok(Some(OTHER_REFERENCE));
        }
        self.proof.agree((map::SPEED_REFERENCE, speed), speed);
        Ok(None)
    }

    pub(crate) async fn stop_motor(&mut self, asked: StopMode) -> Result<Stopped> {
        let mode = if asked == StopMode::Fast { StopMode::Ramp } else { asked };
        let instead = (mode != asked).then_some("its only faster stop, the emergency stop, trips the drive");
        let mut word = self.stop_word(mode);
        let mut taken_from = self.commander().filter(|_| !self.holds_priority());
        // What became of it, the reading tells.
        self.write_stop(word).await?.ok();
        self.registers.owe_judgement();
        let (mut confirming, mut settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let (mut first, mut force) = (None, None);
        let (status, because, sent) = loop {
            let (mut status, held) = match self.status_and_command_word().await {
                Ok(seen) => seen,
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error.after_write()),
            };
            let output = status.output_frequency;
            let runs = status_word(&status).contains(StatusWord::RUN) && !status.is_fault();
            let other = commanded_by_other(&status);
            let takes = runs && other.is_some() && !word.contains(CommandWord::COMMAND_PRIORITY);
            if takes {
                taken_from = Some(who(status_word(&status), source(&status)));
                word |= CommandWord::COMMAND_PRIORITY;
            }
            let (mut because, mut sent) = (None, Ok(()));
            if held != word {
                // Refused, overtaken by another one such as that of a start that was late, or not enough.
                because = Some(OTHER_WORD);
                sent = self.write_stop(word).await.map_err(Error::after_write)?;
                settled = Instant::now() + SETTLED_WITHIN;
            } else if runs && other.is_some() {
                because = other;
            } else if runs {
                // FD01 may show "run" until the motor stands, or the terminals run it whatever FE45 says.
                if force.is_none() {
                    force = Some(self.terminals().await.ok().and_then(|terminals| terminals.force()));
                }
                because = force.flatten();
            }
            if !held.contains(CommandWord::RUN) {
                self.watch.run.end();
            }
            let comes_down = output == Some(Frequency::ZERO) || is_falling(first, output);
            if because.is_none() && (!runs || comes_down) {
                // FD01 may show "run" for as long as the motor comes down, and the order is gone.
                if status.state == State::Running {
                    status.state = State::Stopping;
                }
                let taken_from = taken_from.filter(|_| source(&status) == CommandSource::Serial);
                status.verdict = None;
                let stopped = Stopped { instead, taken_from, ..Stopped::by(mode, status) };
                return Ok(stopped.held_by(&self.watch.shaft));
            }
            self.registers.tell_follower(&status, &sent);
            first = first.or(output);
            let over = because.is_some() && held == word && Instant::now() >= settled;
            if over || !confirming.again().await {
                break (status, because, sent);
            }
        };
        sent?;
        Err(self.not_confirmed(Command::Stop(asked), status, because))
    }

    /// The status, and after all that it shows FA00. FD01 is read before FE45: where another commands, who may have taken the motor
    /// between the two and runs it, all is read again. Who takes it while FA00 is read is told by the next status: with FE45 last, a
    /// start that comes late would be hidden instead, and both in one exchange the drive does not tell.
    async fn status_and_command_word(&mut self) -> Result<(Status, CommandWord)> {
        let mut status = self.read_status(Class::Command).await?;
        if commanded_by_other(&status).is_some() && !status_word(&status).contains(StatusWord::RUN) {
            status = self.read_status(Class::Command).await?;
        }
        Ok((status, self.command_word(Class::Command).await?))
    }

    /// Writes a stop. That the drive refuses it, or that nobody knows whether it arrived, is given back: what the drive
    /// shows tells more.
    pub(crate) async fn write_stop(&mut self, word: CommandWord) -> Result<Result<()>> {
        let sent = self.registers.at(Class::Stop).write_word(map::COMMAND_WORD.address(), word.bits()).await;
        if let Err(error) = &sent
            && error.kind() == ErrorKind::NotSent
        {
            return sent.map(Ok);
        }
        self.held = Some(word);
        self.watch.run.sends(word.bits());
        Ok(sent)
    }

    /// The word that stops in this mode and leaves to others what is theirs: motor, PID control, ramp and the priorities
    /// stay as the drive holds them. A drive that was never read is commanded by the bus from then on; its reference is nothing that a
    /// stop needs, and the priority of the bus's would override the plant's own switch of it (§6.2 p. 16).
    pub(crate) fn stop_word(&self, mode: StopMode) -> CommandWord {
        let order = match mode {
            StopMode::Ramp | StopMode::Fast => CommandWord::empty(),
            StopMode::Freewheel => CommandWord::FREEWHEEL,
            StopMode::DcInjection => CommandWord::DC_BRAKING,
        };
        let kept = self.held.map_or(CommandWord::COMMAND_PRIORITY, |held| held & CommandWord::KEPT);
        (self.priorities() & CommandWord::COMMAND_PRIORITY) | kept | order
    }

    /// The run command in this direction, with what its owner has chosen, or else as the drive holds it.
    pub(crate) fn run_word(&self, direction: Direction, held: CommandWord) -> CommandWord {
        let chosen = match self.selections {
            Some(selections) => selections | (held & CommandWord::PRIORITIES),
            None => held & CommandWord::KEPT,
        };
        self.priorities() | chosen | CommandWord::run(direction)
    }

    /// What makes the bus command the drive: nothing where CMOD and FMOD do so already. A priority that is not needed would
    /// override the plant's own switch of the reference (§6.2 p. 16).
    fn priorities(&self) -> CommandWord {
        if self.authority == Authority::Settings {
            return CommandWord::empty();
        }
        let [command, reference] = self.modes.unwrap_or_default();
        let mut priorities = CommandWord::PRIORITIES;
        priorities.set(CommandWord::COMMAND_PRIORITY, command != Some(BY_SERIAL_LINK));
        priorities.set(CommandWord::REFERENCE_PRIORITY, reference != Some(REFERENCE_BY_SERIAL_LINK));
        priorities
    }

    fn holds_priority(&self) -> bool {
        self.held.is_some_and(|held| held.contains(CommandWord::COMMAND_PRIORITY))
    }

    /// Who else commanded the drive when it was last read.
    fn commander(&self) -> Option<Control> {
        self.shown.map(|(word, source)| who(word, source)).filter(|who| *who != Control::Bus)
    }
}
