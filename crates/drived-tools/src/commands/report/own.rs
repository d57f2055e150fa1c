//! A daemon for as long as the report takes: it watches one line that the command line describes, and writes nothing.

use std::time::Duration;

use axum::Extension;
use drive_bus::Line;
use drive_fleet::{DriveHandle, Fleet, Link, Periods};
use tokio::time::{Instant, sleep_until};

use drived_client::{Way, own_line};
use drived_config::config::{LinePart, add};
use drived_doors::{Caller, Rights};
use drived_http::api;
use drived_plant::plant::Plant;
use drived_words::{drive_options::OptionArgs, drive_spec::DriveName, failure::Failure, line_spec::LineSpec};

/// What such a line is called.
pub(super) const LINE: &str = "line";

/// How often its drives are asked: what is left of the line is for their parameters.
const PERIODS: Periods = Periods {
    running: Duration::from_secs(2),
    rest: Duration::from_secs(2),
    slow: Duration::from_secs(10),
    max_age: Duration::from_secs(10),
};

/// How long the drives have to tell everything once.
const TOLD_WITHIN: Duration = Duration::from_secs(20);

/// The line, and the way to the API of its drives.
pub(super) struct Own {
    line: Line,
    pub(super) way: Way,
}

impl Own {
    /// Opens a line and watches its drives for this long, and until each has told everything or shown that it will not.
    pub(super) async fn watch(
        line: &LineSpec,
        options: &OptionArgs,
        names: &[DriveName],
        time: Duration,
    ) -> Result<Self, Failure> {
        let options = options.of(names)?;
        let config = line.config(names).map_err(|error| Failure::Input(error.to_string()))?;
        let part = LinePart::watched(LINE, config, names, &options, PERIODS);
        let line = own_line::open_line(part.config.clone()).await?;
        Self::over(line, &part, time).await
    }

    /// The same on a line that is open.
    pub(super) async fn over(line: Line, part: &LinePart, time: Duration) -> Result<Self, Failure> {
        let begun = Instant::now();
        // Drives that do not fit are shown as they are: nobody plans the line here.
        let builder = Fleet::builder().whatever_the_plan();
        let builder = builder.line_with(&*part.name, line.clone(), |_| part.budget);
        let builder = part
            .drives
            .iter()
            .fold(builder, |builder, drive| add(builder, part, drive, drive_fleet::Left::default()));
        let fleet = builder.start().map_err(|error| Failure::Input(error.to_string()))?;
        let plant = Plant::start(fleet.clone(), Vec::new(), false);
        for drive in fleet.drives() {
            told(&drive, begun + TOLD_WITHIN).await;
        }
        sleep_until(begun + time).await;
        let reader = Caller::new("report", "this program", Rights { view: true, ..Rights::NONE });
        Ok(Self { line, way: Way::here(api::router(plant).layer(Extension(reader))) })
    }

    /// Lets the line go.
    pub(super) async fn close(self) {
        own_line::close(&self.line).await;
    }
}

/// Waits until a drive has told everything, or does not answer.
async fn told(drive: &DriveHandle, until: Instant) {
    let whole = drive.wait_until(|seen| {
        let silent = seen.link != Link::Connected && seen.counters.failures > 0;
        silent || (seen.measurements.is_some() && seen.self_restarts.is_some())
    });
    let _ = tokio::time::timeout_at(until, whole).await;
}
