//! Start and stop: what is written to 0001h, and how it is seen to act.

use drive_core::{
    Class, Command as Order, Control, Direction, Error, Port, RawWord, Refusal, Result, State, Status,
    StopMode,
};

use crate::{
    Drive3g3ev,
    registers::COMMAND,
    words::{Command, DriveState, Signals},
};

/// How often the drive is read until it shows what was ordered.
pub(crate) const READS: usize = 20;
/// How often a stop is written again where a run command has come after it.
const REPEATS: usize = 2;

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let order = Order::Start(direction);
        let status = self.read_status(Class::Command).await?;
        if status.is_fault() {
            let reason = status.fault_code.map_or(Refusal::Tripped, Refusal::Fault);
            return Err(self.refused(order, reason));
        }
        self.check_run_source(order).await?;
        self.check_direction(order, direction).await?;
        if let Some(control) = status.control
            && control != Control::Bus
        {
            return Err(self.refused(order, Refusal::NotInControl(control)));
        }
        if status.state == State::NotReady {
            return Err(self.refused(order, Refusal::State(State::NotReady)));
        }
        self.write_command(Class::Command, Command::run(direction)).await?;
        self.see_start(direction).await.map_err(Error::after_write)
    }

    /// Reads until the drive runs under the bus and holds the run command.
    async fn see_start(&mut self, direction: Direction) -> Result<Status> {
        let mut shown = Status::default();
        for _ in 0..READS {
            shown = self.read_status(Class::Command).await?;
            if shown.is_fault() {
                break;
            }
            if is_run(&shown) && shown.control == Some(Control::Bus) {
                // RUN is the drive's, the direction may still be the old one: the order itself must stand too.
                shown.raw.push(self.read_command(Class::Command).await?);
                if self.command == Some(Command::run(direction)) {
                    return Ok(shown);
                }
                break;
            }
        }
        Err(self.not_confirmed(Order::Start(direction), shown))
    }

    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        if mode != StopMode::Ramp {
            return Err(Error::Unsupported {
                what: "this stop mode",
                reason: "the bus has one stop, a run command of 0; how the motor stops is a setting of the drive",
            });
        }
        self.write_command(Class::Stop, Command::empty()).await?;
        self.see_stop(mode).await.map_err(Error::after_write)
    }

    /// Reads until 0001h holds no run command after all that the drive shows: the confirmation of function 10h tells no
    /// value, so it may be that of a start that was late, and the start itself may come later still. Then the stop is
    /// written again.
    async fn see_stop(&mut self, mode: StopMode) -> Result<Status> {
        let mut repeats = 0;
        let mut shown = Status::default();
        for _ in 0..READS {
            shown = self.read_status(Class::Stop).await?;
            if shown.raw(COMMAND.address()).is_none() {
                shown.raw.push(self.read_command(Class::Stop).await?);
            }
            if self.command.is_none_or(|held| held.contains(Command::RUN)) {
                if repeats == REPEATS {
                    break;
                }
                self.write_command(Class::Stop, Command::empty()).await?;
                repeats += 1;
            } else if !is_run(&shown) || shown.control == Some(Control::Bus) {
                // RUN may stand until the motor does: it is on its way when the order stands and the bus commands.
                return Ok(shown);
            }
        }
        Err(self.not_confirmed(Order::Stop(mode), shown))
    }

    /// Writes 0001h and remembers the word; while the outcome is not known, none is.
    pub(crate) async fn write_command(&mut self, class: Class, command: Command) -> Result<()> {
        self.command = None;
        self.registers.at(class).write(COMMAND, command.bits()).await?;
        self.command = Some(command);
        Ok(())
    }

    /// Reads 0001h back.
    pub(crate) async fn read_command(&mut self, class: Class) -> Result<RawWord> {
        let value = self.registers.at(class).read(COMMAND).await?;
        self.command = Some(Command::from_bits_retain(value));
        Ok(RawWord { address: COMMAND.address(), code: COMMAND.row().code, value })
    }

    pub(crate) fn not_confirmed(&self, command: Order, status: Status) -> Error {
        Error::NotConfirmed {
            slave: self.registers.slave(),
            command,
            status: Box::new(status),
            because: None,
        }
    }
}

/// Whether the drive shows RUN in either of its words.
pub(crate) fn is_run(status: &Status) -> bool {
    let word = |address| status.raw(address).unwrap_or(0);
    let signals = Signals::from_bits_retain(word(crate::registers::SIGNALS.address()));
    let state = DriveState::from_bits_retain(word(crate::registers::STATE.address()));
    signals.contains(Signals::RUN) || state.contains(DriveState::RUN)
}
