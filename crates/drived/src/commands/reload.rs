//! `drived reload`: the running daemon reads its configuration again.

use serde_json::{Value, json};

use crate::{client::DaemonArgs, failure::Failure, output};

/// Have the running daemon read its configuration again, and touch only what has changed
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Only say what would change
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut daemon = args.daemon.connect().await?;
    let path = if args.dry_run { "/api/v1/reload?dry_run=true" } else { "/api/v1/reload" };
    let done = daemon.post(path, &json!({})).await?.done()?;
    args.daemon.say(&done, say)
}

/// What was done, or would be, a line each.
fn say(done: &Value) -> Result<(), Failure> {
    let lines = done["changes"].as_array().into_iter().flatten();
    let lines: Vec<&str> = lines.filter_map(|line| line.as_str().or_else(|| line["text"].as_str())).collect();
    if lines.is_empty() {
        return output::say("nothing has changed");
    }
    lines.into_iter().try_for_each(output::say)
}
