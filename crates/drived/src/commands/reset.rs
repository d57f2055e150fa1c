//! `drived reset`: resets the present fault of one drive.

use std::time::Duration;

use drive_core::{Drive, ErrorKind, Result, Status};
use tokio::time::{self, Instant};

use crate::{
    failure::Failure,
    one_drive::{OneDriveArgs, told},
    output,
};

/// How long a drive that restarts by its reset may be mute.
const RESTART: Duration = Duration::from_secs(10);

/// Between two attempts to read the status of a drive that restarts.
const RETRY: Duration = Duration::from_millis(200);

/// Reset the present fault of one drive, once; the motor does not start by it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut one = args.one.open().await?;
    let status = told(one.name, reset(&mut *one.drive)).await?.map_err(|error| one.failure(&error))?;
    output::say(format_args!("{} has no fault any more: the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}

/// Resets once. Some drives restart by it and are mute for a while: then the outcome is read when they answer again.
pub(crate) async fn reset(drive: &mut dyn Drive) -> Result<Status> {
    let error = match drive.reset_faults().await {
        Err(error) if error.kind() == ErrorKind::OutcomeUnknown => error,
        outcome => return outcome,
    };
    let until = Instant::now() + RESTART;
    while Instant::now() < until {
        time::sleep(RETRY).await;
        match drive.status().await {
            Ok(status) if !status.is_fault() => return Ok(status),
            _ => {}
        }
    }
    Err(error)
}
