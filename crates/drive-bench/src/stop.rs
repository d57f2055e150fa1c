//! The wait of a Stop behind saturated polling: from the call to the first bit on the wire, as the simulator sees it.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Class, Terms, serial::SerialSettings};
use drive_sim::{Fault, Faults};
use tokio::time::{Instant, sleep};
use tokio_modbus::{Request, client::Client};

use crate::{
    Error, machine,
    masters::{READ, saturate},
    report::{Goal, Report, Unit, micros, millis, quantile},
    rig::{DRIVES, QUANTITY, Rig, exchange, runtime, virtual_runtime},
    simulator::{Logged, Order, Plant, TURNAROUND, populated},
    usage,
};

const SECTION: &str = "stop";

/// CMD of the ATV312 and its word "shutdown" (its manual, DRIVECOM).
const CMD: u16 = 8_501;
const SHUTDOWN: u16 = 6;
const STOP: Request<'static> = Request::WriteSingleRegister(CMD, SHUTDOWN);
const WRITE: u8 = 6;

/// What the host may add.
const HOST: Duration = Duration::from_micros(200);

/// Measured at the same time: one Stop takes some 60 ms, and a thousandth needs thousands.
const LINES: u16 = 8;

/// More than one Stop of each drive takes.
const ROUND: Duration = Duration::from_secs(4);

/// PDU of the longest answer.
const ANSWER: usize = 2 + 2 * QUANTITY as usize;

pub(crate) fn measure(report: &mut Report, time: Duration, transactions: u64) -> Result<(), Error> {
    healthy(report, time)?;
    machine::alone(report, SECTION, LINES, time)?;
    sick(report, transactions)
}

/// Behind polls that are all answered.
fn healthy(report: &mut Report, time: Duration) -> Result<(), Error> {
    let mut rig = Rig::start(Plant { lines: LINES, drives: DRIVES, unpaced: false })?;
    let bound = rig.config()?.worst_case_stop(5, ANSWER);
    let calls = runtime()?.block_on(async {
        let mut stops = Vec::new();
        for (number, config) in rig.configs().enumerate() {
            let line = Line::open(config).await?;
            stops.push(tokio::spawn(async move {
                let polls = {
                    let line = line.clone();
                    // To the last Stop there is something to wait behind.
                    tokio::spawn(async move { saturate(&line, DRIVES, time + ROUND).await })
                };
                let calls = call_stops(&line, time, number as u64).await?;
                polls.await??;
                line.close().await;
                Ok::<_, Error>(calls)
            }));
        }
        let mut calls = Vec::new();
        for stop in stops {
            calls.push(stop.await??);
        }
        Ok::<_, Error>(calls)
    })?;
    let logs = rig.order(&Order::Log)?.logs;
    let (mut waits, mut added) = (Vec::new(), Vec::new());
    for (calls, log) in calls.iter().zip(&logs) {
        for (wait, beyond) in compare(calls, log) {
            waits.push(wait);
            added.push(beyond);
        }
    }
    let count = waits.len();
    let mut wait = |per_mille| millis(quantile(&mut waits, per_mille));
    let goal = Goal::AtMost(millis(exchange(TURNAROUND) + SerialSettings::MODBUS_DEFAULT.t3_5() + HOST));
    report.note(SECTION, format!("wait of {count} Stops: p50"), Unit::Millis, wait(500));
    report.note(SECTION, "wait of a Stop: p99", Unit::Millis, wait(990));
    let what = "wait of a Stop: p99.9, against one whole exchange + t3.5 + 0.2 ms";
    report.row(SECTION, what, Unit::Millis, wait(999), goal);
    let what = "wait of a Stop: worst, against worst_case_stop()";
    report.row(SECTION, what, Unit::Millis, wait(1_000), Goal::AtMost(millis(bound)));
    let name = "beyond the exchange in flight and t3.5";
    let mut beyond = |per_mille| micros(quantile(&mut added, per_mille));
    report.note(SECTION, format!("{name}: p50"), Unit::Micros, beyond(500));
    report.note(SECTION, format!("{name}: p99"), Unit::Micros, beyond(990));
    report.row(SECTION, format!("{name}: p99.9"), Unit::Micros, beyond(999), Goal::AtMost(micros(HOST)));
    report.note(SECTION, format!("{name}: worst"), Unit::Micros, beyond(1_000));
    Ok(())
}

