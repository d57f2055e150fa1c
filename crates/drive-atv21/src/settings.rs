//! What is set and stays: parameters, the watchdog, the indirect blocks, outputs, energy counters, stall level.

use std::time::Duration;

use drive_core::{
    Class, Command, Confirming, Error, ExceptionMeaning, Port, Reaction, Refusal, Result, Row, Watchdog,
    Written,
    registers::{Register, Storage, access::ReadWrite, refuse_commands},
};

use crate::{
    Atv21, WATCHDOG_LONGEST, WriteBlock,
    blocks::{BlockSetUp, Blocks, ReadSlot, WriteSlot},
    control::DECIDE,
    in_effect::ReadBlock,
    registers as map,
    words::{CommandWord, CommandWord2, StatusWord2},
};

/// F603 as the drive is delivered, which the manual does not explain.
const FACTORY_REACTION: u16 = 4;
const STALL_LEVEL: Command = Command::Configure("stall level");
const ENERGY_RESET: Command = Command::Configure("energy reset");

/// What orders the drive: each has methods that check the drive first.
const COMMANDS: [u16; 4] = [
    map::COMMAND_WORD.address(),
    map::COMMAND_WORD_2.address(),
    map::FREQUENCY_REFERENCE.address(),
    map::SPEED_REFERENCE.address(),
];

/// From which current on the drive limits it (Altivar 21 Modbus §8.4, p. 32).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StallLevel {
    /// OC1, the parameter F601.
    Oc1,
    /// OC2, the parameter F185.
    Oc2,
}

/// The drive refuses its watchdog though nothing runs: waiting for standstill does not help.
const NOT_NOW_AT_REST: Refusal = Refusal::Settings(
    "the drive refuses its watchdog (exception 04) though the motor stands: see to the supply of its power part and to a lock \
     of its parameters",
);

/// Whether it chooses what a place of a block holds: F870, F871, F875 to F879.
fn is_slot(row: &Row) -> bool {
    map::READ_SLOTS_IN_ORDER
        .iter()
        .chain(&map::WRITE_SLOTS_IN_ORDER)
        .any(|slot| slot.address() == row.address)
}

impl<P: Port> Atv21<P> {
    /// Sets up the indirect blocks: writes those of F875 to F879, F870 and F871 that differ, each to EEPROM, and reads
    /// them back. They take effect after the next reset or power cycle of the drive; until [`forget`], or a fault reset
    /// by this value, it reads single words when something was changed.
    ///
    /// [`forget`]: drive_core::Drive::forget
    ///
    /// # Errors
    /// [`Error::ValueNotAllowed`] for a slot that the manual does not list, before anything is written;
    /// [`Error::NotConfirmed`] when a slot reads back otherwise.
    pub async fn set_up_blocks(&mut self, blocks: Blocks) -> Result<BlockSetUp> {
        let read = map::READ_SLOTS_IN_ORDER.into_iter().zip(blocks.read.map(ReadSlot::number));
        let write = map::WRITE_SLOTS_IN_ORDER.into_iter().zip(blocks.write.map(WriteSlot::number));
        let slots: Vec<_> = read.chain(write).collect();
        for (register, number) in &slots {
            self.check_value(register.row(), *number)?;
        }
        let before = self.eeprom_writes;
        let command = Command::Configure("indirect blocks");
        let mut result = Ok(());
        for (register, number) in slots {
            result = self.change_parameter(register.row(), number, command).await.map(drop);
            if result.is_err() {
                break;
            }
        }
        let writes = self.eeprom_writes.saturating_sub(before);
        result.map(|()| BlockSetUp { writes, needs_reset: writes > 0 })
    }

    /// Switches the relay RY by FA50. F130 or F137 must say 38 (§8.8).
    ///
    /// # Errors
    /// [`Error::NotConfirmed`] when FA50 reads back otherwise.
    pub async fn set_relay(&mut self, on: bool) -> Result<()> {
        self.set_output(map::LOGIC_OUTPUT_COMMAND, u16::from(on)).await
    }

    /// Sets the analog output FM by FA51, 0 to 1023. FMSL must be 18 (§8.8).
    ///
    /// # Errors
    /// [`Error::ValueNotAllowed`] above 1023; [`Error::NotConfirmed`] when FA51 reads back otherwise.
    pub async fn set_analog_output(&mut self, value: u16) -> Result<()> {
        self.set_output(map::ANALOG_OUTPUT_COMMAND, value).await
    }

