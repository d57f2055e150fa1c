//! What the status words show of the output and of the evidence for a run command.

use drive_core::{Control, Direction, Evidence, Frequency, Lease, Output, Refusal, RunWord, State, Told};

use super::{ControlWord, ExtendedStatus, StatusWord, StatusWords};
use crate::chart::ChartState;

impl StatusWords {
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
    pub(super) fn is_brought_down(self, reference: Frequency, output: Option<Frequency>) -> bool {
        self.is_turning()
            && self.eti.contains(ExtendedStatus::DECELERATING)
            && !self.eti.contains(ExtendedStatus::CURRENT_LIMIT)
            && self.eta.direction() == self.asks_for()
            && output.is_some_and(|output| output < reference)
    }
}
