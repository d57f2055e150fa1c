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
    time::Duration,
};

use tokio::{sync::mpsc, time};
use tracing::Level;

use self::{
    plant::Plant,
    unit::{Event, Unit},
};
use crate::{
    failure::Failure,
    output::{self, Table},
    signals::Ending,
};

/// How long the motors may take to come to a stop at the end: the longest ramp of a simulated drive is 10 s, and one
/// that restarts after a reset is mute before it.
const STOPPING: Duration = Duration::from_secs(30);

/// Events that may wait for a slow terminal; the drives do not wait for it, later ones are left out.
const WAITING: usize = 1_024;

/// Watch simulated drives of every family on one line: started, stopped, tripped, reset
///
/// Nothing real is moved. Ctrl-C (or q) stops the motors and ends it.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// End after so many seconds instead of at Ctrl-C
    #[arg(long, value_name = "N")]
    seconds: Option<u32>,
}

impl Args {
    /// The table must not be written over; plain lines may have warnings between them.
    pub(crate) fn log_level(&self) -> Option<Level> {
        (!io::stdout().is_terminal()).then_some(Level::WARN)
    }
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut ending = Ending::listen()?;
    let (events, incoming) = mpsc::channel(WAITING);
    let plant = Plant::start(&events)?;
    let until = args.seconds.map(|seconds| time::Instant::now() + Duration::from_secs(u64::from(seconds)));
    let show = Show { plant: &plant, incoming, until, ending: &mut ending };
    let why = if io::stdout().is_terminal() { screen::run(show).await? } else { plain::run(show).await? };
    farewell(&plant, why)
}

/// What the two ways of showing the demo need.
struct Show<'a> {
    plant: &'a Plant,
    incoming: mpsc::Receiver<Event>,
    until: Option<time::Instant>,
    ending: &'a mut Ending,
}

/// What the demo is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Act {
    /// Telling its story.
    Playing,
    /// Stopping the motors, until when at most.
    Stopping(Why, time::Instant),
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
        Self::Stopping(why, time::Instant::now() + STOPPING)
    }

    /// Why it is over, when it is: every motor stands, or the time for it has passed.
    fn over(self, plant: &Plant) -> Option<Why> {
        match self {
            Self::Stopping(why, at_the_latest) => {
                let stand = plant.units.iter().all(Unit::stands);
                (stand || time::Instant::now() >= at_the_latest).then_some(why)
            }
            Self::Playing => None,
        }
    }
}

/// The drives that do not stand yet, with their frequency where they tell one.
fn waited_for(plant: &Plant) -> String {
    let turning = plant.units.iter().filter(|unit| !unit.stands());
    let named = turning.map(|unit| match unit.view().status.and_then(|status| status.output_frequency) {
        Some(frequency) => format!("{} {frequency}", unit.name),
        None => format!("{} no status", unit.name),
    });
    named.collect::<Vec<_>>().join(", ")
}

/// Says how each motor was left.
fn farewell(plant: &Plant, why: Why) -> Result<(), Failure> {
    output::say(format_args!("{}: the motors were asked to stop", why.text()))?;
    let mut turning = Vec::new();
    let mut table = Table::texts();
    for unit in &plant.units {
        let view = unit.view();
        let status = view.status.map_or_else(|| "no status".to_owned(), |status| status.to_string());
        let verdict = if unit.stands() { "stands still" } else { "NOT CONFIRMED" };
        if !unit.stands() {
            turning.push(unit.name.to_string());
        }
        table.row([format!("  {}", unit.name), verdict.to_owned(), status]);
    }
    output::say_table(table)?;
    if turning.is_empty() {
        return Ok(());
    }
    Err(Failure::Drive(format!("the stop of {} is not confirmed", turning.join(", "))))
}
