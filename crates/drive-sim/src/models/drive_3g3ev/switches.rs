//! What the manual of the 3G3EV leaves open, as switches.

use crate::Switch;

/// What an input can be for: the manual prints no number for n06 to n08.
const FUNCTIONS: &[&str] =
    &["nothing", "fault-reset", "external-fault", "local", "preset-speed", "base-block"];

/// What an input is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Function {
    #[default]
    Nothing,
    /// A fault is reset when the input goes on.
    FaultReset,
    /// The drive trips with EF as long as it is on.
    ExternalFault,
    /// The console commands and gives the reference.
    Local,
    /// A preset speed is the reference.
    PresetSpeed,
    /// The output is off, and the motor coasts.
    BaseBlock,
}

impl Function {
    fn named(name: &str) -> Self {
        match name {
            "fault-reset" => Self::FaultReset,
            "external-fault" => Self::ExternalFault,
            "local" => Self::Local,
            "preset-speed" => Self::PresetSpeed,
            "base-block" => Self::BaseBlock,
            _ => Self::Nothing,
        }
    }
}

const INPUT_QUESTION: &str = "what bit 4, 5 or 6 of 0001h and the terminal beside it do, by the function that n06, n07 or n08 \
                              selects and whose numbers are not printed (§5.1)";
const INPUTS: [Switch; 3] = [
    Switch { name: "n06", readings: FUNCTIONS, question: INPUT_QUESTION },
    Switch { name: "n07", readings: FUNCTIONS, question: INPUT_QUESTION },
    Switch { name: "n08", readings: FUNCTIONS, question: INPUT_QUESTION },
];
const N02_3: Switch = Switch {
    name: "n02=3",
    readings: &["console", "bus"],
    question: "with n02 = 3 the reference comes from the console as printed, or from the bus as the pattern of the table has it \
               (§2.1)",
};
const RESET_RUN: Switch = Switch {
    name: "after-reset",
    readings: &["waits", "runs"],
    question: "a run command that stood through a fault waits until it was 0 once, or runs the motor after the reset (§5.1)",
};
const RESET_WITH_RUN: Switch = Switch {
    name: "reset-with-run",
    readings: &["resets", "ignored"],
    question: "a fault is reset while a run command stands, or not (§5.1)",
};
const REMOTE_AGAIN: Switch = Switch {
    name: "remote-again",
    readings: &["waits", "runs"],
    question: "back from the panel, a run command that stands in 0001h waits until it was 0 once, or acts (§2.1)",
};
const UNDERVOLTAGE: Switch = Switch {
    name: "UV1",
    readings: &["stays", "clears"],
    question: "UV1 stays until it is reset, or clears itself when the supply of the motor is back, and a run command acts again \
               (§5.2)",
};
const LINK_ERRORS: Switch = Switch {
    name: "003Dh",
    readings: &["until-reset", "until-good"],
    question: "the error bits of 003Dh stand until a fault reset, or until the next good frame (§5.2)",
};

/// All of them.
pub(super) const SWITCHES: &[Switch] = &[
    INPUTS[0],
    INPUTS[1],
    INPUTS[2],
    N02_3,
    RESET_RUN,
    RESET_WITH_RUN,
    REMOTE_AGAIN,
    UNDERVOLTAGE,
    LINK_ERRORS,
];

/// The readings that a drive follows; by default the first of each switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Readings {
    /// Of n06, n07 and n08.
    pub(super) inputs: [Function; 3],
    pub(super) n02_3_is_bus: bool,
    pub(super) runs_after_reset: bool,
    pub(super) run_blocks_reset: bool,
    pub(super) runs_when_remote: bool,
    pub(super) undervoltage_clears: bool,
    pub(super) good_frame_clears: bool,
}

impl Readings {
    pub(super) fn choose(&mut self, name: &str, reading: &str) {
        let mut inputs = INPUTS.iter().zip(&mut self.inputs);
        if let Some((_, function)) = inputs.find(|(switch, _)| switch.name == name) {
            *function = Function::named(reading);
            return;
        }
        let choices = [
            (&N02_3, &mut self.n02_3_is_bus),
            (&RESET_RUN, &mut self.runs_after_reset),
            (&RESET_WITH_RUN, &mut self.run_blocks_reset),
            (&REMOTE_AGAIN, &mut self.runs_when_remote),
            (&UNDERVOLTAGE, &mut self.undervoltage_clears),
            (&LINK_ERRORS, &mut self.good_frame_clears),
        ];
        Switch::choose(choices, name, reading);
    }
}
