//! `drived reset`: resets the present fault of one drive.

use drive_fleet::Order;
use serde_json::json;

use crate::one_drive::OneDriveArgs;
use drived_client::Told;
use drived_plant::plant::commands::ActionWord;
use drived_words::failure::Failure;

/// Reset the present fault of a drive, or of all of a group, once; the motor does not start by it
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive or a group of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    const DONE: &str = "has no fault";
    if !args.one.is_on_line() {
        let told = Told { action: ActionWord::Reset, body: json!({}), done: DONE.to_owned() };
        return args.one.tell(args.name.as_deref(), &told).await;
    }
    args.one.order(Order::ResetFaults, DONE).await
}
