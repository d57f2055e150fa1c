//! The [`Drive`] of this family.

use async_trait::async_trait;
use drive_core::{
    Absent, BroadcastWrite, Class, Direction, Drive, Error, Fault, Faults, Identity, Intent, Lease,
    Measurements, Port, Recognised, Result, Row, Setpoint, Status, StopMode, Stopped, Watchdog,
    WatchdogCapability, Withdrawn, Written, registers::refuse_commands,
};
use drive_drivecom as drivecom;
use tokio_modbus::prelude::ReadCode;

use crate::{
    Atv58,
    reading::Words,
    registers::{CMD, W401, W402, W463, W483},
    watchdog,
    words::FaultRegister,
};

#[async_trait]
impl<P: Port> Drive for Atv58<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(proof.watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        self.run_word(direction).ok()
    }

    fn adopt(&mut self, lease: Lease) {
        self.proof.adopt(lease);
    }

    /// What the card says of itself over UNI-TELWAY begins with the family's name.
    fn recognise(&self, identity: &Identity) -> Recognised {
        let told = identity.model.as_deref().and_then(|model| Recognised::by_reference(model, "ATV58"));
        told.unwrap_or(Recognised::CannotTell)
    }

    fn forget(&mut self) {
        self.proof.forget();
        (self.absent, self.idle) = (Absent::default(), 0);
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
        let sample: Vec<u16> = (W463.address()..).take(4).collect();
        let (absent, mut calls) = (&mut self.absent, self.registers.at(Class::Background));
        let mut words = Words::read(absent, &mut calls, map.input_words, &addresses).await?;
        words.join(Words::read(absent, &mut calls, map.input_words, &sample).await?);
        Ok(Measurements { at: self.registers.snapshot_time(), ..words.measurements(&map) })
    }

    /// The bits of W483 while the drive is tripped, each as its number: their meanings are not public. The family has
    /// no history and names no alarm.
    async fn faults(&mut self) -> Result<Faults> {
        let words = self.produced(Class::Background, &[], self.map.status).await?;
        if !words.is_tripped(&self.map) {
            return Ok(Faults::default());
        }
        let input = self.map.input_words;
        let mut calls = self.registers.at(Class::Background);
        let words = Words::read(&mut self.absent, &mut calls, input, &[W483.address()]).await?;
        let register = FaultRegister(words.at(Some(W483.address())).unwrap_or(0));
        let present = register.bits().map(|code| Fault { code, entry: None }).collect();
        Ok(Faults { present, tripped: true, ..Faults::default() })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        let word = self.run_word(direction)?;
        drivecom::start(self, direction, word).await
    }

    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        self.run_word(direction)?;
        drivecom::may_start(self, direction, setpoint).await
    }

    /// [`StopMode::Ramp`] is the word of the map, the quick stop 0002h where it names none; [`StopMode::DcInjection`], for which
    /// the manual names no bit, is replaced by that ramp.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.proof.watch.shaft.is_stopped_by(mode);
        drivecom::stop(self, mode).await
    }

    /// 0000h to a drive that has left "operation enabled", such as a tripped one. For one that has not the manual names no word
    /// that ends a run command and nothing else.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        drivecom::withdraw(self).await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    /// Refused while local control is forced, or the map names no bit that tells: the inputs of the terminals are no words.
    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        drivecom::reset_fault(self).await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.produced(Class::KeepAlive, &[], self.map.status).await.map(drop)
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
        self.proof.doubt_limits();
        self.registers.at(Class::Background).change_row(row, word).await
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let value = self.word_of(mode)?;
        Some(BroadcastWrite { function: 0x06, register: CMD.address(), value })
    }
}
