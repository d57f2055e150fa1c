//! A full line: several of its drives are started at once, each by itself, and all are stopped.

use std::time::Duration;

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{
    DriveHandle, DriveSettings, EventKind, Fleet, Order, Outcome, Periods, Received, Ticket, Unconfirmed,
    Until,
};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312};
use futures_util::{FutureExt, future::join_all};
use tokio::time::{Instant, sleep};

const SECOND: Duration = Duration::from_secs(1);
/// As many as one line of RS-485 has.
const ON_A_LINE: u8 = 31;

/// A full line at rest, with each drive's machine.
async fn full_line() -> (Fleet, Vec<DriveHandle>, Vec<SimSlave>, SimLine) {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let site = SimLine::new(Wiring::rtu(settings));
    let line = Line::over(site.in_memory(), LineConfig::stream(settings));
    let mut fleet = Fleet::builder().line("north", line);
    let mut machines = Vec::new();
    for slave in 1..=ON_A_LINE {
        machines.push(site.add(slave, atv312::Atv312::under_bus_control()).unwrap());
        let periods =
            Periods { running: 2 * SECOND, rest: 2 * SECOND, max_age: 5 * SECOND, ..Periods::default() };
        let fan = DriveSettings { periods, ..DriveSettings::controlled(format!("fan {slave}")) };
        fleet = fleet.drive("north", slave, fan, |port, slave| Box::new(Atv312::new(port, slave)));
    }
    let fleet = fleet.start().unwrap();
    let fans = fleet.drives();
    for fan in &fans {
        fan.ready(120 * SECOND).await.unwrap();
    }
    (fleet, fans, machines, site)
}

/// Starts so many of them at once, each by itself. What is awaited is what whoever stands before a panel with as many buttons expects: first come,
/// first started, and who is too late is told so and stands.
async fn start_at_once(count: usize, order: impl Fn(&DriveHandle, Order) -> Ticket) -> usize {
    let (fleet, fans, machines, _site) = full_line().await;
    let mut events = fleet.events();
    let setpoint = Some(Frequency::from_hertz(25).into());
    let start = Order::Start { direction: Direction::Forward, setpoint, until: Until::InForce };
    let outcomes = join_all(fans[..count].iter().map(async |fan| order(fan, start).await)).await;
    let first = outcomes.iter().take_while(|outcome| outcome.is_confirmed()).count();
    for (number, (machine, outcome)) in machines.iter().zip(&outcomes).enumerate() {
        let is_late =
            matches!(outcome, Outcome::Expired | Outcome::NotConfirmed(Unconfirmed::NotStarted { .. }));
        assert!(number < first || is_late, "{number}: {outcome}");
        assert_eq!(machine.observe().running, number < first, "{number}: {outcome}");
    }
    while let Some(Received::Event(event)) = events.recv().now_or_never() {
        assert!(!matches!(event.kind, EventKind::Lost { .. }), "{event:?}");
    }
    first
}

#[tokio::test(start_paused = true)]
async fn of_five_that_are_started_at_once_on_a_full_line_the_first_start_and_no_drive_is_lost_for_it() {
    let started = start_at_once(5, DriveHandle::order).await;
    assert!(started >= 1, "{started}");
    let in_the_time_of_a_page = |fan: &DriveHandle, start| fan.order_since(start, Instant::now(), 9 * SECOND);
    assert_eq!(start_at_once(5, in_the_time_of_a_page).await, 5);
}

#[tokio::test(start_paused = true)]
async fn of_all_that_are_started_at_once_on_a_full_line_as_many_start_as_it_has_time_for() {
    let started = start_at_once(31, |fan, start| fan.order_since(start, Instant::now(), 5 * SECOND)).await;
    assert!(started >= 3, "{started}");
}

#[tokio::test(start_paused = true)]
async fn what_waits_to_start_as_the_fleet_ends_is_never_started_and_what_runs_is_stopped() {
    let (fleet, fans, machines, _site) = full_line().await;
    let started = fans[8].run(Direction::Forward, Frequency::from_hertz(45)).await;
    assert!(started.is_confirmed(), "{started}");
    let setpoint = Some(Frequency::from_hertz(25).into());
    let start = Order::Start { direction: Direction::Forward, setpoint, until: Until::InForce };
    let starts = fans[..5].iter().map(async |fan| fan.order_since(start, Instant::now(), 9 * SECOND).await);
    let ends = async {
        sleep(Duration::from_millis(400)).await;
        fleet.shutdown(60 * SECOND).await
    };
    let (outcomes, ended) = tokio::join!(join_all(starts), ends);
    assert!(!outcomes.iter().any(Outcome::is_confirmed), "{outcomes:?}");
    assert!(machines.iter().all(|machine| !machine.observe().running), "{outcomes:?} {ended:?}");
    sleep(10 * SECOND).await;
    assert!(machines.iter().all(|machine| !machine.observe().running));
}

/// `CMD`, the control word (BBV51701 p. 14), of the request that writes one register.
const WRITES_CMD: &[u8] = &[0x06, 0x21, 0x35];

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_reaches_the_drives_that_turn_before_any_that_stands() {
    let (fleet, fans, machines, _site) = full_line().await;
    let turning = [16, 30];
    for number in turning {
        let started = fans[number].run(Direction::Forward, Frequency::from_hertz(25)).await;
        assert!(started.is_confirmed(), "{started}");
    }
    let asked = Instant::now();
    let stop = fleet.all().stop(StopMode::Ramp);
    assert!(stop.await.is_confirmed());
    let mut reached = Vec::new();
    for (number, machine) in machines.iter().enumerate() {
        let received = machine.received_since(asked);
        let first = received.iter().find(|received| received.pdu.starts_with(WRITES_CMD));
        reached.extend(first.map(|received| (received.at, number)));
    }
    reached.sort_unstable();
    let mut first: Vec<_> = reached.iter().take(turning.len()).map(|(_, number)| *number).collect();
    first.sort_unstable();
    assert_eq!(first, turning, "{reached:?}");
}
