//! Simulated variable-speed drives on a simulated line.

mod bank;
mod model;
pub mod models;
mod motor;
mod watchdog;

pub use bank::{Bank, Refusal};
pub use model::{Block, Cast, Exception, Model, Observation, Panel, Rules};
pub use motor::{Motor, Nameplate, Ramp, Ramps};
pub use watchdog::Watchdog;
