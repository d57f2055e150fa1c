//! The control and status words of the Altivar 312 with the bits above the chart (BBV51701 06/2009, page at each word),
//! and what they say together. The Altivar 28 has them too, as at the Altivar 312's access level L1, "interchangeable
//! with ATV28" (p. 35). Bits without a name are kept.

mod commands;
mod control;
mod output;
mod status;

use drive_core::{Control, Direction, State, Status};

use crate::{chart::ChartState, proof::Question};

pub use self::{
    commands::RunShown,
    control::ControlWord,
    status::{ExtendedStatus, StatusWord},
};

/// `ETA` and `ETI` as they were read together: what the drive says of its state and of who commands it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct StatusWords {
    /// The status word.
    pub eta: StatusWord,
    /// The extended status word.
    pub eti: ExtendedStatus,
}

impl StatusWords {
    /// The two words.
    #[must_use]
    pub const fn new(eta: u16, eti: u16) -> Self {
        Self { eta: StatusWord::from_bits_retain(eta), eti: ExtendedStatus::from_bits_retain(eti) }
    }

    /// The state of the chart; `None` for a pattern that the manual's table does not have.
    #[must_use]
    pub const fn chart(self) -> Option<ChartState> {
        ChartState::of(self.eta.bits())
    }

    /// Whether a fault is present.
    #[must_use]
    pub fn is_tripped(self) -> bool {
        self.chart().is_some_and(ChartState::is_fault)
    }

    /// Whether the drive turns the motor.
    #[must_use]
    pub const fn is_turning(self) -> bool {
        self.eti.contains(ExtendedStatus::MOTOR_RUNNING)
    }

    /// Whether the drive turns the motor or brakes it with direct current: only without either has it "come to a complete
    /// stop" (p. 20).
    #[must_use]
    pub const fn is_driving(self) -> bool {
        self.eti.intersects(ExtendedStatus::MOTOR_RUNNING.union(ExtendedStatus::DC_INJECTION))
    }

    /// Who commands: ETA says whether local control is forced, ETI who it is otherwise.
    #[must_use]
    pub const fn control(self) -> Control {
        if self.eta.contains(StatusWord::NOT_FORCED_LOCAL) { self.eti.control() } else { Control::Local }
    }

    /// The state. `command` is the control word that the drive was last seen to hold, if any: in the state "operation
    /// enabled" these words alone do not tell a motor that slows down to stop from one that slows down to a lower
    /// setpoint, nor a stopped one from one that runs at a setpoint of zero.
    #[must_use]
    pub fn state(self, command: Option<ControlWord>) -> State {
        self.chart().map_or(State::Unknown, |chart| chart.state(self.is_driving(), self.enabled(command)))
    }

    /// Whether a drive that shows these words can still hold `command`. A chart that has left operation enabled holds no
    /// run command, whatever was written before; nor is one in force again by itself when somebody else gives control
    /// back. And a motor that speeds up, or turns at its reference, was given another word than a stop.
    #[must_use]
    pub fn can_hold(self, command: ControlWord) -> bool {
        if command.is_run() {
            self.chart() == Some(ChartState::OperationEnabled) && self.control() == Control::Bus
        } else {
            let at_reference = self.eta.contains(StatusWord::REFERENCE_REACHED) && !self.is_stopping();
            let is_driven = at_reference || self.eti.contains(ExtendedStatus::ACCELERATING);
            !(command.is_stop() && self.is_turning() && is_driven)
        }
    }

    /// Whether only the control word that the drive holds tells what it does: a motor that slows down to stop looks like one that
    /// slows down to a lower setpoint, and one that stands at a setpoint of zero, or after `tLS`, like a stopped one. `held` is
    /// the word as far as it is known.
    #[must_use]
    pub fn needs_command(self, held: Option<ControlWord>) -> bool {
        let by_bus = self.chart() == Some(ChartState::OperationEnabled) && self.control() == Control::Bus;
        let slows_down = !self.is_turning() || self.eti.contains(ExtendedStatus::DECELERATING);
        by_bus && held.is_none_or(|command| command.is_run() && slows_down)
    }

    /// What of these words and of `FrH` is another question when it is another: not the alarm, and not how far a ramp is.
    #[must_use]
    pub fn question(self, frh: u16) -> Question {
        let passing = ExtendedStatus::TRANSIENT
            | ExtendedStatus::MOTOR_THERMAL_ALARM
            | ExtendedStatus::BRAKING_ALARM
            | ExtendedStatus::CURRENT_LIMIT;
        ((self.eta - StatusWord::ALARM).bits(), (self.eti - passing).bits(), frh)
    }

    /// What these words say of the fast set; frequency, current, fault code and raw words are the family's to add.
    #[must_use]
    pub fn status(self, command: Option<ControlWord>) -> Status {
        Status {
            state: self.state(command),
            direction: Some(self.eta.direction()),
            at_reference: Some(self.eta.contains(StatusWord::REFERENCE_REACHED)),
            warning: Some(self.eta.contains(StatusWord::ALARM)),
            control: Some(self.control()),
            ..Status::default()
        }
    }

    /// Which way the reference asks the motor to turn, the run command's direction taken into account.
    #[must_use]
    pub const fn asks_for(self) -> Direction {
        if self.eti.contains(ExtendedStatus::REVERSE_REQUESTED) {
            Direction::Reverse
        } else {
            Direction::Forward
        }
    }

    /// Whether a fast stop or an injection of direct current is under way, whoever has asked for it.
    fn is_stopping(self) -> bool {
        self.eti.intersects(ExtendedStatus::FAST_STOP.union(ExtendedStatus::DC_INJECTION))
    }

    fn enabled(self, command: Option<ControlWord>) -> State {
        let command = command.filter(|_| self.control() == Control::Bus);
        let stopping = self.eti.intersects(ExtendedStatus::FAST_STOP.union(ExtendedStatus::DC_INJECTION))
            || command.is_some_and(ControlWord::is_stop);
        match (self.is_driving(), command) {
            (true, _) if stopping => State::Stopping,
            (true, _) => State::Running,
            // At a setpoint of zero a run command is in force and nothing turns.
            (false, Some(command)) if command.is_run() => State::Running,
            (false, _) => State::Ready,
        }
    }
}

#[cfg(test)]
mod tests;
