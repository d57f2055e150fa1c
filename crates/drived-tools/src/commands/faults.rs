//! `drived faults`: the faults of one drive, with what to do about them.

use drive_core::Faults;

use crate::one_drive::OneDriveArgs;
use drived_client as client;
use drived_words::failure::Failure;

/// Read the present faults of one drive, its alarms and its fault history
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    if !args.one.is_on_line() {
        let name = args.name.as_deref();
        let mut daemon = args.one.daemon.connect().await?;
        let path = args.one.path(&mut daemon, name, &["faults"]).await?;
        let faults: Faults = daemon.get(&path).await?.done()?;
        return args.one.daemon.say(&faults, || client::faults(name.unwrap_or_default(), &faults));
    }
    let mut one = args.one.open().await?;
    let faults = one.drive.faults().await.map_err(|error| one.failure(&error))?;
    args.one.daemon.say(&faults, || client::faults(&one.name.to_string(), &faults))?;
    one.close().await;
    Ok(())
}
