//! Variable-speed drives over Modbus from the command line: see [`cli`] for the subcommands.

#![forbid(unsafe_code)]

#[cfg(test)]
mod agreement;
mod api;
#[allow(dead_code, reason = "a Sparkplug node stands on the rest of it")]
mod broker;
mod cli;
mod client;
mod commanded;
mod commands;
mod config_file;
mod desk;
mod explain;
mod gateway;
mod ledger;
mod metrics;
mod mqtt;
mod one_drive;
mod own_line;
mod page;
mod run;
mod sparkplug;

use std::process::ExitCode;

use clap::Parser;
use drived_config::{config, kept, records, rights};
use drived_doors as doors;
use drived_plant::{counts, findings, follow, journal, plant};
use drived_screen::{row, screen};
use drived_simulated as simulated;
use drived_words::{
    drive_options, drive_spec, duration, failure, json, line_spec, logging, output, registers, signals,
    values,
};

fn main() -> ExitCode {
    output::choose_form(std::env::args_os());
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