/// Calls one Stop after another, of one drive after another. When each was called.
async fn call_stops(line: &Line, time: Duration, number: u64) -> Result<Vec<Duration>, Error> {
    let end = Instant::now() + time;
    let mut calls = Vec::new();
    let mut pause = number + 1;
    while Instant::now() < end {
        for drive in 1..=DRIVES {
            // No multiple of the line's cycle, so that the calls fall everywhere inside an exchange.
            pause = pause * 31 % 97;
            sleep(Duration::from_micros(20_000 + 331 * pause)).await;
            let mut slave = line.slave(drive).with_terms(Terms::of(Class::Stop));
            calls.push(usage::monotonic());
            slave.call(STOP).await??;
        }
    }
    Ok(calls)
}

/// Of each Stop, the wait until its first bit, and how much of it is neither the exchange that was in flight nor the
/// silence behind it. The log may have forgotten the first ones.
fn compare(calls: &[Duration], log: &[Logged]) -> Vec<(Duration, Duration)> {
    let busy = exchange(TURNAROUND) + SerialSettings::MODBUS_DEFAULT.t3_5();
    let stops = log.windows(2).rev().filter_map(|pair| match pair {
        [before, stop] if stop.function == WRITE => Some((before, stop)),
        _ => None,
    });
    calls
        .iter()
        .rev()
        .zip(stops)
        // The answer of another Stop is shorter than that of a read.
        .filter(|(_, (before, _))| before.function != WRITE)
        .map(|(&called, (before, stop))| {
            let earliest = called.max(before.at + busy);
            (stop.at.saturating_sub(called), stop.at.saturating_sub(earliest))
        })
        .collect()
}

/// Behind dead drives and every fault, in virtual time: the bound holds there too.
fn sick(report: &mut Report, transactions: u64) -> Result<(), Error> {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let config = LineConfig::stream(settings);
    let bound = config.worst_case_stop(5, ANSWER);
    let stops = transactions / 20;
    let mut waits = virtual_runtime()?.block_on(async {
        let simulated = populated(DRIVES, false)?;
        let faults =
            [Fault::Lost, Fault::Flipped, Fault::Truncated, Fault::Late, Fault::Noise, Fault::Foreign];
        let seeded = faults.into_iter().fold(Faults::seeded(1), |faults, fault| faults.with(fault, 20_000));
        simulated.set_faults(seeded);
        for dead in [3, 14, 25] {
            simulated.slave(dead).ok_or("no such drive")?.mute();
        }
        let line = Line::over(simulated.in_memory(), config);
        let polls: Vec<_> = (1..=DRIVES)
            .map(|drive| {
                let mut slave = line.slave(drive);
                tokio::spawn(async move {
                    loop {
                        if slave.call(READ).await.is_err() {
                            sleep(Duration::from_millis(20)).await;
                        }
                    }
                })
            })
            .collect();
        let mut waits = Vec::new();
        let mut stop = line.slave(1).with_terms(Terms::of(Class::Stop));
        let watched = simulated.slave(1).ok_or("no such drive")?;
        for number in 0..stops {
            sleep(Duration::from_micros(100_000 + number * 7_919 % 100_000)).await;
            let (called, before) = (Instant::now(), watched.requests(WRITE));
            // Whether it is confirmed is another matter: the wire has it in time or not.
            let _ = stop.call(STOP).await;
            let taken = watched.received();
            let first =
                taken.iter().find(|request| request.at >= called && request.pdu.first() == Some(&WRITE));
            if watched.requests(WRITE) > before
                && let Some(first) = first
            {
                waits.push(first.at - called - settings.characters(8));
            }
        }
        polls.iter().for_each(tokio::task::JoinHandle::abort);
        line.close().await;
        Ok::<_, Error>(waits)
    })?;
    let what = format!("wait of {} Stops with 3 drives dead and faults, virtual time: p99.9", waits.len());
    report.note(SECTION, what, Unit::Millis, millis(quantile(&mut waits, 999)));
    let what = "with 3 drives dead and faults, virtual time: worst, against worst_case_stop()";
    report.row(SECTION, what, Unit::Millis, millis(quantile(&mut waits, 1_000)), Goal::AtMost(millis(bound)));
    Ok(())
}
