//! What the manuals leave open about a drive with this chart, as switches.

use crate::world::Switch;

/// Who commands at the access levels L1 and L2, and so on an Altivar 28.
pub(in crate::models) const PRIORITY: Switch = Switch {
    name: "priority",
    readings: &["bus", "newest"],
    question: "at L1 and L2 \"priorities between channels are managed by the drive\" (BBV51701 p. 11): the bus \
               commands from its first control word to the next power-up, or whoever gave the newest command",
};
/// What the reference of the bus is at L1 and L2.
pub(in crate::models) const BUS_REFERENCE: Switch = Switch {
    name: "bus-reference",
    readings: &["alone", "as-Fr1"],
    question: "at L1 and L2 the reference of a bus that commands stands alone, or takes the place of Fr1 and is summed, \
               regulated and replaced by preset speeds as that is (BBV51701 p. 11, 42-47)",
};
/// Which references preset speeds replace.
pub(in crate::models) const PRESETS: Switch = Switch {
    name: "presets",
    readings: &["Fr1", "both"],
    question: "preset speeds replace Fr1 only, as the summing inputs are said to (BBV51701 p. 42), or Fr2 as well",
};
/// What a control word does that stands when the bus gets control back.
pub(in crate::models) const GIVEN_BACK: Switch = Switch {
    name: "given-back",
    readings: &["new-word", "standing-word"],
    question: "when the bus becomes the command channel, what it then writes acts, or the word that stands (BBV51701 \
               p. 37: \"may result in a change of direction\")",
};
/// What follows when a stop input is released while the bus commands.
pub(in crate::models) const STOP_RELEASED: Switch = Switch {
    name: "stop-released",
    readings: &["as-wired", "standing-word"],
    question: "after a fast stop by an input the bus's standing run command acts again only with 2-wire level control \
               (BBV51701 p. 40), or in any case (p. 8)",
};
/// Whether the bus can reset a fault while another channel commands.
pub(in crate::models) const RESET: Switch = Switch {
    name: "reset",
    readings: &["commander", "any"],
    question: "bit 7 of the control word resets a fault while another channel commands, or does not (BBV51701 p. 12)",
};
/// What ETI bit 4 shows while direct current is injected.
pub(in crate::models) const MOTOR_RUNNING: Switch = Switch {
    name: "ETI.4",
    readings: &["any-current", "output-frequency"],
    question: "ETI bit 4 \"motor running\" is 1 or 0 while direct current is injected (BBV51701 p. 20, 22)",
};
/// What 0007h does from operation enabled.
pub(in crate::models) const DISABLE_OPERATION: Switch = Switch {
    name: "0007h",
    readings: &["Stt", "freewheel"],
    question: "the control word 0007h from operation enabled stops as Stt says, or lets the motor coast (BBV51701 p. 10, 12)",
};
/// What an automatic restart does to a drive that the bus commands.
pub(in crate::models) const RESTART: Switch = Switch {
    name: "restart",
    readings: &["runs-on", "locks"],
    question: "after an automatic restart a drive that the bus commands runs on by the standing word, or is in \"switch on \
               disabled\" as after any other reset (BBV51701 p. 10, 51)",
};
/// Whose reference the remote terminal's is.
pub(in crate::models) const TERMINAL_REFERENCE: Switch = Switch {
    name: "terminal-reference",
    readings: &["own", "LFr"],
    question: "the reference of the remote terminal is one of its own, or the word LFr that the bus writes too \
               (BBV51701 p. 38: \"by parameter LFr page 19\")",
};

/// The readings that a drive follows; all `false`: the first of each switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::models) struct Readings {
    pub(in crate::models) newest_commands: bool,
    pub(in crate::models) bus_as_reference_1: bool,
    pub(in crate::models) presets_on_both: bool,
    pub(in crate::models) standing_word_acts: bool,
    pub(in crate::models) stop_release_restarts: bool,
    pub(in crate::models) any_word_resets: bool,
    pub(in crate::models) injection_is_not_running: bool,
    pub(in crate::models) disabling_coasts: bool,
    pub(in crate::models) restart_locks: bool,
    pub(in crate::models) terminal_shares_reference: bool,
}

impl Readings {
    /// Puts a switch on a reading; `false` when it is none of these.
    pub(in crate::models) fn choose(&mut self, name: &str, reading: &str) -> bool {
        let choices = [
            (&PRIORITY, &mut self.newest_commands),
            (&BUS_REFERENCE, &mut self.bus_as_reference_1),
            (&PRESETS, &mut self.presets_on_both),
            (&GIVEN_BACK, &mut self.standing_word_acts),
            (&STOP_RELEASED, &mut self.stop_release_restarts),
            (&RESET, &mut self.any_word_resets),
            (&MOTOR_RUNNING, &mut self.injection_is_not_running),
            (&DISABLE_OPERATION, &mut self.disabling_coasts),
            (&RESTART, &mut self.restart_locks),
            (&TERMINAL_REFERENCE, &mut self.terminal_shares_reference),
        ];
        let found = choices.into_iter().find(|(switch, _)| switch.name == name);
        found.map(|(switch, second)| *second = switch.readings.get(1) == Some(&reading)).is_some()
    }
}
