//! The command line: the subcommands, how bad input is answered, and the exit codes.

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand, error::ErrorKind};
use tracing::Level;

#[cfg(feature = "history")]
use crate::commands::{history, why};
use crate::{
    commands::{audit, check, completions, export, names, token},
    refused::one_line,
};
use drived_daemon::demo;
use drived_daemon::run;
use drived_line_tools::{capture, doctor, explain, families, init, plan, poll, replay, scan, sim};
use drived_tools::commands::{
    accept, alarms, faults, monitor, param, release, reload, report, reset, setpoint, start, status, stop,
    watch,
};
use drived_words::{failure::Failure, output};

/// A map of the subcommands, and what holds for all of them.
const NOTES: &str = "\
To try it:          demo; or sim in one terminal and poll, status, start in another
Before wiring:      families, plan
A drive from a file: profile list, show, check, new, try
A drive, read:      status, faults, param get, param dump
A drive, write:     setpoint, start, stop, reset, release, param set, param save
The running daemon: all these without --line and with the names of its drives; accept, alarms, watch,
                    monitor, reload
One line, read:     scan, poll, doctor, monitor; init writes a configuration from a scan
What went over it:  capture, explain; replay plays it back
What happened:      history, and why at a moment
The service file:   report, of the running daemon or of one line
The plant's drives: check, plan, run, names, token, audit, each with --config FILE; export for its alerts and board
Your shell:         completions, for subcommands, options, and the names of drives and parameters

A line is PATH[,BAUD[,FORMAT[,PROTOCOL]]], such as /dev/ttyUSB0,19200,8E1, or rtu+tcp://HOST:PORT[,BAUD[,FORMAT]], or \
tcp://HOST:PORT. Speed and format are the drives' factory setting when they are not given; PROTOCOL is rtu, ascii or \
unitelway. A drive is FAMILY@ADDRESS, drives are FAMILY@ADDRESSES, such as atv312@1-10,12.

Exit codes: 0 done and confirmed, 1 a drive did not answer or did not do it, 2 bad input or a plan that cannot work.

Environment: DRIVED_LOG says how much is logged, such as debug or drive_bus=trace,warn; DRIVED_PROFILES names a folder \
of profiles; NO_COLOR=1 switches colours off.";

/// Variable-speed drives over Modbus: watch, start and stop them, or try it all on simulated ones
#[derive(Debug, Parser)]
#[command(name = "drived", version, max_term_width = 100, after_help = NOTES)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(demo::Args),
    Run(run::Args),
    Check(check::Args),
    Sim(sim::Args),
    Plan(plan::Args),
    Scan(scan::Args),
    Init(init::Args),
    Doctor(doctor::Args),
    Poll(poll::Args),
    Capture(capture::Args),
    Explain(explain::Args),
    Replay(replay::Args),
    Status(status::Args),
    Start(start::Args),
    Stop(stop::Args),
    Setpoint(setpoint::Args),
    Faults(faults::Args),
    Reset(reset::Args),
    Accept(accept::Args),
    Release(release::Args),
    #[command(subcommand)]
    Param(param::Command),
    Families(families::Args),
    #[command(subcommand)]
    Profile(drived_profile::Command),
    Report(report::Args),
    Export(export::Args),
    Completions(completions::Args),
    Watch(watch::Args),
    #[command(subcommand)]
    Alarms(alarms::Command),
    Monitor(monitor::Args),
    Reload(reload::Args),
    #[command(subcommand)]
    Names(names::Command),
    #[command(subcommand)]
    Token(token::Command),
    #[command(subcommand)]
    Audit(audit::Command),
    #[cfg(feature = "history")]
    History(history::Args),
    #[cfg(feature = "history")]
    Why(why::Args),
    /// Not in this build
    #[cfg(not(feature = "history"))]
    #[command(hide = true, disable_help_flag = true)]
    History(NotBuiltIn),
    /// Not in this build
    #[cfg(not(feature = "history"))]
    #[command(hide = true, disable_help_flag = true)]
    Why(NotBuiltIn),
}

/// Whatever is asked of a subcommand that this program was built without.
#[cfg(not(feature = "history"))]
#[derive(Debug, clap::Args)]
pub(crate) struct NotBuiltIn {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _asked: Vec<std::ffi::OsString>,
}

impl Command {
    /// What is logged unless the environment says otherwise. Those who talk to one drive say everything by their
    /// result; the demo's table must not be written over.
    pub(crate) fn log_level(&self) -> Option<Level> {
        match self {
            Self::Demo(args) => args.log_level(),
            Self::Run(_) => Some(Level::INFO),
            Self::Sim(_) | Self::Poll(_) | Self::Replay(_) => Some(Level::WARN),
            _ => Some(Level::ERROR),
        }
    }

