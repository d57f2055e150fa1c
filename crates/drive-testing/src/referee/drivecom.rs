//! The DRIVECOM chart of the IEC 61800-7 profile, as BBV51701 prints it on pages 10 to 13.

/// A state of the chart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum State {
    /// There is no chart, or nothing says where in it the drive stands.
    #[default]
    Unknown,
    /// Switch on disabled.
    SwitchOnDisabled,
    /// Ready to switch on.
    Ready,
    /// Switched on.
    SwitchedOn,
    /// Operation enabled.
    OperationEnabled,
    /// Quick stop active.
    QuickStop,
    /// A detected fault.
    Fault,
}

const SWITCH_ON: u16 = 1;
const ENABLE_VOLTAGE: u16 = 1 << 1;
const NO_QUICK_STOP: u16 = 1 << 2;
const ENABLE_OPERATION: u16 = 1 << 3;
const RESET: u16 = 1 << 7;

/// All of bits 0 to 3: the run command.
pub(super) const RUN: u16 = SWITCH_ON | ENABLE_VOLTAGE | NO_QUICK_STOP | ENABLE_OPERATION;

/// The state after a control word is sent; `before` is the word before it and `cause` whether the fault's cause stands.
pub(super) fn after(state: State, before: u16, word: u16, cause: bool) -> State {
    use State::{Fault, OperationEnabled, QuickStop, Ready, SwitchOnDisabled, SwitchedOn, Unknown};
    if state == Fault {
        let rises = word & RESET != 0 && before & RESET == 0;
        return if rises && !cause { SwitchOnDisabled } else { Fault };
    }
    if word & ENABLE_VOLTAGE == 0 {
        // 7, 9, 10, 12
        return SwitchOnDisabled;
    }
    if word & NO_QUICK_STOP == 0 {
        return match state {
            OperationEnabled | QuickStop => QuickStop, // 11
            Ready | SwitchedOn => SwitchOnDisabled,    // 7, 10
            other => other,
        };
    }
    match (state, word & SWITCH_ON != 0, word & ENABLE_OPERATION != 0) {
        (QuickStop | Unknown, _, _) => state,
        (_, false, _) => Ready,                          // 2, 6, 8
        (SwitchOnDisabled, true, _) => SwitchOnDisabled, // nothing leads on from here but shutdown
        (_, true, false) => SwitchedOn,                  // 3, 5
        (_, true, true) => OperationEnabled,             // 3A, 4
    }
}

#[cfg(test)]
mod tests {
    use super::State::{Fault, OperationEnabled, QuickStop, Ready, SwitchOnDisabled, SwitchedOn};
    use super::*;

    /// BBV51701 p.12, the table of the control word, and p.10, the figure: transition, from, word, to.
    const PRINTED: &[(&str, State, u16, State)] = &[
        ("2", SwitchOnDisabled, 0x0006, Ready),
        ("3", Ready, 0x0007, SwitchedOn),
        ("3A", Ready, 0x000F, OperationEnabled),
        ("4", SwitchedOn, 0x000F, OperationEnabled),
        ("5", OperationEnabled, 0x0007, SwitchedOn),
        ("6", SwitchedOn, 0x0006, Ready),
        ("7", Ready, 0x0000, SwitchOnDisabled),
        ("7", Ready, 0x0002, SwitchOnDisabled),
        ("8", OperationEnabled, 0x0006, Ready),
        ("9", OperationEnabled, 0x0000, SwitchOnDisabled),
        ("10", SwitchedOn, 0x0000, SwitchOnDisabled),
        ("10", SwitchedOn, 0x0002, SwitchOnDisabled),
        ("11", OperationEnabled, 0x0002, QuickStop),
        ("12", QuickStop, 0x0000, SwitchOnDisabled),
        ("15", Fault, 0x0080, SwitchOnDisabled),
    ];

    #[test]
    fn every_printed_transition_of_the_chart_leads_where_it_is_printed() {
        for &(number, from, word, to) in PRINTED {
            assert_eq!(after(from, 0, word, false), to, "transition {number}");
        }
    }

    #[test]
    fn nothing_but_disable_voltage_leaves_quick_stop_active() {
        // BBV51701 p.11: "Restarting is only possible after the drive has changed to the Switch on disabled state".
        for word in [0x0006, 0x0007, 0x000F, 0x080F] {
            assert_eq!(after(QuickStop, 0x0002, word, false), QuickStop);
        }
    }

    #[test]
    fn a_run_command_does_not_leave_switch_on_disabled() {
        assert_eq!(after(SwitchOnDisabled, 0, 0x000F, false), SwitchOnDisabled);
    }

    #[test]
    fn a_fault_is_reset_by_an_edge_only_and_only_when_its_cause_is_gone() {
        assert_eq!(after(Fault, 0x0080, 0x0080, false), Fault);
        assert_eq!(after(Fault, 0, 0x0080, true), Fault);
        assert_eq!(after(Fault, 0, 0x000F, false), Fault);
    }
}
