//! Variable-speed drives over Modbus from the command line: see [`cli`] for the subcommands.

#![forbid(unsafe_code)]

#[cfg(test)]
mod agreement;
mod cli;
mod commanded;
mod commands;
mod config_file;
mod explain;
mod ledger;
mod one_drive;
mod run;

use std::process::ExitCode;

use clap::Parser;
use drived_broker::{broker, mqtt, sparkplug};
use drived_client::{self as client, own_line};
use drived_config::{config, kept, records};
use drived_doors as doors;
use drived_gateway as gateway;
use drived_http::{api, metrics, page};
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
