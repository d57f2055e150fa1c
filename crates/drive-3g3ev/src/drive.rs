//! The drive as every family is one: [`Drive`] over what the other modules do.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    Absent, BroadcastWrite, Class, Direction, Drive, Faults, Intent, Lease, Measurements, Port, Reaction,
    Result, Row, Setpoint, Status, StopMode, Stopped, Watchdog, Withdrawn, Written,
};

use crate::{CAPABILITIES, Drive3g3ev, broadcast, proof::Proof};

/// What loop-backs carry: the data of the manual's sample (§4.1.2).
const LOOP_BACK: u16 = 0xA537;

#[async_trait]
impl<P: Port> Drive for Drive3g3ev<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        Some((crate::Command::run(direction) | self.inputs()).bits())
    }

    fn adopt(&mut self, lease: Lease) {
        self.watch.adopt(lease);
        (self.shown, self.proof) = (None, Proof::of_unknown(None));
    }

    fn forget(&mut self) {
        self.settings.forget();
        (self.command, self.shown) = (None, None);
        self.watch.lose_sight();
        self.proof = Proof::of_unknown(self.proof.agreed());
        self.absent = Absent::default();
    }

    /// Two exchanges, and one more for n39 the first time, for 0001h the first time and where the drive runs, turns or is
    /// commanded otherwise than before, or while RUN stands after a stop.
    /// `output_frequency` is `None` when n39 counts it in percent.
    async fn status(&mut self) -> Result<Status> {
        let mut status = self.read_status(Class::Status).await?;
        if !self.keep_stop_ready(&status).await {
            self.prove().await;
        }
        self.judge(&mut status);
        Ok(status)
    }

    /// Two exchanges, and one more for n39 the first time. The reference is `None` when n39 counts it in percent.
    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    /// Three exchanges. The alarms are the bits of 0020h, 0022h, 002Ch and 003Dh that tell one.
    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    /// Refused where bits 9 and A of 002Ch name the panel or the terminals: n02 only tells what is in force after the next
    /// power-up. Keeps the inputs of 0001h (bits 4 to 6) as the drive holds them. It is confirmed when 0001h reads back, the
    /// drive runs in that direction with its output on, both bits still name the bus, and 0023h is what 0002h holds. A
    /// motor that turned the other way is on its way as soon as its output goes down: the status then tells the old
    /// direction.
    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        self.start_motor(direction).await
    }

    async fn may_start(&mut self, direction: Direction, _: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        self.check_start(direction).await.map(drop)
    }

    /// Stops by a run command of 0, the only stop that the manual has, whatever mode is asked for: the motor stops in the
    /// way that the drive is set to. The inputs of 0001h (bits 4 to 6) stay as the drive held them last; of a drive that was
    /// never read they become 0. It is confirmed when 0001h holds no run command and the drive does not run, or its output
    /// goes down and the bus commands; written again where a run command has come after it. The bus cannot take the command
    /// from the panel or the terminals.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.stop_motor(mode).await
    }

    /// Writes 0001h without RUN and leaves the rest: if this value gave the run command, or bit A of 002Ch says that it is
    /// not in force.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        self.withdraw_run().await
    }

    /// Refused where bit 9 of 002Ch says that the panel or the terminals give the reference; read back, and confirmed when
    /// that bit still names the bus and 0023h is what was written, or 0 at rest.
    ///
    /// # Errors
    /// Also [`Refused`](drive_core::Error::Refused) when n39 was changed and the drive not switched off since, and
    /// [`Unsupported`](drive_core::Error::Unsupported) in hertz where n39 counts in percent (2, 3), of a frequency for which the
    /// manual names no register, and in percent where it counts in hertz.
    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    /// Pulses the input that carries "fault reset"; the run command is 0 in the same word, so that the motor does not
    /// start. Nothing is written to a drive that shows no fault. Refused where the panel or the terminals command, whose run
    /// command may start the motor once the fault is gone.
    ///
    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) when the number for "fault reset" is not given, see
    /// [`with_fault_reset_function`](Self::with_fault_reset_function), or none of n06 to n08 holds it. The manual's
    /// only reset that needs no input goes to all drives of the line: [`broadcast::fault_reset`].
    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.pulse_fault_reset().await
    }

    /// A loop-back by function 08; any frame feeds the time-over detection.
    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).echo(LOOP_BACK).await
    }

    /// n40. The reaction of a detection is [`Reaction::Trip`].
    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// Checks that n40 already is as asked: 2 s with [`Reaction::Trip`], or any time with [`Reaction::Ignore`] for off.
    /// It writes nothing, because a changed n40 acts after the next power-up only (§2.1, note 3).
    ///
    /// # Errors
    /// Also [`Refused`](drive_core::Error::Refused) when n40 is set otherwise, with the way to change it.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.check_watchdog(timeout, reaction).await
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.asked_by_another(register, word).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// # Errors
    /// Also [`Unsupported`](drive_core::Error::Unsupported) for 0001h, 0002h and 0900h, which have methods of their
    /// own, and exception 22h ([`ExceptionMeaning::NotNow`](drive_core::ExceptionMeaning::NotNow)) for a constant while the motor
    /// runs. What decides who commands and what the inputs do (n02, n06 to n08) is refused while a run command stands, and while an
    /// input is on that may start the motor by its new function.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    /// ENTER, while the motor stands and no run command does. The EEPROM takes 100 000 of them ([`EEPROM_LIFE`](crate::EEPROM_LIFE)); what this value has sent counts, also when its
    /// outcome is unknown, and [`with_saves`](Self::with_saves) adds what came before.
    ///
    /// # Errors
    /// [`Refusal::NothingToSave`](drive_core::Refusal::NothingToSave) when this value has changed no parameter since
    /// its last save, [`Refusal::EepromLife`](drive_core::Refusal::EepromLife) when the count has reached the limit.
    async fn persist(&mut self) -> Result<u32> {
        self.enter().await
    }

    fn assume_changed(&mut self) {
        self.assume_unsaved();
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        CAPABILITIES.broadcast_stops.contains(&mode).then(broadcast::stop)
    }
}
