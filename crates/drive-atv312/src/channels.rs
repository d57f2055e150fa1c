//! Who commands the drive: giving control to the bus when asked, and giving it back.

use std::ops::RangeInclusive;

use drive_core::{
    Class, Command, Confirming, Control, Effect, Error, Port, Result, Status,
    registers::{Register, access::WriteStopped},
};
use drive_drivecom::{self as drivecom, Drivecom, StatusWords};

use crate::{
    Atv312,
    reading::FastWords,
    registers::{CCS, CD1, CD2, CHCF, DCI, FLOC, FR1, FR2, FST, LAC, LFR, LRS3, PS2, PS4, RFC, SA2},
    settings::{CD13, CD14, COMMAND_BY_MODBUS, REFERENCE_1, REFERENCE_BY_MODBUS, SEPARATE},
    words::{AccessLevel, ExtendedStatus3, StatusWord},
};

/// `LAC` = L3.
const L3: u16 = 2;
/// `CCS` = Cd1.
const COMMAND_1: u16 = 98;
/// `Cd1`, `Cd2` = tEr.
const COMMAND_BY_TERMINALS: u16 = 1;
/// `Fr1`, `Fr2` = AI1.
const REFERENCE_BY_AI1: u16 = 1;
/// `SA2` as the drive leaves the factory (p. 15).
const AI2: u16 = 2;
/// `PS2` as the drive leaves the factory.
const LI3: u16 = 131;
/// `PS4` as the drive leaves the factory.
const LI4: u16 = 132;
/// A function that is not assigned.
const UNASSIGNED: u16 = 0;

