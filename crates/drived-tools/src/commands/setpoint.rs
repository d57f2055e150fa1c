//! `drived setpoint`: gives one drive a setpoint.

use drive_core::Setpoint;
use drive_fleet::{Order, Until};
use serde_json::json;

use crate::one_drive::OneDriveArgs;
use drived_client::Told;
use drived_plant::plant::commands::ActionWord;
use drived_words::failure::Failure;

/// Give a drive, or all of a group, a setpoint; a motor that runs follows its ramp to it
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The drive or the group of the running daemon, which --line and --drive stand for otherwise; and a frequency such as
    /// 47.5Hz, or a speed such as 1450rpm or a share such as 50% for the families that take one
    #[arg(value_name = "NAME|SETPOINT", allow_hyphen_values = true)]
    first: String,
    /// The setpoint, behind a name
    #[arg(value_name = "SETPOINT", conflicts_with = "line")]
    second: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let (name, wanted) = match &args.second {
        Some(wanted) => (Some(args.first.as_str()), wanted),
        None => (None, &args.first),
    };
    let setpoint: Setpoint = wanted.parse().map_err(|why| Failure::Input(format!("{wanted:?}: {why}")))?;
    if !args.one.is_on_line() {
        let body = json!({ "setpoint": setpoint });
        let told =
            Told { action: ActionWord::Setpoint, body, done: format!("holds the setpoint {setpoint}") };
        return args.one.tell(name, &told).await;
    }
    let name = args.one.name()?;
    if matches!(setpoint, Setpoint::Speed(_)) && !name.family.capabilities().speed_setpoint {
        let family = name.family.capabilities().name;
        return Err(Failure::Input(format!(
            "{name}: {family} takes no speed in rpm: give a frequency, such as 47.5Hz"
        )));
    }
    let order = Order::Setpoint { setpoint, until: Until::InForce };
    args.one.order(order, &format!("holds the setpoint {setpoint}")).await
}
