//! The drive as every family is one: [`Drive`] over what the other modules do.

use std::time::Duration;

use drive_core::{
    Class, Command, Direction, Drive, Error, Faults, Ground, Identity, Intent, Lease, Measurements, Port,
    Recognised, Refusal, Result, Row, Setpoint, Status, StopMode, Stopped, Watchdog, WatchdogCapability,
    Withdrawn, Written, async_trait,
    registers::{Place, refuse_commands},
};

use super::ProfileDrive;
use crate::written::Written as Value;

#[async_trait]
impl<P: Port> Drive for ProfileDrive<P> {
    drive_core::told_by!(registers);

    fn lease(&self) -> Option<Lease> {
        self.watch.run.lease()
    }

    fn take_changed(&mut self) -> Option<Ground> {
        self.watch.take_changed().or_else(|| self.changed.take())
    }

    fn set_coast_time(&mut self, time: Option<Duration>) {
        self.watch.shaft.set_coast_time(time);
    }

    fn set_injection_time(&mut self, time: Option<Duration>) {
        self.watch.shaft.set_injection_time(time);
    }

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        self.profile.file().run_word(self.profile.start(direction)?, self.kept)
    }

    fn adopt(&mut self, lease: Lease) {
        self.watch.adopt(lease);
        (self.agreed, self.agreed_before) = (None, None);
    }

    fn forget(&mut self) {
        self.watch.lose_sight();
        self.forget_guards();
        (self.comes_down, self.withdrawn_at) = (None, None);
        (self.kept, self.at_speed) = (None, false);
        (self.watchdog_time, self.changed) = (None, None);
        self.steady.forget();
    }

    fn recognise(&self, _: &drive_core::Identity) -> Recognised {
        match self.is_another() {
            Some(it_is) => Recognised::NotMine { it_is },
            // Another maker's drive may read so too: it is likely, and no more.
            None => Recognised::CannotTell,
        }
    }

    fn unmet(&self) -> Option<Refusal> {
        self.found_otherwise().or(self.limited)
    }

    /// The words of its fingerprints, of a drive that has any of one value. Its guards are read in any case.
    async fn identify(&mut self) -> Result<Identity> {
        let identity = self.read_fingerprints().await?;
        match self.profile.identification() {
            Some(_) => Ok(identity),
            None => Err(Error::Unsupported {
                what: "identification",
                reason: "its profile knows no register that holds one value in this drive alone",
            }),
        }
    }

    async fn status(&mut self) -> Result<Status> {
        if !self.guarded.hold {
            // Whoever cannot be asked is read all the same; nothing is written before the guards are seen.
            self.see_guards(Class::Status).await.ok();
        }
        let (mut status, words) = self.read_status(Class::Status).await?;
        self.judge(&mut status, &words);
        Ok(status)
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        let measured = self.read_measurements().await?;
        if self.is_guarded() {
            // Somebody at the drive may set it up otherwise at any time; that it cannot be asked now says nothing.
            self.read_guards(Class::Background).await.ok();
        }
        self.see_settings().await;
        Ok(measured)
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.read_faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        self.start_motor(direction).await
    }

    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        let (_, words) = self.start_is_allowed(direction).await?;
        if setpoint.is_some() { Ok(()) } else { self.check_standing(direction, &words).await.map(drop) }
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.watch.shaft.is_stopped_by(mode);
        self.stop_motor(mode).await
    }

    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        self.withdraw_run().await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        self.pulse_reset().await
    }

    /// A watchdog that its owner has told of and that the bus cannot set: it has to be fed, and the line is planned for that. What
    /// [`watchdog`](Self::watchdog) reads in a register is fed besides. One that a command word alone feeds is not:
    /// no run command is repeated, because nothing that the drive shows tells its run word from another master's stop at once.
    fn watchdog_capability(&self) -> Option<WatchdogCapability> {
        let fixed = |time| WatchdogCapability {
            min: time,
            max: time,
            step: time,
            reactions: &[],
            settable: false,
            wears: false,
        };
        self.owner.watchdog.filter(|_| self.profile.is_fed_by_any_request()).map(fixed)
    }

    async fn watchdog(&mut self) -> Result<Watchdog> {
        self.read_watchdog().await
    }

    /// A reading, and nothing else.
    async fn keep_alive(&mut self) -> Result<()> {
        let Some(block) = self.sight.fast.first().copied() else { return Ok(()) };
        self.read_block(Class::KeepAlive, block).await.map(drop)
    }

    /// Its stops alone, each by the one word that its profile writes for it: what other words do to the motor the profile does not say.
    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match self.stopped_by(&[(Place::from(register), word)]) {
            Some(mode) => Ok(Some(Intent::Stop(mode))),
            None => Intent::kept(),
        }
    }

    fn stopped_by(&self, written: &[(Place, u16)]) -> Option<StopMode> {
        let one = |&(Place { space, address }, value): &(Place, u16)| Value { space, address, value };
        self.profile.stopped_by(&written.iter().map(one).collect::<Vec<_>>())
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        let file = self.profile.file();
        let commands: Vec<u16> = file
            .actions()
            .flat_map(|(_, action)| file.writes(action.get_ref()))
            .filter(|written| written.space == row.space)
            .map(|written| written.address)
            .collect();
        refuse_commands(row, &commands)?;
        let command = Command::WriteParameter(row.address);
        if !row.access.is_writable() {
            let slave = self.registers.slave();
            return Err(Error::AccessForbidden {
                slave,
                register: row.address,
                code: row.code,
                access: row.access,
            });
        }
        self.guard(command).await?;
        let (status, _) = self.read_status(Class::Background).await?;
        if status.state.is_moving() || !status.is_explained() {
            return Err(self.refused(command, Refusal::MotorRunning));
        }
        let changed = self.registers.at(Class::Background).change_row(row, word).await;
        changed.map_err(|error| self.explained(error))
    }
}
