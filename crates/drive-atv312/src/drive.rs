//! The [`Drive`] of this family.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Direction, Drive, Faults, Identity, Intent, Lease, Measurements, Port, Reaction,
    Recognised, Result, Row, SelfRestart, Setpoint, Status, StopMode, Stopped, Watchdog, Withdrawn, Written,
};
use drive_drivecom as drivecom;

use crate::{
    Atv312, command,
    diagnosis::recognised,
    registers::{ATR, ETA},
    settings::Known,
    words::ControlWord,
};

#[async_trait]
impl<P: Port> Drive for Atv312<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(proof.watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        Some(drivecom::Drivecom::as_written(self, ControlWord::run(direction).bits()))
    }

    fn adopt(&mut self, lease: Lease) {
        self.proof.adopt(lease);
    }

    fn recognise(&self, identity: &Identity) -> Recognised {
        recognised(identity)
    }

    fn forget(&mut self) {
        self.proof.forget();
        (self.known, self.control, self.brought_down) = (Known::default(), None, None);
    }

    /// W3201 to W3206 in one exchange. Where these words alone do not tell the frequency or whether a run command is in
    /// force, W8501 to W8504 in a second one: the first time for a drive that runs, and while a motor slows down or stands
    /// with a run command. The statuses behind the first, of a motor that runs, read one setting each until a
    /// [`stop`](Self::stop) needs no reading: 9 blocks, 17 at access level L3, 19 where a bit switches the command channel.
    /// A start, a setpoint and [`self_restarts`](Self::self_restarts) read all that are missing.
    async fn status(&mut self) -> Result<Status> {
        self.watch().await
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.read_measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        drivecom::start(self, direction, ControlWord::run(direction).bits()).await
    }

    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        drivecom::may_start(self, direction, setpoint).await
    }

    /// [`StopMode::Ramp`] is 100Fh, which stops as `Stt` says, where that is no injection; [`StopMode::Fast`] 400Fh where it is
    /// known to act and the quick stop 0002h otherwise; [`StopMode::Freewheel`] 0000h; [`StopMode::DcInjection`] 200Fh where
    /// `LAC` or `dCI` allow it. What does not act is replaced by what `Stt` says, and else by the fast stop. A drive whose
    /// settings were not read yet is stopped by the quick stop. At L3 the bits that have another function stay as they are.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.proof.watch.shaft.is_stopped_by(mode);
        Ok(self.stop_motor(mode).await?.held_by(&self.proof.watch.shaft))
    }

    /// 100Fh with the bits above it as the drive holds them, where bit 12 has its usual meaning.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        self.read_settings(Class::Command).await?;
        drivecom::withdraw(self).await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    /// Where the bus commands nothing else starts by it. At L3 the inputs count where the terminals command; keys and another
    /// bus do not tell what they ask for. At L1 and L2 it is refused where somebody else commands, since the word would take
    /// command from him.
    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        drivecom::reset_fault(self).await
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.read_identity().await
    }

    /// Puts back what `set_up_bus_control` of this value has changed, the reference included. Channels in use that are the
    /// bus's even then, as of a drive that another program has set up, go to the terminals and to AI1; what else may have been
    /// set up there is left alone. `LFr` is set to zero. Refused while the terminals ask for a run that would start the motor.
    async fn release(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.give_control_back().await
    }

    async fn self_restarts(&mut self) -> Result<Vec<SelfRestart>> {
        self.read_settings(Class::Background).await?;
        Ok(self.known.settings.self_restart().into_iter().collect())
    }

    fn accept_self_restart(&mut self, codes: &[&str]) {
        self.accepts_restart = codes.contains(&ATR.row().code);
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(ETA).await.map(|_| ())
    }

    /// Refused while the input of `InH` is closed, which inhibits the fault that it would trip by.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        let watchdog = self.read_watchdog().await?;
        if watchdog.timeout.is_some() {
            self.refuse_inhibited().await?;
        }
        Ok(watchdog)
    }

    /// Sets `ttO` and `SLL`, with the motor stopped, and clears the NTO bit. The drive is left in "switch on disabled"
    /// when one of the two was changed. Refused while the input of `InH` is closed.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        self.set_watchdog(timeout, reaction).await
    }

    /// As it was found; one that was switched off by the NTO bit of `CMI` is so again, and `SLL` stays what it was.
    async fn restore_watchdog(&mut self, found: Watchdog) -> Result<Watchdog> {
        self.put_back_watchdog(found).await
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.asked_by_another(register, word).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    /// Writing a register that is written only with the motor stopped returns the drive to "switch on disabled"
    /// (p. 11); it is refused while the motor runs.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    async fn persist(&mut self) -> Result<u32> {
        self.save_parameters().await
    }

    fn assume_changed(&mut self) {
        self.unsaved = true;
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let (register, value) = command::broadcast_word(mode)?;
        Some(BroadcastWrite { function: 0x06, register: register.address(), value })
    }
}
