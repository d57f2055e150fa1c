//! `drived explain`: what goes over a line, frame by frame, in words.

use std::{
    collections::BTreeMap,
    io::{self, IsTerminal as _},
    path::{Path, PathBuf},
    time::Duration,
};

use drive_bus::config::SerialText;
use drive_core::SerialSettings;
use drive_families::Family;
use serde_json::json;
use tokio::time::{Instant, sleep};

use super::frames::Frames;
use drived_client::DaemonArgs;
use drived_file::Config;
use drived_words::explain::{Counts, Explained, Explainer, Known};
use drived_words::{
    drive_spec::{DriveName, DriveSpec, on_one_line},
    failure::Failure,
    json,
    line_spec::{self, LineSpec, describe},
    output::{self, counted, milliseconds},
    signals::Ending,
};

/// For how long a line of the daemon is captured, unless it is said.
const SECONDS: u64 = 10;

/// Put what goes over a line into words: each frame, which drive, which register, which bit has changed, which silence was too short
///
/// From whatever has frames in it: a capture (pcapng or pcap, of drived, Wireshark or tcpdump, also one that is cut off), a log or a
/// dump with bytes in hexadecimal in any dress, bytes as they were, from a file or a pipe, or the bytes themselves as words; from a
/// line of the running daemon; or from a port that is only listened to, to which nothing is ever written: frame by frame as they
/// are heard, until Ctrl-C. Without the drives' families registers have numbers alone. Times are seconds since the first frame.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A file, or the bytes of frames such as 01 03 0C 81 00 01 D7 72; - or nothing for what comes through a pipe
    #[arg(value_name = "FILE|HEX", conflicts_with_all = ["from", "line"])]
    words: Vec<String>,
    /// A line of the running daemon, by its name
    #[arg(long, value_name = "LINE", conflicts_with = "line")]
    from: Option<String>,
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "PORT", help = line_spec::TO_LISTEN_TO, conflicts_with = "serial")]
    line: Option<LineSpec>,
    /// For how many seconds; 10 of the daemon, until Ctrl-C from a port
    #[arg(long, value_name = "SECONDS", conflicts_with = "words", value_parser = clap::value_parser!(u64).range(1..))]
    seconds: Option<u64>,
    /// Which drives are on the line
    #[arg(long, value_name = "FAMILY@ADDRESSES")]
    drive: Vec<DriveSpec>,
    /// Speed and format of the line, by which the silences are judged, such as 19200,8E1
    #[arg(long, value_name = "BAUD[,FORMAT]")]
    serial: Option<SerialText>,
    /// The configuration that has the line: its drives, speed and format
    #[arg(long, value_name = "FILE", conflicts_with_all = ["drive", "serial"])]
    config: Option<PathBuf>,
    /// Which of its lines, if it has several
    #[arg(long, value_name = "NAME", requires = "config")]
    name: Option<String>,
    /// The bytes are address and PDU, without the check behind them
    #[arg(long, conflicts_with_all = ["from", "line"])]
    no_check: bool,
    /// Show only what is wrong
    #[arg(long)]
    trouble: bool,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let mut ending = Ending::listen()?;
    let drives = on_one_line(&args.drive).map_err(|error| Failure::Input(error.to_string()))?;
    let (mut frames, known) = open(&args, &drives).await?;
    let known = match (&args.config, known) {
        (Some(file), _) => of_config(file, args.name.as_deref())?,
        (None, Some(known)) => known,
        (None, None) => of_options(args.serial, &drives)?,
    };
    let mut explainer = Explainer::new(Known { late: frames.late(), ..known });
    let until =
        args.line.as_ref().and(args.seconds).map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let mut began = None;
    loop {
        let frame = tokio::select! {
            biased;
            () = ending.asked() => break,
            () = passed(until) => break,
            frame = frames.next() => frame?,
        };
        let Some(frame) = frame else { break };
        let explained = explainer.explain(frames.dissector(), &frame);
        let began = *began.get_or_insert(frame.at);
        if args.trouble && explained.trouble.is_empty() {
            continue;
        }
        if args.daemon.is_json() {
            output::say_as_it_is(json::line(&timed(explained, frames.has_times())))?;
        } else {
            say(&explained, frames.has_times().then_some(began), explainer.late())?;
        }
    }
    if !args.daemon.is_json() {
        frames.notes().iter().try_for_each(|note| output::say(format_args!("note: {note}")))?;
    }
    let counts = explainer.counts();
    if args.daemon.is_json() {
        return output::say_as_it_is(json!({ "counts": counts, "notes": frames.notes() }));
    }
    say_counts(counts, explainer.late())
}

