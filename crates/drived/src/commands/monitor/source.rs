//! Where the monitor gets what it shows: the running daemon, or a line that it has opened itself. Both speak the API.

use std::time::Duration;

use axum::Extension;
use drive_bus::Line;
use drive_fleet::{DriveSettings, Fleet, OnControlTaken, OnExit};

use super::{Args, account::Stop};
use crate::{
    api,
    client::Way,
    doors::{Caller, Rights},
    drive_spec,
    failure::Failure,
    one_drive,
    plant::Plant,
};

/// How long a stop that is under way may go on when the monitor ends with a line of its own.
const STOPPED_WITHIN: Duration = Duration::from_secs(5);

/// What a line of its own is called.
const LINE: &str = "line";

/// Who stops on a line of its own, and what else he may do: look.
fn caller() -> Caller {
    let rights = Rights { view: true, stop: true, ..Rights::NONE };
    Caller { name: "monitor".to_owned(), origin: "this program".to_owned(), rights }
}

/// Where the API is. Cheap to clone.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) way: Way,
    own: Option<Own>,
}

/// A line that belongs to this program.
#[derive(Clone)]
struct Own {
    fleet: Fleet,
    line: Line,
}

impl Source {
    /// Finds the daemon, or opens the line. Nothing is written by it.
    ///
    /// # Errors
    ///
    /// There is no daemon; or the line cannot be opened.
    pub(super) async fn open(args: &Args) -> Result<Self, Failure> {
        let Some(line) = &args.line else {
            let daemon = args.daemon.connect().await?;
            return Ok(Self { way: daemon.way().clone(), own: None });
        };
        let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
        let names = drive_spec::on_one_line(&args.drives).map_err(|error| input(&error))?;
        let options = args.options.of(&names)?;
        let config = line.config(&names).map_err(|error| input(&error))?;
        let line = one_drive::open_line(config).await?;
        let mut builder = Fleet::builder().whatever_the_plan().line(LINE, line.clone());
        for name in names {
            builder = builder.drive(LINE, name.slave.number(), watched(name.to_string()), |port, slave| {
                name.family.open_with(port, slave, &options)
            });
        }
        Ok(Self::over(builder.start().map_err(|error| input(&error))?, line))
    }

    /// A fleet on a line of its own.
    fn over(fleet: Fleet, line: Line) -> Self {
        let plant = Plant::start(fleet.clone(), Vec::new(), false);
        let router = api::router(plant).layer(Extension(caller()));
        Self { way: Way::here(router), own: Some(Own { fleet, line }) }
    }

    /// Whether it is a line of its own.
    pub(super) const fn is_own(&self) -> bool {
        self.own.is_some()
    }

    /// Lets a stop through. A line of its own is only read until somebody stops a motor on it.
    pub(super) fn allow(&self, stop: &Stop) {
        let Some(Own { fleet, .. }) = &self.own else { return };
        for drive in fleet.drives() {
            let is_meant = match stop {
                Stop::All => true,
                Stop::One(name) => **drive.name() == **name,
            };
            let settings = drive.settings();
            if is_meant && !settings.control {
                // The same settings but for this are none that contradict themselves.
                let _ = fleet.reconfigure(DriveSettings { control: true, ..DriveSettings::clone(&settings) });
            }
        }
    }

    /// Ends what is its own. A stop that is under way goes on for a moment.
    pub(super) async fn close(self) {
        if let Some(Own { fleet, line }) = self.own {
            // Whoever stopped a motor has been told what came of it.
            let _ = fleet.shutdown(STOPPED_WITHIN).await;
            one_drive::close(&line).await;
        }
    }
}

/// Settings of a drive that is only read: nothing that it does by itself makes anybody write to it, also once it may be
/// stopped.
fn watched(name: String) -> DriveSettings {
    DriveSettings {
        on_control_taken: OnControlTaken::Report,
        on_exit: OnExit::Leave,
        ..DriveSettings::watched(name)
    }
}