    async fn run(self) -> Result<(), Failure> {
        match self {
            Self::Demo(args) => demo::run(args).await,
            Self::Run(args) => run::run(args).await,
            Self::Check(args) => check::run(&args),
            Self::Sim(args) => sim::run(args).await,
            Self::Plan(args) => plan::run(&args),
            Self::Scan(args) => scan::run(args).await,
            Self::Init(args) => init::run(args).await,
            Self::Doctor(args) => doctor::run(args).await,
            Self::Poll(args) => poll::run(args).await,
            Self::Capture(args) => capture::run(args).await,
            Self::Explain(args) => explain::run(args).await,
            Self::Replay(args) => replay::run(args).await,
            Self::Status(args) => status::run(args).await,
            Self::Start(args) => start::run(args).await,
            Self::Stop(args) => stop::run(args).await,
            Self::Setpoint(args) => setpoint::run(args).await,
            Self::Faults(args) => faults::run(args).await,
            Self::Reset(args) => reset::run(args).await,
            Self::Accept(args) => accept::run(args).await,
            Self::Release(args) => release::run(args).await,
            Self::Param(command) => param::run(command).await,
            Self::Families(args) => families::run(&args),
            Self::Profile(command) => drived_profile::run(command).await,
            Self::Report(args) => report::run(args).await,
            Self::Export(args) => export::run(&args, Cli::command()),
            Self::Completions(args) => completions::run(args, Cli::command()).await,
            Self::Alarms(command) => alarms::run(command).await,
            Self::Watch(args) => watch::run(args).await,
            Self::Monitor(args) => monitor::run(args).await,
            Self::Reload(args) => reload::run(args).await,
            Self::Names(command) => names::run(command),
            Self::Token(command) => token::run(command).await,
            Self::Audit(command) => audit::run(command),
            #[cfg(feature = "history")]
            Self::History(args) => history::run(&args).await,
            #[cfg(feature = "history")]
            Self::Why(args) => why::run(&args).await,
            #[cfg(not(feature = "history"))]
            Self::History(_) | Self::Why(_) => Err(Failure::Input(drived_file::without("history"))),
        }
    }
}

/// Carries out a subcommand.
pub(crate) fn run(command: Command) -> Result<(), Failure> {
    let runtime = tokio::runtime::Runtime::new().map_err(|error| {
        Failure::Input(format!("the system gives no threads, timers or file descriptors: {error}"))
    })?;
    runtime.block_on(command.run())
}

/// Says why a subcommand failed, on one line or as an object, and gives the exit code.
pub(crate) fn end(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure != Failure::OutputClosed {
                output::end(&failure);
            }
            failure.exit_code()
        }
    }
}

/// Help and version go to stdout; what clap refuses becomes one line.
pub(crate) fn refuse(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // A closed output is no reason to complain about help.
            let _ = error.print();
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
        _ => {
            let arguments: Vec<String> =
                std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
            end(Err(Failure::Input(one_line(error, &arguments, &Cli::command()))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::export::ENVIRONMENT;
    use drived_words::failure::EXIT_CODES;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    /// The subcommands below one, with the words that call them; those without subcommands of their own.
    fn last_ones(command: &clap::Command, words: &str, all: &mut Vec<(String, clap::Command)>) {
        match command.get_subcommands().next() {
            None => all.push((words.to_owned(), command.clone())),
            Some(_) => command
                .get_subcommands()
                .filter(|one| one.get_name() != "help")
                .for_each(|one| last_ones(one, format!("{words} {}", one.get_name()).trim(), all)),
        }
    }

    fn all() -> Vec<(String, clap::Command)> {
        let mut root = Cli::command();
        root.build();
        let mut all = Vec::new();
        last_ones(&root, "", &mut all);
        all
    }

    #[test]
    fn every_subcommand_answers_programs_or_has_a_reason_not_to() {
        let without = [
            ("demo", "it is a picture for people"),
            ("sim", "it is spoken to on its standard input, a line each"),
            ("replay", "it serves a pty until it is ended"),
            ("export", "it prints or writes files, each in the form that its reader asks for"),
            ("completions", "a shell reads it"),
            ("profile new", "it writes a file for a person to fill in"),
            ("profile try", "it is a talk with the person at the drive"),
        ];
        for (words, command) in all() {
            let has = command.get_arguments().any(|argument| argument.get_long() == Some("json"));
            let reason = without.iter().find(|(name, _)| *name == words);
            assert_ne!(has, reason.is_some(), "{words}: --json, or a reason here why not");
        }
    }

    #[test]
    fn the_help_tells_the_exit_codes_that_the_man_pages_tell() {
        for (code, meaning) in EXIT_CODES {
            assert!(NOTES.contains(&format!("{code} {meaning}")), "{code}");
        }
        assert!(ENVIRONMENT.iter().take(3).all(|(name, _)| NOTES.contains(name)));
    }
}
