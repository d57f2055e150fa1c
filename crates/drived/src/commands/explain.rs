//! `drived explain`: what a capture says, frame by frame.

use std::{collections::BTreeMap, fs, path::PathBuf, time::Duration};

use drive_bus::capture::{self, Recording};
use drive_core::SerialSettings;
use drive_families::Family;
use serde_json::json;

use super::capture::from_daemon;
use crate::{
    client::DaemonArgs,
    config::Config,
    drive_spec::{DriveSpec, on_one_line},
    explain::{Counts, Explained, Explainer, Known},
    failure::Failure,
    json,
    line_spec::SerialSpec,
    output::{self, milliseconds},
};

/// The longest capture that is read.
const LONGEST: u64 = 256 << 20;

/// Put a capture into words: each frame, which drive, which register, which bit has changed, which silence was too short
///
/// A capture is a pcapng file as drived writes it, by capture, from the page, or by a program that embeds the library.
/// Without the drives' families registers have numbers alone. Times are seconds since the first frame.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The capture; without it, a line of the running daemon is captured first
    #[arg(value_name = "FILE", required_unless_present = "from", conflicts_with = "from")]
    file: Option<PathBuf>,
    /// A line of the running daemon, by its name
    #[arg(long, value_name = "LINE")]
    from: Option<String>,
    /// For how many seconds it is captured
    #[arg(long, value_name = "SECONDS", default_value_t = 10, requires = "from",
          value_parser = clap::value_parser!(u64).range(1..=600))]
    seconds: u64,
    /// Which drives are on the line
    #[arg(long, value_name = "FAMILY@ADDRESSES")]
    drive: Vec<DriveSpec>,
    /// Speed and format of the line, by which the silences are judged, such as 19200,8E1
    #[arg(long, value_name = "BAUD[,FORMAT]")]
    serial: Option<SerialSpec>,
    /// The configuration that has the line: its drives, speed and format
    #[arg(long, value_name = "FILE", conflicts_with_all = ["drive", "serial"])]
    config: Option<PathBuf>,
    /// Which of its lines, if it has several
    #[arg(long, value_name = "NAME", requires = "config")]
    name: Option<String>,
    /// Show only what is wrong
    #[arg(long)]
    trouble: bool,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let (bytes, of_daemon) = match (&args.file, &args.from) {
        (Some(file), _) => (read(file)?, None),
        (None, Some(line)) => {
            let captured = from_daemon(&args.daemon, line, args.seconds).await?;
            (captured.bytes, Some(captured.known))
        }
        (None, None) => return Err(Failure::Input("expected FILE or --from LINE".to_owned())),
    };
    let named =
        args.file.as_ref().map_or_else(|| "the capture".to_owned(), |file| file.display().to_string());
    let Recording { dissector, frames } =
        capture::read(&bytes).map_err(|error| Failure::Input(format!("{named}: {error}")))?;
    let known = match (&args.config, of_daemon) {
        (Some(file), _) => of_config(file, args.name.as_deref())?,
        (None, Some(known)) if args.drive.is_empty() && args.serial.is_none() => known,
        _ => of_options(&args)?,
    };
    let mut explainer = Explainer::new(dissector, known);
    let began = frames.first().map_or(Duration::ZERO, |frame| frame.at);
    for frame in &frames {
        let explained = explainer.explain(frame);
        if args.trouble && explained.trouble.is_empty() {
            continue;
        }
        if args.daemon.is_json() {
            output::say_as_it_is(json::line(&explained))?;
        } else {
            say(&explained, began)?;
        }
    }
    let counts = explainer.counts();
    if args.daemon.is_json() { output::say_as_it_is(json!({ "counts": counts })) } else { say_counts(counts) }
}

fn say(explained: &Explained, began: Duration) -> Result<(), Failure> {
    let Explained { at, sent, slave, drive, text, details, trouble, after, .. } = explained;
    let since = at.saturating_sub(began).as_micros();
    let way = if *sent { ">" } else { "<" };
    let who = match (slave, drive) {
        (_, Some(name)) => format!("{name}: "),
        (Some(0), None) => "all: ".to_owned(),
        (Some(slave), None) => format!("slave {slave}: "),
        (None, None) => String::new(),
    };
    let after = after.map_or_else(String::new, |after| format!(", after {}", milliseconds(after)));
    let (seconds, rest) = (since / 1_000_000, since % 1_000_000 / 10);
    output::say(format_args!("{seconds:>4}.{rest:05} {way} {who}{text}{after}"))?;
    for detail in details {
        output::say(format_args!("             {detail}"))?;
    }
    for what in trouble {
        output::say(format_args!("           ! {what}"))?;
    }
    Ok(())
}

fn say_counts(counts: Counts) -> Result<(), Failure> {
    let Counts { requests, answers, exceptions, unanswered, damaged, silences_broken } = counts;
    output::say(format_args!(
        "{requests} requests, {answers} answers, {exceptions} exceptions, {unanswered} without an answer, \
         {damaged} damaged, {silences_broken} silences too short"
    ))
}

fn read(file: &PathBuf) -> Result<Vec<u8>, Failure> {
    let failed = |why: &dyn std::fmt::Display| Failure::Input(format!("{}: {why}", file.display()));
    let found = fs::metadata(file).map_err(|error| failed(&error))?;
    if !found.is_file() || found.len() > LONGEST {
        return Err(failed(&format_args!("expected a file of at most {} MiB", LONGEST >> 20)));
    }
    fs::read(file).map_err(|error| failed(&error))
}

/// What the options say of the line.
fn of_options(args: &Args) -> Result<Known, Failure> {
    let drives = on_one_line(&args.drive).map_err(|error| Failure::Input(error.to_string()))?;
    let serial = args.serial.map(|serial| serial.settings(&drives)).transpose();
    let serial = serial.map_err(|error| Failure::Input(error.to_string()))?;
    let drives = drives.iter().map(|drive| (drive.slave.number(), (drive.family, drive.to_string())));
    Ok(Known { serial, drives: drives.collect() })
}

/// What a configuration says of the line.
fn of_config(file: &std::path::Path, name: Option<&str>) -> Result<Known, Failure> {
    let config = Config::load(file).map_err(|error| Failure::Input(error.to_string()))?;
    let mut found = config.lines.iter().filter(|line| name.is_none_or(|name| line.name == name));
    let (Some(line), None) = (found.next(), found.next()) else {
        let names: Vec<&str> = config.lines.iter().map(|line| line.name.as_str()).collect();
        return Err(Failure::Input(format!("expected --name with one of the lines: {}", names.join(", "))));
    };
    let drives: BTreeMap<u8, (Family, String)> = line
        .drives
        .iter()
        .map(|drive| (drive.name.slave.number(), (drive.name.family, drive.settings.name.clone())))
        .collect();
    let serial: Option<SerialSettings> = line.config.protocol.is_paced().then_some(line.config.serial);
    Ok(Known { serial, drives })
}
