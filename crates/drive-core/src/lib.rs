//! What a variable-speed drive on Modbus is.
//!
//! This crate is the contract between the drives and everything else: the [`Drive`] trait, what a drive says
//! ([`Status`], [`Measurements`], [`Faults`]), what is asked of it ([`Setpoint`], [`Direction`], [`StopMode`]), what
//! can go wrong ([`Error`]), the register tables ([`registers`](mod@registers)) and the way to the line ([`Port`]). It has no task
//! and no port, and of a clock only as much as a command needs to be confirmed in its time ([`Confirming`]).
//!
//! A program that uses drives reads [`Drive`]. A crate that adds a family lists its registers with
//! [`registers!`](crate::registers!), reaches them through [`Registers`] and implements [`Drive`]. A crate that adds
//! a line implements [`Port`].
//!
//! With the feature `serde` all of this is written as JSON and what is asked is read from it, in the shape that
//! `drived` has on its own interfaces: words in `snake_case`, numbers in the unit that their key ends with, what a drive
//! does not tell left out. The feature `schemars` adds the JSON schemas.

#![forbid(unsafe_code)]

mod absent;
pub mod access;
mod address;
mod calls;
mod capabilities;
mod confirm;
mod drive;
mod error;
mod faults;
mod identity;
mod intent;
pub mod interned;
mod kept_readings;
mod lease;
mod motion;
mod named;
mod own_run;
mod panicked;
mod places;
pub mod port;
mod quantity;
mod reconnecting;
mod refusal;
pub mod registers;
pub mod serial;
#[cfg(feature = "serde")]
pub mod serialize;
mod setpoint;
mod state;
mod status;
mod stopped;
mod turns;
mod units;
mod watch;
mod withdrawn;

pub use async_trait::async_trait;
pub use tokio_modbus;

pub use absent::Absent;
pub use address::{SlaveAddress, SlaveAddressError};
pub use calls::{Calls, Lifetimes, Registers};
pub use capabilities::{
    AnswerDelay, Capabilities, LineMismatch, Reaction, StatusBit, Watchdog, WatchdogCapability,
};
pub use confirm::{CONFIRMED_WITHIN, Confirming, SETTLED_WITHIN, later};
pub use drive::{BroadcastWrite, Drive};
pub use error::{Error, ErrorKind, ExceptionMeaning, Exchange, NEGATIVE_REPLY, Result, SetpointProblem};
pub use faults::{Fault, FaultEntry, Faults};
pub use identity::Identity;
pub use intent::Intent;
pub use kept_readings::KeptReadings;
pub use lease::{Ground, Lack, Lease, Recognised, Verdict};
pub use motion::{INJECTION_AT_MOST, INJECTION_TIME, Motion, Output, Shaft};
pub use named::{NameError, is_name};
pub use own_run::{Evidence, OwnRun, RunWord, Told};
pub use panicked::panic_said;
pub use port::{Class, Effect, Port, PortError, Terms};
pub use quantity::Quantity;
pub use reconnecting::Reconnecting;
pub use refusal::{Refusal, SelfRestart};
pub use registers::{Row, Written};
pub use serial::SerialSettings;
pub use setpoint::{Command, Direction, Setpoint, StopMode};
pub use state::{Control, State};
pub use status::{Measurements, RawWord, Status};
pub use stopped::{Followed, Follower, Stopped};
pub use turns::{STATUSES_PER_TURN, Turns};
pub use units::{Current, Frequency, Percent, Power, Speed, UnitError, Voltage};
pub use watch::Watch;
pub use withdrawn::Withdrawn;
