//! `drived stop`: stops the motor of one drive.

use std::time::Duration;

use clap::builder::ArgPredicate;
use drive_core::{INJECTION_AT_MOST, StopMode};
use drive_fleet::StopOrder;
use serde_json::json;

use crate::{
    commanded::UNCONFIRMED,
    one_drive::{OneDriveArgs, unnamed},
};
use drived_client::{self as client, Target, Told};
use drived_plant::plant::commands::ActionWord;
use drived_words::{failure::Failure, json::milliseconds};

/// Stop the motor of a drive, of a group or of all, again and again until each drive confirms it
///
/// A mode that the drive as it is set up does not have is replaced by one that stops; what was done is told. Exit code 1
/// when the stop is not confirmed after 5 s, or the motor does not stand after a minute.
#[derive(Debug, clap::Args)]
pub struct Args {
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
    #[arg(long, default_value_t = StopMode::Ramp, default_value_if("injection", ArgPredicate::IsPresent, "dc-injection"))]
    mode: StopMode,
    /// For how long direct current is injected to bring the motor to rest, in whole seconds, at the most 30; without it as the
    /// configuration says, else 5. It makes the mode dc-injection
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=INJECTION_AT_MOST.as_secs()))]
    injection: Option<u64>,
}

impl Args {
    /// How the motor is to be stopped.
    fn order(&self) -> Result<StopOrder, Failure> {
        match (self.mode, self.injection) {
            (StopMode::DcInjection, Some(seconds)) => Ok(StopOrder::injecting(Duration::from_secs(seconds))),
            (mode, Some(_)) => Err(Failure::Input(format!(
                "--injection is for a stop by dc-injection, and not by {mode}: leave it out, or --mode"
            ))),
            (mode, None) => Ok(mode.into()),
        }
    }
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let order = args.order()?;
    if !args.one.is_on_line() {
        return through_daemon(&args, order).await;
    }
    let mut one = args.one.stop()?;
    match one.stop(order).await {
        Ok(stop) => args.one.say_stopped(&one, &stop)?,
        Err(failure) => {
            // Whoever else has the port open is in nobody's way where the drive has answered.
            let whose = if one.is_unsent() { args.one.whose().await } else { None };
            return Err(match whose {
                Some(whose) => Failure::Drive(format!("{failure}; {whose}")),
                None => failure,
            });
        }
    }
    one.close().await;
    Ok(())
}

/// A stop that the daemon did not get may leave a motor turning, whatever the reason is.
async fn through_daemon(args: &Args, order: StopOrder) -> Result<(), Failure> {
    let unsent = |failure: Failure| Failure::Drive(format!("{UNCONFIRMED}. {failure}"));
    let told = Told {
        action: ActionWord::Stop,
        body: match order.injection {
            Some(time) => json!({ "mode": order.mode, "injection_ms": milliseconds(time) }),
            None => json!({ "mode": order.mode }),
        },
        done: "has taken the stop".to_owned(),
    };
    let mut daemon = args.one.daemon.connect().await.map_err(unsent)?;
    let target = match (args.all, &args.name) {
        (true, _) => Target::All,
        (false, Some(name)) => Target::find(&daemon.state().await.map_err(unsent)?, name)?,
        (false, None) => return Err(unnamed()),
    };
    client::order(&args.one.daemon, daemon, &target, &told).await.map_err(unsent)
}
