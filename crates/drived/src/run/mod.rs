//! `drived run`: the fleet as a daemon.

mod descriptors;
mod exit;
mod json;
mod notify;
mod report;

use std::{io::IsTerminal as _, path::PathBuf, time::Duration};

use drive_bus::Line;
use drive_fleet::{Fleet, FleetBuilder};

use self::{
    notify::Notify,
    report::{Form, Report},
};
use crate::{
    api,
    config::{Config, DrivePart, Http, LinePart},
    doors::Doors,
    failure::Failure,
    journal, one_drive, page,
    plant::Plant,
    signals::Ending,
};

/// How long the disk has for the last records of the audit log.
const AUDITED_WITHIN: Duration = Duration::from_secs(2);

/// Watch and command the drives of a configuration
///
/// Events and snapshots are JSON objects on stdout, one a line; the log is on stderr. On a terminal, where the log tells
/// the events, stdout has one line for each drive whose state has changed instead. Ctrl-C and SIGTERM end it: each drive's
/// policy acts, and what was done is told. A second Ctrl-C ends it at once. Exit code 1 when a motor may turn that no policy
/// leaves turning. A stdout that nobody reads any more ends nothing: the drives are watched on.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    /// Where the page and the API are served: an address and a port, or off; by default as the configuration says
    #[arg(long, value_name = "ADDRESS")]
    http: Option<Http>,
    /// Where the control socket is, for the commands without a line
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// Print JSON objects on a terminal too
    #[arg(long)]
    json: bool,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let config = Config::load_workable(&args.config)?;
    descriptors::check(config.lines.len())?;
    // What is wrong with the doors is told before a drive is spoken to.
    let doors = Doors::prepare(config.doors.clone().with(args.http, args.socket)?)?;
    let mut ending = Ending::listen()?;
    let notify = Notify::start();
    let lines = start_lines(&config)?;
    let fleet = build(&config, &lines).start().map_err(|error| Failure::Input(error.to_string()))?;
    // Whatever else shows the fleet to somebody takes a handle of it and a reader of its events, as this does.
    let form = if args.json || !std::io::stdout().is_terminal() { Form::Json } else { Form::Text };
    let mut report = Report::start(fleet.clone(), fleet.events(), config.snapshots, form);
    let journal = tokio::spawn(journal::keep(fleet.clone(), fleet.events(), journal::log));
    let plant = Plant::start(fleet.clone(), config.groups.clone(), false);
    let doors = doors.open(api::router(plant).merge(page::router()));
    let audited = doors.follow(fleet.events());
    let watching = notify.watch(fleet.clone(), doors.listening());
    let read = tokio::select! {
        () = ending.asked() => Ok(()),
        result = report.ended() => {
            // Without this program the drives' watchdogs would stop their motors.
            tracing::warn!("nobody reads stdout any more: the drives are watched on, Ctrl-C ends it");
            ending.asked().await;
            result
        }
    };
    drop(watching);
    let stopping = notify.stopping(fleet.clone());
    // No motor waits for a reader of the page.
    let closed = tokio::spawn(doors.close());
    let ended = exit::end(&fleet, config.shutdown, &mut ending).await;
    drop(stopping);
    // It ends with the fleet, and what it says last is not lost.
    let _ = journal.await;
    let _ = tokio::time::timeout(AUDITED_WITHIN, audited).await;
    if read.is_ok() {
        report.finish().await;
    }
    let _ = closed.await;
    for line in lines {
        one_drive::close(&line).await;
    }
    ended.and(read)
}

/// Starts every line. One whose port cannot be opened is tried again; its drives are lost meanwhile, and the others run.
fn start_lines(config: &Config) -> Result<Vec<Line>, Failure> {
    let start = |part: &LinePart| Line::start(part.config.clone());
    let lines = config.lines.iter().map(start).collect::<Result<_, _>>();
    lines.map_err(|error| Failure::Input(error.to_string()))
}

fn build(config: &Config, lines: &[Line]) -> FleetBuilder {
    let mut builder = Fleet::builder();
    for (part, line) in config.lines.iter().zip(lines) {
        builder = builder.line_with(&*part.name, line.clone(), |_| part.budget);
        for DrivePart { name, settings, options } in &part.drives {
            builder = builder.drive(&part.name, name.slave.number(), settings.clone(), |port, slave| {
                name.family.open_with(port, slave, &options.values)
            });
        }
    }
    builder
}
