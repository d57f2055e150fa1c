//! Many lines in one process, each at the full speed of its wire.

use std::time::Duration;

use drive_bus::Line;
use drive_core::serial::SerialSettings;
use tokio::time::sleep;

use crate::{
    Error,
    masters::{lawful_by_hand, open, saturate},
    report::{Goal, Report, Unit, micros, millis},
    rig::{DRIVES, Rig},
    simulator::{Counted, Order, Plant},
    usage::{memory_kib, processor_time},
};

const SECTION: &str = "lines";

/// What each line should reach.
const GOAL: f64 = 0.97;

/// Until all lines are open and their timeouts learned.
const SETTLE: Duration = Duration::from_secs(3);

pub(crate) fn measure(report: &mut Report, time: Duration, lines: u16) -> Result<(), Error> {
    let mut rig = Rig::start(Plant { lines, drives: DRIVES, unpaced: false })?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let before = memory_kib()?;
    let masters: Vec<Line> = runtime.block_on(async {
        let mut masters = Vec::new();
        for config in rig.configs() {
            masters.push(Line::open(config).await?);
        }
        Ok::<_, Error>(masters)
    })?;
    let polls: Vec<_> = masters
        .iter()
        .map(|line| {
            let line = line.clone();
            runtime.spawn(async move { saturate(&line, DRIVES, SETTLE + time).await })
        })
        .collect();
    runtime.block_on(async { sleep(SETTLE).await });
    let simulated_before = rig.order(&Order::Take)?.processor_time;
    let own_before = processor_time();
    runtime.block_on(async { sleep(time).await });
    let own = processor_time().saturating_sub(own_before);
    let memory = memory_kib()?.saturating_sub(before);
    let taken = rig.order(&Order::Take)?;
    runtime.block_on(async {
        for poll in polls {
            poll.await??;
        }
        for line in masters {
            line.close().await;
        }
        Ok::<_, Error>(())
    })?;

    let counted = taken.counted;
    let number = counted.len().max(1);
    let whole: Vec<f64> = counted.iter().map(Counted::utilisation).collect();
    let without: Vec<f64> = counted.iter().map(Counted::own_utilisation).collect();
    let mean = |shares: &[f64]| shares.iter().sum::<f64>() / number as f64;
    let least = |shares: &[f64]| shares.iter().copied().fold(f64::INFINITY, f64::min);
    let goal = Goal::AtLeast(GOAL);
    report.row(SECTION, format!("{lines} lines: utilisation, mean"), Unit::Share, mean(&whole), goal);
    report.row(SECTION, format!("{lines} lines: utilisation, the least"), Unit::Share, least(&whole), goal);
    let what = format!("{lines} lines: without the simulator's own lateness, mean");
    report.row(SECTION, what, Unit::Share, mean(&without), goal);
    let what = format!("{lines} lines: without the simulator's own lateness, the least");
    report.row(SECTION, what, Unit::Share, least(&without), goal);

    let requests: u64 = counted.iter().map(|line| line.requests).sum();
    let violations: u64 = counted.iter().map(|line| line.violations).sum();
    let shortest = counted.iter().filter_map(|line| line.shortest_silence).min().unwrap_or_default();
    let what = format!(
        "{lines} lines: silences shorter than {:.3} ms in {requests} reads (the shortest {:.3} ms)",
        millis(SerialSettings::MODBUS_DEFAULT.t3_5()),
        millis(shortest)
    );
    report.row(SECTION, what, Unit::Count, violations as f64, Goal::AtMost(0.0));

    let per_line = memory as f64 / number as f64;
    let what = format!("{lines} lines: memory of a line with {DRIVES} polls");
    report.row(SECTION, what, Unit::KiB, per_line, Goal::AtMost(200.0));
    let each = |used: Duration| micros(used) / requests.max(1) as f64;
    report.note(SECTION, "processor time per transaction, the lines", Unit::Micros, each(own));
    let simulated = taken.processor_time.saturating_sub(simulated_before);
    report.note(SECTION, "processor time per transaction, the simulator", Unit::Micros, each(simulated));
    let cores = |used: Duration| used.as_secs_f64() / time.as_secs_f64();
    report.note(SECTION, "processors in use, the lines", Unit::Times, cores(own));
    report.note(SECTION, "processors in use, the simulator", Unit::Times, cores(simulated));
    drop(rig);
    by_hand(report, time, lines, mean(&whole), each(own))
}

/// As many loops that do nothing else, on as many ports, beside `whole` and the processor time of lines.
fn by_hand(report: &mut Report, time: Duration, lines: u16, whole: f64, own: f64) -> Result<(), Error> {
    let mut rig = Rig::start(Plant { lines, drives: DRIVES, unpaced: false })?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let loops: Vec<_> = rig
        .ports()
        .iter()
        .cloned()
        .map(|port| runtime.spawn(async move { lawful_by_hand(open(&port)?, DRIVES, SETTLE + time).await }))
        .collect();
    runtime.block_on(async { sleep(SETTLE).await });
    let _while_settling = rig.order(&Order::Take)?;
    let before = processor_time();
    runtime.block_on(async { sleep(time).await });
    let used = processor_time().saturating_sub(before);
    let counted = rig.order(&Order::Take)?.counted;
    runtime.block_on(async {
        for each in loops {
            each.await??;
        }
        Ok::<_, Error>(())
    })?;
    let number = counted.len().max(1) as f64;
    let mean = |share: fn(&Counted) -> f64| counted.iter().map(share).sum::<f64>() / number;
    let requests: u64 = counted.iter().map(|line| line.requests).sum();
    let each = micros(used) / requests.max(1) as f64;
    let name = |what: &str| format!("{lines} loops by hand: {what}");
    report.note(SECTION, name("utilisation, mean"), Unit::Share, mean(Counted::utilisation));
    let own_share = mean(Counted::own_utilisation);
    report.note(SECTION, name("without the simulator's own lateness, mean"), Unit::Share, own_share);
    report.note(SECTION, name("processor time per transaction"), Unit::Micros, each);
    let name = |what: &str| format!("{lines} lines by as many loops by hand: {what}");
    report.note(SECTION, name("utilisation, mean"), Unit::Times, whole / mean(Counted::utilisation));
    report.note(SECTION, name("processor time per transaction"), Unit::Times, own / each);
    Ok(())
}
