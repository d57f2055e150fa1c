//! `drived watch`: what happens at the drives of the running daemon, as it happens.

use crate::{
    client::{self, DaemonArgs},
    failure::Failure,
};

/// Print what happens at the drives of the running daemon, until Ctrl-C
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut daemon = args.daemon.connect().await?;
    client::watch(&args.daemon, &mut daemon).await
}
