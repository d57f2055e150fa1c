//! `drived setpoint`: gives one drive a setpoint.

use drive_core::Setpoint;
use drive_fleet::{Order, Until};

use crate::{failure::Failure, one_drive::OneDriveArgs};

/// Give one drive a setpoint; a motor that runs follows its ramp to it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// A frequency such as 47.5Hz, or a speed such as 1450rpm for the families that take one
    #[arg(value_name = "SETPOINT", allow_hyphen_values = true)]
    setpoint: Setpoint,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let setpoint = args.setpoint;
    let name = args.one.name()?;
    if matches!(setpoint, Setpoint::Speed(_)) && !name.family.capabilities().speed_setpoint {
        let family = name.family.capabilities().name;
        return Err(Failure::Input(format!(
            "{name}: a {family} takes no speed in rpm: give a frequency, such as 47.5Hz"
        )));
    }
    let order = Order::Setpoint { setpoint, until: Until::InForce };
    args.one.order(order, &format!("holds the setpoint {setpoint}")).await
}
