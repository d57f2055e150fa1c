//! `drived stop`: stops the motor of one drive.

use drive_core::StopMode;

use crate::{failure::Failure, one_drive::OneDriveArgs, output};

/// Stop the motor of one drive, again and again until the drive confirms it
///
/// A mode that the drive as it is set up does not have is replaced by one that stops; what was done is told. Exit code 1
/// when the stop is not confirmed after 5 s, or the motor does not stand after a minute.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// How: along the deceleration ramp (ramp), along the drive's short ramp (fast), by cutting the output (freewheel), or by
    /// injecting direct current (dc-injection)
    #[arg(long, default_value_t = StopMode::Ramp)]
    mode: StopMode,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut one = args.one.stop()?;
    let status = one.stop(args.mode).await?;
    output::say(format_args!("{} stands still: the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}
