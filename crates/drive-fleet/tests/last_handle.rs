//! The last handle of a fleet goes: what was given before goes on, and nothing else does.

use std::time::Duration;

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{
    DriveHandle, DriveSettings, EventKind, Fleet, GroupStop, Outcome, Received, Refused, Times,
};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312};
use tokio::time::{Instant, sleep};

/// `SLL`, what an Altivar 312 does when its watchdog is over (manual of its parameters): 0, it ignores it.
const SLL: u16 = 7010;
const STANDSTILL: Duration = Duration::from_secs(20);
/// Longer than any stop of these tests.
const LONG: Duration = Duration::from_secs(120);

/// A motor that runs on until somebody stops it, and the fleet that has started it.
async fn running() -> (Fleet, DriveHandle, SimSlave, SimLine) {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let site = SimLine::new(Wiring::rtu(settings));
    let machine = site.add(1, atv312::Atv312::under_bus_control()).unwrap();
    assert!(machine.poke(SLL, 0));
    let line = Line::over(site.in_memory(), LineConfig::stream(settings));
    let times = Times { standstill: STANDSTILL, stop_alarm: STANDSTILL, ..Times::default() };
    let pump = DriveSettings { times, ..DriveSettings::controlled("pump 1") };
    let fleet = Fleet::builder()
        .line("north", line)
        .drive("north", 1, pump, |port, slave| Box::new(Atv312::new(port, slave)))
        .start()
        .unwrap();
    let pump = fleet.drive("pump 1").unwrap();
    pump.ready(Duration::from_secs(10)).await.unwrap();
    let started = pump.run(Direction::Forward, Frequency::from_hertz(30)).await;
    assert!(started.is_confirmed(), "{started}");
    (fleet, pump, machine, site)
}

async fn asks_nothing_more(machine: &SimSlave) {
    sleep(Duration::from_secs(1)).await;
    let (now, asked) = (Instant::now(), machine.all_requests());
    sleep(LONG).await;
    assert_eq!(machine.all_requests(), asked, "{:?}", machine.received_since(now));
}

#[tokio::test(start_paused = true)]
async fn a_stop_whose_ticket_is_all_that_is_left_is_carried_out_and_nothing_follows_it() {
    let (fleet, pump, machine, _site) = running().await;
    let stop = pump.stop(StopMode::Ramp);
    drop((pump, fleet));
    let outcome = stop.await;
    assert!(outcome.is_confirmed(), "{outcome}");
    assert!(!machine.observe().running);
    asks_nothing_more(&machine).await;
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_as_the_last_word_of_a_program_is_carried_out() {
    fn last_word(fleet: Fleet) -> GroupStop {
        fleet.stop_all(StopMode::Fast)
    }
    let (fleet, pump, machine, _site) = running().await;
    drop(pump);
    let report = last_word(fleet).await;
    assert!(report.is_confirmed() && report.confirmed.len() == 1, "{report}");
    assert!(!machine.observe().running);
    asks_nothing_more(&machine).await;
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_which_nothing_is_left_is_carried_out() {
    let (fleet, pump, machine, _site) = running().await;
    drop(pump.stop(StopMode::Ramp));
    drop((pump, fleet));
    sleep(LONG).await;
    assert!(!machine.observe().running);
    asks_nothing_more(&machine).await;
}

#[tokio::test(start_paused = true)]
async fn a_start_whose_ticket_was_dropped_is_taken_back_when_the_handles_go_with_it() {
    let (fleet, pump, machine, _site) = running().await;
    assert!(pump.stop(StopMode::Ramp).await.is_confirmed());
    let start = pump.run(Direction::Forward, Frequency::from_hertz(30));
    sleep(Duration::from_secs(1)).await;
    assert!(machine.observe().running);
    drop(start);
    drop((pump, fleet));
    sleep(LONG).await;
    assert!(!machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn an_order_that_waits_behind_the_stop_goes_with_the_last_handle() {
    let (fleet, pump, machine, _site) = running().await;
    let stop = pump.stop(StopMode::Ramp);
    let setpoint = pump.set_setpoint(Frequency::from_hertz(10));
    drop((pump, fleet));
    assert_eq!(setpoint.await, Outcome::Refused(Refused::ShutDown));
    assert!(stop.await.is_confirmed());
    assert!(!machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_mute_drive_is_stopped_when_it_is_heard_again_within_the_time_of_the_stop() {
    let (fleet, pump, machine, _site) = running().await;
    machine.mute();
    let stop = pump.stop(StopMode::Ramp);
    drop((pump, fleet));
    sleep(STANDSTILL / 2).await;
    assert!(machine.observe().running);
    machine.unmute();
    let outcome = stop.await;
    assert!(outcome.is_confirmed(), "{outcome}");
    assert!(!machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_not_confirmed_in_its_time_ends_with_an_alarm_and_so_does_the_fleet() {
    let (fleet, pump, machine, _site) = running().await;
    let mut events = fleet.events();
    machine.mute();
    let stop = pump.stop(StopMode::Ramp);
    drop((pump, fleet));
    let outcome = stop.await;
    assert!(matches!(outcome, Outcome::OutcomeUnknown(_)), "{outcome}");
    let mut alarms = 0;
    while let Received::Event(event) = events.recv().await {
        alarms += u32::from(matches!(event.kind, EventKind::StopUnconfirmed { .. }));
    }
    assert_eq!(alarms, 1);
    machine.unmute();
    asks_nothing_more(&machine).await;
}

#[tokio::test(start_paused = true)]
async fn the_policies_of_an_end_that_nobody_waits_for_act_without_a_handle() {
    let (fleet, pump, machine, _site) = running().await;
    drop(fleet.shutdown(LONG));
    drop((pump, fleet));
    sleep(LONG).await;
    assert!(!machine.observe().running);
    asks_nothing_more(&machine).await;
}

#[tokio::test(start_paused = true)]
async fn without_a_stop_the_last_handle_ends_it_all_and_the_motor_runs_on() {
    let (fleet, pump, machine, _site) = running().await;
    let before = machine.requests(0x06) + machine.requests(0x10);
    drop((pump, fleet));
    asks_nothing_more(&machine).await;
    assert_eq!(machine.requests(0x06) + machine.requests(0x10), before);
    assert!(machine.observe().running);
}

/// The fleet goes on: only this drive is not of it any more.
#[tokio::test(start_paused = true)]
async fn a_drive_that_was_removed_from_a_fleet_that_runs_refuses_for_that() {
    let (fleet, pump, machine, _site) = running().await;
    let removing = fleet.remove(&["pump 1"], LONG);
    sleep(Duration::from_millis(100)).await;
    let during = pump.start(Direction::Forward).await;
    removing.await;
    let (start, stop) = (pump.start(Direction::Forward).await, pump.stop(StopMode::Ramp).await);
    for outcome in [during, start, stop] {
        assert_eq!(outcome, Outcome::Refused(Refused::Removed));
        assert_eq!(outcome.reason(), Some("removed"));
    }
    assert_eq!(pump.faults().await, Err(Refused::Removed));
    assert!(!machine.observe().running, "its policy has acted");
    assert!(fleet.extend(|fleet| fleet).is_ok(), "the fleet has not shut down");
}
