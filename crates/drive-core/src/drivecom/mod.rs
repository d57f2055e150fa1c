//! The DRIVECOM state chart that the Altivar 28, 58 and 312 share, from the master's side (BBV51701 p. 10–13): as pure
//! functions, status word to state, state to the next control word; and as [`start`], [`stop`] and
//! [`reset_fault`], which carry a command through and see that the drive shows it.
//!
//! The chart's control word is a level: writing a step twice does what writing it once does, so a ladder can be
//! climbed again after an answer was lost. The one edge is the fault reset.

mod chart;
mod ladder;
mod limits;
mod words;

pub use chart::{
    ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, FAULT_RESET, QUICK_STOP, SHUTDOWN, SWITCH_ON, Step,
    next_step,
};
pub use ladder::{CONFIRMING_READS, Drivecom, reset_fault, start, stop};
pub use limits::{speed_limits, speed_word};
pub use words::{ControlWord, ExtendedStatus, StatusWord, StatusWords};
