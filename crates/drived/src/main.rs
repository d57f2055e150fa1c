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
mod config;
mod config_file;
mod desk;
mod doors;
mod drive_options;
mod drive_spec;
mod duration;
mod explain;
mod failure;
mod findings;
mod gateway;
mod journal;
mod json;
mod kept;
mod ledger;
mod line_spec;
mod logging;
mod metrics;
mod mqtt;
mod one_drive;
mod output;
mod own_line;
mod page;
mod plant;
mod records;
mod registers;
mod rights;
mod row;
mod run;
mod screen;
mod signals;
mod simulated;
mod sparkplug;
mod values;

use std::process::ExitCode;

use clap::Parser;

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
