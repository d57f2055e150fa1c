//! The control and status words of the Altivar 312 with the bits above the chart (BBV51701 06/2009, page at each word),
//! and what they say together. The Altivar 28 has them too, as at the Altivar 312's access level L1, "interchangeable
//! with ATV28" (p. 35). Bits without a name are kept.

use bitflags::bitflags;

use super::{
    chart::{ChartState, ENABLE_OPERATION},
    proof::Question,
};
use drive_core::{
    Control, Direction, Evidence, Frequency, Intent, Lease, Output, Refusal, RunWord, State, Status,
    StopMode, Told,
};

/// How a run command shows in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunShown {
    /// It is in force.
    InForce,
    /// It is in force, and the motor still turns in the other direction: it comes down first.
    TurningRound,
    /// It is not in force, or not yet.
    NotYet,
}

bitflags! {
    /// `CMD` and `CMDD`, p. 16 and 19. Bits 4 to 6 and 8 to 10 are reserved and stay 0. Bits 11 to 14 have these meanings
    /// at the access levels L1 and L2; at L3 bits 11 and 12 have them in the factory setting, and each of 11 to 15 has
    /// the function that was assigned to it.
    ///
    /// ```
    /// use drive_core::Direction;
    /// use drive_drivecom::ControlWord;
    ///
    /// assert!(ControlWord::run(Direction::Forward).is_run());
    /// assert_eq!(ControlWord::run(Direction::Reverse).direction(), Direction::Reverse);
    /// assert!(!ControlWord::from_bits_retain(0x0006).is_run(), "shutdown");
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ControlWord: u16 {
        /// Switch on.
        const SWITCH_ON = 1 << 0;
        /// Enable voltage: 0 disables it.
        const ENABLE_VOLTAGE = 1 << 1;
        /// No quick stop: 0 is a quick stop.
        const NO_QUICK_STOP = 1 << 2;
        /// Enable operation.
        const ENABLE_OPERATION = 1 << 3;
        /// Fault reset, on the rising edge.
        const FAULT_RESET = 1 << 7;
        /// Reverse.
        const REVERSE = 1 << 11;
        /// Stop as `Stt` says: along the ramp unless changed.
        const STOP = 1 << 12;
        /// Stop by DC injection.
        const DC_INJECTION = 1 << 13;
        /// Fast stop.
        const FAST_STOP = 1 << 14;
    }
}

impl ControlWord {
    /// Enable operation, in a direction: 000Fh and 080Fh.
    #[must_use]
    pub const fn run(direction: Direction) -> Self {
        let enabled = Self::from_bits_retain(ENABLE_OPERATION);
        match direction {
            Direction::Forward => enabled,
            Direction::Reverse => enabled.union(Self::REVERSE),
        }
    }

    /// The stops that keep operation enabled: 100Fh, 400Fh, 200Fh. `None`: freewheel is no such stop.
    #[must_use]
    pub const fn enabled_stop(mode: StopMode) -> Option<Self> {
        let enabled = Self::from_bits_retain(ENABLE_OPERATION);
        match mode {
            StopMode::Ramp => Some(enabled.union(Self::STOP)),
            StopMode::Fast => Some(enabled.union(Self::FAST_STOP)),
            StopMode::DcInjection => Some(enabled.union(Self::DC_INJECTION)),
            StopMode::Freewheel => None,
        }
    }

    /// Whether it holds a run command: operation enabled and no stop.
    #[must_use]
    pub const fn is_run(self) -> bool {
        self.contains(Self::run(Direction::Forward)) && !self.is_stop()
    }

