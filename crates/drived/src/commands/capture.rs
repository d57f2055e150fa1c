//! `drived capture`: what goes over a line of the daemon, as a file for Wireshark and for `drived explain`.

use std::{fs::OpenOptions, io::Write as _, path::PathBuf, time::Duration};

use http_body_util::BodyExt as _;
use serde_json::Value;

use crate::{
    client::{DaemonArgs, path_of},
    explain::Known,
    failure::Failure,
    line_spec::LineSpec,
    output,
};

/// Keep what goes over a line of the running daemon in a file that Wireshark opens
///
/// The file is made anew; one that is there already is not written over.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The line, by its name in the configuration
    #[arg(value_name = "LINE")]
    line: String,
    /// The file to be made
    #[arg(long, value_name = "FILE")]
    to: PathBuf,
    /// For how many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=600))]
    seconds: u64,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let failed = |error: std::io::Error| Failure::Input(format!("{}: {error}", args.to.display()));
    let mut file = OpenOptions::new().write(true).create_new(true).open(&args.to).map_err(failed)?;
    let captured = from_daemon(&args.daemon, &args.line, args.seconds).await;
    if captured.is_err() {
        // What it made and left empty helps nobody.
        let _ = std::fs::remove_file(&args.to);
    }
    let bytes = captured?.bytes;
    file.write_all(&bytes).map_err(failed)?;
    if args.daemon.is_json() {
        let said = serde_json::json!({ "file": args.to, "bytes": bytes.len() });
        return output::say_as_it_is(said);
    }
    output::say(format_args!("{}: {} bytes", args.to.display(), bytes.len()))
}

/// A capture, and what the daemon knows of its line.
pub(super) struct FromDaemon {
    pub(super) bytes: Vec<u8>,
    pub(super) known: Known,
}

/// Captures a line of the running daemon.
pub(super) async fn from_daemon(args: &DaemonArgs, line: &str, seconds: u64) -> Result<FromDaemon, Failure> {
    let mut daemon = args.connect().await?;
    let state = daemon.state().await?;
    let found = state["lines"].as_array().into_iter().flatten().find(|known| known["name"] == *line);
    let Some(found) = found else {
        let names = state["lines"].as_array().into_iter().flatten().filter_map(|line| line["name"].as_str());
        let names: Vec<&str> = names.collect();
        return Err(Failure::Input(format!(
            "there is no line {line:?}: expected one of {}",
            names.join(", ")
        )));
    };
    let known = known(&state, line, found);
    let path = format!("{}/capture?seconds={seconds}", path_of(&["lines", line]));
    let captured = async {
        let answer = daemon.send("GET", &path, None).await?;
        if !answer.status().is_success() {
            return Err(Failure::Drive(format!("the daemon answers {}", answer.status())));
        }
        let bytes = answer.into_body().collect().await;
        bytes.map_err(|error| Failure::Drive(format!("the capture broke off: {error}")))
    };
    let whole = Some(Duration::from_secs(seconds));
    let bytes = output::during(format_args!("capturing {line}"), whole, captured).await?;
    Ok(FromDaemon { bytes: bytes.to_bytes().to_vec(), known })
}

/// What the daemon's state says of a line.
fn known(state: &Value, name: &str, line: &Value) -> Known {
    let drives = state["drives"].as_array().into_iter().flatten().filter(|drive| drive["line"] == *name);
    let drives = drives.filter_map(|drive| {
        let slave = u8::try_from(drive["slave"].as_u64()?).ok()?;
        let family = drive["family"].as_str()?.parse().ok()?;
        Some((slave, (family, drive["name"].as_str()?.to_owned())))
    });
    let port = line["port"].as_str().and_then(|port| port.parse::<LineSpec>().ok());
    let config = port.and_then(|port| port.config(&[]).ok());
    let serial = config.filter(|config| config.protocol.is_paced()).map(|config| config.serial);
    Known { serial, drives: drives.collect() }
}
