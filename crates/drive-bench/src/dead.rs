//! The sweep of the living drives with dead ones on the line.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::serial::SerialSettings;

use crate::{
    Error,
    masters::sweeps,
    report::{Goal, Report, Unit, millis},
    rig::{DRIVES, Rig, runtime},
    simulator::{Order, Plant},
    virtual_line::{found, sweep},
};

const SECTION: &str = "dead";

const DEAD: [u8; 3] = [3, 14, 25];

/// How many are lost where it is measured how soon they are found.
const LOST: u8 = 20;

/// What the dead may cost.
const GOAL: Goal = Goal::AtMost(1.02);

/// Until the dead are known to be dead they cost their timeouts, once.
const SETTLE: Duration = Duration::from_secs(5);

/// A question that nobody answers: request, 50 ms, the characters of the answer that does not come, silence.
const SHORT_QUESTION: Duration = Duration::from_micros(68_623);

/// The time that is measured in virtual time.
const HOUR: Duration = Duration::from_secs(3_600);

pub(crate) fn measure(report: &mut Report, time: Duration) -> Result<(), Error> {
    // Both at the same time, so that the machine is as busy for one as for the other.
    let mut rig = Rig::start(Plant { lines: 2, drives: DRIVES, unpaced: false })?;
    rig.order(&Order::Mute { line: 1, drives: DEAD.to_vec() })?;
    let all: Vec<u8> = (1..=DRIVES).collect();
    let living: Vec<u8> = all.iter().copied().filter(|drive| !DEAD.contains(drive)).collect();
    let (without, with) = runtime()?.block_on(async {
        let mut measurements = Vec::new();
        for (config, slaves) in rig.configs().zip([living.clone(), all]) {
            let offline_after = LineConfig::serial("", SerialSettings::MODBUS_DEFAULT).offline_after;
            let line = Line::open(LineConfig { offline_after, ..config }).await?;
            measurements.push(tokio::spawn(async move {
                let mean = sweeps(&line, &slaves, &DEAD, SETTLE, time).await;
                line.close().await;
                mean
            }));
        }
        let mut means = Vec::new();
        for measurement in measurements {
            means.push(measurement.await??);
        }
        match means[..] {
            [without, with] => Ok::<_, Error>((without, with)),
            _ => Err("two lines were asked for".into()),
        }
    })?;
    describe(report, "real time", without, with);

    let without = sweep(&living, &[], SETTLE, HOUR)?;
    let with = sweep(&living, &DEAD, SETTLE, HOUR)?;
    describe(report, "an hour of virtual time", without, with);

    let found = found(DRIVES, LOST)?;
    let two_sweeps = without / u32::try_from(living.len())? * 2 * u32::from(DRIVES - LOST);
    let goal = two_sweeps + SHORT_QUESTION * u32::from(LOST);
    for (what, time, goal) in [
        ("20 of 31 never answered: the last of the living has told its status after", found.living, goal),
        (
            "20 of 31 lost and back together: the last of them has after",
            found.together,
            Duration::from_secs(5),
        ),
        ("one of 20 that are lost comes back alone: it has after", found.alone, Duration::from_secs(12)),
    ] {
        let what = format!("{what}, virtual time");
        report.row(SECTION, what, Unit::Millis, millis(time), Goal::AtMost(millis(goal)));
    }
    Ok(())
}

fn describe(report: &mut Report, how: &str, without: Duration, with: Duration) {
    report.note(SECTION, format!("sweep of 28 drives, {how}"), Unit::Millis, millis(without));
    report.note(SECTION, format!("sweep of 31 drives with 3 dead, {how}"), Unit::Millis, millis(with));
    let ratio = with.as_secs_f64() / without.as_secs_f64();
    report.row(SECTION, format!("the latter by the former, {how}"), Unit::Times, ratio, GOAL);
}
