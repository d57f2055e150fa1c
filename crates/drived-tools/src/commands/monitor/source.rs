//! Where the monitor gets what it shows: the running daemon, or a line that it has opened itself. Both speak the API.

use std::time::Duration;

use axum::Extension;
use drive_bus::Line;
use drive_families::Options;
use drive_fleet::{DriveSettings, Fleet, FleetError, OnControlTaken, OnExit, Periods};

use super::{Args, account::Stop};
use drived_client::{Way, own_line};
use drived_doors::{Caller, Rights};
use drived_http::api;
use drived_plant::plant::Plant;
use drived_words::{
    drive_spec::{self, DriveName},
    failure::Failure,
};

/// How long a stop that is under way may go on when the monitor ends with a line of its own.
const STOPPED_WITHIN: Duration = Duration::from_secs(5);

/// What a line of its own is called.
const LINE: &str = "line";

/// Who stops on a line of its own, and what else he may do: look.
fn caller() -> Caller {
    let rights = Rights { view: true, stop: true, ..Rights::NONE };
    Caller::new("monitor", "this program", rights)
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
        Self::over(own_line::open_line(config).await?, &names, &options)
    }

    /// Drives on an open line.
    fn over(line: Line, names: &[DriveName], options: &Options) -> Result<Self, Failure> {
        let mut builder = Fleet::builder().whatever_the_plan().line(LINE, line.clone());
        for name in names {
            builder = builder.drive(LINE, name.slave.number(), watched(name.to_string()), |port, slave| {
                name.family.open_with(port, slave, options)
            });
        }
        let input = |error: FleetError| Failure::Input(error.to_string());
        let fleet = builder.start().map_err(input)?;
        // As often as the line can, with room for the slow values.
        let sweep = fleet.plan(LINE).map(|plan| plan.sweep).unwrap_or_default();
        for drive in fleet.drives() {
            let settings = DriveSettings::clone(&drive.settings());
            fleet.reconfigure(DriveSettings { periods: periods(2 * sweep), ..settings }).map_err(input)?;
        }
        let plant = Plant::start(fleet.clone(), Vec::new(), false);
        let router = api::router(plant).layer(Extension(caller()));
        Ok(Self { way: Way::here(router), own: Some(Own { fleet, line }) })
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
            own_line::close(&line).await;
        }
    }
}

/// The usual periods, or longer ones where a line with many drives needs so long for each.
fn periods(least: Duration) -> Periods {
    let Periods { running, rest, slow, max_age } = Periods::default();
    Periods {
        running: running.max(least),
        rest: rest.max(least),
        slow: slow.max(4 * least),
        max_age: max_age.max(3 * least),
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

#[cfg(test)]
mod tests {
    use drive_bus::LineConfig;
    use drive_core::{Direction, Frequency, SlaveAddress};
    use drive_families::{Family, SetUp, simulated};
    use drive_sim::{SimLine, SimSlave, Wiring};
    use drive_testing::witness::Witnesses;
    use serde_json::json;
    use tokio::{sync::mpsc, time::sleep};

    use super::{
        super::{account::Progress, model::News, stopping},
        *,
    };
    use drived_plant::plant::commands::OutcomeWord;

    /// How often anything was written to it.
    fn writes(machine: &SimSlave) -> u64 {
        [0x05, 0x06, 0x0F, 0x10, 0x16, 0x17].into_iter().map(|function| machine.requests(function)).sum()
    }

    #[tokio::test(start_paused = true)]
    async fn a_line_of_its_own_is_only_read_whatever_its_drives_do_until_somebody_stops_them() {
        for family in Family::all() {
            let settings = family.capabilities().factory;
            let simulated = SimLine::new(Wiring::rtu(settings));
            let machines = [1, 2].map(|slave| {
                simulated.add_boxed(slave, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap()
            });
            let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
            let names =
                [1, 2].map(|slave| DriveName { family, slave: SlaveAddress::try_from(slave).unwrap() });
            // Somebody else has started the motors, and has gone.
            let builder = Fleet::builder().whatever_the_plan().line("line", line.clone());
            let builder = names.iter().fold(builder, |builder, name| {
                let settings = DriveSettings::controlled(name.to_string());
                builder.drive("line", name.slave.number(), settings, |port, slave| {
                    family.open_with(port, slave, &simulated::options())
                })
            });
            let other = builder.start().unwrap();
            let witnesses = Witnesses::of_fleet(&other, [("line", &simulated)]);
            for drive in other.drives() {
                let _ = drive.ready(Duration::from_secs(20)).await;
                let held = drive.set_setpoint(Frequency::from_hertz(20)).await;
                let started = drive.start(Direction::Forward).await;
                assert!(held.is_confirmed() && started.is_confirmed(), "{family}: {held} {started}");
            }
            drop((witnesses, other));
            let before = machines.each_ref().map(writes);
            let source = Source::over(line, &names, &simulated::options()).unwrap();
            sleep(Duration::from_secs(60)).await;
            let [one, two] = &machines;
            assert!(one.observe().running && two.observe().running, "{family}: their watchdogs are fed");
            two.trip(family.simulated_trip().unwrap());
            sleep(Duration::from_secs(60)).await;
            let mut daemon = source.way.connect().await.unwrap();
            let start = format!("/api/v1/drives/{}/start", names[0]);
            assert_eq!(daemon.post(&start, &json!({})).await.unwrap().status.as_u16(), 403, "{family}");
            assert_eq!(machines.each_ref().map(writes), before, "{family}");

            let (told, mut progress) = mpsc::unbounded_channel();
            stopping::carry_out(source, 1, Stop::One(names[0].to_string()), told).await;
            let mut last = None;
            while let Some(News::Stop { progress, .. }) = progress.recv().await {
                last = Some(progress);
            }
            let Some(Progress::Answer(answer)) = last else { panic!("{family}: {last:?}") };
            assert_eq!(answer.outcome, OutcomeWord::Confirmed, "{family}: {answer:?}");
            assert!(!one.observe().running, "{family}");
            assert_eq!(writes(two), before[1], "{family}: the other one was not meant");
        }
    }
}
