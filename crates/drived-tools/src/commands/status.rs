//! `drived status`: what one drive says of itself.

use drive_core::{Measurements, Status};
use serde::Serialize;

use crate::one_drive::OneDriveArgs;
use drived_client::{self as client, Target};
use drived_words::{
    failure::Failure,
    json,
    output::{self, Table},
    values,
};

/// Show the drives of the running daemon, a group or one of them, or read one drive on a line; nothing is written
///
/// A value that is old is in brackets, with its age. Exit code 1 when a drive that was asked for does not answer.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive or a group of the running daemon; without it, all
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
    /// Also read the slow values: voltages, torque, thermal states, hours, inputs and outputs
    #[arg(long)]
    all: bool,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    if !args.one.is_on_line() {
        return through_daemon(&args).await;
    }
    let mut one = args.one.open().await?;
    let status = one.drive.status().await.map_err(|error| one.failure(&error))?;
    let restarts = one.drive.self_restarts().await;
    let measurements = match args.all {
        true => Some(one.drive.measurements().await.map_err(|error| one.failure(&error))?),
        false => None,
    };
    if args.one.daemon.is_json() {
        let read = Read {
            name: one.name.to_string(),
            family: one.drive.capabilities().key,
            status: &status,
            measurements: measurements.as_ref(),
            starts_by_itself: restarts.ok().map(|all| all.iter().map(|one| one.code).collect()),
        };
        output::say_as_it_is(json::line(&read))?;
        one.close().await;
        return Ok(());
    }
    output::say(format_args!("{} {}", one.name, one.drive.capabilities().name))?;
    let mut table = Table::texts();
    let restarts = match restarts {
        Ok(restarts) => restarts.iter().map(ToString::to_string).collect(),
        Err(error) => vec![format!("not known: {error}")],
    };
    let restarts = restarts.into_iter().map(|restart| ("starts by itself", restart));
    let lines = [("state", values::state(&status))].into_iter().chain(values::status(&status));
    for (label, value) in lines.chain(restarts).chain(measurements.iter().flat_map(values::measurements)) {
        table.row([format!("  {label}"), value]);
    }
    output::say_table(table)?;
    one.close().await;
    Ok(())
}

/// What one drive on a line has said of itself, as the API says it of those of the daemon.
#[derive(Serialize)]
struct Read<'a> {
    name: String,
    family: &'static str,
    status: &'a Status,
    #[serde(skip_serializing_if = "Option::is_none")]
    measurements: Option<&'a Measurements>,
    /// Absent where the drive did not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    starts_by_itself: Option<Vec<&'static str>>,
}

async fn through_daemon(args: &Args) -> Result<(), Failure> {
    let mut daemon = args.one.daemon.connect().await?;
    let state = daemon.state().await?;
    let target = args.name.as_deref().map_or(Ok(Target::All), |name| Target::find(&state, name))?;
    let one =
        state.drives.iter().find(|drive| matches!(&target, Target::Drive(name) if drive.name() == name));
    match one {
        Some(drive) => args.one.daemon.say(drive, || client::whole(drive, args.all)),
        None => args.one.daemon.say(&state, || client::overview(&state, &target)),
    }
}
