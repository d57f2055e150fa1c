//! What the manual of the Altivar 21 leaves open, as switches.

use crate::Switch;

const FORCED: Switch = Switch {
    name: "forced",
    readings: &["terminals", "runs"],
    question: "functions 52 and 53 give command and reference to the terminals, or run the motor by themselves at UL (§8.4 p. 31)",
};
const FORCED_OFF: Switch = Switch {
    name: "forced-off",
    readings: &["ends", "stays"],
    question: "a run forced by 52 or 53 ends with its input, or stays until the supply goes (§8.4 p. 31)",
};
const LOCAL_OFF: Switch = Switch {
    name: "local-off",
    readings: &["priority", "bus"],
    question: "with function 48 assigned and off, CMOD = 0: the bus commands by bits 14 and 15 of FA00 only, or at once (§6.2 p. 15)",
};
const FCHG: Switch = Switch {
    name: "FCHG",
    readings: &["over-priority", "under-priority"],
    question: "function 38 switches the reference also while bit 14 of FA00 is set, or not (§6.2 p. 16, §8.4 p. 31)",
};
const TWO_REFERENCES: Switch = Switch {
    name: "two-references",
    readings: &["newest", "speed"],
    question: "of FA01 and FA13 the one written last counts, or FA13 as long as it is not 0 (§8.5 p. 33)",
};
const POLES: Switch = Switch {
    name: "poles",
    readings: &["poles", "pairs"],
    question: "F856 counts poles or pairs of poles (§8.5 p. 33)",
};
const RESET_BIT: Switch = Switch {
    name: "reset-bit",
    readings: &["always", "command"],
    question: "bit 13 of FA00 resets whoever commands, or only while the bus does (§8.4 p. 31)",
};
const CLOSED_AT_START: Switch = Switch {
    name: "closed-at-start",
    readings: &["runs", "waits"],
    question: "an input that was closed through a reset or a power-up runs the motor, or waits to be closed anew (§8.2 p. 28)",
};
const RETRIES: Switch = Switch {
    name: "retries",
    readings: &["none", "after-1s"],
    question: "a trip stays, or the drive tries again by itself: bit 1 of FD01 includes retries (§8.6 p. 34)",
};
const LOC_REM: Switch = Switch {
    name: "LOC/REM",
    readings: &["waits", "resumes"],
    question: "back from the keypad, the run command that stands in FA00 waits to be written anew, or acts (§6.2 p. 12)",
};
const BUMPLESS: Switch = Switch {
    name: "LOC",
    readings: &["stops", "runs-on"],
    question: "a running motor whose control the keypad takes stops, or runs on at its frequency (§6.2 p. 12)",
};
const LOCAL_BIT: Switch = Switch {
    name: "FD01.15",
    readings: &["any", "keypad"],
    question: "bit 15 of FD01 shows local also while the terminals are forced, or for the keypad alone (§8.6 p. 34)",
};
const RUN_BIT: Switch = Switch {
    name: "FD01.10",
    readings: &["ordered", "turning"],
    question: "bit 10 of FD01 stands as long as a run is ordered, or until the motor stands (§8.6 p. 34)",
};
const RUN_BIT_ST: Switch = Switch {
    name: "FD01.10-ST",
    readings: &["ordered", "in-force"],
    question: "with ST = OFF bit 10 of FD01 stands because a run is ordered, or not (§8.6 p. 34)",
};
const BEFORE_TRIP: Switch = Switch {
    name: "before-trip",
    readings: &["frozen", "live"],
    question: "words that are remarked \"value before the trip\" keep it while the trip lasts, or are live (§8.3 p. 29)",
};
const F603_4: Switch = Switch {
    name: "F603=4",
    readings: &["coasts", "runs-on"],
    question: "the factory's F603 = 4, which is not explained, trips and coasts, or does nothing (§6.4 p. 19)",
};
const UNDERVOLTAGE: Switch = Switch {
    name: "undervoltage",
    readings: &["alarm", "trip"],
    question: "without supply of the power circuit the drive shows MOFF and runs again when it is back, or trips UP1 (§8.6 p. 34, §8.7 p. 37)",
};

/// All of them.
pub(super) const SWITCHES: &[Switch] = &[
    FORCED,
    FORCED_OFF,
    LOCAL_OFF,
    FCHG,
    TWO_REFERENCES,
    POLES,
    RESET_BIT,
    CLOSED_AT_START,
    RETRIES,
    LOC_REM,
    BUMPLESS,
    LOCAL_BIT,
    RUN_BIT,
    RUN_BIT_ST,
    BEFORE_TRIP,
    F603_4,
    UNDERVOLTAGE,
];

/// The readings that a drive follows; all `false`: the first of each switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Readings {
    pub(super) forced_runs: bool,
    pub(super) forced_run_stays: bool,
    pub(super) local_off_is_bus: bool,
    pub(super) priority_over_fchg: bool,
    pub(super) speed_first: bool,
    pub(super) pole_pairs: bool,
    pub(super) only_commander_resets: bool,
    pub(super) closed_inputs_wait: bool,
    pub(super) retries: bool,
    pub(super) remote_resumes: bool,
    pub(super) local_runs_on: bool,
    pub(super) local_is_keypad: bool,
    pub(super) run_until_standstill: bool,
    pub(super) run_needs_st: bool,
    pub(super) live_at_trip: bool,
    pub(super) factory_reaction_runs_on: bool,
    pub(super) undervoltage_trips: bool,
}

impl Readings {
    pub(super) fn choose(&mut self, name: &str, reading: &str) {
        let choices = [
            (&FORCED, &mut self.forced_runs),
            (&FORCED_OFF, &mut self.forced_run_stays),
            (&LOCAL_OFF, &mut self.local_off_is_bus),
            (&FCHG, &mut self.priority_over_fchg),
            (&TWO_REFERENCES, &mut self.speed_first),
            (&POLES, &mut self.pole_pairs),
            (&RESET_BIT, &mut self.only_commander_resets),
            (&CLOSED_AT_START, &mut self.closed_inputs_wait),
            (&RETRIES, &mut self.retries),
            (&LOC_REM, &mut self.remote_resumes),
            (&BUMPLESS, &mut self.local_runs_on),
            (&LOCAL_BIT, &mut self.local_is_keypad),
            (&RUN_BIT, &mut self.run_until_standstill),
            (&RUN_BIT_ST, &mut self.run_needs_st),
            (&BEFORE_TRIP, &mut self.live_at_trip),
            (&F603_4, &mut self.factory_reaction_runs_on),
            (&UNDERVOLTAGE, &mut self.undervoltage_trips),
        ];
        Switch::choose(choices, name, reading);
    }
}
