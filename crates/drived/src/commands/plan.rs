//! `drived plan`: what a line will be like, reckoned before the cable is pulled.

use std::time::Duration;

use drive_bus::{Echo, Endpoint, LineConfig};
use drive_core::{Capabilities, Reaction};
use drive_fleet::{Demand, LineBudget, LinePlan, Periods, PlanProblem, WatchdogContract, plan};

use crate::{
    drive_spec::{self, DriveName, DriveSpec},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output::{self, Table},
};

/// Bytes of a PDU around its words: function, address, quantity and count of a write; function and count of an answer.
const AROUND_WRITE: usize = 6;
const AROUND_ANSWER: usize = 2;

/// What the line gives to the probes of dead drives at the most, in millionths.
const PROBES_PPM: u64 = 50_000;

/// How many dead drives are reckoned with.
const DEAD: usize = 3;

/// The speed for which the plan is made besides the line's own.
const OTHER_SPEED: u32 = 38_400;

/// Reckon a line: cycle time, age of the values, utilisation, the longest wait of a stop, whether watchdogs are fed
///
/// No port is opened. Exit code 2, with the arithmetic, for what cannot work.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// Drives, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", required = true)]
    drives: Vec<DriveSpec>,
    /// Time between two polls of one drive
    #[arg(long, value_name = "TIME", default_value = "1s")]
    period: Time,
    /// Time of the drives' communication watchdogs that has to be fed; 0: there are none
    #[arg(long, value_name = "TIME", default_value = "0")]
    watchdog: Time,
    /// The usual time from the end of a request to its answer
    #[arg(long, value_name = "TIME", default_value = "10ms")]
    response: Time,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let names = drive_spec::on_one_line(&args.drives).map_err(|error| Failure::Input(error.to_string()))?;
    let config = args.line.config(&names).map_err(|error| Failure::Input(error.to_string()))?;
    let case = Case { config: &config, names: &names, args };
    let planned = case.plan(0).map_err(|problem| Failure::Input(format!("it cannot work: {problem}")))?;
    output::say(format_args!(
        "{} drives on {}, each polled every {:?}",
        names.len(),
        medium(&config),
        args.period.0
    ))?;

    let heads = [
        "case",
        "cycle",
        "oldest value",
        "used",
        "left",
        "stop to the wire",
        "all stopped",
        "watchdog heard within",
    ];
    let mut table = Table::new(heads).with_numbers_from(1);
    let mut remarks = Vec::new();
    case.row(&mut table, "as planned", &planned, 0);
    if config.serial.baud() != OTHER_SPEED
        && let Some(line) = args.line.at(OTHER_SPEED)
    {
        let label = format!("at {OTHER_SPEED}");
        match line.config(&names) {
            Ok(config) => {
                let faster = Case { config: &config, ..case };
                match faster.plan(0) {
                    Ok(plan) => faster.row(&mut table, &label, &plan, 0),
                    Err(problem) => remarks.push(format!("{label} it cannot work: {problem}")),
                }
            }
            Err(problem) => remarks.push(format!("not {label}: {problem}")),
        }
    }
    if names.len() > DEAD {
        match case.plan(DEAD) {
            Ok(plan) => case.row(&mut table, &format!("with {DEAD} dead"), &plan, DEAD),
            Err(problem) => remarks.push(format!("with {DEAD} dead it cannot work: {problem}")),
        }
    }
    output::say_table(table)?;
    remarks.into_iter().try_for_each(output::say)
}

/// The drives on one configuration of their line.
#[derive(Clone, Copy)]
struct Case<'a> {
    config: &'a LineConfig,
    names: &'a [DriveName],
    args: &'a Args,
}

impl Case<'_> {
    /// The plan with so many of the drives dead: those are only probed.
    fn plan(&self, dead: usize) -> Result<LinePlan, PlanProblem> {
        let budget = LineBudget { response: self.args.response.0, ..LineBudget::of(self.config) };
        let living = self.names.get(dead..).unwrap_or_default();
        let watchdog = (!self.args.watchdog.0.is_zero())
            .then_some(WatchdogContract { timeout: self.args.watchdog.0, reaction: Reaction::Freewheel });
        let periods = Periods {
            running: self.args.period.0,
            rest: self.args.period.0,
            slow: Duration::ZERO,
            ..Periods::default()
        };
        let demand = |name: &DriveName| Demand {
            drive: name.to_string(),
            capabilities: name.family.capabilities(),
            periods,
            watchdog,
        };
        plan(budget, &living.iter().map(demand).collect::<Vec<_>>())
    }

    fn row(&self, table: &mut Table, label: &str, plan: &LinePlan, dead: usize) {
        let probes = if dead > 0 { PROBES_PPM } else { 0 };
        // What the probes take, the sweep has to do without.
        let cycle = plan.sweep * 1_000_000 / u32::try_from(1_000_000 - probes).unwrap_or(1);
        let used = (plan.utilisation_ppm + probes).min(1_000_000);
        let mute = u32::try_from(dead).unwrap_or(u32::MAX);
        table.row([
            label.to_owned(),
            milliseconds(cycle),
            milliseconds(self.args.period.0.max(cycle) + cycle),
            output::percent(used),
            output::percent(1_000_000 - used),
            milliseconds(self.stop_to_the_wire()),
            milliseconds(plan.stop_all(mute)),
            output::or_dash(plan.feed_gap.map(milliseconds)),
        ]);
    }

    /// The longest wait of a stop, once the line knows whether its adapter echoes.
    fn stop_to_the_wire(&self) -> Duration {
        let config = LineConfig { echo: Echo::Off, ..self.config.clone() };
        let words = |of: fn(&Capabilities) -> u16| {
            let most = self.names.iter().map(|name| of(name.family.capabilities())).max();
            2 * usize::from(most.unwrap_or_default())
        };
        config.worst_case_stop(
            AROUND_WRITE + words(|family| family.write_words),
            AROUND_ANSWER + words(|family| family.read_words),
        )
    }
}

fn medium(config: &LineConfig) -> String {
    match config.endpoint {
        Endpoint::ModbusTcp(_) => "Modbus TCP".to_owned(),
        _ => config.serial.to_string(),
    }
}

fn milliseconds(time: Duration) -> String {
    format!("{} ms", time.as_millis())
}
