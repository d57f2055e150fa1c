//! The demo where stdout is no terminal: one line for each event, and the line's numbers now and then.

use std::time::Duration;

use drive_fleet::Received;
use tokio::time::{self, Instant};

use super::{
    Act, STOPPING, Show, Why,
    meter::{self, Meter},
    plant::Plant,
    waited_for,
};
use drived_words::{failure::Failure, output};

/// Between two looks at the plant.
const LOOK: Duration = Duration::from_millis(100);

/// Between two reports of the line's numbers.
const REPORT: Duration = Duration::from_secs(5);

pub(super) async fn run(show: Show<'_>) -> Result<Why, Failure> {
    let Show { plant, page, mut incoming, until, ending } = show;
    output::say(&page)?;
    let began = Instant::now();
    let seconds = |at: Instant| at.saturating_duration_since(began).as_millis();
    let mut meters: Vec<Meter> = plant.lines.iter().map(|_| Meter::new()).collect();
    let mut looks = time::interval(LOOK);
    let mut reports = time::interval_at(Instant::now() + REPORT, REPORT);
    let mut act = Act::Playing;
    loop {
        tokio::select! {
            Received::Event(event) = incoming.recv() => {
                let at = seconds(event.at);
                output::say(format_args!("{:>3}.{:03} {:<12} {}", at / 1_000, at % 1_000, event.drive, event.kind))?;
            }
            () = ending.asked() => match act {
                Act::Playing => act = stop(plant, Why::Asked)?,
                Act::Stopping(why) => return Ok(why),
            },
            _ = looks.tick() => {
                for (meter, line) in meters.iter_mut().zip(&plant.lines) {
                    meter.look(plant, line, Instant::now());
                }
                if act == Act::Playing && until.is_some_and(|until| Instant::now() >= until) {
                    act = stop(plant, Why::TimeIsUp)?;
                }
                if let Some(why) = act.over(plant) {
                    return Ok(why);
                }
            }
            _ = reports.tick() => {
                if act != Act::Playing {
                    output::say(format_args!("        waiting for {}", waited_for(plant)))?;
                    continue;
                }
                for (meter, line) in meters.iter().zip(&plant.lines) {
                    output::say(format_args!("        {}", meter::sentence(meter.cells(line))))?;
                }
            }
        }
    }
}

fn stop(plant: &Plant, why: Why) -> Result<Act, Failure> {
    output::say(format_args!("        {}: stopping the motors, waiting {STOPPING:?} at most", why.text()))?;
    Ok(Act::stop(plant, why))
}
