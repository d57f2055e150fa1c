//! `drived reset`: resets the present fault of one drive.

use drive_fleet::Order;

use crate::{failure::Failure, one_drive::OneDriveArgs};

/// Reset the present fault of one drive, once; the motor does not start by it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    args.one.order(Order::ResetFaults, "has no fault").await
}
