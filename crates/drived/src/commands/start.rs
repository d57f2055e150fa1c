//! `drived start`: starts the motor of one drive.

use drive_core::Direction;

use crate::{failure::Failure, one_drive::OneDriveArgs, output};

/// Start the motor of one drive at the setpoint that the drive holds
///
/// Refused when the drive has tripped, is not ready, is commanded by somebody else, or starts again by itself. A start that
/// is not confirmed is taken back by a stop. The motor goes on when this program has ended, unless the drive's own
/// communication watchdog stops it: keep the line alive with `drived poll`. Ctrl-C before the start is confirmed stops the
/// motor again.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// Which way: forward or reverse
    #[arg(long, default_value_t = Direction::Forward)]
    direction: Direction,
    /// A setting of the drive by which it may start again by itself, such as Atr; may be given several times
    #[arg(long, value_name = "MNEMONIC")]
    accept_self_restart: Vec<String>,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut one = args.one.command(args.accept_self_restart).await?;
    let direction = args.direction;
    let status = one.start(async |drive| drive.start(direction).await).await?;
    output::say(format_args!("{} started {direction}: the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}
