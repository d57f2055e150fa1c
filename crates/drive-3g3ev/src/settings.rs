//! What the drive is set up for: n40, and n05 and n39, which are read anew for what moves the motor.

use std::time::Duration;

use drive_core::{
    Class, Command, Direction, Error, ExceptionMeaning, Exchange, Ground, Port, Reaction, Refusal, Result,
    Watchdog, registers::Row,
};

use crate::{
    Drive3g3ev, TIME_OVER,
    frequency::FrequencyUnit,
    registers::{N05, N39, N40, REFERENCE},
};

/// What was read once; `None`: not yet.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Settings {
    /// n39 as it is in force, as far as is known.
    n39: Option<u16>,
    /// n39 as it was in force before the line was lost.
    n39_before: Option<u16>,
    /// n39 was changed: until the drive is switched off, the old unit may still count (§2.1, note 3).
    unit_changed: bool,
}

impl Settings {
    /// Forgets what a write to this parameter may have changed.
    pub(crate) fn written(&mut self, row: &Row) {
        self.unit_changed |= row.address == N39.address();
    }

    /// The line was lost: the drive may have been switched off, or be another one.
    pub(crate) fn forget(&mut self) {
        *self = Self { n39_before: self.n39.or(self.n39_before), ..Self::default() };
    }

    /// n39 was read. True where it is found to be another than the one in force.
    pub(crate) fn finds_unit(&mut self, n39: u16) -> bool {
        let is_new = !self.unit_changed && self.n39.is_some_and(|known| known != n39);
        self.unit_changed |= is_new;
        is_new
    }
}

impl<P: Port> Drive3g3ev<P> {
    /// What the frequencies that are read count; `None` when it is not certain.
    pub(crate) async fn unit(&mut self, class: Class) -> Result<Option<FrequencyUnit>> {
        if !self.settings.unit_changed && self.settings.n39.is_none() {
            self.learn_unit(class).await?;
        }
        Ok(self.known_unit())
    }

    /// The same without an exchange; `None` also where it was not read.
    pub(crate) fn known_unit(&self) -> Option<FrequencyUnit> {
        self.settings.n39.filter(|_| !self.settings.unit_changed).and_then(FrequencyUnit::of)
    }

    /// Reads n39 behind everything else that was read of it: an order that moves the motor rests on it, and a cut between two
    /// looks at the drive may have put another unit in force.
    pub(crate) async fn look_at_unit(&mut self) -> Result<()> {
        if self.settings.unit_changed {
            return Ok(());
        }
        if self.settings.n39.is_none() {
            return self.learn_unit(Class::Command).await;
        }
        let mut calls = self.registers.at(Class::Command);
        if let Some(n39) = self.absent.word(&mut calls, N39.address()).await? {
            self.finds_unit(n39);
        }
        Ok(())
    }

    /// n39 was read.
    pub(crate) fn finds_unit(&mut self, n39: u16) {
        if self.settings.finds_unit(n39) {
            self.watch.changes(Ground::Units);
        }
    }

    /// n39 as it stands, for the one in force: unless the drive still holds the reference that it was given when another one
    /// was, for that does not outlive its supply, and what was set since acts at the next power-up.
    async fn learn_unit(&mut self, class: Class) -> Result<()> {
        let mut calls = self.registers.at(class);
        // A drive that does not have it counts nobody knows what.
        let n39 = self.absent.word(&mut calls, N39.address()).await?;
        let is_other = n39.zip(self.settings.n39_before).is_some_and(|(now, before)| now != before);
        let given = self.proof.agreed().filter(|reference| is_other && *reference != 0);
        if let Some(given) = given
            && self.registers.at(class).read(REFERENCE).await? == given
        {
            self.settings.unit_changed = true;
            return Ok(());
        }
        self.settings.n39 = n39;
        Ok(())
    }

    /// Refuses what rests on the unit, where n39 was changed.
    pub(crate) fn check_unit(&self, command: Command) -> Result<()> {
        const CHANGED: Refusal =
            Refusal::Settings("n39 was changed and acts at the next power-up: switch the drive off and on");
        if self.settings.unit_changed { Err(self.refused(command, CHANGED)) } else { Ok(()) }
    }

    /// What the reference counts.
    pub(crate) async fn reference_unit(&mut self, command: Command) -> Result<FrequencyUnit> {
        self.look_at_unit().await?;
        self.check_unit(command)?;
        let n39 = match self.settings.n39 {
            Some(n39) => n39,
            // The drive's own exception says so.
            None => self.registers.at(Class::Command).read(N39).await?,
        };
        let exchange = Exchange { function: 0x03, register: Some(N39.address()) };
        FrequencyUnit::of(n39).ok_or(Error::Answer {
            slave: self.registers.slave(),
            exchange,
            reason: "n39 holds a unit that the manual does not list",
        })
    }

    /// Refuses reverse where n05 forbids it: the drive would show OP6. It is read each time, for whoever is refused allows it at the drive.
    pub(crate) async fn check_direction(&mut self, command: Command, direction: Direction) -> Result<()> {
        if direction == Direction::Forward {
            return Ok(());
        }
        match self.registers.at(Class::Command).read(N05).await {
            Ok(1) => Err(self.refused(command, Refusal::DirectionForbidden)),
            // What this drive does not have forbids nothing.
            Ok(_) | Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    pub(crate) async fn read_watchdog(&mut self) -> Result<Watchdog> {
        let mut calls = self.registers.at(Class::Background);
        let n40 = calls.read(N40).await?;
        self.watch.knows(N40.address(), n40);
        match n40 {
            0 => Ok(Watchdog { timeout: Some(TIME_OVER), reaction: Some(Reaction::Trip) }),
            1 => Ok(Watchdog { timeout: None, reaction: Some(Reaction::Ignore) }),
            _ => {
                let exchange = Exchange { function: 0x03, register: Some(N40.address()) };
                let calls = self.registers.at(Class::Background);
                Err(calls.answer(exchange, "n40 holds a value that the manual does not list"))
            }
        }
    }

    pub(crate) async fn check_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        let slave = self.registers.slave();
        let off = reaction == Reaction::Ignore;
        if !off && reaction != Reaction::Trip {
            return Err(Error::Unsupported {
                what: "a reaction of the watchdog",
                reason: "the drive trips with BUS, and the manual does not say how the motor stops then",
            });
        }
        if !off && timeout != TIME_OVER {
            let (min, max, step) = (TIME_OVER, TIME_OVER, TIME_OVER);
            return Err(Error::WatchdogTime { slave, timeout, min, max, step });
        }
        let watchdog = self.read_watchdog().await?;
        if watchdog.timeout.is_none() == off {
            return Ok(watchdog);
        }
        let how = if off {
            "n40 detects time-over and acts at power-up only: write 1 to n40, save it, switch the drive off and on"
        } else {
            "n40 switches time-over off and acts at power-up only: write 0 to n40, save it, switch the drive off and on"
        };
        Err(self.refused(Command::ArmWatchdog, Refusal::Settings(how)))
    }

    pub(crate) const fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }
}
