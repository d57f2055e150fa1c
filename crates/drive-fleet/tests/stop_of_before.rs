//! A stop that was not confirmed when its program ended: the next one gives it as soon as the drive can be heard again.

use std::time::Duration;

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, Fleet, RunKept, RunRecord};
use drive_sim::{SimLine, Wiring, models::atv312};
use tokio::{
    sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel},
    time::{Instant, sleep},
};

/// `SLL`, what an Altivar 312 does when its watchdog is over (manual of its parameters): 0, it ignores it.
const SLL: u16 = 7010;
/// A question in vain takes half a second, and what is asked for a stop a fifth of the line.
const SOON: Duration = Duration::from_secs(4);

fn fleet(
    site: &SimLine,
    before: Option<RunRecord>,
    runs: UnboundedSender<RunKept>,
) -> (Fleet, DriveHandle, Line) {
    let line = Line::over(site.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let settings = DriveSettings { run_before: before, ..DriveSettings::controlled("pump") };
    let open = |port, slave| Box::new(Atv312::new(port, slave)) as _;
    let builder = Fleet::builder().keep_runs(runs).line("north", line.clone());
    // Others are polled on the same line, so that it is never idle.
    let other = DriveSettings::watched("other");
    let fleet = builder.drive("north", 1, settings, open).drive("north", 2, other, open).start();
    let fleet = fleet.expect("it starts");
    let pump = fleet.drive("pump").expect("it is there");
    (fleet, pump, line)
}

/// The record of the stop that is owed, from what is kept.
async fn owed(kept: &mut UnboundedReceiver<RunKept>) -> RunRecord {
    loop {
        let one = kept.recv().await.expect("the fleet keeps it");
        let record = one.run.clone().filter(|run| run.stop.is_some());
        one.kept();
        if let Some(record) = record {
            return record;
        }
    }
}

/// How long the motor runs on behind the cable's return, of which the next program has heard nothing for so long.
async fn runs_on(away: Duration) -> Duration {
    let site = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let [machine, _other] = [1, 2].map(|at| site.add(at, atv312::Atv312::under_bus_control()).unwrap());
    assert!(machine.poke(SLL, 0));
    let (runs, mut kept) = unbounded_channel();
    let (first, pump, line) = fleet(&site, None, runs);
    let keeping = tokio::spawn(async move { (owed(&mut kept).await, kept) });
    pump.ready(Duration::from_secs(10)).await.unwrap();
    let started = pump.run(Direction::Forward, Frequency::from_hertz(30)).await;
    assert!(started.is_confirmed(), "{started}");
    machine.mute();
    drop(pump.stop(StopMode::Ramp));
    let (record, _kept) = keeping.await.unwrap();
    line.close().await;
    drop((first, pump));

    let (runs, _kept) = unbounded_channel();
    let (_second, _pump, _line) = fleet(&site, Some(record), runs);
    sleep(away).await;
    assert!(machine.observe().running);
    let back = Instant::now();
    machine.unmute();
    machine.wait_until(|machine| !machine.running).await;
    back.elapsed()
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_before_waits_for_no_probe_of_a_drive_that_is_off_line() {
    for away in [5, 17, 25, 40] {
        let runs_on = runs_on(Duration::from_secs(away)).await;
        assert!(runs_on < SOON, "away for {away} s: it runs on for {runs_on:?}");
    }
}
