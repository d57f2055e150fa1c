//! The subcommands, one module each.

pub mod capture;
pub mod doctor;
pub mod explain;
pub mod families;
pub mod faults;
mod frames;
pub mod init;
pub mod monitor;
pub mod param;
pub mod plan;
pub mod poll;
pub mod release;
pub mod reload;
pub mod replay;
pub mod report;
pub mod reset;
pub mod scan;
pub mod setpoint;
pub mod sim;
pub mod start;
pub mod status;
pub mod stop;
pub mod watch;
