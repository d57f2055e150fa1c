//! The [`Drive`] of this family.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Direction, Drive, Error, Fault, Faults, Ground, Identity, Intent, Lease,
    Measurements, Port, Recognised, Result, Row, Setpoint, Status, StopMode, Stopped, Watchdog,
    WatchdogCapability, Withdrawn, Written, drivecom, registers::refuse_commands,
};
use tokio_modbus::prelude::ReadCode;

use crate::{
    Atv58,
    proof::Seen,
    reading::Words,
    registers::{CMD, W401, W402, W463},
    watchdog,
};

#[async_trait]
impl<P: Port> Drive for Atv58<P> {
    drive_core::told_by!(registers);

    fn lease(&self) -> Option<Lease> {
        self.own.lease()
    }

    fn adopt(&mut self, lease: Lease) {
        self.own.adopt(lease);
        // What the drive holds is read with the next status.
        self.seen = Seen::default();
    }

    fn take_changed(&mut self) -> Option<Ground> {
        (!self.changed.is_empty()).then(|| self.changed.remove(0))
    }

    /// What the card says of itself over UNI-TELWAY begins with the family's name.
    fn recognise(&self, identity: &Identity) -> Recognised {
        match identity.model.as_deref() {
            Some(model) if model.starts_with("ATV58") => Recognised::Mine,
            Some(model) if model.starts_with("ATV") => {
                Recognised::NotMine { it_is: "another Altivar than an Altivar 58" }
            }
            _ => Recognised::CannotTell,
        }
    }

    fn set_coast_time(&mut self, time: Option<Duration>) {
        self.shaft.set_coast_time(time);
    }

    fn forget(&mut self) {
        self.limits = None;
        self.seen = Seen::default();
        if self.own.lease().is_none() {
            self.given = None;
        }
    }

    /// One exchange with the default map, and a second one for W483 when the drive has tripped. Of several fault bits
    /// [`Status::fault_code`] is the lowest; [`faults`](Drive::faults) has all.
    async fn status(&mut self) -> Result<Status> {
        self.watch().await
    }

    /// Two exchanges with the default map: the mapped words, and W463 to W466, whose content is not known.
    async fn measurements(&mut self) -> Result<Measurements> {
        let map = self.map;
        self.registers.begin_snapshot();
        let mapped = [map.reference, map.line_voltage, map.motor_thermal, map.drive_thermal];
        let addresses: Vec<u16> = mapped.into_iter().flatten().collect();
        let mut calls = self.registers.at(Class::Background);
        let mut words = Words::read(&mut calls, map.input_words, &addresses).await?;
        words.append(&mut calls, map.input_words, W463.address(), 4).await?;
        Ok(Measurements { at: self.registers.snapshot_time(), ..words.measurements(&map) })
    }

    /// The bits of W483 while the drive is tripped, each as its number: their meanings are not public. The family has
    /// no history and names no alarm.
    async fn faults(&mut self) -> Result<Faults> {
        let words = self.produced(Class::Background, self.map.status).await?;
        if !words.is_tripped(&self.map) {
            return Ok(Faults::default());
        }
        let register = self.fault_register().await?;
        let present = register.bits().map(|code| Fault { code, entry: None }).collect();
        Ok(Faults { present, ..Faults::default() })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        let word = self.run_word(direction)?;
        drivecom::start(self, direction, word).await
    }

    /// [`StopMode::Ramp`] is the word of the map, the quick stop 0002h where it names none; [`StopMode::DcInjection`], for which
    /// the manual names no bit, is replaced by that ramp.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        drivecom::stop(self, mode).await
    }

    /// 0000h to a drive that has left "operation enabled", such as a tripped one. For one that has not the manual names no word
    /// that ends a run command and nothing else.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.withdraw_run().await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    /// Refused while local control is forced, or the map names no bit that tells: the inputs of the terminals are no words.
    async fn reset_faults(&mut self) -> Result<Status> {
        drivecom::reset_fault(self).await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.produced(Class::KeepAlive, self.map.status).await.map(drop)
    }

    /// What the card says of itself on a UNI-TELWAY line: its rating and the version of its software (request 0Fh,
    /// p. 11/35). A line asks for it as it asks for a device identification.
    ///
    /// # Errors
    /// [`Error::Unsupported`] over Modbus, for which the manual names nothing of the kind and the card answers exception
    /// 01 (p. 22/46).
    async fn identify(&mut self) -> Result<Identity> {
        match self.registers.at(Class::Background).identification(ReadCode::Basic).await {
            Err(Error::Exception { code: 0x01, .. }) => Err(Error::Unsupported {
                what: "identification",
                reason: "the card says what it is over UNI-TELWAY only",
            }),
            result => result,
        }
    }

    /// The time of [`Atv58Map::message_watch`](crate::Atv58Map::message_watch), on a line in Modbus ASCII 1 s at the most.
    fn watchdog_capability(&self) -> Option<WatchdogCapability> {
        Some(watchdog(self.message_watch()))
    }

    /// What the card's manual prints, without an exchange: the time can neither be read nor set, and what the drive does
    /// when it runs out is not said.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        Ok(Watchdog { timeout: Some(self.message_watch()), reaction: None })
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.asked_by_another(register, word).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &[CMD.address(), W401.address()])?;
        if row.address == W402.address() {
            return Err(Error::Unsupported {
                what: "writing W402 as a parameter",
                reason: "it is suspected to be CMI, whose bits recall factory settings and write the EEPROM",
            });
        }
        // The limits that were read once may change with it.
        self.limits = None;
        self.registers.at(Class::Background).change_row(row, word).await
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let value = self.word_of(mode)?;
        Some(BroadcastWrite { function: 0x06, register: CMD.address(), value })
    }
}
