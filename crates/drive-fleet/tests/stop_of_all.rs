//! A stop of all: in which order it is given and told. In a program of its own, because whether a place logs is remembered for the whole
//! process.

use std::{
    fmt::Debug,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, Fleet, GroupStart, Until};
use drive_sim::{SimLine, Wiring, models::atv312};
use tracing::field::{Field, Visit};

const LINES: usize = 3;
const DRIVES: u8 = 4;
/// What the log of a line says of a stop.
const IS_THERE: &str = "a stop is in the queue of its line";

/// Counts the stops that lines have, and of how many drives something was told while others had none.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Seen>>);

#[derive(Default)]
struct Seen {
    drives: Vec<DriveHandle>,
    given: usize,
    told_before: usize,
}

impl tracing::Subscriber for Log {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        *metadata.level() <= tracing::Level::DEBUG && metadata.target().starts_with("drive_bus")
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::Id {
        tracing::Id::from_u64(1)
    }

    fn record(&self, _: &tracing::Id, _: &tracing::span::Record<'_>) {}

    fn record_follows_from(&self, _: &tracing::Id, _: &tracing::Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        let mut said = Said(String::new());
        event.record(&mut said);
        if said.0 == IS_THERE {
            let mut seen = self.0.lock().unwrap();
            seen.given += 1;
            if seen.given <= seen.drives.len() {
                let is_told = |drive: &&DriveHandle| drive.snapshot().stop.is_some();
                seen.told_before += seen.drives.iter().filter(is_told).count();
            }
        }
    }

    fn enter(&self, _: &tracing::Id) {}

    fn exit(&self, _: &tracing::Id) {}
}

struct Said(String);

impl Visit for Said {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

async fn running() -> (Fleet, Vec<SimLine>) {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let (mut builder, mut sites) = (Fleet::builder(), Vec::new());
    for number in 0..LINES {
        let site = SimLine::new(Wiring::rtu(settings));
        let name = format!("line {number}");
        builder = builder.line(name.clone(), Line::over(site.in_memory(), LineConfig::stream(settings)));
        for slave in 1..=DRIVES {
            site.add(slave, atv312::Atv312::under_bus_control()).unwrap();
            let drive = DriveSettings::controlled(format!("{number}/{slave}"));
            builder = builder.drive(&name, slave, drive, |port, slave| Box::new(Atv312::new(port, slave)));
        }
        sites.push(site);
    }
    let fleet = builder.start().unwrap();
    for drive in fleet.drives() {
        drive.ready(Duration::from_secs(10)).await.unwrap();
    }
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(30).into()),
        spacing: Duration::ZERO,
        until: Until::AtReference,
    };
    fleet.all().start(start).await.unwrap();
    (fleet, sites)
}

async fn seen(stop: impl AsyncFnOnce(&Fleet)) -> (usize, usize) {
    let log = Log::default();
    let _guard = tracing::subscriber::set_default(log.clone());
    let (fleet, _sites) = running().await;
    log.0.lock().unwrap().drives = fleet.drives();
    stop(&fleet).await;
    let seen = log.0.lock().unwrap();
    (seen.given, seen.told_before)
}

#[tokio::test(start_paused = true)]
async fn every_drive_has_its_stop_on_its_line_before_anything_is_told_of_any() {
    let stop = async |fleet: &Fleet| assert!(fleet.stop_all(StopMode::Ramp).await.is_confirmed());
    let (given, told_before) = seen(stop).await;
    assert!(given >= LINES * usize::from(DRIVES), "{given}");
    assert_eq!(told_before, 0);
}

#[tokio::test(start_paused = true)]
async fn at_the_end_of_the_program_every_drive_has_its_stop_on_its_line_before_anything_is_told_of_any() {
    let stop = async |fleet: &Fleet| drop(fleet.shutdown(Duration::from_secs(60)).await);
    let (given, told_before) = seen(stop).await;
    assert!(given >= LINES * usize::from(DRIVES), "{given}");
    assert_eq!(told_before, 0);
}
