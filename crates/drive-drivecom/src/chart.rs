//! The chart itself, as pure functions.

use drive_core::State;

/// A state of the chart, from the status word ETA under the mask 006Fh.
///
/// ```
/// use drive_core::State;
/// use drive_drivecom::ChartState;
///
/// // ETA of a motor that runs.
/// let state = ChartState::of(0x0627).expect("the manual's table has it");
/// assert_eq!(state, ChartState::OperationEnabled);
/// assert_eq!(state.state(true, State::Running), State::Running);
/// assert_eq!(ChartState::of(0x0001), None, "a pattern that it does not have");
/// ```
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

/// The bits of ETA that tell the state.
const MASK: u16 = 0x006F;

impl ChartState {
    /// The state in a status word; `None` for a pattern that the manual's table does not have.
    #[must_use]
    pub const fn of(eta: u16) -> Option<Self> {
        Some(match eta & MASK {
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

    /// Whether a fault is present.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        matches!(self, Self::Fault | Self::FaultReactionActive)
    }

    /// The same in the terms that all families share. What the chart alone does not tell: whether the motor is
    /// `turning`, and what the drive does while operation is `enabled`.
    #[must_use]
    pub const fn state(self, turning: bool, enabled: State) -> State {
        match self {
            Self::NotReadyToSwitchOn => State::NotReady,
            Self::SwitchOnDisabled | Self::ReadyToSwitchOn => State::Disabled,
            Self::SwitchedOn if turning => State::Stopping,
            Self::SwitchedOn => State::Ready,
            Self::OperationEnabled => enabled,
            Self::QuickStopActive => State::QuickStop,
            Self::FaultReactionActive => State::FaultReaction,
            Self::Fault => State::Fault,
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
