//! What the drive is set up for: n05, n39 and n40, read when they are first needed.

use std::time::Duration;

use drive_core::{
    Class, Command, Direction, Error, ExceptionMeaning, Exchange, Port, Reaction, Refusal, Result, Watchdog,
    registers::{Register, Row, access::Readable},
};

use crate::{
    Drive3g3ev, TIME_OVER,
    frequency::FrequencyUnit,
    registers::{N05, N39, N40},
};

/// What was read once; `None`: not yet.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Settings {
    n05: Option<u16>,
    n39: Option<u16>,
    /// n39 was changed over the bus: until the drive is switched off, the old unit may still count (§2.1, note 3).
    unit_changed: bool,
}

impl Settings {
    /// Forgets what a write to this parameter may have changed.
    pub(crate) fn written(&mut self, row: &Row) {
        self.unit_changed |= row.address == N39.address();
        *self = Self { unit_changed: self.unit_changed, ..Self::default() };
    }

    /// Somebody has changed n39.
    pub(crate) const fn unit_was_changed(&mut self) {
        self.unit_changed = true;
    }
}

impl<P: Port> Drive3g3ev<P> {
    /// What the frequencies that are read count; `None` when it is not certain.
    pub(crate) async fn unit(&mut self, class: Class) -> Result<Option<FrequencyUnit>> {
        if self.settings.unit_changed {
            return Ok(None);
        }
        if self.settings.n39.is_none() {
            // A drive that does not have it counts nobody knows what.
            let mut calls = self.registers.at(class);
            self.settings.n39 = self.absent.word(&mut calls, N39.address()).await?;
        }
        Ok(self.settings.n39.and_then(FrequencyUnit::of))
    }

    /// The same without an exchange; `None` also where it was not read.
    pub(crate) fn known_unit(&self) -> Option<FrequencyUnit> {
        self.settings.n39.filter(|_| !self.settings.unit_changed).and_then(FrequencyUnit::of)
    }

    /// What the reference counts.
    pub(crate) async fn reference_unit(&mut self, command: Command) -> Result<FrequencyUnit> {
        if self.settings.unit_changed {
            let reason = Refusal::Settings(
                "n39 was changed and acts at the next power-up: switch the drive off and on, then forget() reads it again",
            );
            return Err(self.refused(command, reason));
        }
        let exchange = Exchange { function: 0x03, register: Some(N39.address()) };
        FrequencyUnit::of(self.n39(Class::Command).await?).ok_or(Error::Answer {
            slave: self.registers.slave(),
            exchange,
            reason: "n39 holds a unit that the manual does not list",
        })
    }

    /// Refuses reverse where n05 forbids it: the drive would show OP6.
    pub(crate) async fn check_direction(&mut self, command: Command, direction: Direction) -> Result<()> {
        if direction == Direction::Reverse && self.n05().await? == 1 {
            return Err(self.refused(command, Refusal::DirectionForbidden));
        }
        Ok(())
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

    async fn n05(&mut self) -> Result<u16> {
        let known = self.settings.n05;
        let value = match self.once(Class::Command, N05, known).await {
            // What this drive does not have forbids nothing.
            Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => 0,
            read => read?,
        };
        self.settings.n05 = Some(value);
        Ok(value)
    }

    async fn n39(&mut self, class: Class) -> Result<u16> {
        let known = self.settings.n39;
        let value = self.once(class, N39, known).await?;
        self.settings.n39 = Some(value);
        Ok(value)
    }

    async fn once(
        &mut self,
        class: Class,
        register: Register<impl Readable>,
        known: Option<u16>,
    ) -> Result<u16> {
        match known {
            Some(value) => Ok(value),
            None => self.registers.at(class).read(register).await,
        }
    }
}
