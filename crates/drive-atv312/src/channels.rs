//! Who commands the drive: giving control to the bus when asked, and giving it back.

use drive_core::{
    Class, Command, Control, Effect, Error, Port, Result, Status,
    drivecom::{self, CONFIRMING_READS, Drivecom},
    registers::{Register, access::WriteStopped},
};

use crate::{
    Atv312,
    registers::{CCS, CD1, CD2, CHCF, DCI, FR1, FR2, FST, LAC, LRS3, RFC},
    settings::{CD13, CD14, REFERENCE_BY_MODBUS},
    status::FastWords,
    words::{AccessLevel, ExtendedStatus3},
};

/// `LAC` = L3.
const L3: u16 = 2;
/// `CHCF` = SEP.
const SEPARATE: u16 = 2;
/// `rFC` = Fr1.
const REFERENCE_1: u16 = 96;
/// `CCS` = Cd1.
const COMMAND_1: u16 = 98;
/// `Cd1`, `Cd2` = Mdb.
const COMMAND_BY_MODBUS: u16 = 10;
/// `Cd1`, `Cd2` = tEr.
const COMMAND_BY_TERMINALS: u16 = 1;
/// `Fr1`, `Fr2` = AI1.
const REFERENCE_BY_AI1: u16 = 1;
/// A function that is not assigned.
const UNASSIGNED: u16 = 0;

impl<P: Port> Atv312<P> {
    /// Sets the drive up for command and reference by Modbus: `LAC` = L3, `CHCF` = SEP, `Cd1` = `Fr1` = Mdb, both
    /// selected, and, as far as nothing else is assigned, `FSt` = Cd14 and `dCI` = Cd13, so that the control word keeps
    /// all its stops (BBV51701 p. 11, 16, 35–37, 40). What is set that way already is not written. Nothing of it
    /// survives a power cycle until [`persist`](drive_core::Drive::persist).
    ///
    /// **Going to L3 returns `Fr1`, `Cd1`, `CHCF` and `tCC` to their factory setting, and only a return to factory
    /// settings leads back to L1 or L2** (p. 35). The drive is left in "switch on disabled".
    ///
    /// # Errors
    /// [`Error::Refused`] while the motor runs or the drive saves its parameters; [`Error::NotConfirmed`] when the drive
    /// does not name the bus as its command source afterwards.
    pub async fn set_up_bus_control(&mut self) -> Result<Status> {
        const COMMAND: Command = Command::Configure("bus control set-up");
        self.check_standing(COMMAND).await?;
        // The control word that was written last acts as soon as the channel is ours.
        self.write_control(Class::Command, drivecom::DISABLE_VOLTAGE, Effect::Level).await?;
        self.change(LAC, L3).await?;
        for (register, value) in [
            (CHCF, SEPARATE),
            (CCS, COMMAND_1),
            (CD1, COMMAND_BY_MODBUS),
            (RFC, REFERENCE_1),
            (FR1, REFERENCE_BY_MODBUS),
        ] {
            self.change(register, value).await?;
        }
        for (register, value) in [(FST, CD14), (DCI, CD13)] {
            if self.registers.at(Class::Background).read(register).await? == UNASSIGNED {
                self.change(register, value).await?;
            }
        }
        self.until_control(COMMAND, |control| control == Control::Bus).await
    }

    /// Gives the command channel in use to the terminals. See [`release`](drive_core::Drive::release).
    pub(crate) async fn give_control_back(&mut self) -> Result<Status> {
        const COMMAND: Command = Command::Release;
        let words = self.check_standing(COMMAND).await?;
        if words.state_words().control() != Control::Bus {
            return self.fast_status(Class::Command).await;
        }
        if self.control_settings(Class::Command).await?.level != AccessLevel::L3 {
            return Err(Error::Unsupported {
                what: "release",
                reason: "at access level L1 or L2 the drive chooses its channel itself; set it up for L3",
            });
        }
        self.write_control(Class::Command, drivecom::DISABLE_VOLTAGE, Effect::Level).await?;
        let mut calls = self.registers.at(Class::Background);
        let separate = calls.read(CHCF).await? == SEPARATE;
        let selection = ExtendedStatus3::from_bits_retain(calls.read(LRS3).await?);
        let second = selection.contains(ExtendedStatus3::COMMAND_2);
        let (register, value) = match (separate, second) {
            (true, false) => (CD1, COMMAND_BY_TERMINALS),
            (true, true) => (CD2, COMMAND_BY_TERMINALS),
            (false, false) => (FR1, REFERENCE_BY_AI1),
            (false, true) => (FR2, REFERENCE_BY_AI1),
        };
        self.change(register, value).await?;
        self.until_control(COMMAND, |control| control != Control::Bus).await
    }

    /// A fresh look whether the settings may be changed.
    pub(crate) async fn check_standing(&mut self, command: Command) -> Result<FastWords> {
        let words = self.fast_words(Class::Command).await?;
        match words.refuses_settings() {
            None => Ok(words),
            Some(reason) => Err(self.refused(command, reason)),
        }
    }

    /// Writes a setting that differs, and remembers that it is not saved.
    pub(crate) async fn change(&mut self, register: Register<WriteStopped>, value: u16) -> Result<bool> {
        Ok(self.write_row(register.row(), value).await?.changed)
    }

    async fn until_control(&mut self, command: Command, reached: fn(Control) -> bool) -> Result<Status> {
        let mut status = self.fast_status(Class::Command).await.map_err(Error::after_write)?;
        for _ in 1..CONFIRMING_READS {
            if status.control.is_some_and(reached) {
                return Ok(status);
            }
            status = self.fast_status(Class::Command).await.map_err(Error::after_write)?;
        }
        if status.control.is_some_and(reached) {
            Ok(status)
        } else {
            Err(self.not_confirmed(command, status))
        }
    }
}
