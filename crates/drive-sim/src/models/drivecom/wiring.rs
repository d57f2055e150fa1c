//! The run command of the terminals (BBV51701 p. 33).

use super::Run;

/// How the logic inputs give a run command (tCC and tCt).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wiring {
    /// 2-wire: an input that is on runs. Of two that are on, neither begins a run.
    Level,
    /// 2-wire: an input that goes on runs until it goes off.
    Transition,
    /// 2-wire: an input that is on runs, the forward one in preference.
    ForwardFirst,
    /// 3-wire: a pulse runs until the stop input goes off.
    ThreeWire,
}

/// The inputs that give a run command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RunInputs {
    /// Forward.
    pub forward: bool,
    /// In reverse.
    pub reverse: bool,
    /// The stop of 3-wire control, which stops while it is off.
    pub stop: bool,
}

/// Follows the run inputs and remembers what edges have begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Terminals {
    before: RunInputs,
    latched: Option<Run>,
}

impl Terminals {
    /// The inputs are so at power-up: nothing of it is an edge.
    pub const fn power_up(&mut self, inputs: RunInputs) {
        (self.before, self.latched) = (inputs, None);
    }

    /// The run command that stands.
    #[must_use]
    pub const fn run(&self) -> Option<Run> {
        self.latched
    }

    /// The run command that these inputs give.
    pub fn see(&mut self, wiring: Wiring, inputs: RunInputs) -> Option<Run> {
        let forward_rises = inputs.forward && !self.before.forward;
        let reverse_rises = inputs.reverse && !self.before.reverse;
        self.before = inputs;
        let holds = |run| match run {
            Run::Forward => inputs.forward,
            Run::Reverse => inputs.reverse,
        };
        let held = self.latched.filter(|&run| holds(run));
        let edge = match (forward_rises, reverse_rises) {
            (true, _) => Some(Run::Forward),
            (false, true) => Some(Run::Reverse),
            (false, false) => None,
        };
        self.latched = match wiring {
            Wiring::Level => held.or(match (inputs.forward, inputs.reverse) {
                (true, false) => Some(Run::Forward),
                (false, true) => Some(Run::Reverse),
                _ => None,
            }),
            Wiring::ForwardFirst if inputs.forward => Some(Run::Forward),
            Wiring::ForwardFirst => inputs.reverse.then_some(Run::Reverse),
            Wiring::Transition => held.or(edge),
            Wiring::ThreeWire if inputs.stop => edge.or(self.latched),
            Wiring::ThreeWire => None,
        };
        self.latched
    }
}