    /// Sets the energy counters FE76 and FE77 to zero by FA20 bit 1: written once, seen in FD42, then cleared. It works
    /// whoever commands the drive.
    ///
    /// # Errors
    /// [`Error::NotConfirmed`] when FD42 does not show the reset.
    pub async fn reset_energy(&mut self) -> Result<()> {
        let present = CommandWord2::from_bits_retain(self.read_background(map::COMMAND_WORD_2).await?);
        let edge = (present | CommandWord2::ENERGY_RESET).bits();
        let clear = (present - CommandWord2::ENERGY_RESET).bits();
        let sent = self.registers.at(Class::Background).edge().write(map::COMMAND_WORD_2, edge).await;
        let shown = self.shows(StatusWord2::ENERGY_RESET, true).await;
        let cleared = self.registers.at(Class::Background).write(map::COMMAND_WORD_2, clear).await;
        cleared.map_err(Error::after_write)?;
        if shown.map_err(Error::after_write)? {
            return Ok(());
        }
        sent?;
        let status = self.read_status(Class::Background).await?;
        Err(self.not_confirmed(ENERGY_RESET, status, None))
    }

    /// Chooses the overcurrent stall level by FA20 bit 12. It holds until the command priority, the supply or a reset
    /// ends it.
    ///
    /// # Errors
    /// [`Error::Refused`] when the command priority (FA00 bit 15) is not set, without which the drive does not listen;
    /// [`Error::NotConfirmed`] when FD42 does not show it.
    pub async fn set_stall_level(&mut self, level: StallLevel) -> Result<()> {
        let command = CommandWord::from_bits_retain(self.read_background(map::COMMAND_WORD).await?);
        if !command.contains(CommandWord::COMMAND_PRIORITY) {
            let reason = Refusal::Settings(
                "FA20 bit 12 works only with FA00 bit 15, the command priority: open the drive with Authority::Priority",
            );
            return Err(self.refused(STALL_LEVEL, reason));
        }
        let mut word = CommandWord2::from_bits_retain(self.read_background(map::COMMAND_WORD_2).await?);
        let second = level == StallLevel::Oc2;
        word.set(CommandWord2::STALL_LEVEL_2, second);
        self.registers.at(Class::Background).write(map::COMMAND_WORD_2, word.bits()).await?;
        if self.shows(StatusWord2::STALL_LEVEL_2, second).await.map_err(Error::after_write)? {
            return Ok(());
        }
        let status = self.read_status(Class::Background).await?;
        Err(self.not_confirmed(STALL_LEVEL, status, None))
    }

    pub(crate) async fn read_watchdog(&mut self) -> Result<Watchdog> {
        let seconds = self.read_background(map::TIME_OUT).await?;
        let reaction = match self.read_background(map::TIME_OUT_REACTION).await? {
            0 => Reaction::Freewheel,
            1 => Reaction::Ramp,
            2 => Reaction::DcInjection,
            other => Reaction::Unknown(other),
        };
        let timeout = (seconds != 0).then(|| Duration::from_secs(seconds.into()));
        Ok(Watchdog { timeout, reaction: Some(reaction) })
    }

