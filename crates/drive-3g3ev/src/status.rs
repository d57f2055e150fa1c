//! The words of the fast set, and what they say.

use drive_core::{Control, Current, Direction, Motion, RawWord, State, Status};

use crate::{
    blocks::Words,
    frequency::FrequencyUnit,
    registers::{CURRENT, ERRORS, OUTPUT_FREQUENCY, REFERENCE_SEEN, SIGNALS, STATE, address},
    words::{Command, DriveState, Errors, Signals},
};

/// The words of one status, read in two exchanges: they may be of two moments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FastWords {
    signals: Signals,
    /// What is `None` this drive does not have.
    errors: Option<Errors>,
    state: DriveState,
    reference: Option<u16>,
    output: Option<u16>,
    current: Option<u16>,
    raw: Vec<RawWord>,
}

impl FastWords {
    pub(crate) fn of(words: Words) -> Self {
        Self {
            signals: Signals::from_bits_retain(words.word(SIGNALS).unwrap_or(0)),
            errors: words.word(ERRORS).map(Errors::from_bits_retain),
            state: DriveState::from_bits_retain(words.word(STATE).unwrap_or(0)),
            reference: words.word(REFERENCE_SEEN),
            output: words.word(OUTPUT_FREQUENCY),
            current: words.word(CURRENT),
            raw: words.into_raw(),
        }
    }

    /// The status. `command` is the word in 0001h, where it is known: RUN alone does not tell a motor that slows down
    /// to stop from one that follows its reference.
    pub(crate) fn status(self, unit: Option<FrequencyUnit>, command: Option<Command>) -> Status {
        let warnings = DriveState::OVERTORQUE | DriveState::REFERENCE_ERROR | DriveState::LINK_FAULT;
        let warning = self.state.intersects(warnings | DriveState::UNDERVOLTAGE)
            || self.signals.contains(Signals::DATA_ERROR);
        let reverse = self.signals.contains(Signals::REVERSE);
        Status {
            state: self.drive_state(command),
            direction: Some(if reverse { Direction::Reverse } else { Direction::Forward }),
            output_frequency: unit.zip(self.output).and_then(|(unit, word)| unit.frequency(word)),
            current: self.current.map(|word| Current::from_deciamperes(u32::from(word))),
            reference: unit.zip(self.reference).and_then(|(unit, word)| unit.frequency(word)),
            at_reference: Some(self.state.contains(DriveState::AT_REFERENCE)),
            warning: Some(warning),
            fault_code: self.errors.filter(|errors| errors.bits() != 0).map(lowest_bit),
            control: Some(self.control()),
            verdict: None,
            motion: Motion::NotKnown,
            raw: self.raw,
            ..Status::default()
        }
    }

    fn control(&self) -> Control {
        if self.state.contains(DriveState::LOCAL_RUN) { Control::Local } else { Control::Bus }
    }

    pub(crate) fn is_tripped(&self) -> bool {
        self.signals.contains(Signals::FAULT)
            || self.errors.is_some_and(|errors| errors.bits() != 0)
            || self.state.contains(DriveState::MAJOR_FAULT)
    }

    fn drive_state(&self, command: Option<Command>) -> State {
        let running = self.signals.contains(Signals::RUN) || self.state.contains(DriveState::RUN);
        let turning =
            self.output.is_some_and(|output| output != 0) && !self.state.contains(DriveState::OUTPUT_OFF);
        // A run command without an output is none: something keeps it off.
        let cut = self.state.contains(DriveState::OUTPUT_OFF)
            && self.reference != Some(0)
            && self.output.is_none_or(|output| output == 0);
        let ready = self.signals.contains(Signals::READY)
            && self.state.contains(DriveState::READY)
            && !self.state.contains(DriveState::UNDERVOLTAGE);
        let stop_ordered =
            self.control() == Control::Bus && command.is_some_and(|command| !command.contains(Command::RUN));
        if self.is_tripped() {
            State::Fault
        } else if running && stop_ordered {
            State::Stopping
        } else if running && cut {
            State::NotReady
        } else if running {
            State::Running
        } else if turning {
            State::Stopping
        } else if ready {
            State::Ready
        } else {
            State::NotReady
        }
    }
}

/// The number of the lowest bit that is set: the first of the present faults.
const fn lowest_bit(errors: Errors) -> u16 {
    errors.bits().trailing_zeros() as u16
}

pub(crate) fn state_word(status: &Status) -> DriveState {
    DriveState::from_bits_retain(status.raw(address::STATE).unwrap_or(0))
}

/// Whether the drive shows RUN in either of its words.
pub(crate) fn is_run(status: &Status) -> bool {
    let signals = Signals::from_bits_retain(status.raw(address::SIGNALS).unwrap_or(0));
    signals.contains(Signals::RUN) || state_word(status).contains(DriveState::RUN)
}
