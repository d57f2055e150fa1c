#![doc = include_str!("../README.md")]
//!
//! The chart's control word is a level, so a write whose answer was lost may be repeated; the one edge is the fault
//! reset. A start writes each word once, because a drive that does not follow may have been stopped; a stop is written
//! until it shows. What shows a command is what the drive does, never that the word reads back.

#![forbid(unsafe_code)]

mod chart;
mod climb;
mod ladder;
mod limits;
mod proof;
mod words;

pub use chart::{
    ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, FAULT_RESET, QUICK_STOP, SHUTDOWN, SWITCH_ON,
};
pub use ladder::{Drivecom, StopWord, may_start, reset_fault, start, stop, withdraw};
pub use limits::{follows_frequency, follows_speed, speed_limits, speed_word};
pub use proof::{Followed, Limits, Proof, Question};
pub use words::{ControlWord, ExtendedStatus, RunShown, StatusWord, StatusWords};
