//! The words of the fast set, and what they say.

use drive_core::{
    Control, Current, Direction, Frequency, RawWord, State, Status, drivecom::ChartState, registers::Register,
};

use crate::{
    registers::{CMD, ETA, ETI, ETI2, FRH, LCR, LFT, RFR, THD, THR, ULN, W452},
    words::{ControlWord, ExtendedStatus, StatusWord},
};

/// The first block: W450 to W456, the seven words that the manual's own sample reads.
pub(crate) const FIRST_BLOCK: (u16, u16) = (FRH.address(), 7);
/// The second block: W457 to W460.
pub(crate) const SECOND_BLOCK: (u16, u16) = (LFT.address(), 4);

/// The mnemonics of the two blocks in their order.
const CODES: [&str; 11] = [
    FRH.row().code,
    RFR.row().code,
    W452.row().code,
    LCR.row().code,
    ULN.row().code,
    THR.row().code,
    THD.row().code,
    LFT.row().code,
    ETA.row().code,
    ETI.row().code,
    ETI2.row().code,
];

/// W450 to W460 as they were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FastWords {
    words: [u16; 11],
}

impl FastWords {
    /// From the two blocks; `None` when a word is missing.
    pub(crate) fn of(first: &[u16], second: &[u16]) -> Option<Self> {
        let mut words = [0; 11];
        if first.len() + second.len() != words.len() {
            return None;
        }
        for (word, read) in words.iter_mut().zip(first.iter().chain(second)) {
            *word = *read;
        }
        Some(Self { words })
    }

    /// From the raw words of a status that [`status`](Self::status) made.
    pub(crate) fn of_raw(raw: &[RawWord]) -> Self {
        let mut words = [0; 11];
        for (word, read) in words.iter_mut().zip(raw) {
            *word = read.value;
        }
        Self { words }
    }

    pub(crate) fn word<A: drive_core::registers::access::Kind>(&self, register: Register<A>) -> u16 {
        let index = register.address().checked_sub(FIRST_BLOCK.0).map(usize::from);
        index.and_then(|index| self.words.get(index)).copied().unwrap_or(0)
    }

    pub(crate) fn chart(&self) -> Option<ChartState> {
        ChartState::of(self.word(ETA))
    }

    pub(crate) fn eta(&self) -> StatusWord {
        StatusWord::from_bits_retain(self.word(ETA))
    }

    pub(crate) fn eti(&self) -> ExtendedStatus {
        ExtendedStatus::from_bits_retain(self.word(ETI))
    }

    /// Who commands: ETA says whether local control is forced, ETI who it is otherwise.
    pub(crate) fn control(&self) -> Control {
        if self.eta().contains(StatusWord::REMOTE) { self.eti().control() } else { Control::Local }
    }

    /// The status. `command` is the control word that this drive was last seen to hold, if any: in the state
    /// "operation enabled" the status words alone do not tell a motor that slows down to stop from one that slows down
    /// to a lower setpoint.
    pub(crate) fn status(&self, command: Option<ControlWord>) -> Status {
        let eta = self.eta();
        let chart = self.chart();
        Status {
            state: self.state(chart, command),
            direction: Some(eta.direction()),
            output_frequency: Some(Frequency::from_decihertz(self.word(RFR).cast_signed().unsigned_abs())),
            current: Some(Current::from_deciamperes(u32::from(self.word(LCR)))),
            current_share: None,
            at_reference: Some(eta.contains(StatusWord::REFERENCE_REACHED)),
            warning: Some(eta.contains(StatusWord::ALARM)),
            fault_code: matches!(chart, Some(ChartState::Fault | ChartState::FaultReactionActive))
                .then(|| self.word(LFT)),
            control: Some(self.control()),
            raw: self.raw(),
        }
    }

    pub(crate) fn raw(&self) -> Vec<RawWord> {
        Self::first_block(&self.words)
    }

    /// The raw form of words that begin at W450.
    pub(crate) fn first_block(words: &[u16]) -> Vec<RawWord> {
        let words = (FIRST_BLOCK.0..).zip(CODES).zip(words);
        words.map(|((address, code), &value)| RawWord { address, code, value }).collect()
    }

    fn state(&self, chart: Option<ChartState>, command: Option<ControlWord>) -> State {
        let eti = self.eti();
        let turning = eti.contains(ExtendedStatus::MOTOR_RUNNING);
        match chart {
            None => State::Unknown,
            Some(ChartState::NotReadyToSwitchOn) => State::NotReady,
            Some(ChartState::SwitchOnDisabled | ChartState::ReadyToSwitchOn) => State::Disabled,
            Some(ChartState::SwitchedOn) if turning => State::Stopping,
            Some(ChartState::SwitchedOn) => State::Ready,
            Some(ChartState::OperationEnabled) => self.enabled(turning, command),
            Some(ChartState::QuickStopActive) => State::QuickStop,
            Some(ChartState::FaultReactionActive) => State::FaultReaction,
            Some(ChartState::Fault) => State::Fault,
        }
    }

    fn enabled(&self, turning: bool, command: Option<ControlWord>) -> State {
        let command = command.filter(|_| self.control() == Control::Bus);
        let stopping = self.eti().intersects(ExtendedStatus::FAST_STOP | ExtendedStatus::DC_INJECTION)
            || command.is_some_and(ControlWord::is_stop);
        match (turning, command) {
            (true, _) if stopping => State::Stopping,
            (true, _) => State::Running,
            // At a setpoint of zero a run command is in force and nothing turns.
            (false, Some(command)) if command.is_run() => State::Running,
            (false, _) => State::Ready,
        }
    }
}

impl ControlWord {
    /// Enable operation, in a direction.
    pub(crate) fn run(direction: Direction) -> Self {
        let enabled = Self::SWITCH_ON | Self::ENABLE_VOLTAGE | Self::NO_QUICK_STOP | Self::ENABLE_OPERATION;
        match direction {
            Direction::Forward => enabled,
            Direction::Reverse => enabled | Self::REVERSE,
        }
    }

    /// Whether it holds a run command: operation enabled and no stop.
    pub(crate) fn is_run(self) -> bool {
        self.contains(Self::run(Direction::Forward)) && !self.is_stop()
    }

    /// Whether it holds one of the stops that keep operation enabled.
    pub(crate) fn is_stop(self) -> bool {
        self.intersects(Self::STOP | Self::DC_INJECTION | Self::FAST_STOP)
    }
}

/// The raw form of the control word, for statuses that were confirmed by it.
pub(crate) const fn raw_command(value: u16) -> RawWord {
    RawWord { address: CMD.address(), code: CMD.row().code, value }
}
