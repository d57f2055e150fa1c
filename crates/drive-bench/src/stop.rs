//! The wait of a Stop behind saturated polling.

use std::time::Duration;

use drive_bus::Line;
use drive_core::{Class, Terms, serial::SerialSettings};
use tokio::time::{Instant, sleep};
use tokio_modbus::{Request, client::Client};

use crate::{
    Error, millis,
    rig::{QUANTITY, Rig, TURNAROUND, runtime},
    row,
    utilisation::saturate,
};

const DRIVES: u8 = 31;

/// CMD of the ATV312 and its word "shutdown" (its manual, DRIVECOM).
const CMD: u16 = 8_501;
const SHUTDOWN: u16 = 6;

/// What the host may add.
const HOST: Duration = Duration::from_micros(200);

pub(crate) fn measure(time: Duration) -> Result<Vec<String>, Error> {
    let rig = Rig::start(DRIVES, false)?;
    let config = rig.config();
    let answer = 2 + 2 * usize::from(QUANTITY);
    let bound = config.worst_case_stop(5, answer);
    let wait = runtime()?.block_on(async {
        let line = Line::open(config).await?;
        let stops = tokio::spawn({
            let line = line.clone();
            async move {
                let end = Instant::now() + time;
                let mut slave = line.slave(1).with_terms(Terms::of(Class::Stop));
                let mut pause = 1;
                while Instant::now() < end {
                    // No multiple of the line's cycle, so that the calls fall everywhere inside an exchange.
                    pause = pause * 31 % 97;
                    sleep(Duration::from_millis(30 + pause)).await;
                    slave.call(Request::WriteSingleRegister(CMD, SHUTDOWN)).await??;
                }
                Ok::<_, Error>(())
            }
        });
        saturate(&line, DRIVES, time).await?;
        stops.await??;
        let wait = line.stats().class(Class::Stop).wait.clone();
        line.close().await;
        Ok::<_, Error>(wait)
    })?;
    let serial = SerialSettings::MODBUS_DEFAULT;
    let exchange = serial.characters(8) + TURNAROUND + serial.characters(answer + 3);
    let goal = exchange + serial.t3_5() + HOST;
    Ok(vec![
        row(
            format!("wait of a Stop, {} of them: p50 / p99", wait.count()),
            format!("{} / {}", millis(wait.quantile(500)), millis(wait.quantile(990))),
            "",
        ),
        row(
            "wait of a Stop: p99.9",
            format!("{} (to an eighth)", millis(wait.quantile(999))),
            &format!("≤ {}: one exchange + t3.5 + 0.2 ms", millis(goal)),
        ),
        row("wait of a Stop: worst", millis(wait.max()), &format!("≤ {}: worst_case_stop()", millis(bound))),
    ])
}
