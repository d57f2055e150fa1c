//! `drived reset`: resets the present fault of one drive.

use crate::{failure::Failure, one_drive::OneDriveArgs, output};

/// Reset the present fault of one drive, once; the motor does not start by it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut one = args.one.command(Vec::new()).await?;
    let outcome = one.command(async |drive| drive.reset_faults().await).await?;
    if !outcome.is_confirmed() {
        return Err(one.failure(&outcome));
    }
    output::say(format_args!("{} has no fault: the drive shows {}", one.name, one.status()))?;
    one.close().await;
    Ok(())
}
