//! Variable-speed drives over Modbus from the command line, as a program that can be made again with more in it.
//!
//! What drives a program knows is decided where it begins: one with a family from outside adds it and goes on as this one does.
//!
//! ```no_run
//! use std::process::ExitCode;
//!
//! # use drive_core::Capabilities;
//! # use drive_families::{Definition, Family};
//! # static CAPABILITIES: Capabilities = Capabilities::least("fan1", "Somebody's fan drive");
//! # static FAN1: Definition = Definition::new(&CAPABILITIES, &|_, _, _| unimplemented!());
//! fn main() -> ExitCode {
//!     Family::new(&FAN1).add().expect("no other family has its name");
//!     drived::program()
//! }
//! ```
//!
//! The subcommands are in `cli`; the crates below are made for this program, and keep no promise of their own.

#![forbid(unsafe_code)]

#[cfg(test)]
mod agreement;
mod cli;
mod commands;
mod faces;
mod refused;

use std::process::ExitCode;

use clap::Parser;
use drived_config::profiles;
use drived_words::{failure::Failure, logging, output};

/// The program: reads the command line of this process, does what it says, and gives the exit code.
pub fn program() -> ExitCode {
    output::choose_form(std::env::args_os());
    if let Err(taken) = faces::add() {
        return cli::end(Err(Failure::Input(taken.to_string())));
    }
    if let Err(taken) = profiles::ship() {
        return cli::end(Err(Failure::Input(taken.to_string())));
    }
    // What is wrong with a file there keeps nobody from stopping another drive.
    let left_out = profiles::of_environment().unwrap_or_else(|wrong| vec![wrong]);
    for wrong in left_out {
        output::complain(format_args!("{}: left out: {wrong}", profiles::ENVIRONMENT));
    }
    let cli = match cli::Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return cli::refuse(&error),
    };
    let log = match logging::start(cli.command.log_level()) {
        Ok(log) => log,
        Err(failure) => return cli::end(Err(failure)),
    };
    let result = cli::run(cli.command);
    if let Some(log) = log {
        log.finish();
    }
    cli::end(result)
}
