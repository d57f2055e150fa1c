//! `drived watch`: what happens at the drives of the running daemon, as it happens.

use drived_client::{self as client, DaemonArgs};
use drived_words::failure::Failure;

/// Print what happens at the drives of the running daemon, until Ctrl-C
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let mut daemon = args.daemon.connect().await?;
    client::watch(&args.daemon, &mut daemon).await
}
