//! Processor time of one transaction, on a pty without pacing.

use std::time::Duration;

use drive_bus::Line;

use crate::{
    Error,
    masters::{by_hand, in_turn, stock},
    report::{Goal, Report, Unit, micros, quantile},
    rig::{DRIVES, Rig, runtime},
    simulator::Plant,
    usage::processor_time,
};

const SECTION: &str = "cpu";

/// How often each master is measured, in turn with the others. How soon an answer is there depends on whether the
/// simulator's processor has fallen asleep, and with it how often a master has to wait for it: single rounds differ by
/// a third, so that their median counts.
const ROUNDS: u32 = 21;

pub(crate) fn measure(report: &mut Report, time: Duration) -> Result<(), Error> {
    let rig = Rig::start(Plant { lines: 1, drives: DRIVES, unpaced: true })?;
    let (config, port) = (rig.config()?, rig.port()?.clone());
    let each = time / (3 * ROUNDS);
    let (mut ours, mut hand, mut others, mut ratios) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let config = config.clone();
        let our = one(async move { in_turn(Line::open(config).await?, DRIVES, each).await })?;
        let by_hand = one(by_hand(port.clone(), DRIVES, each))?;
        ratios.push(our.as_secs_f64() / by_hand.as_secs_f64());
        ours.push(our);
        hand.push(by_hand);
        others.push(one(stock(port.clone(), DRIVES, each, false))?);
    }
    for (name, mut times) in [("this line", ours), ("loop by hand", hand), ("stock tokio-modbus", others)] {
        let what = format!("processor time per transaction, {name}");
        report.note(SECTION, what, Unit::Micros, micros(quantile(&mut times, 500)));
    }
    ratios.sort_unstable_by(f64::total_cmp);
    let ratio = |per_mille: usize| {
        ratios.get((ratios.len() - 1) * per_mille / 1_000).copied().ok_or("nothing was measured")
    };
    let what = "this line by the loop by hand, median of the rounds";
    report.row(SECTION, what, Unit::Times, ratio(500)?, Goal::AtMost(1.15));
    report.note(SECTION, "… in a tenth of the rounds at most", Unit::Times, ratio(100)?);
    report.note(SECTION, "… in nine tenths of the rounds at most", Unit::Times, ratio(900)?);
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
