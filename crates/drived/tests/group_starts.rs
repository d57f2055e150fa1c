//! A whole line of drives started as one group, over a simulated line in virtual time.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, Setpoint, StopMode};
use drive_families::Family;
use drive_fleet::{
    DriveSettings, Fleet, GroupFailure, GroupStart, GroupStarted, IdentityCheck, Outcome, Periods, Refused,
    Until,
};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312::Atv312};
use drive_testing::witness::Witnesses;
use tokio::{
    task::{JoinHandle, JoinSet},
    time::{Instant, sleep},
};

const SECOND: Duration = Duration::from_secs(1);
const DRIVES: u8 = 31;

/// These often and no older, which the plan of a full line at 19200 bit/s allows.
const fn periods(period: u64, max_age: u64) -> Periods {
    let (period, max_age) = (Duration::from_millis(period), Duration::from_millis(max_age));
    Periods { running: period, rest: period, slow: Duration::from_secs(60), max_age }
}

struct FullLine {
    fleet: Fleet,
    machines: Vec<SimSlave>,
    _witnesses: Witnesses,
}

impl FullLine {
    /// 31 drives without a watchdog contract, ready.
    async fn ready(periods: Periods) -> Self {
        let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
        let line = Line::over(simulated.in_memory(), config);
        let mut builder = Fleet::builder().line("north", line.clone());
        let mut machines = Vec::new();
        for number in 1..=DRIVES {
            machines.push(simulated.add(number, Atv312::under_bus_control()).expect("the address is free"));
            let settings = DriveSettings { periods, ..DriveSettings::controlled(format!("fan {number}")) };
            builder =
                builder.drive("north", number, settings, |port, slave| Family::ATV312.open(port, slave));
        }
        let fleet = builder.start().expect("it is planned to work");
        let _witnesses = Witnesses::of_fleet(&fleet, [("north", &simulated)]);
        for drive in fleet.drives() {
            drive.ready(Duration::MAX).await.expect("it gets ready");
            drive.wait_until(|snapshot| matches!(snapshot.identity, IdentityCheck::Same(_))).await;
        }
        Self { fleet, machines, _witnesses }
    }

    fn running(&self) -> usize {
        self.machines.iter().filter(|machine| machine.observe().running).count()
    }

    /// How often any drive of the line was lost since the fleet began.
    fn lost(&self) -> u64 {
        self.fleet.drives().iter().map(|drive| drive.snapshot().counters.lost).sum()
    }
}

const fn start(setpoint: Option<Setpoint>, spacing: Duration) -> GroupStart {
    GroupStart { direction: Direction::Forward, setpoint, spacing, until: Until::InForce }
}

#[tokio::test(start_paused = true)]
async fn a_full_line_starts_as_one_group_and_no_drive_is_lost_meanwhile() {
    let setpoint = Some(Setpoint::from(Frequency::from_hertz(40)));
    for (period, max_age) in [(1_000, 3_000), (1_500, 6_000), (10_000, 30_000)] {
        for (setpoint, spacing) in
            [(setpoint, Duration::ZERO), (None, Duration::ZERO), (setpoint, Duration::from_millis(1))]
        {
            let what = format!("every {period} ms, {max_age} ms, {setpoint:?}, spacing {spacing:?}");
            let line = FullLine::ready(periods(period, max_age)).await;
            let begun = Instant::now();
            let started = line.fleet.all().start(start(setpoint, spacing)).await;
            started.unwrap_or_else(|failure| panic!("{what}: {failure}"));
            println!("{what}: started in {:?}", begun.elapsed());
            assert_eq!((line.running(), line.lost()), (usize::from(DRIVES), 0), "{what}");
        }
    }
}

/// A group start of the full line under way, with these of its machines running, and a watch on every other for the
/// case that it runs at any time.
async fn under_way(line: &FullLine, running: usize) -> (JoinHandle<GroupStarted>, JoinSet<()>) {
    let group = line.fleet.all();
    let setpoint = Some(Setpoint::from(Frequency::from_hertz(40)));
    let starting = tokio::spawn(async move { group.start(start(setpoint, Duration::from_millis(1))).await });
    let (first, others) = line.machines.split_at(running);
    for machine in first {
        machine.wait_until(|machine| machine.running).await;
    }
    let mut watched = JoinSet::new();
    for machine in others {
        let machine = machine.clone();
        watched.spawn(async move {
            machine.wait_until(|machine| machine.running).await;
        });
    }
    (starting, watched)
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_comes_while_a_group_starts_keeps_the_rest_from_ever_starting() {
    let line = FullLine::ready(periods(1_500, 6_000)).await;
    let (starting, mut ran) = under_way(&line, 5).await;
    let called = Instant::now();
    let stopped = line.fleet.stop_all(StopMode::Freewheel).await;
    assert!(stopped.is_confirmed(), "{stopped}");
    let bound = line.fleet.plan("north").expect("it is a line").stop_all(0);
    assert!(called.elapsed() <= bound, "{:?}", called.elapsed());
    let failure = starting.await.expect("it ends").expect_err("a stop came");
    assert!(matches!(&failure, GroupFailure::Failed { stopped, .. } if stopped.is_confirmed()), "{failure}");
    sleep(60 * SECOND).await;
    assert_eq!((ran.try_join_next().is_none(), line.running()), (true, 0));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_stopped_before_its_turn_is_not_started_when_it_comes_and_the_group_stops() {
    let line = FullLine::ready(periods(1_500, 6_000)).await;
    let (starting, _ran) = under_way(&line, 2).await;
    let last = line.fleet.drive("fan 31").expect("it is there");
    assert!(last.stop(StopMode::Ramp).await.is_confirmed());
    let machine = line.machines.last().expect("it is there").clone();
    let ran = tokio::spawn(async move { machine.wait_until(|machine| machine.running).await });
    let failure = starting.await.expect("it ends").expect_err("one was stopped");
    let GroupFailure::Failed { outcomes, stopped } = failure else { panic!("{failure}") };
    assert_eq!(outcomes, [(last.name().clone(), Outcome::Refused(Refused::Stopped))]);
    assert!(stopped.is_confirmed() && !ran.is_finished() && line.running() == 0, "{stopped}");
}

#[tokio::test(start_paused = true)]
async fn when_one_of_a_group_does_not_start_those_whose_turn_had_not_come_never_do() {
    let line = FullLine::ready(periods(1_500, 6_000)).await;
    line.machines.get(5).expect("it is there").mute();
    let (starting, mut ran) = under_way(&line, 5).await;
    let failure = starting.await.expect("it ends").expect_err("one is mute");
    let GroupFailure::Failed { outcomes, .. } = failure else { panic!("{failure}") };
    let names: Vec<_> = outcomes.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["fan 6"]);
    assert_eq!((ran.try_join_next().is_none(), line.running()), (true, 0));
}

#[tokio::test(start_paused = true)]
async fn a_group_start_that_is_dropped_begins_no_further_drive_and_is_taken_back() {
    let line = FullLine::ready(periods(1_500, 6_000)).await;
    let (starting, _ran) = under_way(&line, 5).await;
    starting.abort();
    sleep(60 * SECOND).await;
    // Nobody has heard that those run which were begun.
    assert_eq!(line.running(), 0);
}