    pub(crate) async fn write_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.check_own(Command::ArmWatchdog).await?;
        let reaction_word = match reaction {
            Reaction::Ignore => None,
            Reaction::Freewheel => Some(0),
            Reaction::Ramp => Some(1),
            Reaction::DcInjection => Some(2),
            Reaction::Unknown(FACTORY_REACTION) => Some(FACTORY_REACTION),
            Reaction::Fast | Reaction::Trip | Reaction::Unknown(_) => {
                return Err(Error::Unsupported {
                    what: "this watchdog reaction",
                    reason: "F603 has freewheel, ramp stop and DC injection",
                });
            }
        };
        let seconds = if reaction == Reaction::Ignore { 0 } else { self.watchdog_seconds(timeout)? };
        if let Some(word) = reaction_word {
            // Before the time, so that it never runs with the reaction of before.
            self.change_parameter(map::TIME_OUT_REACTION.row(), word, Command::ArmWatchdog).await?;
        }
        self.change_parameter(map::TIME_OUT.row(), seconds, Command::ArmWatchdog).await?;
        self.watch.set_armed(seconds != 0);
        self.read_watchdog().await
    }

    /// Writes a parameter for its own sake. What decides who commands is changed only while the motor stands and no input
    /// would start it then.
    pub(crate) async fn set_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &COMMANDS)?;
        if row.address == map::ADDRESS.address() {
            return Err(Error::Unsupported {
                what: "writing F802 as a parameter",
                reason: "the drive answers at the new address at once, and at none for 0; set it at the keypad",
            });
        }
        let command = Command::WriteParameter(row.address);
        self.check_own(command).await?;
        if DECIDE.iter().any(|register| register.address() == row.address) {
            self.check_value(row, word)?;
            let moves = self.read_status(Class::Command).await?.state.is_moving();
            if moves || self.command_word(Class::Command).await?.contains(CommandWord::RUN) {
                // A run command that stands and does not act, of this side or another, may act by it.
                return Err(self.refused(command, Refusal::MotorRunning));
            }
            if let Some(reason) = self.terminals().await?.with(row.address, word).would_start() {
                return Err(self.refused(command, reason));
            }
        }
        self.change_parameter(row, word, command).await
    }

    /// Writes a parameter unless it holds the value already, and reads it back.
    pub(crate) async fn change_parameter(
        &mut self,
        row: &'static Row,
        word: u16,
        command: Command,
    ) -> Result<Written> {
        self.check_value(row, word)?;
        let mut calls = self.registers.at(Class::Background);
        if calls.read_row(row).await? == word {
            return Ok(Written { changed: false, storage: row.storage });
        }
        if is_slot(row) {
            // From now on what is configured is not what is in effect, also when the answer is lost.
            self.read_block = ReadBlock::Unused;
            self.write_block = WriteBlock::Unused;
        }
        // UL, CMOD and FMOD may be others then.
        (self.upper_limit, self.modes) = (None, None);
        if row.storage == Storage::Eeprom {
            // Counted before the answer: the EEPROM may wear by a write whose answer is lost.
            self.eeprom_writes = self.eeprom_writes.saturating_add(1);
        }
        let sent = calls.write_row(row, word).await;
        match sent {
            Err(Error::Exception { meaning: ExceptionMeaning::NotNow, .. })
                if command == Command::ArmWatchdog
                    && !self.read_status(Class::Background).await?.state.is_moving() =>
            {
                return Err(self.refused(command, NOT_NOW_AT_REST));
            }
            Err(error) if error.kind() != drive_core::ErrorKind::OutcomeUnknown => return Err(error),
            _ => {}
        }
        let mut calls = self.registers.at(Class::Background);
        if calls.read_row(row).await.map_err(Error::after_write)? == word {
            self.watch.knows(row.address, word);
            return Ok(Written { changed: true, storage: row.storage });
        }
        sent?;
        let status = self.read_status(Class::Background).await?;
        Err(self.not_confirmed(command, status, None))
    }

    /// What a row forbids, before anything is sent.
    fn check_value(&self, row: &Row, word: u16) -> Result<()> {
        let slave = self.registers.slave();
        if !row.access.is_writable() {
            let (register, code, access) = (row.address, row.code, row.access);
            return Err(Error::AccessForbidden { slave, register, code, access });
        }
        let value = row.unit.number(word);
        if row.range.allows(value) {
            return Ok(());
        }
        Err(Error::ValueNotAllowed { slave, register: row.address, code: row.code, value })
    }

    fn watchdog_seconds(&self, timeout: Duration) -> Result<u16> {
        let seconds = u16::try_from(timeout.as_secs()).unwrap_or(u16::MAX);
        let step = Duration::from_secs(1);
        if timeout < step || timeout > WATCHDOG_LONGEST || timeout.subsec_nanos() != 0 {
            let slave = self.registers.slave();
            return Err(Error::WatchdogTime { slave, timeout, min: step, max: WATCHDOG_LONGEST, step });
        }
        Ok(seconds)
    }

    async fn set_output(&mut self, register: Register<ReadWrite>, word: u16) -> Result<()> {
        let command = Command::WriteParameter(register.address());
        self.change_parameter(register.row(), word, command).await.map(drop)
    }

    async fn read_background(&mut self, register: Register<ReadWrite>) -> Result<u16> {
        let word = self.registers.at(Class::Background).read(register).await?;
        self.watch.knows(register.address(), word);
        Ok(word)
    }

    /// Whether FD42 comes to show these bits set or clear.
    async fn shows(&mut self, bits: StatusWord2, set: bool) -> Result<bool> {
        let mut confirming = Confirming::begin();
        loop {
            let word = self.registers.at(Class::Background).read(map::STATUS_WORD_2).await?;
            let shown = StatusWord2::from_bits_retain(word).contains(bits) == set;
            if shown || !confirming.again().await {
                return Ok(shown);
            }
        }
    }
}
