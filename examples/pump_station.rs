//! A pump station: three pumps into one pipe. Two share the flow at one setpoint, the third joins when they run near
//! their limit and leaves when they no longer do, and a pump that trips is replaced by the one that rests.
//!
//! ```console
//! $ cargo run -p examples --example pump_station                 # simulated: a day in half a minute, and a trip
//! $ cargo run -p examples --example pump_station /dev/ttyUSB0    # Altivar 312 at 1 to 3, 19200 8E1
//! ```

use std::{error::Error, time::Duration};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, Reaction, SerialSettings, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, EventKind, Fleet, Received, WatchdogContract};
use drive_sim::{SimLine, Wiring, models};
use tokio::time::{interval, sleep};

const PUMPS: [&str; 3] = ["pump 1", "pump 2", "pump 3"];
/// What the pipe wants, hour by hour, in hertz of all pumps together.
const DEMAND: [u16; 10] = [56, 62, 76, 96, 108, 102, 84, 72, 60, 54];
/// Two pumps run up to this; above it the third joins.
const TWO_CARRY: u16 = 90;
const HOUR: Duration = Duration::from_secs(3);

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let port = std::env::args().nth(1);
    let config = LineConfig::serial(port.clone().unwrap_or_default(), SerialSettings::MODBUS_DEFAULT);
    let config = LineConfig { response_timeout: Duration::from_millis(200), ..config };
    let line = if port.is_some() { Line::open(config).await? } else { simulated()? };

    let mut station = Fleet::builder().line("station", line.clone());
    for (name, address) in PUMPS.into_iter().zip(1..) {
        // Should this program die, each pump stops by itself after 3 s.
        let watchdog = WatchdogContract { timeout: Duration::from_secs(3), reaction: Reaction::Ramp };
        let settings = DriveSettings { watchdog: Some(watchdog), ..DriveSettings::controlled(name) };
        station =
            station.drive("station", address, settings, |port, slave| Box::new(Atv312::new(port, slave)));
    }
    let fleet = station.start()?;
    for pump in fleet.drives() {
        pump.ready(Duration::from_secs(30)).await.map_err(|reason| format!("{}: {reason}", pump.name()))?;
    }
    // Heard at any moment, also while a pump comes down its ramp.
    let end = tokio::select! {
        () = run_the_day(&fleet) => "the day is over",
        _ = tokio::signal::ctrl_c() => "Ctrl-C",
    };
    println!("{end}, all stop: {}", fleet.stop_all(StopMode::Ramp).await);
    for (drive, action) in fleet.shutdown(Duration::from_secs(30)).await {
        println!("{drive}: {action}");
    }
    line.close().await;
    Ok(())
}

/// Follows the demand until the day is over.
async fn run_the_day(fleet: &Fleet) {
    let mut events = fleet.events();
    let mut healthy = fleet.drives();
    let mut hours = DEMAND.into_iter();
    let mut clock = interval(HOUR);
    let mut demand = DEMAND[0];
    loop {
        tokio::select! {
            _ = clock.tick() => match hours.next() {
                Some(next) => demand = next,
                None => return,
            },
            received = events.recv() => match received {
                Received::Event(event) if matches!(event.kind, EventKind::Tripped(_)) => {
                    println!("{} {}", event.drive, event.kind);
                    healthy.retain(|pump| *pump.name() != event.drive);
                }
                Received::Event(_) | Received::Missed(_) => continue,
                Received::End => return,
            },
        }
        share(&healthy, demand).await;
    }
}

/// Shares the demand among as few healthy pumps as carry it, two at least, and rests the others.
async fn share(healthy: &[DriveHandle], demand: u16) {
    let wanted = if demand > TWO_CARRY { 3 } else { 2 };
    let (working, resting) = healthy.split_at(wanted.min(healthy.len()));
    let Some(pumps) = u16::try_from(working.len()).ok().filter(|pumps| *pumps > 0) else {
        return println!("no pump is left");
    };
    let each = Frequency::from_hertz((demand / pumps).min(50));
    println!("the pipe wants {demand} Hz: {pumps} pumps at {each}");
    for pump in working {
        let outcome = if pump.snapshot().started_here {
            pump.set_setpoint(each).await
        } else {
            println!("  {} joins", pump.name());
            pump.start_at(Direction::Forward, each).await
        };
        if !outcome.is_confirmed() {
            println!("  {}: {outcome}", pump.name());
        }
    }
    for pump in resting.iter().filter(|pump| pump.snapshot().started_here) {
        println!("  {} leaves: {}", pump.name(), pump.stop(StopMode::Ramp).await);
    }
}

/// Three simulated pumps; the first trips by an overcurrent in the late afternoon.
fn simulated() -> Result<Line, Box<dyn Error>> {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    for address in 1..=3 {
        simulated.add(address, models::atv312::Atv312::under_bus_control())?;
    }
    let line = Line::over(simulated.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    tokio::spawn(async move {
        sleep(HOUR * 8).await;
        if let Some(pump) = simulated.slave(1) {
            pump.trip(9);
        }
    });
    Ok(line)
}
