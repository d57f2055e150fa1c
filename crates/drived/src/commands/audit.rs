//! `drived audit`: who did what, and whether the log of it is whole.

use std::{path::PathBuf, str::FromStr};

use chrono::Local;
use serde_json::json;

use super::token::ConfigArgs;
use drived_doors::audit::{Filter, Found, Verdict, shown, verify_since};
use drived_words::{
    failure::Failure,
    moment,
    output::{self, JsonArgs, Table},
};

/// Look into the audit log
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Say whether the log is whole: from the first line that is kept to the last that was written
    ///
    /// The files that were put aside (FILE.1 and so on) are read too. Exit code 1 where a line was changed, added or taken
    /// out, also at the beginning and at the end. A log that was put back as it was earlier, with its key, is known by a newest line
    /// that was noted elsewhere: the daemon tells it in its own log, at its start and every hour, and to its MQTT broker.
    Verify {
        #[command(flatten)]
        log: LogArgs,
        /// A newest line that was noted earlier: it has to be in the log
        #[arg(long, value_name = "HEAD")]
        since: Option<String>,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Show who did what
    Show {
        #[command(flatten)]
        log: LogArgs,
        /// From this time on: 03:12, "2026-11-21 03:12" or as RFC 3339 has it
        #[arg(long, value_name = "TIME")]
        since: Option<Time>,
        /// Before this time
        #[arg(long, value_name = "TIME")]
        until: Option<Time>,
        /// By whom: a token's name, local, anonymous, drived
        #[arg(long, value_name = "NAME")]
        caller: Option<String>,
        /// About what: a part of it, such as the name of a drive
        #[arg(long, value_name = "TEXT")]
        about: Option<String>,
        /// What somebody might not do, instead of what was done
        #[arg(long)]
        refused: bool,
        /// How many, the newest
        #[arg(long, value_name = "N", default_value_t = 100)]
        last: usize,
        #[command(flatten)]
        json: JsonArgs,
    },
}

/// Which log it is.
#[derive(Debug, clap::Args)]
pub(crate) struct LogArgs {
    /// The log, if not that of the configuration
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
}

impl LogArgs {
    fn file(self) -> Result<PathBuf, Failure> {
        match self.file {
            Some(file) => Ok(file),
            None => self.config.named("audit", self.config.doors()?.state.audit),
        }
    }
}

/// A moment, as a person says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Time(u64);

impl FromStr for Time {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let time = moment::said(text, &Local::now()).map_err(|error| error.to_string())?.at;
        let unix_ms = u64::try_from(time.timestamp_millis());
        unix_ms.map(Self).map_err(|_| "expected a time after 1970".to_owned())
    }
}

pub(crate) fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::Verify { log, since, json } => verify(log.file()?, since.as_deref(), json),
        Command::Show { log, since, until, caller, about, refused, last, json } => {
            let [since_unix_ms, until_unix_ms] = [since, until].map(|time| time.map(|time| time.0));
            let filter = Filter { since_unix_ms, until_unix_ms, caller, about, refused };
            let file = log.file()?;
            let records = shown(&file, &filter, last).map_err(|error| unreadable(&file, &error))?;
            if json.is_json() {
                return records.iter().try_for_each(|record| output::say_as_it_is(json!(record)));
            }
            if records.is_empty() {
                return output::say(format_args!("{}: nothing of that", file.display()));
            }
            show(&records)
        }
    }
}

fn unreadable(file: &std::path::Path, error: &std::io::Error) -> Failure {
    Failure::Input(format!("{}: cannot be read: {error}", file.display()))
}

fn show(records: &[Found]) -> Result<(), Failure> {
    let mut table = Table::new(["time", "caller", "from", "kind", "what", "outcome"]);
    for record in records {
        let Found { kind, caller, origin, what, .. } = record.clone();
        let time = i64::try_from(record.time_unix_ms).ok();
        let time = output::or_dash(time.and_then(|time| moment::told_here(time, "%Y-%m-%d %H:%M:%S%.3f")));
        let body = record.body.as_ref().map(|body| format!(" {body}")).unwrap_or_default();
        let status = record.status.map(|status| status.to_string());
        table.row([
            time,
            caller,
            origin,
            kind,
            what + &body,
            output::or_dash(record.outcome.clone().or(status)),
        ]);
    }
    output::say_table(table)
}

fn verify(file: PathBuf, since: Option<&str>, json: JsonArgs) -> Result<(), Failure> {
    match verify_since(&file, since).map_err(|error| unreadable(&file, &error))? {
        Verdict::Unbroken { records, torn, last, head } => {
            let object =
                || json!({ "file": file, "records": records, "torn": torn, "last": last, "head": head });
            json.say(object, || {
                let torn = match torn {
                    0 => String::new(),
                    torn => format!(", {torn} torn by a crash"),
                };
                let head = head.as_ref().unwrap_or(&last);
                output::say(format_args!(
                    "{}: {records} records, unbroken{torn}; the last is {head}",
                    file.display()
                ))
            })
        }
        Verdict::Broken { file, line, why } => {
            Err(Failure::Drive(format!("{}:{line}: the chain is broken: {why}", file.display())))
        }
    }
}