/// The frames that are asked for, and what is known of their line without the other options.
async fn open(args: &Args, drives: &[DriveName]) -> Result<(Frames, Option<Known>), Failure> {
    match (&*args.words, &args.from, &args.line) {
        (_, Some(line), _) => {
            let seconds = args.seconds.unwrap_or(SECONDS);
            let (frames, known) = Frames::of_daemon(&args.daemon, line, seconds).await?;
            Ok((frames, Some(known).filter(|_| drives.is_empty() && args.serial.is_none())))
        }
        (.., Some(port)) => {
            let config = port.config(drives).map_err(|error| Failure::Input(error.to_string()))?;
            let frames = Frames::of_port(&config).await?;
            if !args.daemon.is_json() {
                let port = describe(&config);
                output::say(format_args!("listening to {port}; nothing is ever written (Ctrl-C ends it)"))?;
            }
            let known = Known { serial: Some(config.serial), late: None, drives: named(drives) };
            Ok((frames, Some(known)))
        }
        ([], ..) if io::stdin().is_terminal() => Err(Failure::Input(
            "explain what? a FILE, bytes such as 01 03 0C 81 00 01 D7 72, a pipe, --from LINE or --line PORT"
                .to_owned(),
        )),
        ([], ..) => Ok((Frames::of_file(None, args.no_check)?, None)),
        ([alone], ..) if alone == "-" => Ok((Frames::of_file(None, args.no_check)?, None)),
        ([alone], ..) if is_file(alone) => {
            Ok((Frames::of_file(Some(Path::new(alone)), args.no_check)?, None))
        }
        (words, ..) => Ok((Frames::of_words(words, args.no_check)?, None)),
    }
}

/// Whether a word is a file: one that is there, or one that is called as no bytes are.
fn is_file(word: &str) -> bool {
    let path = Path::new(word);
    let is_hex = word.bytes().all(|byte| byte.is_ascii_hexdigit() || b" ,;:-_[]<>xXhH\\".contains(&byte));
    path.exists() || !is_hex
}

/// What is told to a program of a frame whose time is not known.
fn timed(explained: Explained, has_times: bool) -> Explained {
    if has_times { explained } else { Explained { at: None, after: None, ..explained } }
}

async fn passed(until: Option<Instant>) {
    match until {
        Some(until) => sleep(until.saturating_duration_since(Instant::now())).await,
        None => std::future::pending().await,
    }
}

/// Says a frame, with its time since that of the first where times are known.
fn say(explained: &Explained, began: Option<Duration>, late: Option<Duration>) -> Result<(), Failure> {
    let Explained { at, sent, slave, drive, text, details, trouble, after, .. } = explained;
    let way = match sent {
        Some(true) => ">",
        Some(false) => "<",
        None => "?",
    };
    let who = match (slave, drive) {
        (_, Some(name)) => format!("{name}: "),
        (Some(0), None) => "all: ".to_owned(),
        (Some(slave), None) => format!("slave {slave}: "),
        (None, None) => String::new(),
    };
    let after = after.filter(|_| began.is_some()).map(|after| match late {
        Some(_) => format!(", after about {} ms", after.as_millis()),
        None => format!(", after {}", milliseconds(after)),
    });
    let after = after.unwrap_or_default();
    let time = at.zip(began).map_or_else(String::new, |(at, began)| {
        let since = at.saturating_sub(began).as_micros();
        let (seconds, rest) = (since / 1_000_000, since % 1_000_000 / 10);
        format!("{seconds:>4}.{rest:05} ")
    });
    let below = " ".repeat(time.len());
    output::say_behind(&format!("{time}{way} "), &format!("{who}{text}{after}"))?;
    for detail in details {
        output::say_behind(&format!("{below}  "), detail)?;
    }
    for what in trouble {
        output::say_behind(&format!("{below}! "), what)?;
    }
    Ok(())
}

fn say_counts(counts: Counts, late: Option<Duration>) -> Result<(), Failure> {
    let Counts { requests, answers, exceptions, unanswered, damaged, silences_broken, silences_doubtful } =
        counts;
    let told = format!(
        "{requests} requests, {answers} answers, {exceptions} exceptions, {unanswered} without an answer, \
         {damaged} damaged, {silences_broken} silences too short"
    );
    let Some(late) = late else { return output::say(told) };
    let doubtful = counted(usize::try_from(silences_doubtful).unwrap_or(usize::MAX), "silence", "silences");
    output::say(format_args!(
        "{told}; {doubtful} too close to call: frames are heard up to {} late",
        milliseconds(late)
    ))
}

/// What the options say of the line.
fn of_options(serial: Option<SerialText>, drives: &[DriveName]) -> Result<Known, Failure> {
    let serial = serial.map(|serial| line_spec::settings(serial, drives)).transpose();
    let serial = serial.map_err(|error| Failure::Input(error.to_string()))?;
    Ok(Known { serial, late: None, drives: named(drives) })
}

/// The drives by their addresses.
pub(super) fn named(drives: &[DriveName]) -> BTreeMap<u8, (Family, String)> {
    drives.iter().map(|drive| (drive.slave.number(), (drive.family, drive.to_string()))).collect()
}

/// What a configuration says of the line.
fn of_config(file: &Path, name: Option<&str>) -> Result<Known, Failure> {
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
    Ok(Known { serial, late: None, drives })
}
