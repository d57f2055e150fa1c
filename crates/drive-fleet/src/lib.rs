//! Many drives on many lines, supervised as a plant needs it.
//!
//! A [`Fleet`] is built from lines and from drives of any family, which it knows only as
//! [`dyn Drive`](drive_core::Drive). It asks each drive at its own periods, judges how old its values are, tells what
//! happens ([`Events`]), carries out commands to a known [`Outcome`], keeps the drives' communication watchdogs armed
//! and fed, and acts by each drive's policies when a drive is lost, trips, or the program ends.
//!
//! ```no_run
//! use drive_bus::{Line, LineConfig};
//! use drive_core::{Direction, Drive, Frequency, SerialSettings, StopMode};
//! use drive_fleet::{DriveSettings, Fleet};
//!
//! # fn atv312(port: drive_bus::Slave, slave: drive_core::SlaveAddress) -> Box<dyn Drive> { unimplemented!() }
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let line = Line::open(LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT)).await?;
//! let fleet = Fleet::builder()
//!     .line("north", line)
//!     .drive("north", 1, DriveSettings::controlled("pump 1"), |port, slave| atv312(port, slave))
//!     .start()?;
//!
//! let pump = fleet.drive("pump 1").ok_or("no such pump")?;
//! let outcome = pump.run(Direction::Forward, Frequency::from_hertz(40)).await;
//! println!("{outcome}");
//! println!("{}", fleet.stop_all(StopMode::Ramp).await);
//! # Ok(())
//! # }
//! ```
//!
//! # Rules
//! What moves a motor goes by rules, each enforced here or below and each with a test of its name: a stop outranks
//! everything and is repeated until it is confirmed; a command expires; an ambiguous write is read back; motion needs a
//! fresh status, a checked identity, no fault and control here; nothing restarts by itself; edges are written once; the
//! running state is adopted and nothing is written before; each drive's policy acts at the exit; a watchdog is armed,
//! verified and fed, or the configuration is refused; EEPROM is written only when asked; a drive that is not under
//! control is only read.
//!
//! With the feature `serde` a [`Snapshot`], an [`Event`], an [`Outcome`] and the settings are written as JSON, ready for
//! a service of your own, and read from it: the settings as they are, the others as their `view`. The feature `schemars`
//! adds the JSON schemas.
//!
//! # Inside
//! One task for each drive owns the conversation with it. What it does next is decided by a supervisor that is a pure
//! machine: no clock, no port.

#![forbid(unsafe_code)]

pub mod alarms;
mod builder;
mod cause;
mod concern;
mod driver;
mod eeprom;
mod event;
mod exceeded;
mod fleet;
mod group;
mod group_ticket;
mod handle;
mod limits;
mod line_entry;
mod members;
mod membership;
mod message;
mod outcome;
mod place;
mod plan;
mod progress;
mod round;
mod row;
mod runs;
mod settings;
mod shown_identity;
mod shows;
mod snapshot;
mod stop_order;
mod supervisor;
mod task;
#[cfg(test)]
mod testing;
mod ticket;
mod troubles;
#[cfg(feature = "serde")]
pub mod view;
mod watchdog;

/// See `drive_bus::mutants`.
#[doc(hidden)]
pub use drive_bus::mutant;

pub use builder::{FleetBuilder, FleetError, SettingProblem, check_settings};
pub use cause::{Act, Cause, ChangedWord, Policy};
pub use concern::{Concern, ConcernKind, Severity};
pub use eeprom::{EEPROM_WRITES_A_DAY, EepromLedger, EepromUse, InVain};
pub use event::{Event, EventKind, ExitAction};
pub use exceeded::Limit;
pub use fleet::{Events, Fleet, Received};
pub use group::{Group, GroupFailure, GroupStart, GroupStarted, NoSuchDrive};
pub use group_ticket::{GroupStop, GroupTicket, StopReport};
pub use handle::DriveHandle;
pub use limits::{Band, FrequencyLimits, LimitProblem};
pub use outcome::{
    Became, LastSeen, Order, Outcome, Refused, Started, StopModes, Unconfirmed, Unknown, Until,
};
pub use place::Place;
pub use plan::{Demand, Feed, Forecast, LineBudget, LinePlan, PlanProblem, forecast, plan};
pub use runs::RunKept;
pub use settings::{
    Alarms, Commanders, DriveSettings, Left, OnControlTaken, OnExit, OnExitAdopted, OnExitWatchdog, OnFault,
    OnLoss, Periods, RunRecord, Times,
};
pub use shown_identity::ShownIdentity;
pub use shows::Shows;
pub use snapshot::{
    Counters, Freshness, IdentityCheck, Link, OffSetpoint, PendingStop, Snapshot, Timed, Trip, WatchdogCheck,
    has_reached,
};
pub use stop_order::StopOrder;
pub use supervisor::checks::FEED_PART;
pub use ticket::{StopTicket, Ticket};
pub use watchdog::{WatchdogBefore, WatchdogContract};
