//! The drive as every family is one: [`Drive`] over what the other modules do.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    Absent, BroadcastWrite, Class, Direction, Drive, Error, Faults, Identity, Intent, Lease, Measurements,
    Port, Reaction, Recognised, Result, Row, Setpoint, Status, StopMode, Stopped, Watchdog, Withdrawn,
    Written,
};

use crate::{Atv21, CommandWord, model, proof::Proof, registers};

#[async_trait]
impl<P: Port> Drive for Atv21<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        Some(self.run_word(direction, self.held.unwrap_or_default()).bits())
    }

    fn adopt(&mut self, lease: Lease) {
        self.watch.adopt(lease);
        (self.shown, self.proof) = (None, Proof::of_unknown());
    }

    fn forget(&mut self) {
        self.forget_blocks();
        self.proof.forget();
        self.watch.lose_sight();
        (self.held, self.shown, self.references) = (None, None, None);
        (self.upper_limit, self.modes, self.kind, self.named) = (None, None, None, None);
        self.absent = Absent::default();
    }

    fn recognise(&self, identity: &Identity) -> Recognised {
        model::recognise(identity)
    }

    /// Reads the fast set: from the block of the drive, in one exchange, where it is known to hold FD01, FD00 and FE03;
    /// else the words one by one. FE45, for who commands, has no place in the block and is always read. Where FD01 or FE45
    /// shows that FA00 may be another one than is known, that is read as well: the next stop keeps its bits 4 to 6, 14
    /// and 15.
    ///
    /// What is configured for the block is in effect only if the drive was reset since, and no register tells that: it is
    /// used once [`measurements`](Self::measurements) have seen it. A trip ends that.
    ///
    /// [`Status::at_reference`] and [`Status::fault_code`] are always `None`: no word of the fast set tells them.
    async fn status(&mut self) -> Result<Status> {
        let mut status = self.read_status(Class::Status).await?;
        if !self.keep_stop_ready(&status).await {
            self.prove(&mut status).await;
        }
        self.judge(&mut status);
        Ok(status)
    }

    /// Reads the slow set, FD01 last. The first of a turning motor also read the block and every register that it could
    /// hold: the block is used from then on when nothing but what is configured explains its words.
    async fn measurements(&mut self) -> Result<Measurements> {
        let measurements = self.read_measurements().await?;
        self.look_at_block(&measurements).await;
        Ok(measurements)
    }

    /// Reads FD01, FC90, FE10 to FE13 (the newest first), FC91 and FE79, one by one.
    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    /// Reads the status, FA00 and FE46; where FA00 does not hold the priorities and the selections yet, writes them without a
    /// run command; and writes that only when FE45 and FE46 name the bus. It is confirmed when FA00 reads back, FD01 runs
    /// with ST on (bits 10, 11 and 13) in the direction that was asked for, FE45 and FE46 still name the bus, and FE02 is
    /// what FA01 holds. A motor that turned the other way is on its way as soon as its output goes down: the status then
    /// tells the old direction.
    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        self.start_motor(direction, None).await
    }

    /// What FA00 has to be written for first, only [`start`](Drive::start) sees: who commands once the priorities stand there.
    async fn may_start(&mut self, direction: Direction, _: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        self.judge_start(direction).await.map(drop)
    }

    /// Writes FA00 at once, with bits 4 to 6, 14 and 15 as the drive held them last; of a drive that was never read 8000h
    /// with the mode's bit. A fast stop is one by ramp. It is confirmed when FA00 reads back and FD01 does not run, or the
    /// output goes down, the bus commands and no input forces anything (F110 to F113, F118). Where somebody else runs the
    /// motor and the command priority is not set, it is set.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.watch.shaft.is_stopped_by(mode);
        self.stop_motor(mode).await
    }

    /// Writes FA00 without RUN, and nothing else: if this value gave the run command, or FE45 says that it is not in force.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        self.withdraw_run().await
    }

    /// Writes FA01 in steps of 0.01 Hz, up to the drive's UL, or FA13 in rpm, up to 24000: how F856 counts the
    /// motor's poles is not in the manual, so a speed is not compared with UL, and the drive limits it.
    ///
    /// The other one of the two is set to 0 first. A setpoint that something else overrides is refused: FE46 must name the
    /// bus, or come to do so by the next start, and FE02 must be what was written.
    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.write_setpoint(setpoint).await
    }

    /// Sends FA00 bit 13 once, then a word without it, and reads until the drive shows no fault.
    ///
    /// A drive that was reset starts up again and does not answer for about 2 s. When it answers nothing at all after
    /// the reset, the error is of the kind [`OutcomeUnknown`](drive_core::ErrorKind::OutcomeUnknown): read the status
    /// 2 s later. The reset also clears FA00 and with it the priorities, so it is refused where an input that is on would
    /// start the motor then.
    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.reset_trip().await
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.read_identity().await
    }

    /// Clears the priorities and what this value has chosen, and puts back FA01 and FA13 as they were before its first
    /// setpoint: CMOD and FMOD decide again. Refused when an input that is on would start the motor then, and when CMOD = 2,
    /// because the command stays with the bus then.
    async fn release(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.give_control_back().await
    }

    /// Reads FD01: the family has no shorter exchange.
    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(registers::STATUS_WORD).await.map(drop)
    }

    /// Reads F803 and F603.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// Writes F603, then F803, each to EEPROM and only where it differs. For [`Reaction::Ignore`] F803 is set to 0,
    /// and the time does not matter.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.write_watchdog(timeout, reaction).await
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.asked_by_another(register, word).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) for FA00, FA20, FA01 and FA13, which have methods of their own,
    /// and for F802, which moves the drive to another address at once. What decides who commands (CMOD, FMOD, F207, F110 to
    /// F113, F118) is refused while the motor runs, and where an input that is on would start it.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.set_parameter(row, word).await
    }

    async fn persist(&mut self) -> Result<u32> {
        Err(Error::Unsupported {
            what: "saving parameters",
            reason: "the drive stores each parameter in EEPROM when it is written",
        })
    }

    /// The stop of a drive that was never read: every drive is commanded by the bus from then on.
    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let order = match mode {
            StopMode::Ramp => CommandWord::empty(),
            StopMode::Freewheel => CommandWord::FREEWHEEL,
            StopMode::DcInjection => CommandWord::DC_BRAKING,
            StopMode::Fast => return None,
        };
        let value = (CommandWord::COMMAND_PRIORITY | order).bits();
        Some(BroadcastWrite { function: 0x06, register: registers::COMMAND_WORD.address(), value })
    }
}
