//! `drived release`: gives control of one drive back.

use drive_fleet::Order;

use crate::{failure::Failure, one_drive::OneDriveArgs};

/// Give control of one drive back to its panel or its terminals, such as after a stop that took it; the motor must stand
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let name = args.one.name()?;
    let capabilities = name.family.capabilities();
    if !capabilities.release {
        return Err(Failure::Input(format!(
            "{name}: the bus of a {} cannot give control back: take it at the drive",
            capabilities.name
        )));
    }
    args.one.order(Order::Release, "has given control back").await
}
