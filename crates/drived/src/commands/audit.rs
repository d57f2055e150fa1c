//! `drived audit`: whether the log of who did what is whole.

use std::path::PathBuf;

use serde_json::json;

use super::token::ConfigArgs;
use crate::{
    doors::audit::{Verdict, verify},
    failure::Failure,
    output::{self, JsonArgs},
};

/// Look into the audit log
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Say whether each line of the log stands behind the line that it was written behind
    ///
    /// The files that were put aside (FILE.1 and so on) are read too. Exit code 1 where a line was changed, added or taken
    /// out. A log that was cut at its end is known by the last hash alone, so note it elsewhere.
    Verify {
        /// The log, if not that of the configuration
        #[arg(value_name = "FILE")]
        file: Option<PathBuf>,
        #[command(flatten)]
        config: ConfigArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
}

pub(crate) fn run(command: Command) -> Result<(), Failure> {
    let Command::Verify { file, config, json } = command;
    let file = match file {
        Some(file) => file,
        None => config.named("audit", config.doors()?.state.audit)?,
    };
    let verdict = verify(&file)
        .map_err(|error| Failure::Input(format!("{}: cannot be read: {error}", file.display())))?;
    match verdict {
        Verdict::Unbroken { records, torn, last } => {
            let object = || json!({ "file": file, "records": records, "torn": torn, "last": last });
            json.say(object, || {
                let torn = match torn {
                    0 => String::new(),
                    torn => format!(", {torn} torn by a crash"),
                };
                output::say(format_args!(
                    "{}: {records} records, unbroken{torn}; the last is {last}",
                    file.display()
                ))
            })
        }
        Verdict::Broken { file, line } => Err(Failure::Drive(format!(
            "{}:{line}: the chain is broken: this line or the one before was changed, added or taken out",
            file.display()
        ))),
    }
}
