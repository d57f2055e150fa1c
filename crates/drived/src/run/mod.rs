//! `drived run` and `drived check`: the fleet as a daemon.

mod config;
mod json;
mod output;

use std::path::PathBuf;

use drive_bus::Line;
use drive_fleet::{Fleet, FleetBuilder, Periods};

use self::{
    config::{Config, LinePart},
    output::JsonLines,
};
use crate::{failure::Failure, one_drive::open_line, output as console, signals::Ending};

/// Watch and command the drives of a configuration
///
/// Events and snapshots are JSON objects on stdout, one a line; the log is on stderr. Ctrl-C and SIGTERM end it: each
/// drive's policy acts, and what was done is told. A second Ctrl-C ends it at once.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

/// Validate a configuration without opening a port, and show what its lines will be like
#[derive(Debug, clap::Args)]
pub(crate) struct CheckArgs {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

pub(crate) fn check(args: &CheckArgs) -> Result<(), Failure> {
    let config = load(&args.config)?;
    for LinePart { name, plan, drives, .. } in &config.lines {
        let controlled = drives.iter().filter(|(_, settings)| settings.control).count();
        console::say(format_args!(
            "line {name}: {} drives, {controlled} under control, a sweep takes {}, the polls take {} of the line",
            drives.len(),
            console::milliseconds(plan.sweep),
            console::percent(plan.utilisation_ppm),
        ))?;
        let slowest =
            drives.iter().map(|(_, settings)| settings.periods).max_by_key(|periods| periods.running);
        if let Some(Periods { running, rest, slow, max_age }) = slowest {
            console::say(format_args!(
                "line {name}: status every {running:?} running, {rest:?} at rest, measurements every {slow:?}, a status \
                 is fresh for {max_age:?}"
            ))?;
        }
        if let Some(gap) = plan.feed_gap {
            console::say(format_args!(
                "line {name}: a watched drive hears something at the latest after {}",
                console::milliseconds(gap)
            ))?;
        }
    }
    Ok(())
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let config = load(&args.config)?;
    let mut ending = Ending::listen()?;
    let lines = open_lines(&config).await?;
    let fleet = build(&config, &lines).start().map_err(|error| Failure::Input(error.to_string()))?;
    // Whatever else shows the fleet to somebody takes a handle of it and a reader of its events, as this does.
    let mut json = JsonLines::start(fleet.clone(), fleet.events(), config.snapshots);
    let result = tokio::select! {
        () = ending.asked() => Ok(()),
        result = json.ended() => result,
    };
    tokio::select! {
        // Each drive's event tells what was done.
        _ = fleet.shutdown(config.shutdown) => {}
        () = ending.asked() => tracing::warn!("asked to end a second time: drives are left as they are"),
    }
    if result.is_ok() {
        json.finish().await;
    }
    for line in lines {
        line.close().await;
    }
    result
}

fn load(file: &std::path::Path) -> Result<Config, Failure> {
    Config::load(file).map_err(|error| Failure::Input(error.to_string()))
}

async fn open_lines(config: &Config) -> Result<Vec<Line>, Failure> {
    let mut lines = Vec::with_capacity(config.lines.len());
    for part in &config.lines {
        lines.push(open_line(part.config.clone()).await?);
    }
    Ok(lines)
}

fn build(config: &Config, lines: &[Line]) -> FleetBuilder {
    config.lines.iter().zip(lines).fold(Fleet::builder(), |builder, (part, line)| {
        let builder = builder.line(part.name.as_str(), line.clone(), part.budget);
        part.drives.iter().fold(builder, |builder, (drive, settings)| {
            let port = line.slave(drive.slave.number());
            builder.drive(part.name.as_str(), settings.clone(), drive.family.open(port, drive.slave))
        })
    })
}
