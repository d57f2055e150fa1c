//! The figures of a line as a person reads them: one row for each, one column for each case.

use std::time::Duration;

use drive_fleet::{Feed, LinePlan, Periods};
use serde_json::{Value, json};

use super::line::{Case, PlannedLine};
use drived_words::{
    drive_spec::{self, DriveName},
    failure::Failure,
    json::microseconds,
    line_spec,
    output::{self, Table},
};

const ON_THE_WIRE: &str = "a stop is on the wire within";
const ALL_STOPPED: &str = "all have confirmed a stop within";

/// A line and its cases.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheet<'a> {
    pub(super) line: &'a PlannedLine,
    pub(super) cases: &'a [Case],
}

/// Drives that ask the same of their line.
struct Alike {
    names: Vec<(DriveName, String)>,
    periods: Periods,
    watchdog: Option<Duration>,
}

impl Sheet<'_> {
    /// Prints what the line is, its figures, and what is to be said of the cases.
    pub(super) fn say(self) -> Result<(), Failure> {
        let name = self.line.name.as_ref().map_or_else(|| "line".to_owned(), |name| format!("line {name}"));
        output::say(format_args!(
            "{name}: {} on {}; answers after {:?}, given up after {:?}",
            output::counted(self.line.drives.len(), "drive", "drives"),
            line_spec::describe(&self.line.config),
            self.line.budget.response,
            self.line.budget.response_timeout,
        ))?;
        output::say_table(self.table())?;
        for said in [self.line.until_echo_is_known(), self.line.behind_gateway()].into_iter().flatten() {
            output::say(said)?;
        }
        for case in self.cases {
            if let Some(forbidden) = &case.hypothetical {
                output::say(format_args!("{}: for comparison only, {forbidden}", case.label))?;
            }
        }
        // Why it cannot work as it is planned is what the command ends with.
        for case in self.cases.iter().skip(1) {
            if let Some(problem) = &case.forecast.problem {
                output::say(format_args!("{} it cannot work: {problem}", case.label))?;
            }
        }
        Ok(())
    }

    /// The same for a program, an object with each case.
    pub(super) fn object(self) -> Value {
        let case = |case: &Case| {
            let plan = &case.forecast.plan;
            json!({
                "case": case.label,
                "works": case.forecast.problem.is_none(),
                "problem": case.forecast.problem.as_ref().map(ToString::to_string),
                "for_comparison_only": case.hypothetical,
                "cycle_us": microseconds(plan.sweep),
                "used_ppm": plan.utilisation_ppm,
                "left_ppm": plan.left_ppm(),
                "stop_on_the_wire_us": microseconds(case.stop_to_the_wire),
                "all_stopped_us": microseconds(case.all_stopped),
            })
        };
        let drives = self.line.drives.iter().map(|(name, demand)| {
            let plan = self.cases.first().map(|case| &case.forecast.plan);
            let age = |period| {
                plan.filter(|plan| !plan.is_overloaded()).map(|plan| microseconds(plan.status_age(period)))
            };
            json!({
                "drive": name.to_string(),
                "name": demand.drive,
                "age_running_us": age(demand.periods.running),
                "age_rest_us": age(demand.periods.rest),
            })
        });
        json!({
            "line": self.line.name,
            "port": self.line.config.to_string(),
            "gateway": self.line.behind_gateway(),
            "cases": self.cases.iter().map(case).collect::<Vec<_>>(),
            "drives": drives.collect::<Vec<_>>(),
        })
    }

    fn table(self) -> Table {
        let mut table = table_of(self.cases);
        let mut row = |label: &str, cell: &dyn Fn(&Case) -> String| {
            table.cells([label.to_owned()].into_iter().chain(self.cases.iter().map(cell)));
        };
        let works = |case: &Case| if case.forecast.problem.is_none() { "yes" } else { "NO" }.to_owned();
        row("works", &works);
        row("cycle: one status of every drive", &|case| output::bound(case.forecast.plan.sweep));
        row("used by polls and watchdogs", &|case| output::percent(case.forecast.plan.utilisation_ppm));
        row("left for commands", &|case| output::percent(case.forecast.plan.left_ppm()));
        row(ON_THE_WIRE, &|case| output::bound(case.stop_to_the_wire));
        row(ALL_STOPPED, &|case| output::bound(case.all_stopped));
        for alike in self.alike() {
            row(&drive_spec::listed(&alike.names), &|_| String::new());
            let periods = alike.periods;
            let mut age = |what: String, of: &dyn Fn(&LinePlan) -> Duration| {
                row(&format!("  {what}, age up to"), &|case| match case.forecast.plan {
                    plan if plan.is_overloaded() => "no limit".to_owned(),
                    plan => output::bound(of(&plan)),
                });
            };
            if periods.running == periods.rest {
                age(format!("status every {:?}", periods.rest), &|plan| plan.status_age(periods.rest));
            } else {
                age(format!("running: status every {:?}", periods.running), &|plan| {
                    plan.status_age(periods.running)
                });
                age(format!("at rest: status every {:?}", periods.rest), &|plan| {
                    plan.status_age(periods.rest)
                });
            }
            if !periods.slow.is_zero() {
                age(format!("measurements every {:?}", periods.slow), &|plan| {
                    plan.measurements_age(periods.slow)
                });
            }
            match alike.watchdog {
                Some(timeout) => row(&format!("  watchdog of {timeout:?}, fed within"), &|case| {
                    fed(case.forecast.plan.feed(timeout))
                }),
                // How one that the file does not name is set at the drive is not known before it is read there.
                None => row("  no watchdog counted", &|_| String::new()),
            }
        }
        table
    }

    /// The drives of the line, those together that ask the same, in the order in which they were named.
    fn alike(self) -> Vec<Alike> {
        let mut all: Vec<Alike> = Vec::new();
        for (name, demand) in &self.line.drives {
            let same = |alike: &&mut Alike| {
                alike.periods == demand.periods && alike.watchdog == demand.watchdog_timeout()
            };
            match all.iter_mut().find(same) {
                Some(alike) => alike.names.push((*name, demand.drive.clone())),
                None => all.push(Alike {
                    periods: demand.periods,
                    watchdog: demand.watchdog_timeout(),
                    names: vec![(*name, demand.drive.clone())],
                }),
            }
        }
        all
    }
}