    /// What it asks, by the table of commands on p. 12 and the bits on p. 16 and 19. `None` for a run command with bits
    /// that are reserved, or that act as they were assigned.
    #[must_use]
    pub fn intent(self) -> Option<Intent> {
        const RUN: ControlWord = ControlWord::run(Direction::Reverse);
        let enabled = self.contains(Self::run(Direction::Forward));
        Some(if self.contains(Self::FAULT_RESET) {
            return (!enabled).then_some(Intent::ResetFaults(StopMode::Freewheel));
        } else if !self.contains(Self::ENABLE_VOLTAGE) {
            Intent::Stop(StopMode::Freewheel)
        } else if !self.contains(Self::NO_QUICK_STOP) {
            Intent::QuickStop
        } else if !self.contains(Self::SWITCH_ON) {
            Intent::Prepare(StopMode::Freewheel)
        } else if !enabled {
            Intent::Prepare(StopMode::Ramp)
        } else if self.contains(Self::DC_INJECTION) {
            Intent::Stop(StopMode::DcInjection)
        } else if self.contains(Self::FAST_STOP) {
            Intent::Stop(StopMode::Fast)
        } else if self.contains(Self::STOP) {
            Intent::Stop(StopMode::Ramp)
        } else if RUN.contains(self) {
            let reverse = self.contains(Self::REVERSE);
            Intent::Start(if reverse { Direction::Reverse } else { Direction::Forward })
        } else {
            return None;
        })
    }

    /// Which way it turns the motor, at a reference without a sign.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }

    /// Whether, held by the drive, it is the run command of this lease.
    #[must_use]
    pub fn stands_for(self, lease: Lease) -> RunWord {
        match self.is_run() {
            true if self.direction() == lease.direction => RunWord::Stands,
            true => RunWord::Another,
            false => RunWord::Gone,
        }
    }

    /// Whether it holds one of the stops that keep operation enabled.
    #[must_use]
    pub const fn is_stop(self) -> bool {
        self.intersects(Self::STOP.union(Self::DC_INJECTION).union(Self::FAST_STOP))
    }
}

bitflags! {
    /// `ETA` and `ETAD`, p. 13, 17 and 21. The states are in [`ChartState`]. Bits 8, 12 and 13 are reserved, bit 4 is
    /// always 0.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct StatusWord: u16 {
        /// Ready to switch on.
        const READY = 1 << 0;
        /// Switched on.
        const SWITCHED_ON = 1 << 1;
        /// Operation enabled.
        const OPERATION_ENABLED = 1 << 2;
        /// Fault.
        const FAULT = 1 << 3;
        /// Voltage disabled; always 0.
        const VOLTAGE_DISABLED = 1 << 4;
        /// No quick stop: 0 while one is active.
        const NO_QUICK_STOP = 1 << 5;
        /// Switch on disabled.
        const SWITCH_ON_DISABLED = 1 << 6;
        /// Alarm.
        const ALARM = 1 << 7;
        /// No forced local mode: 0 while it is in progress.
        const NOT_FORCED_LOCAL = 1 << 9;
        /// Reference reached.
        const REFERENCE_REACHED = 1 << 10;
        /// `LFRD` below `LSP` or above `HSP`.
        const REFERENCE_EXCEEDED = 1 << 11;
        /// Stopped by the STOP key.
        const STOP_KEY = 1 << 14;
        /// The output turns in reverse.
        const REVERSE = 1 << 15;
    }
}

impl StatusWord {
    /// Direction of the output.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }
}

bitflags! {
    /// `ETI`, p. 22. Bit 3 is reserved; bits 13 and 14 are told by [`ExtendedStatus::control`].
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct ExtendedStatus: u16 {
        /// The EEPROM is being written: no parameter can be written now.
        const EEPROM_BUSY = 1 << 0;
        /// Parameters are checked for consistency; 0: no check, and the drive locked on standstill.
        const CONSISTENCY_CHECK = 1 << 1;
        /// A fault reset is authorised.
        const RESET_AUTHORISED = 1 << 2;
        /// Motor running.
        const MOTOR_RUNNING = 1 << 4;
        /// DC injection.
        const DC_INJECTION = 1 << 5;
        /// Transient state.
        const TRANSIENT = 1 << 6;
        /// Motor thermal overload alarm.
        const MOTOR_THERMAL_ALARM = 1 << 7;
        /// Alarm: excessive braking.
        const BRAKING_ALARM = 1 << 8;
        /// Accelerating.
        const ACCELERATING = 1 << 9;
        /// Decelerating.
        const DECELERATING = 1 << 10;
        /// Current limit alarm.
        const CURRENT_LIMIT = 1 << 11;
        /// Fast stop in progress.
        const FAST_STOP = 1 << 12;
        /// Low bit of the control source.
        const SOURCE_LOW = 1 << 13;
        /// High bit of the control source.
        const SOURCE_HIGH = 1 << 14;
        /// Reverse requested by the reference.
        const REVERSE_REQUESTED = 1 << 15;
    }
}

