//! `drived start`: starts the motor of one drive.

use drive_core::{Direction, Setpoint};
use drive_fleet::{Order, Until};
use serde_json::json;

use crate::one_drive::OneDriveArgs;
use drived_client::Told;
use drived_plant::plant::commands::ActionWord;
use drived_words::failure::Failure;

/// Start the motor of a drive at the setpoint that it holds, or of all drives of a group
///
/// With --line: refused when the drive has tripped, is not ready, is commanded by somebody else, or starts again by itself. A start that
/// is not confirmed is taken back by a stop. The motor goes on when this program has ended, unless the drive's own
/// communication watchdog stops it: keep the line alive with `drived poll`. Ctrl-C before the start is confirmed stops the
/// motor again.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive or a group of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
    /// Which way: forward or reverse
    #[arg(long, default_value_t = Direction::Forward)]
    direction: Direction,
    /// The setpoint to be given first, such as 47.5Hz or 1450rpm
    #[arg(long, value_name = "SETPOINT")]
    setpoint: Option<Setpoint>,
    /// A setting of the drive by which it may start again by itself, such as Atr; may be given several times. The daemon has
    /// that in its configuration
    #[arg(long, value_name = "MNEMONIC", requires = "line")]
    accept_self_restart: Vec<String>,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let Args { direction, setpoint, .. } = args;
    if !args.one.is_on_line() {
        let mut body = json!({ "direction": direction });
        if setpoint.is_some() {
            body["setpoint"] = json!(setpoint);
        }
        let told = Told { action: ActionWord::Start, body, done: format!("started {direction}") };
        return args.one.tell(args.name.as_deref(), &told).await;
    }
    let mut one = args.one.command(args.accept_self_restart).await?;
    let order = Order::Start { direction, setpoint, until: Until::InForce };
    let (started, status) = one.start(async |drive| drive.order(order).await).await?;
    args.one.say_started(&one, started, &status)?;
    one.close().await;
    Ok(())
}
