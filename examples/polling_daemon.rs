//! A service that polls many drives on one line and reacts: five conveyors, one behind the other. When one of them
//! no longer runs (it tripped, it went mute, somebody stopped it), those that feed it are stopped.
//!
//! ```console
//! $ cargo run -p examples --example polling_daemon                 # simulated; the fourth conveyor trips
//! $ cargo run -p examples --example polling_daemon /dev/ttyUSB0    # Altivar 312 at 1 to 5, 19200 8E1; only ever stops
//! ```

use std::{error::Error, time::Duration};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig, Slave};
use drive_core::{
    Direction, Drive, ErrorKind, Frequency, SerialSettings, SlaveAddress, State, Status, StopMode,
};
use drive_sim::{SimLine, Wiring, models};
use tokio::{
    sync::{mpsc, watch},
    time,
};

/// The conveyors by their address; material runs from the first to the last.
const CONVEYORS: std::ops::RangeInclusive<u8> = 1..=5;

const POLL_PERIOD: Duration = Duration::from_millis(200);

/// What a conveyor's task tells.
struct Report {
    conveyor: u8,
    text: String,
    /// It ran and no longer does, or nobody knows.
    halted: bool,
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let line = match std::env::args().nth(1) {
        Some(path) => Line::open(LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT)).await?,
        None => simulated().await?,
    };
    let (reports, mut incoming) = mpsc::channel(64);
    // The conveyor that halted; those before it must not feed it.
    let (halted, _) = watch::channel(0);
    for conveyor in CONVEYORS {
        let drive = Atv312::new(line.slave(conveyor), SlaveAddress::try_from(conveyor)?);
        tokio::spawn(run_conveyor(drive, halted.subscribe(), reports.clone()));
    }
    loop {
        tokio::select! {
            _ = tokio::signal::ctrl_c() => break,
            Some(report) = incoming.recv() => {
                println!("conveyor {}: {}", report.conveyor, report.text);
                if report.halted && report.conveyor > *halted.borrow() {
                    println!("conveyor {} no longer takes material: stopping those before it", report.conveyor);
                    halted.send_replace(report.conveyor);
                }
            }
        }
    }
    // The tasks end with the runtime. What runs goes on: this service watches, it does not command the plant.
    println!("no longer watching; utilisation of the line: {} ppm", line.stats().utilisation_ppm());
    Ok(())
}

/// Polls one conveyor, reports what changes, and stops it when one behind it has halted.
async fn run_conveyor(
    mut drive: Atv312<Slave>,
    mut halted: watch::Receiver<u8>,
    reports: mpsc::Sender<Report>,
) {
    let conveyor = drive.slave().number();
    let mut ticks = time::interval(POLL_PERIOD);
    let mut before = None;
    loop {
        let status = tokio::select! {
            Ok(()) = halted.changed() => {
                let blocked = *halted.borrow_and_update() > conveyor;
                if !blocked || !matches!(before, Some(State::Running | State::Unknown)) {
                    continue;
                }
                stop(&mut drive).await
            }
            _ = ticks.tick() => drive.status().await,
        };
        // A drive that does not answer counts as halted, and is told once.
        let state = status.as_ref().map_or(State::Unknown, |status| status.state);
        if before == Some(state) {
            continue;
        }
        let mut text = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        if state.is_fault()
            && let Ok(faults) = drive.faults().await
        {
            for fault in faults.present {
                text = format!("{text}; {fault}; {}", fault.remedy().unwrap_or("see the manual"));
            }
        }
        let halted = before == Some(State::Running) && state != State::Running;
        before = Some(state);
        if reports.send(Report { conveyor, text, halted }).await.is_err() {
            return;
        }
    }
}

/// Between two attempts of a stop.
const STOP_PAUSE: Duration = Duration::from_millis(100);

/// A stop is repeated until the drive confirms it, or until the line takes the drive for dead.
async fn stop(drive: &mut Atv312<Slave>) -> drive_core::Result<Status> {
    loop {
        match drive.stop(StopMode::Ramp).await {
            // A drive that refuses at once is given time to do otherwise.
            Err(error) if error.kind() != ErrorKind::NotSent => time::sleep(STOP_PAUSE).await,
            outcome => return outcome.map(|stopped| stopped.status),
        }
    }
}

/// A simulated plant in which somebody has started all conveyors, and in which the fourth trips after three seconds.
async fn simulated() -> Result<Line, Box<dyn Error>> {
    let plant = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let line = Line::over(plant.in_memory_precise(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    for conveyor in CONVEYORS {
        plant.add(conveyor, models::atv312::Atv312::new())?;
        let mut drive = Atv312::new(line.slave(conveyor), SlaveAddress::try_from(conveyor)?);
        drive.set_setpoint(Frequency::from_hertz(40).into()).await?;
        drive.start(Direction::Forward).await?;
    }
    tokio::spawn(async move {
        time::sleep(Duration::from_secs(3)).await;
        if let Some(fourth) = plant.slave(4) {
            fourth.trip(OVERLOAD);
        }
    });
    Ok(line)
}

/// The Altivar 312's code of a motor overload (OLF).
const OVERLOAD: u16 = 17;
