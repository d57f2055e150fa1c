//! What a plan promises, a fleet over a simulated line keeps. In virtual time.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, Reaction, SerialSettings};
use drive_families::Family;
use drive_fleet::{
    Demand, DriveHandle, DriveSettings, Fleet, Forecast, GroupStart, LineBudget, Periods, Until,
    WatchdogContract, forecast,
};
use drive_sim::{SimLine, Wiring, models::atv312::Atv312};
use drive_testing::witness::Witnesses;
use tokio::time::{Instant, sleep, timeout_at};

const SECOND: Duration = Duration::from_secs(1);

const PERIODS: Periods = Periods {
    running: Duration::from_millis(1_500),
    rest: Duration::from_secs(2),
    slow: Duration::from_secs(60),
    max_age: Duration::from_secs(6),
};

/// The longest time from one status of a drive to its next, and from one slow set to its next.
async fn longest_gaps(drive: DriveHandle, end: Instant) -> (Duration, Duration) {
    let mut snapshots = drive.watch();
    let mut last: Option<(Instant, Instant)> = None;
    let mut longest = (Duration::ZERO, Duration::ZERO);
    while let Ok(Ok(())) = timeout_at(end, snapshots.changed()).await {
        let snapshot = snapshots.look();
        let (Some(status), Some(slow)) = (&snapshot.status, &snapshot.measurements) else { continue };
        if let Some((status_before, slow_before)) = last {
            longest = (longest.0.max(status.at - status_before), longest.1.max(slow.at - slow_before));
        }
        last = Some((status.at, slow.at));
    }
    longest
}

#[tokio::test(start_paused = true)]
async fn no_value_of_31_drives_grows_older_than_planned_also_with_three_of_them_dead() {
    let family = Family::ATV312;
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let config = LineConfig {
        response_timeout: Duration::from_millis(200),
        ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
    };
    let budget = LineBudget::of(&config);
    let line = Line::over(simulated.in_memory(), config);
    let mut builder = Fleet::builder().line("north", line.clone());
    let mut demands = Vec::new();
    let mut machines = Vec::new();
    let watchdog = Some(WatchdogContract { timeout: 10 * SECOND, reaction: Reaction::Ramp });
    for number in 1..=31 {
        machines.push(simulated.add(number, Atv312::under_bus_control()).expect("the address is free"));
        let name = format!("fan {number}");
        let capabilities = family.capabilities();
        demands.push(Demand {
            drive: name.clone(),
            capabilities,
            watchdog_capability: capabilities.watchdog,
            periods: PERIODS,
            watchdog,
        });
        let settings = DriveSettings { periods: PERIODS, watchdog, ..DriveSettings::controlled(name) };
        builder = builder.drive("north", number, settings, |port, slave| family.open(port, slave));
    }
    let fleet = builder.start().expect("it is planned to work");
    let _witnesses = Witnesses::of_fleet(&fleet, [("north", &simulated)]);
    for drive in fleet.drives() {
        drive.ready(120 * SECOND).await.expect("it gets ready");
    }
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(40).into()),
        spacing: Duration::ZERO,
        until: Until::AtReference,
    };
    fleet.all().start(start).await.expect("all start");

    for dead in [0, 3] {
        let Forecast { plan, problem } = forecast(budget, &demands, dead);
        assert_eq!(problem, None);
        machines.iter().take(dead).for_each(drive_sim::SimSlave::mute);
        // Until the line has found out, and every drive had its slow set.
        sleep(120 * SECOND).await;
        let (end, busy) = (Instant::now() + 600 * SECOND, line.stats().busy);
        let living = fleet.drives().into_iter().skip(dead);
        let watched: Vec<_> = living.map(|drive| tokio::spawn(longest_gaps(drive, end))).collect();
        for gaps in watched {
            let (status, slow) = gaps.await.expect("it ends");
            assert!(status >= PERIODS.running && slow >= PERIODS.slow, "{dead} dead: {status:?} {slow:?}");
            assert!(status <= plan.status_age(PERIODS.running), "{dead} dead: {status:?}");
            assert!(slow <= plan.measurements_age(PERIODS.slow), "{dead} dead: {slow:?}");
        }
        let used = (line.stats().busy - busy).as_micros() / 600;
        assert!(used <= u128::from(plan.utilisation_ppm), "{dead} dead: {used} ppm of {plan:?}");
    }
    assert_eq!(simulated.violations(), []);
}
