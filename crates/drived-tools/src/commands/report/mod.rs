//! `drived report`: what is known of drives and their lines, as one HTML file for the service file.

mod drive;
mod french;
mod gather;
mod line;
mod own;
mod page;
mod parameters;
mod past;
mod plot;
mod program;
mod sheet;
mod summary;
#[cfg(test)]
mod tests;
mod words;

use std::path::PathBuf;

use chrono::Local;
use serde_json::json;

#[cfg(any(test, feature = "testing"))]
pub use self::summary::worst_of;
use self::{
    gather::Gathered,
    own::Own,
    page::{Page, Parties},
    sheet::Sheet,
};
use super::param;
use drived_client::{DaemonArgs, Way};
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::{self, DriveSpec},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output,
    signals::Ending,
};

/// Write a report of drives and their lines into one HTML file, for the service file; nothing is written to a drive
///
/// Identity, hours, state, faults, what differs from the factory setting, watchdogs, the quality of the lines with plots, and
/// the plan beside what was measured. The file needs nothing else, and prints on A4. What could not be read stands in it with
/// the reason; the exit code is 1 where a drive does not answer. All drives of the running daemon, unless some are named.
///
/// With --line take care: a drive whose communication watchdog is armed begins to expect messages by the first one that it hears,
/// and trips when the report is done and nobody speaks to it any more. Do that while the motors stand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Drives, groups or lines of the running daemon; without any, all its drives
    #[arg(value_name = "NAME", conflicts_with = "line")]
    names: Vec<String>,
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", requires = "drives", conflicts_with_all = ["socket", "token_file"], help = line_spec::HELP)]
    line: Option<LineSpec>,
    /// Drives on it, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", requires = "line")]
    drives: Vec<DriveSpec>,
    #[command(flatten)]
    options: OptionArgs,
    /// The file
    #[arg(long, value_name = "FILE")]
    to: PathBuf,
    /// Write over a file that is there
    #[arg(long)]
    overwrite: bool,
    /// The language of its own words; what drives and manuals say stays as it is
    #[arg(long, value_name = "LANGUAGE", value_enum, default_value_t = Language::En)]
    language: Language,
    /// For whom it is; with him or the technician there is a block for signatures
    #[arg(long, value_name = "TEXT")]
    customer: Option<String>,
    /// Who was there
    #[arg(long, value_name = "TEXT")]
    technician: Option<String>,
    /// What the drives held before: backups of drived param backup, or a folder of them; what was changed since is told of each drive
    #[arg(long, value_name = "FILE|FOLDER", conflicts_with = "without_parameters")]
    before: Vec<PathBuf>,
    /// What stands at its head, such as the plant and its line
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// What else is to be said: why, an order number; may be given several times
    #[arg(long = "note", value_name = "TEXT")]
    notes: Vec<String>,
    /// Leave out the parameters, whose reading takes some seconds a drive
    #[arg(long)]
    without_parameters: bool,
    /// With --line: watch the line for so long at the least, so that there is something to measure
    #[arg(long, value_name = "TIME", default_value = "10s", requires = "line")]
    watch: Time,
    #[command(flatten)]
    daemon: DaemonArgs,
}

/// The languages of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Language {
    En,
    Fr,
}

/// What stands at the head of a report that is given no title.
const TITLE: &str = "Report on drives";

/// Who tells it where no daemon does.
const THE_LINE: &str = "the line itself, watched for this report; nothing was written to it";

pub async fn run(args: Args) -> Result<(), Failure> {
    let sheet = Sheet::begin(&args.to, args.overwrite)?;
    let before = param::backups(&args.before)?;
    let mut ending = Ending::listen()?;
    let (way, own, gathered) = tokio::select! {
        biased;
        () = ending.asked() => {
            return Err(Failure::Drive("asked to end: there is no report, and nothing was written to a drive".to_owned()));
        }
        read = args.read() => read?,
    };
    drop(way);
    let source = if own.is_some() { THE_LINE } else { "the running daemon" };
    if let Some(own) = own {
        own.close().await;
    }
    let gathered = gathered?;
    let page = Page {
        title: args.title.as_deref().unwrap_or(TITLE),
        notes: &args.notes,
        parties: Parties { customer: args.customer.as_deref(), technician: args.technician.as_deref() },
        before: (!args.before.is_empty()).then_some(&before),
        source,
        written: Local::now().fixed_offset(),
        gathered: &gathered,
    };
    let html = page.html().into_string();
    sheet.write(&match args.language {
        Language::En => html,
        Language::Fr => french::translated(&html, &french::found(gathered.lines.iter().flatten())),
    })?;
    let silent = gathered.silent();
    let written = json!({ "file": args.to, "drives": gathered.drives.len(), "silent": silent });
    args.daemon.say(&written, || {
        let drives = output::counted(gathered.drives.len(), "drive", "drives");
        output::say(format_args!("{}: {drives}", args.to.display()))?;
        match (&args.line, gathered.armed()) {
            (None, _) | (_, 0) => Ok(()),
            (Some(_), armed) => output::say(format_args!(
                "the communication watchdog of {armed} of them is armed: without another master they trip now"
            )),
        }
    })?;
    match silent.len() {
        0 => Ok(()),
        1 => Err(Failure::Drive(format!("{} does not answer: the report says so", silent.concat()))),
        several => Err(Failure::Drive(format!(
            "{several} drives do not answer, the report says so: {}",
            silent.join(", ")
        ))),
    }
}

impl Args {
    /// Everything that is reported, and the line that was opened for it.
    async fn read(&self) -> Result<(Way, Option<Own>, Result<Gathered, Failure>), Failure> {
        let (way, own) = self.source().await?;
        let gathered = Gathered::read(&way, &self.names, !self.without_parameters).await;
        Ok((way, own, gathered))
    }

    /// The way to who answers, and the line that was opened for it.
    async fn source(&self) -> Result<(Way, Option<Own>), Failure> {
        let Some(line) = &self.line else {
            return Ok((self.daemon.connect().await?.way().clone(), None));
        };
        let names =
            drive_spec::on_one_line(&self.drives).map_err(|error| Failure::Input(error.to_string()))?;
        let own = Own::watch(line, &self.options, &names, self.watch.0).await?;
        Ok((own.way.clone(), Some(own)))
    }
}

impl Gathered {
    /// How many drives have a communication watchdog that runs.
    fn armed(&self) -> usize {
        let is_armed = |drive: &&gather::DriveTold| {
            drive.settings.as_ref().is_ok_and(|told| told.watchdog_armed == Some(true)) && drive.is_there()
        };
        self.drives.iter().filter(is_armed).count()
    }

    /// The drives that do not answer.
    fn silent(&self) -> Vec<String> {
        let silent = self.drives.iter().filter(|drive| !drive.is_there());
        silent.map(|drive| drive.name().to_owned()).collect()
    }
}
