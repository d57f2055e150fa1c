//! `drived stop`: stops the motor of one drive.

use drive_core::StopMode;
use serde_json::json;

use crate::{
    client::{self, Target, Told},
    commanded::UNCONFIRMED,
    failure::Failure,
    one_drive::{OneDriveArgs, unnamed},
    plant::commands::ActionWord,
};

/// Stop the motor of a drive, of a group or of all, again and again until each drive confirms it
///
/// A mode that the drive as it is set up does not have is replaced by one that stops; what was done is told. Exit code 1
/// when the stop is not confirmed after 5 s, or the motor does not stand after a minute.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A drive or a group of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    /// Every drive of the running daemon
    #[arg(long, conflicts_with_all = ["line", "name"])]
    all: bool,
    #[command(flatten)]
    one: OneDriveArgs,
    /// How: along the deceleration ramp (ramp), along the drive's short ramp (fast), by cutting the output (freewheel), or by
    /// injecting direct current (dc-injection)
    #[arg(long, default_value_t = StopMode::Ramp)]
    mode: StopMode,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    if !args.one.is_on_line() {
        return through_daemon(&args).await;
    }
    let mut one = args.one.stop()?;
    match one.stop(args.mode).await {
        Ok(status) => args.one.say_done(&one, "stop", &status, "stands still")?,
        Err(failure) => {
            return Err(match args.one.whose().await {
                Some(whose) => Failure::Drive(format!("{failure}; {whose}")),
                None => failure,
            });
        }
    }
    one.close().await;
    Ok(())
}

/// A stop that the daemon did not get may leave a motor turning, whatever the reason is.
async fn through_daemon(args: &Args) -> Result<(), Failure> {
    let unsent = |failure: Failure| Failure::Drive(format!("{UNCONFIRMED}. {failure}"));
    let told = Told {
        action: ActionWord::Stop,
        body: json!({ "mode": args.mode }),
        done: "stands still".to_owned(),
    };
    let mut daemon = args.one.daemon.connect().await.map_err(unsent)?;
    let target = match (args.all, &args.name) {
        (true, _) => Target::All,
        (false, Some(name)) => Target::find(&daemon.state().await.map_err(unsent)?, name)?,
        (false, None) => return Err(unnamed()),
    };
    client::order(&args.one.daemon, daemon, &target, &told).await.map_err(unsent)
}
