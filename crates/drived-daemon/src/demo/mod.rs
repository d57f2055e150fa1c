//! `drived demo`: simulated drives of every family on simulated lines, driven through a story, in real time.

mod meter;
mod plain;
mod plant;
mod screen;
mod story;
mod table;
mod unit;

use std::{
    io::{self, IsTerminal},
    path::PathBuf,
    time::Duration,
};

use drive_families::Family;
use drive_fleet::{Events, ExitAction};
use tokio::time;
use tracing::Level;

use self::plant::Plant;
use drived_doors::{
    Doors,
    config::{DoorsConfig, Http},
};
use drived_http::{api, metrics, page};
use drived_words::{
    failure::Failure,
    output::{self, Table},
    signals::Ending,
    values,
};

/// How long the motors may take to come to a stop at the end: the longest ramp of a simulated drive is 10 s, and one
/// that restarts after a reset is mute before it.
const STOPPING: Duration = Duration::from_secs(30);

/// Watch simulated drives of every family on one line: started, stopped, tripped, reset
///
/// Nothing real is moved. Ctrl-C (or q) stops the motors and ends it.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// End after so many seconds instead of at Ctrl-C
    #[arg(long, value_name = "N")]
    seconds: Option<u32>,
    /// A family to be shown, such as v20; may be given several times. Without it all are, but for those of drives from files
    #[arg(long = "family", value_name = "FAMILY")]
    families: Vec<Family>,
    /// Where the page and the API are served: an address and a port, or off
    #[arg(long, value_name = "ADDRESS", default_value_t)]
    http: Http,
    /// A control socket, for the commands without a line
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
}

impl Args {
    /// The table must not be written over, and where there is none the events are told already.
    pub fn log_level(&self) -> Option<Level> {
        (!io::stdout().is_terminal()).then_some(Level::ERROR)
    }
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let page = match args.http {
        Http::At(address) => format!("page: http://{address}/"),
        Http::Off => "without a page".to_owned(),
    };
    let doors = Doors::prepare(DoorsConfig::of_demo(args.socket).with(Some(args.http), None)?)?;
    let mut ending = Ending::listen()?;
    let families = if args.families.is_empty() { usual() } else { args.families };
    let plant = Plant::start(families)?;
    let groups = plant.groups();
    let faces = drived_plant::plant::Plant::start(plant.fleet.clone(), groups, true);
    let router = api::demo_router(faces.clone(), plant.stage()).merge(page::router());
    let doors = doors.open(metrics::serve(router, faces, Vec::new()), api::stops());
    let incoming = plant.fleet.events();
    let until = args.seconds.map(|seconds| time::Instant::now() + Duration::from_secs(u64::from(seconds)));
    let show = Show { plant: &plant, page, incoming, until, ending: &mut ending };
    let why = if io::stdout().is_terminal() { screen::run(show).await? } else { plain::run(show).await? };
    doors.close().await;
    farewell(&plant, why)
}

/// Those that are shown to somebody who names none: those from files would fill the lines.
fn usual() -> Vec<Family> {
    Family::all().into_iter().filter(|family| family.revision().is_none()).collect()
}

/// What the two ways of showing the demo need.
struct Show<'a> {
    plant: &'a Plant,
    /// Where its page is, in words.
    page: String,
    incoming: Events,
    until: Option<time::Instant>,
    ending: &'a mut Ending,
}

/// What the demo is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Act {
    /// Telling its story.
    Playing,
    /// Stopping the motors.
    Stopping(Why),
}

/// Why the demo ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Why {
    TimeIsUp,
    Asked,
}

impl Why {
    fn text(self) -> &'static str {
        match self {
            Self::TimeIsUp => "the time is up",
            Self::Asked => "Ctrl-C",
        }
    }
}

impl Act {
    /// Begins to stop the motors.
    fn stop(plant: &Plant, why: Why) -> Self {
        plant.stop();
        Self::Stopping(why)
    }

    /// Why it is over, when it is.
    fn over(self, plant: &Plant) -> Option<Why> {
        match self {
            Self::Stopping(why) => plant.actions().map(|_| why),
            Self::Playing => None,
        }
    }
}

/// The drives that do not stand yet, with their frequency where they tell one.
fn waited_for(plant: &Plant) -> String {
    let turning = plant.units.iter().filter(|unit| !unit.stands());
    let named = turning.map(|unit| match unit.status().and_then(|status| status.output_frequency) {
        Some(frequency) => format!("{} {frequency}", unit.name),
        None => format!("{} no status", unit.name),
    });
    named.collect::<Vec<_>>().join(", ")
}

/// Says how each motor was left.
fn farewell(plant: &Plant, why: Why) -> Result<(), Failure> {
    output::say(format_args!("{}: the motors were asked to stop", why.text()))?;
    let actions = plant.actions().unwrap_or_default();
    let mut turning = Vec::new();
    let mut table = Table::texts();
    for unit in &plant.units {
        let status = unit.status().map_or_else(|| "no status".to_owned(), |status| status.to_string());
        let action =
            actions.iter().find(|(name, _)| **name == *unit.name.to_string()).map(|(_, action)| action);
        let verdict = match action {
            Some(ExitAction::Left) if unit.stands() => values::stopped(unit.status().as_deref()),
            Some(ExitAction::Left) => "left as it is",
            Some(ExitAction::Stopped(outcome)) if outcome.is_confirmed() => {
                values::stopped(unit.status().as_deref())
            }
            _ => {
                turning.push(unit.name.to_string());
                "NOT CONFIRMED"
            }
        };
        table.row([format!("  {}", unit.name), verdict.to_owned(), status]);
    }
    output::say_table(table)?;
    if turning.is_empty() {
        return Ok(());
    }
    Err(Failure::Drive(format!("the stop of {} is not confirmed", turning.join(", "))))
}
