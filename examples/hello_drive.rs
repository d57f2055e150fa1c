//! One drive on a line: read it, start it, change its setpoint, stop it.
//!
//! ```console
//! $ cargo run -p examples --example hello_drive                 # a simulated Altivar 312
//! $ cargo run -p examples --example hello_drive /dev/ttyUSB0    # the one at address 1, 19200 8E1: ITS MOTOR TURNS
//! ```
//!
//! Further drives of the same line are further slaves of the same `Line`: see `polling_daemon.rs`.

use std::{error::Error, time::Duration};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Drive, Frequency, SerialSettings, SlaveAddress, StopMode};
use drive_sim::{SimLine, Wiring, models};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let line = match std::env::args().nth(1) {
        Some(path) => Line::open(LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT)).await?,
        None => simulated()?,
    };
    let mut drive = Atv312::new(line.slave(1), SlaveAddress::try_from(1)?);

    println!("before:   {}", drive.status().await?);
    drive.set_setpoint(Frequency::from_hertz(20).into()).await?;
    // From here on the motor may turn, also when the start is not confirmed: whatever fails, the stop below is sent.
    let ran = run(&mut drive).await;
    println!("stopping: {}", drive.stop(StopMode::Ramp).await?);
    ran?;
    while !drive.status().await?.is_undriven() {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    println!("after:    {}", drive.status().await?);
    Ok(())
}

/// Starts the motor and watches it until it has reached its setpoint, then slows it down and watches again.
async fn run(drive: &mut impl Drive) -> drive_core::Result<()> {
    println!("started:  {}", drive.start(Direction::Forward).await?);
    for hertz in [20, 10] {
        drive.set_setpoint(Frequency::from_hertz(hertz).into()).await?;
        loop {
            tokio::time::sleep(Duration::from_millis(250)).await;
            let status = drive.status().await?;
            println!("          {status}");
            let reached = status.output_frequency == Some(Frequency::from_hertz(hertz));
            if reached || status.is_fault() {
                break;
            }
        }
    }
    Ok(())
}

/// A simulated Altivar 312 on a simulated line.
fn simulated() -> Result<Line, Box<dyn Error>> {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let plant = SimLine::new(Wiring::rtu(settings));
    plant.add(1, models::atv312::Atv312::new())?;
    Ok(Line::over(plant.in_memory(), LineConfig::stream(settings)))
}
