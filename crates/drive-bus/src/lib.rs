//! One RS-485 line, shared by many drives.
//!
//! A [`Line`] owns the port. Each [`Slave`] of it is a tokio-modbus `Client`, turns into a tokio-modbus `Context`, and is
//! the [`Port`](drive_core::Port) that a drive of any family runs on:
//!
//! ```
//! use drive_bus::{Line, LineConfig};
//! use drive_core::serial::SerialSettings;
//! use tokio_modbus::{client::{Context, Reader}, prelude::Writer};
//!
//! # async fn on_a_real_port() -> Result<(), Box<dyn std::error::Error>> {
//! let line = Line::open(LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT)).await?;
//!
//! let mut third: Context = line.slave(3).into();
//! let state_word = third.read_holding_registers(3201, 1).await??;
//! println!("ETA {:04X}h", state_word[0]);
//!
//! let mut all: Context = line.broadcast().into();
//! all.write_single_register(8501, 0).await??; // returns after the pause, nobody answers
//! line.close().await;
//! # Ok(())
//! # }
//! ```
//!
//! In a test, or with any other stream:
//!
//! ```
//! use drive_bus::{Line, LineConfig};
//! use drive_core::{Class, Port, Terms, serial::SerialSettings};
//! use std::time::Duration;
//!
//! # #[tokio::main(flavor = "current_thread", start_paused = true)]
//! # async fn main() {
//! let (ours, theirs) = tokio::io::duplex(512);
//! let line = Line::over(ours, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
//! let mut slave = line.slave(1);
//! slave.set_terms(Terms::of(Class::Command).within(Duration::from_secs(1)));
//! # drop(theirs);
//! # }
//! ```
//!
//! What the line sees to:
//! - **silences**: 3.5 characters of the real character length before each request, each slave's own pause
//!   ([`SlaveSettings::turnaround`]), [`LineConfig::slave_change_gap`], the pause after a broadcast;
//! - **the right answer**: every answer is checked against its request; late, foreign, damaged and echoed frames are
//!   recognised and counted, never returned;
//! - **order**: the classes of [`drive_core::Class`]; inside one, every slave in turn and the earliest deadline first;
//! - **slaves that do not answer**: timeouts learned per slave, fast failure while off-line, probes;
//! - **the port**: opened again when it was lost.
//!
//! # Errors
//! A slave's refusal is the inner error of a tokio-modbus call. Everything else comes as
//! [`PortError`](drive_core::PortError) inside `tokio_modbus::Error::Transport`;
//! [`PortError::from_modbus`](drive_core::PortError::from_modbus) takes it out.
//!
//! A slave is what the Modbus Organization calls a server, and Modbus TCP a unit.
//!
//! # Inside
//! What decides is pure: no clock, no port. One task per line reads, writes and waits. The modules that are hidden here
//! are public for the tests and measurements of this workspace; they change with any version.

/// The examples of the README, which compile.
#[cfg(all(doctest, feature = "serial"))]
#[doc = include_str!("../README.md")]
struct Readme;

#[doc(hidden)]
pub mod answer;
pub mod capture;
pub mod config;
pub mod content;
pub mod evidence;
#[doc(hidden)]
pub mod exchange;
mod gateway;
mod latest;
mod line;
pub mod listen;
#[doc(hidden)]
pub mod master;
#[doc(hidden)]
pub mod mutants;
#[doc(hidden)]
pub mod pdu;
pub mod protocol;
pub mod record;
#[doc(hidden)]
pub mod schedule;
#[doc(hidden)]
pub mod shape;
mod shared;
mod slave;
pub mod stats;
mod task;
#[doc(hidden)]
pub mod timeout;
mod transport;
#[cfg(feature = "unitelway")]
pub mod unite;

#[cfg(feature = "serial")]
pub use config::Rs485;
pub use config::{Echo, Endpoint, LineConfig, SlaveSettings};
pub use gateway::{Gateway, GatewayError};
pub use latest::{Ended, Latest};
pub use line::Line;
pub use protocol::Protocol;
pub use slave::Slave;
pub use stats::Stats;
pub use transport::OpenError;
#[cfg(feature = "serial")]
pub use transport::adapter_latency;
