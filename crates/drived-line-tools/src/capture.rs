//! `drived capture`: what goes over a line, of the daemon or listened to, as a file for Wireshark and for `drived explain`.

use std::{
    fs::{self, File, OpenOptions},
    io,
    path::PathBuf,
    time::Duration,
};

use drive_bus::capture::Writer;
use serde_json::json;
use tokio::time::Instant;

use super::frames::Frames;
use drived_client::DaemonArgs;
use drived_words::{
    failure::Failure,
    line_spec::{self, LineSpec, describe},
    output::{self, counted},
    signals::Ending,
};

/// For how long a line of the daemon is captured, unless it is said.
const SECONDS: u64 = 10;

/// Keep what goes over a line in a file that Wireshark opens
///
/// A line of the running daemon, by its name; or a port that is only listened to, by --line: nothing is ever written to
/// it, so that whoever speaks there is not disturbed. A port is listened to until Ctrl-C. The file is made anew; one that
/// is there already is not written over, and what was captured before an error is kept.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The line of the daemon, by its name in the configuration
    #[arg(value_name = "LINE", required_unless_present = "port", conflicts_with = "port")]
    line: Option<String>,
    // The text has brackets that a doc comment would take for links.
    #[arg(long = "line", id = "port", value_name = "PORT", help = line_spec::TO_LISTEN_TO, conflicts_with_all = ["socket", "token_file"])]
    port: Option<LineSpec>,
    /// The file to be made
    #[arg(long, value_name = "FILE")]
    to: PathBuf,
    /// For how many seconds; 10 of the daemon, until Ctrl-C from a port
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    seconds: Option<u64>,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let Args { line, port, to, seconds, daemon } = args;
    let mut ending = Ending::listen()?;
    let (mut frames, name, whole) = match (&line, &port) {
        (Some(line), _) => {
            let seconds = seconds.unwrap_or(SECONDS);
            let (frames, _) = Frames::of_daemon(&daemon, line, seconds).await?;
            (frames, line.clone(), Some(seconds))
        }
        (None, Some(port)) => {
            let config = port.config(&[]).map_err(|error| Failure::Input(error.to_string()))?;
            (Frames::of_port(&config).await?, describe(&config), seconds)
        }
        (None, None) => return Err(Failure::Input("expected LINE or --line PORT".to_owned())),
    };
    let failed = |error: io::Error| Failure::Input(format!("{}: {error}", to.display()));
    let file = OpenOptions::new().write(true).create_new(true).open(&to).map_err(failed)?;
    let whole = whole.map(Duration::from_secs);
    let until = port.and(whole).map(|whole| Instant::now() + whole);
    let mut kept = Kept::default();
    let work = keep(&mut frames, file, &mut kept, failed, until, &mut ending);
    let ended = output::during(format_args!("capturing {name}"), whole, work).await;
    if kept.frames == 0 && ended.is_err() {
        // What it made and left empty helps nobody.
        let _ = fs::remove_file(&to);
    }
    ended?;
    let Kept { frames: count, bytes } = kept;
    if daemon.is_json() {
        return output::say_as_it_is(json!({ "file": to, "frames": count, "bytes": bytes }));
    }
    let count = counted(count, "frame", "frames");
    output::say(format_args!("{}: {count}, {bytes} bytes of them", to.display()))
}

/// What was written.
#[derive(Debug, Clone, Copy, Default)]
struct Kept {
    frames: usize,
    bytes: usize,
}

/// Writes frame by frame, so that the file is whole whenever it ends.
async fn keep(
    frames: &mut Frames,
    file: File,
    kept: &mut Kept,
    failed: impl Fn(io::Error) -> Failure,
    until: Option<Instant>,
    ending: &mut Ending,
) -> Result<(), Failure> {
    // What the line speaks is known with the first frame.
    let (mut file, mut writer) = (Some(file), None);
    loop {
        let next = tokio::select! {
            biased;
            () = ending.asked() => None,
            () = passed(until) => None,
            next = frames.next() => next?,
        };
        if let Some(file) = file.take() {
            let begun = match frames.late() {
                Some(late) => Writer::of_listener(file, frames.dissector(), late),
                None => Writer::new(file, frames.dissector()),
            };
            writer = Some(begun.map_err(&failed)?);
        }
        let (Some(frame), Some(writer)) = (next, &mut writer) else { return Ok(()) };
        writer.write(&frame).map_err(&failed)?;
        kept.frames += 1;
        kept.bytes += frame.bytes.len();
    }
}

async fn passed(until: Option<Instant>) {
    match until {
        Some(until) => tokio::time::sleep_until(until).await,
        None => std::future::pending().await,
    }
}
