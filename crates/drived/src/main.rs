//! Variable-speed drives over Modbus from the command line: see [`cli`] for the subcommands.

#![forbid(unsafe_code)]

#[cfg(test)]
mod agreement;
mod cli;
mod commands;

use std::process::ExitCode;

use clap::Parser;
use drived_words::{logging, output};

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
