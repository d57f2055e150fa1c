//! `drived init`: a first configuration, from a scan of a line.

use std::path::PathBuf;

use super::scan::{self, Save, What};
use drived_config::config::look_alikes;
use drived_words::{failure::Failure, output::JsonArgs};

/// Write a commented configuration from a scan of a line; nothing is written to any drive
///
/// It is `drived scan --save`, with a name for the line. Every drive of it is only read by `drived run` until somebody sets
/// `control = true`. What is guessed stands there as a guess. Scan while the motors stand. Exit code 1 when nobody
/// answers, 2 when the file is there already.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    what: What,
    /// The file to write; one that is there is not touched
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    to: PathBuf,
    /// What the line is called
    #[arg(long, value_name = "NAME", default_value = "main")]
    name: String,
    #[command(flatten)]
    json: JsonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let Args { what, to, name, json } = args;
    if let Some(oddity) = look_alikes::oddity(&name) {
        return Err(Failure::Input(format!("--name {oddity}")));
    }
    scan::scan(&what, Some(Save { file: to, name, option: "--to" }), json.is_json()).await
}
