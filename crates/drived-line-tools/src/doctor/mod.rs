//! `drived doctor`: what is wrong with a line, in words, each with the next step to take.
//!
//! [`observe`] listens and asks, [`judge`] says from what was noticed what is wrong, [`report`] and [`object`] tell it. Nothing
//! here writes to a drive.

mod judge;
mod object;
mod observations;
mod observe;
mod report;
#[cfg(test)]
mod tests;
mod verdict;

use std::{
    fs::{File, OpenOptions},
    io::Write as _,
    path::PathBuf,
    time::Duration,
};

use chrono::Local;
use drive_bus::{Endpoint, Line, LineConfig, OpenError, adapter_latency, listen::Listener};
use drive_core::SlaveAddress;
use tokio::time::Instant;

use self::{
    observations::{Adapter, Observations},
    observe::{Task, Ways},
    report::Diagnosis,
};
use drived_client as client;
use drived_words::{
    drive_spec::{self, Addresses, DriveSpec},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output::{self, Progress},
    ports,
    signals::Ending,
};

/// Say in words what is wrong with a line, and what to do next; nothing is written
///
/// It listens first, then asks, after short and long pauses. Start and stop the drives meanwhile, at their panels: what is damaged
/// only while a motor runs shows then. An armed communication watchdog counts from the first message that its drive hears:
/// name the drives that have one with --drive, and do not end it while they run. Exit code 0: healthy, 1: something is wrong.
#[derive(Debug, clap::Args)]
pub struct Args {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// Who should be there, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", conflicts_with = "addresses")]
    drives: Vec<DriveSpec>,
    /// Where to look for somebody, without --drive
    #[arg(long, value_name = "ADDRESSES", default_value = "1-247")]
    addresses: Addresses,
    /// How long to wait for the answer of an address that may be nobody's
    #[arg(long, value_name = "TIME", default_value = "100ms")]
    wait: Time,
    /// How long to ask those that answer
    #[arg(long = "for", value_name = "TIME", default_value = "20s")]
    time: Time,
    /// A text file to be made, which can be sent to somebody: figures, damaged frames, verdicts
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let task = task(&args)?;
    let mut ending = Ending::listen()?;
    let mut file = args.report.as_ref().map(create).transpose()?;
    if !args.json {
        announce(&task)?;
    }
    let (began, seconds) =
        (Instant::now(), |time: Duration| usize::try_from(time.as_secs()).unwrap_or(usize::MAX));
    let of = seconds(task.estimate());
    let mut progress = Progress::of("seconds", of);
    let show = |text: &str| {
        progress.note(text);
        progress.at(seconds(began.elapsed()).min(of));
    };
    let port = Port(task.config.endpoint.clone());
    let observed = observe::observe(&task, &port, show, ending.asked()).await;
    drop(progress);
    if observed.is_err()
        && let Some(path) = &args.report
    {
        // What it made and left empty helps nobody.
        let _ = std::fs::remove_file(path);
    }
    tell(&args, &observed?, file.as_mut())
}

/// Prints what came of it, writes the report, and says by the outcome whether anything is wrong.
fn tell(args: &Args, seen: &Observations, file: Option<&mut File>) -> Result<(), Failure> {
    let date = Local::now().format("%Y-%m-%d %H:%M:%S %:z").to_string();
    let diagnosis = Diagnosis { date, verdicts: judge::judge(seen), seen };
    if let (Some(file), Some(path)) = (file, &args.report) {
        let written = file.write_all(diagnosis.to_string().as_bytes());
        written.map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
    }
    if args.json {
        output::say_as_it_is(object::of(&diagnosis))?;
    } else {
        diagnosis.short().into_iter().try_for_each(output::say)?;
        if let Some(path) = &args.report {
            output::say(format_args!("report: {}", path.display()))?;
        }
    }
    match (diagnosis.verdicts.len(), &seen.cut_short) {
        (0, Some(why)) => {
            Err(Failure::Drive(format!("nothing wrong was found until the end, which came early: {why}")))
        }
        (0, None) => Ok(()),
        (found, _) => Err(Failure::Drive(format!(
            "{} with this line",
            if found == 1 { "1 thing is wrong".to_owned() } else { format!("{found} things are wrong") }
        ))),
    }
}

fn task(args: &Args) -> Result<Task, Failure> {
    let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
    if args.wait.0.is_zero() {
        return Err(Failure::Input("--wait 0: expected how long to wait for each answer".to_owned()));
    }
    let expected = drive_spec::on_one_line(&args.drives).map_err(|error| input(&error))?;
    let config = args.line.config(&expected).map_err(|error| input(&error))?;
    let addresses: Vec<SlaveAddress> = match &expected[..] {
        [] => args.addresses.0.clone(),
        named => named.iter().map(|name| name.slave).collect(),
    };
    Ok(Task { config, expected, addresses, wait: args.wait.0, time: args.time.0 })
}

fn create(path: &PathBuf) -> Result<File, Failure> {
    let made = OpenOptions::new().write(true).create_new(true).open(path);
    made.map_err(|error| Failure::Input(format!("{}: {error}", path.display())))
}

/// Says how long it will take, before anything is sent.
fn announce(task: &Task) -> Result<(), Failure> {
    let listening = match task.config.protocol.is_paced() {
        true => format!("listening for {} s, then ", observe::LISTENING.as_secs()),
        false => String::new(),
    };
    let silent = task.estimate_of_silent().map_or_else(String::new, |more| {
        format!(", and {} s more for each drive that is silent", more.as_secs())
    });
    output::say(format_args!(
        "{listening}asking {} on {}: about {} s{silent}; only reads\n",
        output::counted(task.addresses.len(), "address", "addresses"),
        line_spec::describe(&task.config),
        task.estimate().max(Duration::from_secs(1)).as_secs(),
    ))
}

/// A port of this computer, or a connection.
struct Port(Endpoint);

impl Ways for Port {
    async fn open(&self, config: LineConfig) -> Result<Line, Failure> {
        match Line::open(config).await {
            Ok(line) => Ok(line),
            Err(error) => Err(refused(error).await),
        }
    }

    async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure> {
        match Listener::open(config).await {
            Ok(listener) => Ok(listener),
            Err(error) => Err(refused(error).await),
        }
    }

    fn adapter(&self) -> Adapter {
        let Endpoint::Serial(path) = &self.0 else { return Adapter::default() };
        let device = std::fs::canonicalize(path).ok();
        let driver = device.as_deref().and_then(|device| {
            let driver =
                std::path::Path::new("/sys/class/tty").join(device.file_name()?).join("device/driver");
            Some(std::fs::canonicalize(driver).ok()?.file_name()?.to_string_lossy().into_owned())
        });
        Adapter { driver, latency: adapter_latency(path) }
    }
}

/// Why a port cannot be had, and what to do.
async fn refused(error: OpenError) -> Failure {
    let OpenError::InUse { path } = &error else { return Failure::Input(ports::refused(&error)) };
    match client::whose(path).await {
        Some(whose) => Failure::Input(format!(
            "{} is {whose}: a line has one master, so end that first and let the doctor have the port; the daemon's own view of \
             its line is on its page and in drived status",
            path.display()
        )),
        None => Failure::Input(error.to_string()),
    }
}
