//! A start through the chart, as a pure machine: the state that the drive shows, to what is done next.

use super::chart::{ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, SHUTDOWN, SWITCH_ON};

/// What to do next on the way to operation enabled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// Write this to the low byte of the control word, then read the status again.
    Write(u16),
    /// Read the status again: the drive has been told, and does not show it yet.
    Wait,
    /// Operation is enabled and the run command was given there or on the way.
    Arrived,
    /// Somebody else has commanded the drive meanwhile, or it was powered off: the start is over.
    Over,
    /// A fault stands in the way; only a reset leads on, and nobody resets unasked.
    Faulted,
}

/// How far a start has come. It never writes a word twice: a drive that is slow to follow is waited for, and one that
/// somebody else has commanded meanwhile, at a key or from another master, is not started against that will. A drive shows
/// that by falling back, and by skipping a rung: the stops that keep operation enabled lead right up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Climb {
    height: u8,
    written: Option<u16>,
}

impl Climb {
    /// From the rung on which the drive stands; `None` where no rung is.
    pub(super) fn from(state: ChartState) -> Option<Self> {
        rung(state).map(|(height, _)| Self { height, written: None })
    }

    /// The drive has not taken the last word: it is given again.
    pub(super) const fn forget_written(&mut self) {
        self.written = None;
    }

    /// What to do, now that the drive shows this state.
    pub(super) fn next(&mut self, state: ChartState) -> Next {
        if state.is_fault() {
            return Next::Faulted;
        }
        let next_or_same = self.height..=self.height + 1;
        let Some((height, word)) = rung(state).filter(|(height, _)| next_or_same.contains(height)) else {
            return Next::Over;
        };
        self.height = height;
        if self.written.replace(word) != Some(word) {
            Next::Write(word)
        } else if state == ChartState::OperationEnabled {
            Next::Arrived
        } else {
            Next::Wait
        }
    }
}

/// How high a state is, and the word that leads on from it. Operation enabled is also the state of a stopped drive that
/// keeps its voltage, or of one whose terminals command it: the run command is given there like on the rung before.
const fn rung(state: ChartState) -> Option<(u8, u16)> {
    match state {
        ChartState::QuickStopActive => Some((0, DISABLE_VOLTAGE)),
        ChartState::SwitchOnDisabled => Some((1, SHUTDOWN)),
        ChartState::ReadyToSwitchOn => Some((2, SWITCH_ON)),
        ChartState::SwitchedOn => Some((3, ENABLE_OPERATION)),
        ChartState::OperationEnabled => Some((4, ENABLE_OPERATION)),
        ChartState::NotReadyToSwitchOn | ChartState::FaultReactionActive | ChartState::Fault => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUNGS: [ChartState; 5] = [
        ChartState::QuickStopActive,
        ChartState::SwitchOnDisabled,
        ChartState::ReadyToSwitchOn,
        ChartState::SwitchedOn,
        ChartState::OperationEnabled,
    ];
    const NO_RUNGS: [ChartState; 3] =
        [ChartState::NotReadyToSwitchOn, ChartState::FaultReactionActive, ChartState::Fault];

    /// The drive's side of the table on page 12, for the words that the climb writes.
    fn follow(state: ChartState, word: u16) -> ChartState {
        match (state, word) {
            (_, DISABLE_VOLTAGE) => ChartState::SwitchOnDisabled,
            (ChartState::SwitchOnDisabled, SHUTDOWN) => ChartState::ReadyToSwitchOn,
            (ChartState::ReadyToSwitchOn, SWITCH_ON) => ChartState::SwitchedOn,
            (ChartState::SwitchedOn | ChartState::OperationEnabled, ENABLE_OPERATION) => {
                ChartState::OperationEnabled
            }
            (state, word) => panic!("{word:04X}h does nothing in {state:?}"),
        }
    }

    #[test]
    fn a_climb_arrives_from_every_rung_and_writes_each_word_once_however_slow_the_drive() {
        for start in RUNGS {
            for lag in 0..3 {
                let mut climb = Climb::from(start).unwrap();
                let (mut state, mut written) = (start, Vec::new());
                while let Next::Write(word) = climb.next(state) {
                    for _ in 0..lag {
                        let next = climb.next(state);
                        assert!(matches!(next, Next::Wait | Next::Arrived), "{start:?}: {next:?}");
                    }
                    state = follow(state, word);
                    written.push(word);
                }
                assert_eq!(climb.next(state), Next::Arrived, "{start:?}");
                let from = RUNGS.iter().position(|&rung| rung == start).unwrap().min(3);
                let all = [DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION];
                assert_eq!(written, all[from..], "{start:?}");
            }
        }
    }

    #[test]
    fn whatever_falls_back_is_never_written_to_again() {
        for (at, reached) in RUNGS.into_iter().enumerate() {
            for fallen in RUNGS[..at].iter().copied().chain([ChartState::NotReadyToSwitchOn]) {
                let mut climb = Climb::from(reached).unwrap();
                assert!(matches!(climb.next(reached), Next::Write(_)));
                assert_eq!(climb.next(fallen), Next::Over, "{reached:?}, then {fallen:?}");
            }
        }
    }

    #[test]
    fn whatever_skips_a_rung_is_never_written_to_again() {
        for (at, reached) in RUNGS.into_iter().enumerate() {
            for skipped_to in RUNGS.into_iter().skip(at + 2) {
                let mut climb = Climb::from(reached).unwrap();
                assert!(matches!(climb.next(reached), Next::Write(_)));
                assert_eq!(climb.next(skipped_to), Next::Over, "{reached:?}, then {skipped_to:?}");
            }
        }
    }

    #[test]
    fn nothing_leads_out_of_a_fault_and_no_climb_begins_where_no_rung_is() {
        for state in NO_RUNGS {
            assert!(Climb::from(state).is_none(), "{state:?}");
            let mut climb = Climb::from(ChartState::SwitchOnDisabled).unwrap();
            assert_eq!(climb.next(state) == Next::Faulted, state.is_fault(), "{state:?}");
        }
    }
}
