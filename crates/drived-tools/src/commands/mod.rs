//! The subcommands, one module each.

pub mod accept;
pub mod alarms;
pub mod faults;
pub mod monitor;
pub mod param;
pub mod release;
pub mod reload;
pub mod report;
pub mod reset;
pub mod setpoint;
pub mod start;
pub mod status;
pub mod stop;
pub mod watch;
