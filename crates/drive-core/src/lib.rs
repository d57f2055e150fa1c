//! What a variable-speed drive on Modbus is.

pub mod port;
pub mod serial;

pub use port::{Class, Effect, Port, PortError, Terms};
