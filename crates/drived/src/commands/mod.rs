//! The subcommands, one module each.

pub(crate) mod audit;
pub(crate) mod capture;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod demo;
pub(crate) mod doctor;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod families;
pub(crate) mod faults;
mod frames;
pub(crate) mod init;
pub(crate) mod monitor;
pub(crate) mod param;
pub(crate) mod plan;
pub(crate) mod poll;
pub(crate) mod release;
pub(crate) mod reload;
pub(crate) mod reset;
pub(crate) mod scan;
pub(crate) mod setpoint;
pub(crate) mod sim;
pub(crate) mod start;
pub(crate) mod status;
pub(crate) mod stop;
pub(crate) mod token;
pub(crate) mod watch;
