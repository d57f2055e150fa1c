//! `drived plan`: what lines will be like, calculated before the cable is pulled.

mod line;
mod sheet;

use std::{path::PathBuf, time::Duration};

use clap::ArgGroup;
use drive_bus::Protocol;
use drive_core::Reaction;
use drive_families::Options;
use drive_fleet::{Demand, LineBudget, Periods, WatchdogContract, plan};

use self::{
    line::{Case, PlannedLine},
    sheet::Sheet,
};
use drived_config::config::LinePart;
use drived_file::Config;
use drived_words::{
    drive_spec::{self, DriveName, DriveSpec},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output::{self, JsonArgs, Table},
};

/// Calculate lines before the cable is pulled: cycle, age of values, load, worst stop, watchdogs
///
/// Of the lines of a configuration, or of one line that is described here. The same is calculated at 38400 bit/s and with
/// three of the drives dead. No port is opened. Exit code 2, with the arithmetic, for what cannot work.
#[derive(Debug, clap::Args)]
#[command(group = ArgGroup::new("what").required(true).args(["config", "line"]))]
pub struct Args {
    /// The configuration of `drived run`, in TOML
    #[arg(long, value_name = "FILE", conflicts_with_all = ["drives", "period", "watchdog", "response", "segments"])]
    config: Option<PathBuf>,
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP, requires = "drives")]
    line: Option<LineSpec>,
    /// Drives on it, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", requires = "line")]
    drives: Vec<DriveSpec>,
    /// Time between two polls of one drive
    #[arg(long, value_name = "TIME", default_value = "1s")]
    period: Time,
    /// Time of the drives' communication watchdogs that has to be fed; 0: none but those that a family always has
    #[arg(long, value_name = "TIME", default_value = "0")]
    watchdog: Time,
    /// The usual time from the end of a request to its answer
    #[arg(long, value_name = "TIME", default_value = "10ms")]
    response: Time,
    /// Segments of the line: 1, and one more behind each repeater
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..))]
    segments: u8,
    #[command(flatten)]
    json: JsonArgs,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let mut kept = Vec::new();
    let (lines, problems) = match (&args.config, &args.line) {
        (Some(file), _) => {
            let config = Config::load(file).map_err(|error| Failure::Input(error.to_string()))?;
            if let Some(history) = config.face("history") {
                kept = history.meaning();
            }
            of_file(config)
        }
        (None, Some(line)) => args.described(line)?,
        (None, None) => {
            return Err(Failure::Input("expected --config FILE, or --line and --drive".to_owned()));
        }
    };
    let forecasts: Vec<(&PlannedLine, Vec<Case>)> = lines.iter().map(|line| (line, line.cases())).collect();
    let mut problems = problems.into_iter();
    let first = problems.next();
    let refused = first.map_or(Ok(()), |problem| Err(Failure::Input(problem)));
    if args.json.is_json() {
        forecasts
            .iter()
            .try_for_each(|(line, cases)| output::say_as_it_is(Sheet { line, cases }.object()))?;
        return refused;
    }
    for (line, cases) in &forecasts {
        Sheet { line, cases }.say()?;
        output::say("")?;
    }
    if forecasts.len() > 1 {
        sheet::say_all_lines(&forecasts)?;
        output::say("")?;
    }
    output::say(
        "Ages and times are the longest there can be while no commands are given; a motor whose stop is confirmed \
         still needs its ramp.",
    )?;
    problems.try_for_each(output::say)?;
    // How large the history becomes belongs to what is known beforehand.
    for kept in kept {
        output::say(format_args!("\n{}", kept.head))?;
        let mut table = Table::texts();
        for (label, text) in kept.rows {
            table.row([format!("  {label}"), text]);
        }
        output::say_table(table)?;
    }
    refused
}

/// The lines of a file, and what is wrong with those that cannot work.
fn of_file(config: Config) -> (Vec<PlannedLine>, Vec<String>) {
    let problems = config.lines.iter().filter_map(|line| Some(line.problem.as_ref()?.to_string())).collect();
    let planned = |line: LinePart| PlannedLine {
        drives: line.drives.iter().map(|drive| drive.name).zip(line.demands()).collect(),
        name: Some(line.name),
        config: line.config,
        budget: line.budget,
    };
    (config.lines.into_iter().map(planned).collect(), problems)
}

impl Args {
    /// The line that the command line describes, and why it cannot work.
    fn described(&self, line: &LineSpec) -> Result<(Vec<PlannedLine>, Vec<String>), Failure> {
        let names =
            drive_spec::on_one_line(&self.drives).map_err(|error| Failure::Input(error.to_string()))?;
        let config = line.config(&names).map_err(|error| Failure::Input(error.to_string()))?;
        if self.period.0.is_zero() {
            return Err(Failure::Input(
                "--period 0: expected the time between two polls of one drive".to_owned(),
            ));
        }
        let budget =
            LineBudget { response: self.response.0, segments: self.segments, ..LineBudget::of(&config) };
        let demand = |name| (name, self.demand(name, config.protocol));
        let drives: Vec<_> = names.into_iter().map(demand).collect();
        let demands: Vec<Demand> = drives.iter().map(|(_, demand)| demand.clone()).collect();
        let problem = plan(budget, &demands).err().map(|problem| format!("it cannot work: {problem}"));
        Ok((vec![PlannedLine { name: None, config, budget, drives }], problem.into_iter().collect()))
    }

    fn demand(&self, name: DriveName, protocol: Protocol) -> Demand {
        let watchdog_capability = line_spec::watchdog(name, &Options::default(), protocol);
        // A watchdog that the bus cannot set has its own time, whatever is wished here.
        let fixed = watchdog_capability.is_some_and(|watchdog| watchdog.fixed().is_some());
        let wished = !self.watchdog.0.is_zero() && !fixed;
        Demand {
            drive: name.to_string(),
            capabilities: name.family.capabilities(),
            watchdog_capability,
            periods: Periods {
                running: self.period.0,
                rest: self.period.0,
                slow: Duration::ZERO,
                max_age: Duration::MAX,
            },
            watchdog: wished
                .then_some(WatchdogContract { timeout: self.watchdog.0, reaction: Reaction::Freewheel }),
        }
    }
}
