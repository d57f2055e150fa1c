//! An ordinary bad day of a plant: the program ends and nobody speaks to the drives, or it begins over drives that turn or
//! have tripped.

use std::time::Duration;

use drive_core::{Frequency, Reaction, State};
use drive_families::Family;
use drive_fleet::{EventKind, ExitAction, OnFault, WatchdogBefore, WatchdogContract};
use support::{
    drives,
    plant::{PATIENCE, Plant, contract},
};
use tokio::time::{sleep, timeout};

const SECOND: Duration = Duration::from_secs(1);

/// Families whose watchdog the bus can set, and a line of the simulator that switches it off.
const SETTABLE: [(Family, &str); 2] = [(Family::ATV21, "set F803 0"), (Family::ATV312, "set SLL 0")];

fn is_named(kind: &EventKind, name: &str) -> bool {
    kind.name() == name
}

/// A plant whose program has ended with this name of an event among its last.
async fn ended(plant: &mut Plant) -> Vec<EventKind> {
    let _ = plant.fleet.shutdown(60 * SECOND).await;
    plant.events_so_far().await
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_stands_does_not_trip_because_the_program_has_ended() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.happens("set SLL 0");
    plant.event("the contract", |kind| is_named(kind, "watchdog verified")).await;
    let told = ended(&mut plant).await;
    assert!(told.iter().any(|kind| is_named(kind, "watchdog put back")), "{told:?}");
    sleep(600 * SECOND).await;
    assert_eq!(plant.machine().observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_was_stopped_at_the_exit_does_not_trip_afterwards() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.happens("set SLL 0");
    plant.run_at(30).await;
    ended(&mut plant).await;
    assert!(!plant.machine().observe().running);
    sleep(600 * SECOND).await;
    assert_eq!(plant.machine().observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_that_nto_had_switched_off_is_off_again_and_sll_stays_what_it_was() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    // CMI bit 14, BBV51701 p. 20.
    plant.happens("set CMI 16384");
    plant.event("the contract", |kind| is_named(kind, "watchdog verified")).await;
    let sll = plant.machine().observe().eeprom_writes;
    ended(&mut plant).await;
    sleep(600 * SECOND).await;
    let after = plant.machine().observe();
    assert_eq!((after.trip, after.eeprom_writes), (None, sll));
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_in_an_eeprom_is_put_back_only_where_the_policy_says_so_and_else_it_is_told() {
    for restores in [false, true] {
        let mut plant = Plant::single(Family::ATV21, |settings| {
            if restores {
                settings.on_exit_watchdog = drive_fleet::OnExitWatchdog::Restore;
            }
        });
        plant.happens("set F803 0");
        plant.event("the contract", |kind| is_named(kind, "watchdog verified")).await;
        let written = plant.machine().observe().eeprom_writes;
        let told = ended(&mut plant).await;
        let name = if restores { "watchdog put back" } else { "watchdog stays armed" };
        assert!(told.iter().any(|kind| is_named(kind, name)), "{restores}: {told:?}");
        sleep(600 * SECOND).await;
        let after = plant.machine().observe();
        assert_eq!(after.trip.is_none(), restores);
        assert_eq!(after.eeprom_writes > written, restores);
    }
}

/// A drive whose watchdog was off before a program armed it and was killed, and the program after it, which knows what was
/// kept, changed by `change`.
async fn after_a_kill(change: impl FnOnce(&mut WatchdogBefore)) -> Plant {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    // CMI bit 14, BBV51701 p. 20.
    plant.happens("set CMI 16384");
    let verified = plant.event("the contract", |kind| is_named(kind, "watchdog verified")).await;
    let EventKind::WatchdogVerified { written: true, before: Some(before), .. } = verified else {
        panic!("{verified:?}")
    };
    let mut before = (*before).clone();
    assert_eq!(before.found.timeout, None);
    change(&mut before);
    plant.sites[0].members[0].2.watchdog_before = Some(before);
    let mut plant = plant.restarted().await;
    plant.event("the contract", |kind| is_named(kind, "watchdog verified")).await;
    plant
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_a_killed_program_left_armed_is_put_back_at_the_exit_of_the_next() {
    let mut plant = after_a_kill(|_| {}).await;
    let told = ended(&mut plant).await;
    assert!(told.iter().any(|kind| is_named(kind, "watchdog put back")), "{told:?}");
    sleep(600 * SECOND).await;
    assert_eq!(plant.machine().observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn what_was_kept_of_another_drive_or_another_setting_is_not_put_back() {
    let of_another = |before: &mut WatchdogBefore| "ATV312HU22N4".clone_into(&mut before.identity);
    let otherwise = |before: &mut WatchdogBefore| before.set.timeout = Some(29 * SECOND);
    for mut plant in [after_a_kill(of_another).await, after_a_kill(otherwise).await] {
        let writes = Plant::writes(plant.machine());
        let told = ended(&mut plant).await;
        assert!(told.iter().any(|kind| is_named(kind, "watchdog stays armed")), "{told:?}");
        assert_eq!(Plant::writes(plant.machine()), writes);
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_at_the_exit_and_was_not_started_here_is_an_alarm() {
    for family in Family::BUILT_IN {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let mut plant = plant.restarted().await;
        plant.event("the adoption", |kind| matches!(kind, EventKind::Connected(_))).await;
        let told = ended(&mut plant).await;
        let exit = told.iter().find(|kind| matches!(kind, EventKind::Exit(_)));
        let exit = exit.unwrap_or_else(|| panic!("{family}: {told:?}"));
        assert!(exit.is_alarm(), "{family}: {exit}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_adopted_motor_is_stopped_at_the_exit_or_left_without_an_alarm_where_the_policy_says_so() {
    use drive_core::StopMode;
    use drive_fleet::OnExitAdopted;
    for (policy, stands) in [(OnExitAdopted::Stop(StopMode::Ramp), true), (OnExitAdopted::Leave, false)] {
        let plant = Plant::single(Family::ATV312, |settings| settings.on_exit_adopted = policy);
        plant.run_at(30).await;
        let mut plant = plant.restarted().await;
        plant.event("the adoption", |kind| matches!(kind, EventKind::Connected(_))).await;
        let actions = plant.fleet.shutdown(60 * SECOND).await;
        let [(_, action)] = &actions[..] else { panic!("{actions:?}") };
        assert!(!action.is_alarm(), "{policy:?}: {action}");
        assert_eq!(*action != ExitAction::Left, stands);
        assert_eq!(!plant.machine().observe().running, stands, "{policy:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_given_up_at_the_exit_is_an_alarm() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.run_at(30).await;
    plant.happens("line cut");
    let told = ended(&mut plant).await;
    let exit = told.iter().find(|kind| matches!(kind, EventKind::Exit(_)));
    assert!(exit.is_some_and(EventKind::is_alarm), "{told:?}");
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_trip_found_at_the_next_start_is_known_by_the_drives_own_code_and_reset_by_policy() {
    for family in [Family::ATV21, Family::ATV312, Family::OMRON_3G3EV] {
        let plant = Plant::single(family, |settings| settings.on_fault = OnFault::ResetWatchdogTrip);
        plant.run_at(30).await;
        let Plant { sites, fleet, lines, events, .. } = plant;
        drop((fleet, events));
        for line in lines {
            line.close().await;
        }
        let machine = sites[0].simulated.slave(support::plant::ADDRESS).expect("it is there");
        machine.wait_until(|machine| machine.trip.is_some() && machine.shaft_frequency == 0).await;
        let plant = Plant::open(sites).expect("it was there before");
        let reset = plant.machine().wait_until(|machine| machine.trip.is_none());
        timeout(PATIENCE, reset).await.unwrap_or_else(|_| panic!("{family}: it is not reset"));
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
        let snapshot = plant.motor().snapshot();
        assert!(snapshot.trips.back().is_some_and(|trip| trip.by_watchdog), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn another_trip_that_came_while_the_line_was_away_is_not_reset_as_the_watchdogs() {
    // The manual of an Altivar 58 names no code for a trip by it: whatever tripped it, it does not say.
    for family in [Family::ATV21, Family::ATV58, Family::ATV312, Family::OMRON_3G3EV] {
        let mut plant = Plant::single(family, |settings| settings.on_fault = OnFault::ResetWatchdogTrip);
        plant.run_at(30).await;
        plant.happens(&format!("trip {}", drives::a_trip(family)));
        plant.machine().mute();
        plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
        sleep(20 * SECOND).await;
        plant.machine().unmute();
        plant.event("the trip", |kind| matches!(kind, EventKind::TripExplained(_))).await;
        sleep(60 * SECOND).await;
        let state = plant.motor().snapshot().status.as_ref().map(|status| status.value.state);
        assert_eq!(state, Some(State::Fault), "{family}: it was reset");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_runs_with_another_watchdog_than_its_contract_is_an_alarm_at_once() {
    for (family, off) in SETTABLE {
        let plant = Plant::single(family, |settings| settings.watchdog = None);
        plant.happens(off);
        plant.run_at(30).await;
        let Plant { mut sites, fleet, lines, events, .. } = plant;
        drop((fleet, events));
        for line in lines {
            line.close().await;
        }
        for (_, _, settings) in &mut sites[0].members {
            settings.watchdog = contract(family);
        }
        let mut plant = Plant::open(sites).expect("it can be fed");
        plant.event("the adoption", |kind| matches!(kind, EventKind::Connected(_))).await;
        sleep(2 * SECOND).await;
        let told = plant.events_so_far().await;
        let alarms = told.iter().filter(|kind| kind.is_alarm() && kind.to_string().contains("watchdog"));
        assert_eq!(alarms.count(), 1, "{family}: {told:?}");
        assert_eq!(plant.machine().observe().output_frequency, 3_000, "{family}: it runs on");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_is_started_without_an_alarm_where_its_watchdog_is_armed_for_it() {
    let mut plant = Plant::single(Family::ATV312, |settings| {
        settings.watchdog = Some(WatchdogContract { timeout: 5 * SECOND, reaction: Reaction::Ramp });
    });
    plant.run_at(30).await;
    assert!(plant.motor().set_setpoint(Frequency::from_hertz(20)).await.is_confirmed());
    let told = plant.events_so_far().await;
    assert!(!told.iter().any(EventKind::is_alarm), "{told:?}");
}
