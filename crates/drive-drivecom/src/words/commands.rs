//! How a run command and a stop show in the status words, and what keeps a command from acting.

use drive_core::{Control, Direction, Frequency, Refusal};

use super::{ControlWord, ExtendedStatus, StatusWord, StatusWords};
use crate::chart::ChartState;

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

impl StatusWords {
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
}
