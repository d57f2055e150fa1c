//! `drived reload`: the running daemon reads its configuration again.

use serde_json::json;

use drived_client::DaemonArgs;
use drived_http::api::Changes;
use drived_words::{failure::Failure, output};

/// Have the running daemon read its configuration again, and touch only what has changed
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Only say what would change
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let mut daemon = args.daemon.connect().await?;
    let path = if args.dry_run { "/api/v1/reload?dry_run=true" } else { "/api/v1/reload" };
    let done: Changes = daemon.post(path, &json!({})).await?.done()?;
    let text = || match &*done.changes {
        [] => output::say("nothing has changed"),
        changes => changes.iter().try_for_each(output::say),
    };
    if args.dry_run { args.daemon.say(&done, text) } else { args.daemon.say_done(&done, text) }
}
