//! The chart itself, as pure functions.

/// A state of the chart, from the status word ETA under the mask 006Fh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChartState {
    /// Initialising; the drive leaves it by itself.
    NotReadyToSwitchOn,
    /// Locked; the ladder begins here.
    SwitchOnDisabled,
    /// The first rung.
    ReadyToSwitchOn,
    /// The second rung.
    SwitchedOn,
    /// Run commands act.
    OperationEnabled,
    /// Stopping or stopped by a quick stop; left by disabling the voltage.
    QuickStopActive,
    /// Doing what the fault asks; the drive leaves it by itself.
    FaultReactionActive,
    /// Tripped; left by a reset only.
    Fault,
}

impl ChartState {
    /// The bits of ETA that tell the state.
    pub const MASK: u16 = 0x006F;

    /// The state in a status word; `None` for a pattern that the manual's table does not have.
    #[must_use]
    pub const fn of(eta: u16) -> Option<Self> {
        Some(match eta & Self::MASK {
            0x0000 | 0x0020 => Self::NotReadyToSwitchOn,
            0x0040 | 0x0060 => Self::SwitchOnDisabled,
            0x0021 => Self::ReadyToSwitchOn,
            0x0023 => Self::SwitchedOn,
            0x0027 => Self::OperationEnabled,
            0x0007 => Self::QuickStopActive,
            0x0008 | 0x0028 => Self::Fault,
            0x000F | 0x002F => Self::FaultReactionActive,
            _ => return None,
        })
    }
}

/// Where a ladder leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Goal {
    /// Run commands act.
    OperationEnabled,
    /// Switched on, no run command in force.
    SwitchedOn,
    /// No voltage at the output; from operation enabled the motor coasts.
    SwitchOnDisabled,
}

/// What to do next on the way to a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Step {
    /// Write this to the low byte of the control word, then read the status again.
    Write(u16),
    /// Read the status again: the drive leaves this state by itself.
    Wait,
    /// The goal is reached.
    Reached,
    /// A fault stands in the way; only a reset leads on, and nobody resets unasked.
    Faulted,
}

/// CMD 0000h: disable voltage; a running motor coasts.
pub const DISABLE_VOLTAGE: u16 = 0x0000;
/// CMD 0002h: quick stop.
pub const QUICK_STOP: u16 = 0x0002;
/// CMD 0006h: shutdown; a running motor coasts.
pub const SHUTDOWN: u16 = 0x0006;
/// CMD 0007h: switch on, and disable operation.
pub const SWITCH_ON: u16 = 0x0007;
/// CMD 000Fh: enable operation.
pub const ENABLE_OPERATION: u16 = 0x000F;
/// CMD 0080h: fault reset on its rising edge.
pub const FAULT_RESET: u16 = 0x0080;

/// The next step from a state to a goal.
#[must_use]
pub const fn next_step(state: ChartState, goal: Goal) -> Step {
    match (state, goal) {
        (ChartState::Fault | ChartState::FaultReactionActive, _) => Step::Faulted,
        (ChartState::NotReadyToSwitchOn, _) => Step::Wait,
        (ChartState::OperationEnabled, Goal::OperationEnabled)
        | (ChartState::SwitchedOn, Goal::SwitchedOn)
        | (ChartState::SwitchOnDisabled, Goal::SwitchOnDisabled) => Step::Reached,
        (_, Goal::SwitchOnDisabled) | (ChartState::QuickStopActive, _) => Step::Write(DISABLE_VOLTAGE),
        (ChartState::SwitchOnDisabled, _) => Step::Write(SHUTDOWN),
        (ChartState::ReadyToSwitchOn, _) | (ChartState::OperationEnabled, Goal::SwitchedOn) => {
            Step::Write(SWITCH_ON)
        }
        (ChartState::SwitchedOn, Goal::OperationEnabled) => Step::Write(ENABLE_OPERATION),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATES: [ChartState; 8] = [
        ChartState::NotReadyToSwitchOn,
        ChartState::SwitchOnDisabled,
        ChartState::ReadyToSwitchOn,
        ChartState::SwitchedOn,
        ChartState::OperationEnabled,
        ChartState::QuickStopActive,
        ChartState::FaultReactionActive,
        ChartState::Fault,
    ];
    const GOALS: [Goal; 3] = [Goal::OperationEnabled, Goal::SwitchedOn, Goal::SwitchOnDisabled];

    #[test]
    fn every_status_word_has_the_state_that_the_table_of_page_10_gives_or_none() {
        for eta in 0..=u16::MAX {
            let expected = match eta & 0x6F {
                0x00 | 0x20 => Some(ChartState::NotReadyToSwitchOn),
                0x40 | 0x60 => Some(ChartState::SwitchOnDisabled),
                0x21 => Some(ChartState::ReadyToSwitchOn),
                0x23 => Some(ChartState::SwitchedOn),
                0x27 => Some(ChartState::OperationEnabled),
                0x07 => Some(ChartState::QuickStopActive),
                0x08 | 0x28 => Some(ChartState::Fault),
                0x0F | 0x2F => Some(ChartState::FaultReactionActive),
                _ => None,
            };
            assert_eq!(ChartState::of(eta), expected, "{eta:04X}h");
        }
        // The examples of page 21: steady forward and reverse, accelerating forward and reverse.
        for eta in [0x0627, 0x8627, 0x0227, 0x8227] {
            assert_eq!(ChartState::of(eta), Some(ChartState::OperationEnabled));
        }
    }

    #[test]
    fn only_the_control_words_of_the_manual_are_ever_written() {
        for state in STATES {
            for goal in GOALS {
                if let Step::Write(word) = next_step(state, goal) {
                    assert!([DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION].contains(&word));
                }
            }
        }
    }

    #[test]
    fn no_goal_leads_out_of_a_fault() {
        for goal in GOALS {
            assert_eq!(next_step(ChartState::Fault, goal), Step::Faulted);
            assert_eq!(next_step(ChartState::FaultReactionActive, goal), Step::Faulted);
        }
    }

    #[test]
    fn the_ladder_reaches_each_goal_from_every_state_without_a_fault() {
        // The drive's side of the table on page 12, for the words that the ladder writes.
        let follow = |state, word| match (state, word) {
            (_, DISABLE_VOLTAGE) => ChartState::SwitchOnDisabled,
            (ChartState::SwitchOnDisabled, SHUTDOWN) => ChartState::ReadyToSwitchOn,
            (ChartState::ReadyToSwitchOn | ChartState::OperationEnabled, SWITCH_ON) => ChartState::SwitchedOn,
            (ChartState::SwitchedOn, ENABLE_OPERATION) => ChartState::OperationEnabled,
            (state, word) => panic!("{word:04X}h does nothing in {state:?}"),
        };
        for start in STATES {
            for goal in GOALS {
                let mut state = start;
                for _ in 0..5 {
                    match next_step(state, goal) {
                        Step::Write(word) => state = follow(state, word),
                        Step::Wait => state = ChartState::SwitchOnDisabled,
                        Step::Reached | Step::Faulted => break,
                    }
                }
                assert!(
                    matches!(next_step(state, goal), Step::Reached | Step::Faulted),
                    "{start:?} to {goal:?}"
                );
            }
        }
    }
}