impl<P: Port> Atv312<P> {
    /// Sets the drive up for command and reference by Modbus: `LAC` = L3, `CHCF` = SEP, `Cd1` = `Fr1` = Mdb, both
    /// selected; `FSt` = Cd14 and `dCI` = Cd13, as far as nothing else is assigned, so that the control word keeps
    /// all its stops; and `SA2`, `PS4` and `PS2` to nO, where they are as the drive leaves the factory, so that neither AI2
    /// nor LI3 and LI4 change the setpoint (BBV51701 p. 11, 15, 16, 35–37, 40, 42). What is set that way already is not
    /// written, and what is changed is remembered: [`release`](drive_core::Drive::release) puts it back. Nothing of it
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
        self.registers.begin_order();
        if let Some(reason) = self.refuses_writes() {
            return Err(self.refused(COMMAND, reason));
        }
        self.check_standing(COMMAND).await?;
        // The control word that was written last acts as soon as the channel is ours.
        self.write_control(Class::Command, drivecom::DISABLE_VOLTAGE, Effect::Level).await?;
        // What L3 returns to the factory setting is put back as it was.
        let reference = self.registers.at(Class::Background).read(FR1).await?;
        if self.change(LAC, L3).await? {
            self.remember(FR1, reference);
        }
        for (register, value) in [
            (CHCF, SEPARATE),
            (CCS, COMMAND_1),
            (CD1, COMMAND_BY_MODBUS),
            (RFC, REFERENCE_1),
            (FR1, REFERENCE_BY_MODBUS),
        ] {
            self.set_up(register, value, None).await?;
        }
        for (register, from, to) in [
            (FST, UNASSIGNED, CD14),
            (DCI, UNASSIGNED, CD13),
            (SA2, AI2, UNASSIGNED),
            (PS4, LI4, UNASSIGNED),
            (PS2, LI3, UNASSIGNED),
        ] {
            self.set_up(register, to, Some(from)).await?;
        }
        self.until_control(COMMAND, |control| control == Control::Bus).await
    }

    /// Puts back what was set up, and gives the channels that are then still the bus's to the terminals and AI1. See
    /// [`release`](drive_core::Drive::release).
    pub(crate) async fn give_control_back(&mut self) -> Result<Status> {
        const COMMAND: Command = Command::Release;
        if let Some(reason) = self.refuses_writes() {
            return Err(self.refused(COMMAND, reason));
        }
        let words = self.check_standing(COMMAND).await?;
        if words.state_words().control() != Control::Bus && self.set_up_before.is_empty() {
            // The reference may be the bus's all the same: whoever commands finds no setpoint of before.
            let stands = self.registers.at(Class::Command).read(LFR).await? != 0;
            if stands {
                self.registers.at(Class::Command).write(LFR, 0).await?;
            }
            let status = self.fast_status(Class::Command).await;
            return status.map_err(|error| if stands { error.after_write() } else { error });
        }
        self.read_settings(Class::Command).await?;
        if self.known.settings.level() != Some(AccessLevel::L3) {
            return Err(Error::Unsupported {
                what: "release",
                reason: "at access level L1 or L2 the drive chooses its channel itself; set it up for L3",
            });
        }
        if let Some(reason) = self.terminals_ask_for_run().await? {
            return Err(self.refused(COMMAND, reason));
        }
        self.write_control(Class::Command, drivecom::DISABLE_VOLTAGE, Effect::Level).await?;
        // Whoever gives the bus its channels again finds no setpoint of before.
        self.registers.at(Class::Command).write(LFR, 0).await.map_err(Error::after_write)?;
        while let Some(&(register, value)) = self.set_up_before.last() {
            self.change(register, value).await.map_err(Error::after_write)?;
            self.set_up_before.pop();
        }
        self.give_channels_to_terminals().await.map_err(Error::after_write)?;
        self.until_control(COMMAND, |control| control != Control::Bus).await
    }

    /// The reference first: no run command of the terminals is to find a setpoint of the bus.
    async fn give_channels_to_terminals(&mut self) -> Result<()> {
        let mut calls = self.registers.at(Class::Background);
        let separate = calls.read(CHCF).await? == SEPARATE;
        let selection = ExtendedStatus3::from_bits_retain(calls.read(LRS3).await?);
        let pick = |second, pair: [Register<WriteStopped>; 2]| pair[usize::from(second)];
        let reference = pick(selection.contains(ExtendedStatus3::REFERENCE_2), [FR1, FR2]);
        let command = pick(selection.contains(ExtendedStatus3::COMMAND_2), [CD1, CD2]);
        if calls.read(reference).await? == REFERENCE_BY_MODBUS {
            self.change(reference, REFERENCE_BY_AI1).await?;
        }
        if separate && self.registers.at(Class::Background).read(command).await? == COMMAND_BY_MODBUS {
            self.change(command, COMMAND_BY_TERMINALS).await?;
        }
        Ok(())
    }

    /// Whether the local command is that of the terminals, and not of keys, which do not tell what they ask for.
    pub(crate) async fn is_commanded_by_terminals(&mut self, words: StatusWords) -> Result<bool> {
        const ANALOG_INPUTS: RangeInclusive<u16> = 1..=3;
        let mut calls = self.registers.at(Class::Command);
        if !words.eta.contains(StatusWord::NOT_FORCED_LOCAL) {
            return Ok(ANALOG_INPUTS.contains(&calls.read(FLOC).await?));
        }
        let selection = ExtendedStatus3::from_bits_retain(calls.read(LRS3).await?);
        let pick = |bit, pair: [Register<WriteStopped>; 2]| pair[usize::from(selection.contains(bit))];
        if calls.read(CHCF).await? == SEPARATE {
            let channel = calls.read(pick(ExtendedStatus3::COMMAND_2, [CD1, CD2])).await?;
            return Ok(channel == COMMAND_BY_TERMINALS);
        }
        let channel = calls.read(pick(ExtendedStatus3::REFERENCE_2, [FR1, FR2])).await?;
        Ok(ANALOG_INPUTS.contains(&channel))
    }

    /// A fresh look whether the settings may be changed.
    pub(crate) async fn check_standing(&mut self, command: Command) -> Result<FastWords> {
        let words = self.fast_words(Class::Command).await?;
        match words.refuses_settings() {
            None => Ok(words),
            Some(reason) => Err(self.refused(command, reason)),
        }
    }

    /// Changes a setting of the channels, if it is what `from` says, and remembers what it was, also where it is not known
    /// whether the write arrived.
    async fn set_up(
        &mut self,
        register: Register<WriteStopped>,
        value: u16,
        from: Option<u16>,
    ) -> Result<()> {
        let before = self.registers.at(Class::Background).read(register).await?;
        if before == value || from.is_some_and(|from| from != before) {
            return Ok(());
        }
        self.remember(register, before);
        self.change(register, value).await.map(drop)
    }

    fn remember(&mut self, register: Register<WriteStopped>, before: u16) {
        let known = self.set_up_before.iter().any(|(known, _)| known.address() == register.address());
        if !known {
            self.set_up_before.push((register, before));
        }
    }

    /// Writes a setting that differs, and remembers that it is not saved.
    pub(crate) async fn change(&mut self, register: Register<WriteStopped>, value: u16) -> Result<bool> {
        Ok(self.write_row(register.row(), value).await?.changed)
    }

    async fn until_control(&mut self, command: Command, reached: fn(Control) -> bool) -> Result<Status> {
        let mut confirming = Confirming::begin();
        loop {
            let status = self.fast_status(Class::Command).await.map_err(Error::after_write)?;
            if status.control.is_some_and(reached) {
                return Ok(status);
            }
            if !confirming.again().await {
                return Err(self.not_confirmed(command, status, None));
            }
        }
    }
}
