//! Other masters on the same line.

use std::time::Duration;

use drive_bus::exchange::rtu;
use drive_core::serial::SerialSettings;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    time::Instant,
};
use tokio_modbus::{Slave, client, prelude::*};
use tokio_serial::{Parity, SerialPortBuilderExt, SerialStream};

use crate::{
    Error,
    rig::{FIRST, QUANTITY, Rig},
};

fn open(rig: &Rig) -> Result<SerialStream, Error> {
    Ok(tokio_serial::new(rig.port(), 19_200).parity(Parity::Even).open_native_async()?)
}

/// The stock tokio-modbus client, which keeps no silence by itself, with a `sleep(t3.5)` before each request or none.
/// How many reads it made.
pub(crate) async fn stock(rig: &Rig, drives: u8, time: Duration, silence: bool) -> Result<u64, Error> {
    let mut context = client::rtu::attach(open(rig)?);
    let end = Instant::now() + time;
    let mut reads = 0;
    while Instant::now() < end {
        for slave in 1..=drives {
            context.set_slave(Slave(slave));
            if silence {
                tokio::time::sleep(SerialSettings::MODBUS_DEFAULT.t3_5()).await;
            }
            context.read_holding_registers(FIRST, QUANTITY).await??;
            reads += 1;
        }
    }
    Ok(reads)
}

/// A loop written by hand for this one request: the least that a tokio program can do.
pub(crate) async fn by_hand(rig: &Rig, drives: u8, time: Duration) -> Result<u64, Error> {
    let mut port = open(rig)?;
    let end = Instant::now() + time;
    let [a1, a0] = FIRST.to_be_bytes();
    let mut answer = [0; 5 + 2 * QUANTITY as usize];
    let mut reads = 0;
    while Instant::now() < end {
        for slave in 1..=drives {
            port.write_all(&rtu::frame(slave, &[3, a1, a0, 0, QUANTITY as u8])).await?;
            tokio::time::timeout(Duration::from_millis(500), port.read_exact(&mut answer)).await??;
            if !rtu::is_frame(&answer) {
                return Err("a damaged answer on a line without faults".into());
            }
            reads += 1;
        }
    }
    Ok(reads)
}
