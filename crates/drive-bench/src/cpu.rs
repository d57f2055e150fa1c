//! Processor time of one transaction, on a pty without pacing.

use std::time::Duration;

use drive_bus::Line;

use crate::{
    Error,
    masters::{by_hand, in_turn, stock},
    report::{Goal, Report, Unit, micros},
    rig::{DRIVES, Rig, runtime},
    simulator::Plant,
    usage::processor_time,
};

const SECTION: &str = "cpu";

/// How often each master is measured, in turn with the others.
const ROUNDS: u32 = 5;

pub(crate) fn measure(report: &mut Report, time: Duration) -> Result<(), Error> {
    let rig = Rig::start(Plant { lines: 1, drives: DRIVES, unpaced: true })?;
    let (config, port) = (rig.config()?, rig.port()?.clone());
    let each = time / (3 * ROUNDS);
    let (mut ours, mut hand, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let config = config.clone();
        ours.push(one(async move { in_turn(Line::open(config).await?, DRIVES, each).await })?);
        hand.push(one(by_hand(port.clone(), DRIVES, each))?);
        others.push(one(stock(port.clone(), DRIVES, each, false))?);
    }
    // The least of each: everything else on the machine only adds.
    let [ours, hand, others] = [ours, hand, others].map(|times| times.into_iter().min().unwrap_or_default());
    report.note(SECTION, "processor time per transaction, this line", Unit::Micros, micros(ours));
    report.note(SECTION, "processor time per transaction, loop by hand", Unit::Micros, micros(hand));
    report.note(SECTION, "processor time per transaction, stock tokio-modbus", Unit::Micros, micros(others));
    let ratio = ours.as_secs_f64() / hand.as_secs_f64();
    report.row(SECTION, "this line by the loop by hand", Unit::Times, ratio, Goal::AtMost(1.15));
    Ok(())
}

/// Processor time per transaction of one master, all threads of this process, the kernel's work for it included.
fn one(master: impl Future<Output = Result<u64, Error>> + Send + 'static) -> Result<Duration, Error> {
    let runtime = runtime()?;
    let before = processor_time();
    // As a task: every wake-up of the main future of a runtime costs a system call more.
    let reads = runtime.block_on(async { tokio::spawn(master).await? })?;
    let used = processor_time().saturating_sub(before);
    Ok(used / u32::try_from(reads)?.max(1))
}
