//! Utilisation: the shortest time that the exchanges can take, by the time they took.

use std::time::Duration;

use drive_bus::{Line, Slave};
use drive_core::serial::SerialSettings;
use drive_sim::LineStats;
use tokio::time::Instant;
use tokio_modbus::{Request, client::Client};

use crate::{
    Error, millis,
    rig::{FIRST, QUANTITY, Rig, runtime},
    rivals, row, share,
};

const DRIVES: u8 = 31;

/// Polls one slave until `end`. How many reads were answered.
pub(crate) async fn poll(mut slave: Slave, end: Instant) -> Result<u64, Error> {
    let mut reads = 0;
    while Instant::now() < end {
        slave.call(Request::ReadHoldingRegisters(FIRST, QUANTITY)).await??;
        reads += 1;
    }
    Ok(reads)
}

/// Polls every slave of a line as fast as it answers. How many reads were answered.
pub(crate) async fn saturate(line: &Line, drives: u8, time: Duration) -> Result<u64, Error> {
    let end = Instant::now() + time;
    let polls: Vec<_> = (1..=drives).map(|slave| tokio::spawn(poll(line.slave(slave), end))).collect();
    let mut reads = 0;
    for poll in polls {
        reads += poll.await??;
    }
    Ok(reads)
}

pub(crate) fn measure(time: Duration) -> Result<Vec<String>, Error> {
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    let mut rows = Vec::new();

    let rig = Rig::start(DRIVES, false)?;
    let stats = runtime()?.block_on(async {
        let line = Line::open(rig.config()).await?;
        saturate(&line, DRIVES, time / 10).await?;
        let _warming_up = rig.line.take_stats();
        tokio::spawn({
            let line = line.clone();
            async move { saturate(&line, DRIVES, time).await }
        })
        .await??;
        let stats = line.stats();
        line.close().await;
        Ok::<_, Error>(stats)
    })?;
    let seen = rig.line.take_stats();
    drop(rig);
    rows.extend(describe("this line", &seen, t3_5, "≥ 0.9950, none too short"));
    rows.push(row(
        "this line: late behind its silence, mean / p50 / p99",
        format!(
            "{} / {} / {}",
            millis(stats.lag.mean()),
            millis(stats.lag.quantile(500)),
            millis(stats.lag.quantile(990))
        ),
        "",
    ));

    for (name, silence) in
        [("stock tokio-modbus, sleep(t3.5)", true), ("stock tokio-modbus, no silence", false)]
    {
        let rig = Rig::start(DRIVES, false)?;
        runtime()?.block_on(rivals::stock(&rig, DRIVES, time / 2, silence))?;
        rows.extend(describe(name, &rig.line.take_stats(), t3_5, ""));
    }
    Ok(rows)
}

/// The simulator's own lateness is taken out of the second number: a real drive's is its turnaround.
fn describe(name: &str, seen: &LineStats, t3_5: Duration, goal: &str) -> Vec<String> {
    let taken = seen.first.zip(seen.last).map_or(t3_5, |(first, last)| last - first + t3_5);
    let ppm =
        |time: Duration| (seen.ideal.as_nanos() * 1_000_000).checked_div(time.as_nanos()).unwrap_or_default();
    let (whole, without) = (ppm(taken) as u64, ppm(taken.saturating_sub(seen.lag)) as u64);
    vec![
        row(format!("{name}: utilisation over {} reads", seen.requests), share(whole), goal),
        row(format!("{name}: without the simulator's own lateness"), share(without), ""),
        row(
            format!("{name}: silences shorter than {}", millis(t3_5)),
            format!("{} (shortest {})", seen.violations, millis(seen.shortest_silence.unwrap_or_default())),
            if goal.is_empty() { "" } else { "0" },
        ),
    ]
}