impl ExtendedStatus {
    /// Who commands, by bits 14 and 13. Terminals and the built-in keypad have one pattern.
    #[must_use]
    pub const fn control(self) -> Control {
        match (self.contains(Self::SOURCE_HIGH), self.contains(Self::SOURCE_LOW)) {
            (false, false) => Control::Local,
            (false, true) => Control::Panel,
            (true, false) => Control::Bus,
            (true, true) => Control::OtherBus,
        }
    }
}

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

    /// What these words show of the output. `command` is the control word that the drive was last seen to hold; `ramps`: the
    /// normal stop is known to bring the motor down; `braked`: the status before showed it being brought down; `reacted`: by the
    /// reaction to a fault.
    #[must_use]
    pub fn output(
        self,
        command: Option<ControlWord>,
        frequency: Option<Frequency>,
        ramps: bool,
        braked: bool,
        reacted: bool,
    ) -> Output {
        let at = frequency.unwrap_or(Frequency::from_centihertz(1));
        // Zero is no output also where the words say that the motor is driven: as in a quick stop that has ended.
        let fed = self.is_turning();
        let Some(chart) = self.chart() else { return Output::NotKnown };
        if self.eti.contains(ExtendedStatus::DC_INJECTION) {
            return Output::Injection;
        }
        match chart {
            ChartState::OperationEnabled if fed => {
                let stops =
                    command.filter(|_| self.control() == Control::Bus).is_some_and(ControlWord::is_stop);
                let fast = self.eti.contains(ExtendedStatus::FAST_STOP);
                if stops || fast { Output::Braking(at) } else { Output::Driven }
            }
            _ if fed => Output::Braking(at),
            // A ramp has ended, or a run command stands and asks for nothing.
            ChartState::OperationEnabled if ramps => Output::None,
            ChartState::OperationEnabled if braked => Output::Gone,
            // Neither voltage nor operation was taken from it: it came to its end.
            ChartState::QuickStopActive => Output::Ended,
            ChartState::SwitchedOn if braked => Output::None,
            // A trip cuts off a motor that was coming down for another reason.
            ChartState::Fault if braked && reacted => Output::None,
            ChartState::Fault => Output::Tripped,
            _ => Output::Cut,
        }
    }

    /// What these words say of a run command of this side, with `frh`, the reference before the ramp, and the output behind it.
    /// Whether the word stands, and whether that reference is the bus's, is the family's to add.
    #[must_use]
    pub fn evidence(self, lease: Lease, frh: Frequency, output: Option<Frequency>) -> Evidence {
        const SIGN: Refusal = Refusal::Overridden {
            by: "the sign of the reference, which another master has turned round,",
            remedy: "stop the motor, and give a setpoint",
        };
        let control = self.control();
        let command = (control != Control::Bus).then_some(Refusal::NotInControl(control));
        let turned = frh != Frequency::ZERO && self.asks_for() != lease.direction;
        Evidence {
            word: RunWord::NotTold,
            command: Told::unless(command),
            output: if self.is_brought_down(frh, output) { Told::NotTold } else { self.told_output(frh) },
            reference: Told::unless(turned.then_some(SIGN)),
        }
    }

    /// Which way these words show the motor to be driven, and whether they say that it comes down: as
    /// [`Watch::see_turning`](drive_core::Watch::see_turning) wants it.
    #[must_use]
    pub fn turning(self) -> (Option<Direction>, Option<bool>) {
        let is_driven = self.chart() == Some(ChartState::OperationEnabled) && self.is_turning();
        let goes_on = self.eta.contains(StatusWord::REFERENCE_REACHED)
            || self.eti.contains(ExtendedStatus::ACCELERATING);
        let comes_down = match self.eti.contains(ExtendedStatus::DECELERATING) {
            true => Some(true),
            false => goes_on.then_some(false),
        };
        (is_driven.then(|| self.eta.direction()), comes_down)
    }

    /// Whether the motor is driven or may be. A reference of zero asks for nothing.
    fn told_output(self, frh: Frequency) -> Told {
        const STOPPED: Refusal = Refusal::Overridden {
            by: "a stop at the drive, by an input (FSt, dCI, nSt, LAF, LAr), a key, or after tLS at low speed,",
            remedy: "see which one it is, release it, and start again",
        };
        const LOCKED: Refusal = Refusal::Overridden {
            by: "a stop that has disabled operation, by the freewheel input (nSt), the stop of three wires, or a parameter,",
            remedy: "see which one it is, release it, and start again",
        };
        const STOP_KEY: Refusal =
            Refusal::Overridden { by: "the STOP key of the drive", remedy: "start again when it may turn" };
        let Some(chart) = self.chart() else { return Told::NotTold };
        let driven = self.is_turning() && !self.is_stopping() || frh == Frequency::ZERO && !self.is_driving();
        Told::unless(match chart {
            ChartState::Fault | ChartState::FaultReactionActive => Some(Refusal::Tripped),
            ChartState::NotReadyToSwitchOn => Some(Refusal::State(State::NotReady)),
            _ if self.eta.contains(StatusWord::STOP_KEY) => Some(STOP_KEY),
            ChartState::OperationEnabled if driven => None,
            ChartState::OperationEnabled => Some(STOPPED),
            ChartState::QuickStopActive => Some(Refusal::State(State::QuickStop)),
            ChartState::SwitchOnDisabled | ChartState::ReadyToSwitchOn | ChartState::SwitchedOn => {
                Some(LOCKED)
            }
        })
    }

    /// Whether the motor slows down although the reference asks for more than its output: by a stop that these words do not name, as
    /// behind a panel that has given control back, or before it speeds up again. In current limitation a drive lowers its output and
    /// obeys all the same.
    fn is_brought_down(self, reference: Frequency, output: Option<Frequency>) -> bool {
        self.is_turning()
            && self.eti.contains(ExtendedStatus::DECELERATING)
            && !self.eti.contains(ExtendedStatus::CURRENT_LIMIT)
            && self.eta.direction() == self.asks_for()
            && output.is_some_and(|output| output < reference)
    }

    /// How a run command in this direction shows, the bus being the source of the reference too. A reference of zero asks
    /// for no direction.
    #[must_use]
    pub fn shows_run(
        self,
        direction: Direction,
        reference: Frequency,
        output: Option<Frequency>,
    ) -> RunShown {
        let enabled = self.control() == Control::Bus && self.chart() == Some(ChartState::OperationEnabled);
        if !enabled || self.is_stopping() || self.is_brought_down(reference, output) {
            RunShown::NotYet
        } else if reference == Frequency::ZERO {
            RunShown::InForce
        } else if !self.is_turning() || self.asks_for() != direction {
            RunShown::NotYet
        } else if self.eta.direction() != direction {
            RunShown::TurningRound
        } else {
            RunShown::InForce
        }
    }

    /// Whether a fast stop or an injection of direct current is under way, whoever has asked for it.
    fn is_stopping(self) -> bool {
        self.eti.intersects(ExtendedStatus::FAST_STOP.union(ExtendedStatus::DC_INJECTION))
    }

    /// What keeps a run command of the bus from acting, as far as these words tell it.
    #[must_use]
    pub fn prevents_run(self) -> Option<Refusal> {
        const STOP: Refusal = Refusal::Overridden {
            by: "a stop at the drive, by an input or a key,",
            remedy: "release it, and start again",
        };
        match self.control() {
            Control::Bus if self.is_stopping() || self.eta.contains(StatusWord::STOP_KEY) => Some(STOP),
            Control::Bus => None,
            somebody => Some(Refusal::NotInControl(somebody)),
        }
    }

    /// Why a reference of the bus has no effect in a drive that manages the priorities of its channels itself: somebody else
    /// has its motor running, or has it for himself.
    #[must_use]
    pub fn refuses_reference(self) -> Option<Refusal> {
        let another = self.is_driving() && self.control() != Control::Bus;
        self.refuses_to_take_over().or_else(|| another.then(|| Refusal::NotInControl(self.control())))
    }

    /// Why the bus does not take command of a drive that manages the priorities of its channels itself (p. 11): it takes
    /// command from the terminals of a motor at rest, not of one that they have running, not in forced local mode, and not
    /// from a remote terminal, which only has it where somebody gave it (p. 38).
    #[must_use]
    pub fn refuses_to_take_over(self) -> Option<Refusal> {
        let free = match self.control() {
            Control::Bus => true,
            Control::Local => self.eta.contains(StatusWord::NOT_FORCED_LOCAL) && !self.is_turning(),
            _ => false,
        };
        (!free).then(|| Refusal::NotInControl(self.control()))
    }

    /// Why a run command of this side cannot be withdrawn without doing more than that: a drive that manages the priorities
    /// of its channels itself gives command to the bus by any command, also from somebody who has the motor running.
    #[must_use]
    pub fn refuses_withdrawal(self) -> Option<&'static str> {
        let forced = !self.eta.contains(StatusWord::NOT_FORCED_LOCAL);
        (self.control() != Control::Bus && !forced && self.is_driving())
            .then_some("any command by the bus would take the motor from whoever has it running")
    }

    /// Whether the drive itself shows that no run command acts after the stop `word`: it has left "operation enabled",
    /// or there, where the word keeps it, the motor stands, or the bus commands and the motor slows down or is braked:
    /// one that somebody else has running obeys no word of ours, and slows down for reasons of his. Where somebody else
    /// commands, no word of ours leads out of "operation enabled": there the motor that nothing drives shows every stop. A
    /// quick stop still drives the motor, so it does not show a stop without voltage.
    #[must_use]
    pub fn shows_stop(self, word: ControlWord) -> bool {
        const BRAKES: ExtendedStatus =
            ExtendedStatus::DECELERATING.union(ExtendedStatus::FAST_STOP).union(ExtendedStatus::DC_INJECTION);
        match self.chart() {
            None | Some(ChartState::NotReadyToSwitchOn) => false,
            Some(ChartState::OperationEnabled) if self.control() != Control::Bus => !self.is_driving(),
            Some(ChartState::OperationEnabled) => {
                word.contains(ControlWord::ENABLE_OPERATION)
                    && (!self.is_turning() || self.eti.intersects(BRAKES))
            }
            Some(ChartState::QuickStopActive) => word.contains(ControlWord::ENABLE_VOLTAGE),
            Some(_) => true,
        }
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
mod tests {
    use crate::{DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON};

    use super::*;

    /// ETA bits 10 and 15, ETI bits 9 and 10 (p. 21, 22).
    #[test]
    fn which_way_a_motor_turns_and_whether_it_comes_down_is_told_as_the_drive_says_it() {
        use Direction::{Forward, Reverse};
        for (eta, eti, told) in [
            (0x0627, 0x4012, (Some(Forward), Some(false))),
            (0x8627, 0x4012, (Some(Reverse), Some(false))),
            (0x8227, 0x4212, (Some(Reverse), Some(false))),
            (0x8227, 0x4412, (Some(Reverse), Some(true))),
            (0x8227, 0x4812, (Some(Reverse), None)),
            (0x8223, 0x4412, (None, Some(true))),
        ] {
            assert_eq!(StatusWords::new(eta, eti).turning(), told, "{eta:04X}h {eti:04X}h");
        }
    }

    #[test]
    fn every_pair_of_words_has_a_state_and_none_outside_the_table_is_called_a_known_one() {
        for eta in 0..=u16::MAX {
            for eti in [0x0000, 0x4000, 0x4010, 0xFFFF] {
                let words = StatusWords::new(eta, eti);
                assert_eq!(words.state(None) == State::Unknown, ChartState::of(eta).is_none(), "{eta:04X}h");
                assert_eq!(words.status(None).is_fault(), words.is_tripped(), "{eta:04X}h");
            }
        }
    }

    #[test]
    fn forced_local_mode_outranks_the_control_source() {
        assert_eq!(StatusWords::new(0x0227, 0x4000).control(), Control::Bus);
        assert_eq!(StatusWords::new(0x0027, 0x4000).control(), Control::Local);
    }

    #[test]
    fn the_control_word_tells_a_stop_from_a_run_while_the_bus_commands() {
        let [run, stop] = [0x000F, 0x100F].map(|word| Some(ControlWord::from_bits_retain(word)));
        let turning = StatusWords::new(0x0227, 0x4410);
        assert_eq!(turning.state(run), State::Running);
        assert_eq!(turning.state(stop), State::Stopping);
        let standing = StatusWords::new(0x0627, 0x4002);
        assert_eq!(standing.state(run), State::Running, "at a setpoint of zero");
        assert_eq!(standing.state(stop), State::Ready);
        let by_terminals = StatusWords::new(0x0227, 0x0410);
        assert_eq!(by_terminals.state(stop), State::Running, "the word is not in force");
    }

    #[test]
    fn a_word_that_the_drive_contradicts_is_held_no_longer() {
        let [run, stop, quick] = [0x000F, 0x100F, 0x0002].map(ControlWord::from_bits_retain);
        let held = |eta, eti| [run, stop, quick].map(|word| StatusWords::new(eta, eti).can_hold(word));
        assert_eq!(held(0x0227, 0x4210), [true, false, true], "speeding up");
        assert_eq!(held(0x0227, 0x4410), [true; 3], "slowing down");
        assert_eq!(held(0x0627, 0x4010), [true, false, true], "at its reference");
        assert_eq!(held(0x0627, 0x4030), [true; 3], "braked by direct current");
        assert_eq!(held(0x0223, 0x4000), [false, true, true], "switched on");
        assert_eq!(held(0x0027, 0x4010), [false, true, true], "forced local");
        assert_eq!(held(0x0227, 0x0010), [false, true, true], "by the terminals");
    }

    #[test]
    fn a_motor_that_direct_current_brakes_has_not_come_to_a_stop() {
        let injection = StatusWords::new(0x0627, 0x4020);
        let [run, stop] = [0x000F, 0x200F].map(|word| Some(ControlWord::from_bits_retain(word)));
        assert_eq!([None, run, stop].map(|held| injection.state(held)), [State::Stopping; 3]);
        assert!(injection.shows_stop(ControlWord::from_bits_retain(0x200F)));
    }

    #[test]
    fn a_run_command_shows_in_the_direction_of_the_motor_and_not_of_the_reference_alone() {
        let fifty = Frequency::from_hertz(50);
        let shown = |eta, eti| StatusWords::new(eta, eti).shows_run(Direction::Reverse, fifty, None);
        assert_eq!(shown(0x0227, 0xC410), RunShown::TurningRound, "forward, slowing down");
        assert_eq!(shown(0x8227, 0xC210), RunShown::InForce);
        assert_eq!(shown(0x8227, 0x4210), RunShown::NotYet, "the reference asks for forward");
        assert_eq!(shown(0x0227, 0xC000), RunShown::NotYet, "the motor stands");
        assert_eq!(shown(0x8227, 0x8210), RunShown::NotYet, "the terminals command");
        let stands = StatusWords::new(0x0627, 0x4002).shows_run(Direction::Reverse, Frequency::ZERO, None);
        assert_eq!(stands, RunShown::InForce, "at a reference of zero");
    }

    /// Behind a panel that has taken and given back control the run command stands, is the bus's, and so is the reference, while the
    /// motor is on its way to standstill (ETI bit 10, p. 22).
    #[test]
    fn a_motor_that_slows_down_below_its_reference_is_not_shown_to_obey_it() {
        let lease = Lease::new(Direction::Forward, 0x000F);
        let thirty = Frequency::from_hertz(30);
        for (eti, output, is_told) in [
            (0x4452, Frequency::from_centihertz(40), false),
            (0x4452, Frequency::from_hertz(40), true),
            (0x4452, thirty, true),
            (0x4252, Frequency::from_centihertz(40), true),
            (0x4C52, Frequency::from_hertz(20), true),
        ] {
            let words = StatusWords::new(0x0227, eti);
            let told = words.evidence(lease, thirty, Some(output)).output;
            assert_eq!(told, if is_told { Told::Yes } else { Told::NotTold }, "{eti:04X}h at {output}");
            let shown = words.shows_run(Direction::Forward, thirty, Some(output));
            assert_eq!(shown == RunShown::InForce, is_told, "{eti:04X}h at {output}");
        }
        // Turning round: it comes down first.
        let round = StatusWords::new(0x8227, 0x4452);
        let shown = round.shows_run(Direction::Forward, thirty, Some(Frequency::from_hertz(9)));
        assert_eq!(shown, RunShown::TurningRound);
    }

    #[test]
    fn a_stop_never_shows_in_a_motor_that_is_called_running() {
        let stops = StopMode::ALL
            .iter()
            .filter_map(|&mode| ControlWord::enabled_stop(mode))
            .chain([QUICK_STOP, SHUTDOWN, SWITCH_ON, DISABLE_VOLTAGE].map(ControlWord::from_bits_retain));
        for stop in stops {
            for eta in 0..=u16::MAX {
                // Every source of commands, with the motor at rest, turning, accelerating, slowing down, braked.
                for source in [0x0000, 0x2000, 0x4000, 0x6000] {
                    for motion in [0x0000, 0x0010, 0x0210, 0x0410, 0x0020, 0x0030, 0x1010, 0x1410, 0x9FFF] {
                        let words = StatusWords::new(eta, source | motion);
                        let running = words.state(Some(stop)) == State::Running;
                        assert!(!(running && words.shows_stop(stop)), "{words:?} after {stop:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_stop_shows_where_no_run_command_acts() {
        let [ramp, quick, freewheel] = [0x100F, 0x0002, 0x0000].map(ControlWord::from_bits_retain);
        let running = StatusWords::new(0x0627, 0x4010);
        let slowing = StatusWords::new(0x0227, 0x4410);
        let quick_stop = StatusWords::new(0x0207, 0x5010);
        let disabled = StatusWords::new(0x0240, 0x4000);
        let shown = |words: StatusWords| [ramp, quick, freewheel].map(|word| words.shows_stop(word));
        assert_eq!(shown(running), [false; 3]);
        assert_eq!(shown(slowing), [true, false, false]);
        assert_eq!(shown(quick_stop), [true, true, false]);
        assert_eq!(shown(disabled), [true; 3]);
        let by_terminals = StatusWords::new(0x0227, 0x0410);
        assert_eq!(shown(by_terminals), [false; 3], "the terminals slow it down to another speed");
        let forced_local = StatusWords::new(0x0027, 0x4410);
        assert_eq!(shown(forced_local), [false; 3]);
        let released = StatusWords::new(0x0227, 0x0000);
        assert_eq!(shown(released), [true; 3], "the terminals command a motor that nothing drives");
        let held = StatusWords::new(0x0227, 0x0020);
        assert_eq!(shown(held), [false; 3], "they brake it with direct current");
        let standing = StatusWords::new(0x0227, 0x4000);
        assert_eq!(shown(standing), [true, false, false]);
        assert_eq!(shown(StatusWords::new(0x0200, 0)), [false; 3], "initialising");
        assert_eq!(shown(StatusWords::new(0x0201, 0)), [false; 3], "a pattern that the table does not have");
    }
}
