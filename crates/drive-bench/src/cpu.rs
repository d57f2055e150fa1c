//! Processor time of one transaction, on a pty without pacing.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use tokio::time::Instant;
use tokio_modbus::{Request, client::Client};

use crate::{
    Error,
    rig::{FIRST, QUANTITY, Rig, runtime},
    rivals, row,
    usage::time_of_master,
};

const DRIVES: u8 = 31;

/// How often each master is measured; the least is taken, because everything else on the machine only adds.
const ROUNDS: u32 = 5;

pub(crate) fn measure(time: Duration) -> Result<Vec<String>, Error> {
    let each = time / (3 * ROUNDS);
    let (mut ours, mut by_hand, mut stock) = (u64::MAX, u64::MAX, u64::MAX);
    for _ in 0..ROUNDS {
        ours = ours.min(one(async |rig: &Rig| {
            let line = Line::open(LineConfig { unpaced: true, ..rig.config() }).await?;
            // As a task, for every wake-up of the main future of a runtime costs a system call.
            let caller = line.clone();
            let reads = tokio::spawn(async move { one_after_another(&caller, each).await }).await??;
            line.close().await;
            Ok(reads)
        })?);
        by_hand = by_hand.min(one(async |rig: &Rig| rivals::by_hand(rig, DRIVES, each).await)?);
        stock = stock.min(one(async |rig: &Rig| rivals::stock(rig, DRIVES, each, false).await)?);
    }
    let micros = |nanos: u64| format!("{}.{:02} µs", nanos / 1_000, nanos % 1_000 / 10);
    let ratio = ours * 100 / by_hand.max(1);
    Ok(vec![
        row(
            "processor time per transaction: this line",
            format!("{}: {}.{:02} × the loop by hand", micros(ours), ratio / 100, ratio % 100),
            "≤ 1.15 ×",
        ),
        row("processor time per transaction: loop by hand", micros(by_hand), ""),
        row("processor time per transaction: stock tokio-modbus", micros(stock), ""),
    ])
}

/// Nanoseconds per transaction of one master on a new line.
fn one(master: impl AsyncFnOnce(&Rig) -> Result<u64, Error>) -> Result<u64, Error> {
    let rig = Rig::start(DRIVES, true)?;
    let runtime = runtime()?;
    let before = time_of_master()?;
    let reads = runtime.block_on(master(&rig))?;
    let used = time_of_master()?.saturating_sub(before);
    Ok(u64::try_from(used.as_nanos())?.checked_div(reads).unwrap_or(u64::MAX))
}

/// Reads one drive after another, as the other masters do it.
async fn one_after_another(line: &Line, time: Duration) -> Result<u64, Error> {
    let end = Instant::now() + time;
    let mut reads = 0;
    while Instant::now() < end {
        for address in 1..=DRIVES {
            line.slave(address).call(Request::ReadHoldingRegisters(FIRST, QUANTITY)).await??;
            reads += 1;
        }
    }
    Ok(reads)
}