fn fed(feed: Feed) -> String {
    let within = output::bound(feed.heard_within());
    if feed.is_in_time() { within } else { format!("{within}: NO") }
}

/// A table with the cases as heads.
fn table_of(cases: &[Case]) -> Table {
    let labels = cases.iter().map(|case| case.label.clone());
    Table::headed([String::new()].into_iter().chain(labels)).with_numbers_from(1)
}

/// Prints what holds for the lines together. They work beside each other, so a stop of all is as long as that of the
/// slowest line.
pub(super) fn say_all_lines(lines: &[(&PlannedLine, Vec<Case>)]) -> Result<(), Failure> {
    let drives: usize = lines.iter().map(|(line, _)| line.drives.len()).sum();
    output::say(format_args!("all {} lines: {drives} drives", lines.len()))?;
    let mut labels: Vec<&str> = Vec::new();
    for case in lines.iter().flat_map(|(_, cases)| cases) {
        if !labels.contains(&case.label.as_str()) {
            labels.push(&case.label);
        }
    }
    let heads = [""].into_iter().chain(labels.iter().copied()).map(str::to_owned);
    let mut table = Table::headed(heads).with_numbers_from(1);
    let mut row = |label: &str, of: &dyn Fn(&Case) -> Duration| {
        // A line that does not have the case stays as it is planned.
        let slowest = |wanted: &&str| {
            let cases = lines.iter().filter_map(|(_, cases)| {
                cases.iter().find(|case| case.label == *wanted).or_else(|| cases.first())
            });
            output::bound(cases.map(of).max().unwrap_or_default())
        };
        table.cells([label.to_owned()].into_iter().chain(labels.iter().map(slowest)));
    };
    row(ON_THE_WIRE, &|case| case.stop_to_the_wire);
    row(ALL_STOPPED, &|case| case.all_stopped);
    output::say_table(table)
}
