//! One drive on a plain tokio-modbus context: read it, start it, change its setpoint, stop it.
//!
//! ```console
//! $ cargo run -p examples --example hello_drive                 # a simulated Altivar 312
//! $ cargo run -p examples --example hello_drive /dev/ttyUSB0    # the one at address 1, 19200 8E1: ITS MOTOR TURNS
//! ```
//!
//! A plain context is enough for one drive on its own line. For several drives, or a line with other slaves, take
//! `drive_bus::Line`: see `polling_daemon.rs`.

use std::{error::Error, time::Duration};

use drive_atv312::Atv312;
use drive_core::{Direction, Drive, Frequency, SerialSettings, SlaveAddress, StopMode};
use drive_sim::{SimLine, Wiring, models};
use tokio_modbus::{
    Slave,
    client::{Context, rtu},
};
use tokio_serial::{Parity, SerialPortBuilderExt};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let context = match std::env::args().nth(1) {
        Some(path) => {
            let port = tokio_serial::new(path, 19_200).parity(Parity::Even).open_native_async()?;
            rtu::attach_slave(port, Slave(1))
        }
        None => simulated()?,
    };
    let mut drive = Atv312::new(context, SlaveAddress::try_from(1)?);

    println!("before:   {}", drive.status().await?);
    drive.set_setpoint(Frequency::from_hertz(20).into()).await?;
    // From here on the motor may turn, also when the start is not confirmed: whatever fails, the stop below is sent.
    let ran = run(&mut drive).await;
    println!("stopping: {}", drive.stop(StopMode::Ramp).await?);
    ran?;
    while !drive.status().await?.is_standstill() {
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

/// A simulated Altivar 312 on a simulated line, behind the same kind of context.
fn simulated() -> Result<Context, Box<dyn Error>> {
    let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    line.add(1, models::atv312::Atv312::new())?;
    Ok(rtu::attach_slave(line.in_memory(), Slave(1)))
}
