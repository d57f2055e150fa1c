//! `drived release`: gives control of one drive back.

use drive_fleet::Order;
use serde_json::json;

use crate::one_drive::OneDriveArgs;
use drived_client::Told;
use drived_plant::plant::commands::ActionWord;
use drived_words::failure::Failure;

/// Give control of one drive back to its panel or its terminals, such as after a stop that took it; the motor must stand
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive or a group of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    const DONE: &str = "has given control back";
    if !args.one.is_on_line() {
        let told = Told { action: ActionWord::Release, body: json!({}), done: DONE.to_owned() };
        return args.one.tell(args.name.as_deref(), &told).await;
    }
    let name = args.one.name()?;
    let capabilities = name.family.capabilities();
    if !capabilities.release {
        return Err(Failure::Input(format!(
            "{name}: the bus of {} cannot give control back: take it at the drive",
            capabilities.name
        )));
    }
    args.one.order(Order::Release, DONE).await
}
