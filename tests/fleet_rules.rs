//! The rules of motion, each for every family that can do it, against the simulator in virtual time.

use std::{sync::Arc, time::Duration};

use drive_bus::{Line, LineConfig, Protocol, protocol::AsciiSettings};
use drive_core::{
    Class, Direction, Frequency, Ground, Identity, Motion, Reaction, Refusal, SerialSettings, State,
    StopMode, serial::CharacterFormat,
};
use drive_families::Family;
use drive_fleet::{
    ConcernKind, DriveSettings, EventKind, ExitAction, Fleet, IdentityCheck, Link, OnExit, OnFault, Outcome,
    Periods, Received, Refused, Times, WatchdogCheck, WatchdogContract,
};
use drive_sim::{Fault, Panel, SimLine, SimSlave, Wiring, models::atv21::Atv21};
use drive_testing::witness::Witnesses;
use support::{
    drives::{self, Five},
    plant::{ADDRESS, MOTOR, Plant, Site, common_settings, contract, controlled},
};
use tokio::time::{Instant, sleep};

const SECOND: Duration = Duration::from_secs(1);

/// A test of every family that the condition lets through.
async fn each(test: impl AsyncFn(Family)) {
    for family in Family::BUILT_IN {
        test(family).await;
    }
}

#[tokio::test(start_paused = true)]
async fn rule_1_a_stop_is_repeated_until_the_drive_confirms_it_and_ends_in_an_alarm_when_it_cannot() {
    each(async |family| {
        let mut plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        plant.machine().mute();
        let outcome = plant.motor().stop(StopMode::Ramp).await;
        assert!(!outcome.is_confirmed(), "{family}: {outcome}");
        plant.event("the alarm", |kind| matches!(kind, EventKind::StopUnconfirmed { .. })).await;
        assert!(plant.motor().snapshot().stop.is_some(), "{family}: it goes on");
        plant.machine().unmute();
        plant.event("the confirmation", |kind| matches!(kind, EventKind::StopConfirmed { .. })).await;
        assert!(!plant.machine().observe().running, "{family}");
        assert_eq!(plant.motor().snapshot().stop, None);
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_1_a_motor_that_a_start_under_way_turns_is_known_as_started_here_while_nobody_has_confirmed_it()
{
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        assert!(!plant.motor().snapshot().started_here(), "{family}");
        let started = plant.motor().run(Direction::Forward, Frequency::from_hertz(20));
        while !plant.machine().observe().running {
            sleep(Duration::from_millis(1)).await;
        }
        assert!(plant.motor().snapshot().started_here(), "{family}");
        assert!(started.await.is_confirmed(), "{family}");
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}");
        assert!(!plant.motor().snapshot().started_here(), "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_1_a_drive_whose_settings_have_no_ramp_stop_is_stopped_by_another() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    // The normal stop is a freewheel stop: no word of the bus stops this drive along its ramp.
    assert!(plant.machine().poke(drive_atv312::registers::STT.address(), 2));
    plant.run_at(30).await;
    assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed());
    plant
        .event("the other stop", |kind| {
            matches!(kind, EventKind::StopModeReplaced { asked: StopMode::Ramp, used, .. } if *used != StopMode::Ramp)
        })
        .await;
    assert!(!plant.machine().observe().running);
}

/// Another master writes its reference behind that of a setpoint, before it is read back.
#[tokio::test(start_paused = true)]
async fn rule_3_a_motor_that_follows_another_masters_reference_behind_a_setpoint_is_told_and_not_left_to_it()
{
    each(async |family| {
        let (register, word) = reference_of_40_hz(family);
        let mut plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let machine = plant.machine().clone();
        let before = writes(&machine);
        let other = tokio::spawn(async move {
            machine.wait_until(|_| writes(&machine) > before).await;
            // Its answer is on its way.
            sleep(Duration::from_millis(8)).await;
            machine.written_by_another(register, word)
        });
        // Some have read it back by then.
        drop(plant.motor().set_setpoint(Frequency::from_hertz(20)).await);
        other.await.expect("it is written").expect("another master may");
        plant.event("who gives the reference", |kind| matches!(kind, EventKind::ReferenceTaken(_))).await;
    })
    .await;
}

/// `LFr`; FA01h; 0002h.
fn reference_of_40_hz(family: Family) -> (u16, u16) {
    match drives::five(family) {
        Five::Atv21 => (0xFA01, 4_000),
        Five::Atv28 | Five::Atv58 => (401, 400),
        Five::Atv312 => (8_502, 400),
        Five::Omron3g3ev => (0x0002, 400),
    }
}

fn writes(machine: &SimSlave) -> u64 {
    machine.requests(0x06) + machine.requests(0x10)
}

/// Between the setpoint of a start, which was read back, and its run word another master writes its own.
#[tokio::test(start_paused = true)]
async fn rule_3_a_start_at_another_masters_reference_is_not_confirmed_and_its_motor_is_brought_to_rest() {
    each(async |family| {
        let (register, word) = reference_of_40_hz(family);
        let plant = Plant::single(family, |_| {});
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        let machine = plant.machine().clone();
        let before = writes(&machine);
        let other = tokio::spawn(async move {
            machine.wait_until(|_| writes(&machine) > before + 1).await;
            machine.written_by_another(register, word)
        });
        let outcome = plant.motor().start_at(Direction::Forward, Frequency::from_hertz(25)).await;
        other.await.expect("it is written").expect("another master may");
        assert!(!outcome.is_confirmed(), "{family}: {outcome}");
        sleep(30 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_1_a_stop_outranks_a_line_full_of_polls_and_commands() {
    let members = (1..=31)
        .map(|address| {
            let periods =
                Periods { running: 2 * SECOND, rest: 2 * SECOND, max_age: 5 * SECOND, ..Periods::default() };
            let settings = DriveSettings { periods, ..DriveSettings::controlled(format!("drive {address}")) };
            (Family::ATV312, address, settings)
        })
        .collect();
    let plant = Plant::open(vec![Site::new(common_settings(), members)]).expect("it can be");
    for drive in plant.fleet.drives() {
        drive.ready(60 * SECOND).await.expect("it gets ready");
    }
    let stopped = plant.drive("drive 17");
    for round in 0..50_u16 {
        let everybody = plant.fleet.drives();
        let setpoints: Vec<_> = everybody
            .into_iter()
            .map(|drive| {
                tokio::spawn(async move { drive.set_setpoint(Frequency::from_hertz(10 + round % 20)).await })
            })
            .collect();
        sleep(Duration::from_millis(7 * u64::from(round))).await;
        assert!(stopped.stop(StopMode::Ramp).await.is_confirmed());
        for setpoint in setpoints {
            let _outcome = setpoint.await.expect("it ends");
        }
    }
    let stats = plant.lines[0].stats();
    let (wait, bound) = (stats.class(Class::Stop).wait.max(), plant.lines[0].worst_case_stop());
    assert!(stats.class(Class::Stop).sent >= 50);
    assert!(wait <= bound, "{wait:?} of {bound:?}");
}

#[tokio::test(start_paused = true)]
async fn rule_2_a_command_expires_and_is_never_sent_late_nor_replayed_after_a_reconnect() {
    each(async |family| {
        // A neighbour holds up the line for longer than the command lives.
        let times = Times { lifetime: Duration::from_millis(20), ..Times::default() };
        let settings = DriveSettings { times, ..controlled(family, MOTOR) };
        let neighbour = DriveSettings::watched("neighbour");
        let members = vec![(family, ADDRESS, settings), (family, ADDRESS + 1, neighbour)];
        let plant = Plant::open(vec![Site::new(common_settings(), members)]).expect("it can be fed");
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        let neighbour = plant.machine_of("neighbour");
        neighbour.hold_next_answer();
        neighbour.wait_until_held().await;
        let writes = Plant::writes(plant.machine());
        let outcome = plant.motor().start(Direction::Forward).await;
        assert_eq!(outcome, Outcome::Expired, "{family}");
        sleep(30 * SECOND).await;
        assert_eq!(Plant::writes(plant.machine()), writes, "{family}");

        // A command that falls into a lost line is not carried out when the line is back.
        plant.machine().mute();
        let outcome = plant.motor().start(Direction::Forward).await;
        assert!(!outcome.is_confirmed(), "{family}: {outcome}");
        sleep(30 * SECOND).await;
        plant.machine().unmute();
        plant.motor().wait_until(|snapshot| snapshot.link == Link::Connected).await;
        sleep(30 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_3_nothing_is_confirmed_that_the_machine_does_not_do() {
    each(async |family| {
        let plant = Plant::single(family, |settings| {
            settings.watchdog = None;
            settings.periods.max_age = 20 * SECOND;
            // Every loss costs the line the late window of 1 s, and a start proves what it rests on before its setpoint is written and
            // once more before it is written itself.
            settings.times.lifetime = 6 * SECOND;
        });
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        plant.sites[0].simulated.set_faults(drive_sim::Faults::seeded(6).with(Fault::Lost, 100_000));
        let mut confirmed = 0;
        for round in 0..40_u16 {
            let setpoint = Frequency::from_hertz(20 + round % 10);
            let outcome = plant.motor().run(Direction::Forward, setpoint).await;
            let seen = plant.machine().observe();
            if outcome.is_confirmed() {
                confirmed += 1;
                assert!(
                    seen.running && seen.setpoint == i32::from(20 + round % 10) * 100,
                    "{family}: {seen:?}"
                );
            }
            let outcome = plant.motor().stop(StopMode::Ramp).await;
            assert!(
                !outcome.is_confirmed() || !plant.machine().observe().running,
                "{family}: {outcome}, {:?}",
                plant.machine().observe()
            );
        }
        assert!(confirmed >= 30, "{family}: {confirmed} of 40 got through a line that loses a tenth");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_4_motion_needs_a_drive_that_answers() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.machine().mute();
        sleep(10 * SECOND).await;
        let outcome = plant.motor().start(Direction::Forward).await;
        assert_eq!(outcome, Outcome::Refused(Refused::NotConnected), "{family}");
        assert_eq!(Plant::writes(plant.machine()), 0, "{family}");
    })
    .await;
}

/// Who reads of a trip finds by its time what was read with it.
#[tokio::test(start_paused = true)]
async fn what_one_reading_shows_bears_one_time() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let mut events = plant.fleet.events();
        plant.machine().trip(support::drives::a_trip(family));
        let (mut change, mut trip) = (None, None);
        while change.is_none() || trip.is_none() {
            let Received::Event(event) = events.recv().await else { panic!("{family}: the fleet has ended") };
            match event.kind {
                EventKind::StateChanged { to: State::Fault, .. } => change = Some((event.at, event.wall)),
                EventKind::Tripped(_) => trip = Some((event.at, event.wall)),
                _ => {}
            }
        }
        assert_eq!(change, trip, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_4_motion_needs_a_drive_without_a_fault() {
    each(async |family| {
        let mut plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        plant.machine().trip(support::drives::a_trip(family));
        plant.event("the trip", |kind| matches!(kind, EventKind::Tripped(_))).await;
        // The run command of before is withdrawn.
        sleep(5 * SECOND).await;
        let writes = Plant::writes(plant.machine());
        let outcome = plant.motor().start(Direction::Forward).await;
        assert!(
            matches!(outcome, Outcome::Refused(Refused::Because(Refusal::Fault(_) | Refusal::Tripped))),
            "{family}: {outcome}"
        );
        assert_eq!(Plant::writes(plant.machine()), writes, "{family}");
        let explained =
            plant.event("its explanation", |kind| matches!(kind, EventKind::TripExplained(_))).await;
        let EventKind::TripExplained(trip) = explained else { unreachable!() };
        assert_eq!(trip.before.expect("it ran before").value.state, State::Running, "{family}");
        let present = trip.faults.expect("it was read").present.first().map(|fault| fault.code);
        assert_eq!(present, Some(support::drives::a_trip(family)), "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_4_motion_needs_control_here() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        plant.machine().panel(Panel::TakeControl);
        if !plant.machine().observe().local {
            // This family has no such key.
            return;
        }
        sleep(5 * SECOND).await;
        let outcome = plant.motor().start(Direction::Forward).await;
        assert!(matches!(outcome, Outcome::Refused(_)), "{family}: {outcome}");
        assert!(!plant.machine().observe().running, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_4_motion_needs_the_drive_that_is_remembered_until_another_is_accepted() {
    each(async |family| {
        let remembered = Identity { model: Some("another".to_owned()), ..Identity::default() };
        let mut plant = Plant::single(family, |settings| settings.identity = Some(remembered));
        // The card of the Altivar 58 says it over UNI-TELWAY only.
        if family.capabilities().identification.is_none() || family == Family::ATV58 {
            plant.motor().ready(60 * SECOND).await.expect("it cannot say what it is");
            return;
        }
        plant.event("the change", |kind| matches!(kind, EventKind::IdentityChanged { .. })).await;
        let outcome = plant.motor().start(Direction::Forward).await;
        assert_eq!(outcome, Outcome::Refused(Refused::IdentityChanged), "{family}");
        assert_eq!(Plant::writes(plant.machine()), 0, "{family}: not even its watchdog is written");
        let IdentityCheck::Changed { found, remembered } = plant.motor().snapshot().identity.clone() else {
            panic!("{family}")
        };
        let outcome = plant.motor().accept_identity(&remembered).await;
        assert_eq!(outcome, Outcome::Refused(Refused::NotTheShown(Some(Arc::clone(&found)))), "{family}");
        assert!(plant.motor().accept_identity(&found).await.is_confirmed());
        plant.run_at(20).await;
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_5_nothing_restarts_after_a_power_cycle() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        plant.machine().power_cycle();
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
        plant.motor().wait_until(|snapshot| snapshot.link == Link::Connected).await;
        assert!(!plant.motor().snapshot().started_here(), "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_5_nothing_restarts_after_a_fault_and_its_reset() {
    each(async |family| {
        let mut plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        plant.machine().trip(support::drives::a_trip(family));
        plant.event("the trip", |kind| matches!(kind, EventKind::Tripped(_))).await;
        plant.machine().wait_until(|machine| machine.shaft_frequency == 0).await;
        let outcome = plant.motor().reset_faults().await;
        assert!(outcome.is_confirmed(), "{family}: {outcome}");
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
        assert_eq!(plant.machine().observe().trip, None, "{family}");
        plant.run_at(20).await;
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_5_nothing_restarts_after_a_lost_line() {
    each(async |family| {
        let mut plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        plant.machine().mute();
        plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
        sleep(20 * SECOND).await;
        let ran_on = plant.machine().observe().running;
        assert_eq!(ran_on, family.capabilities().watchdog.is_none(), "{family}: a watchdog stops it");
        plant.machine().unmute();
        plant.event("the return", |kind| matches!(kind, EventKind::Connected(_))).await;
        sleep(60 * SECOND).await;
        assert_eq!(plant.machine().observe().running, ran_on, "{family}: what it does is adopted");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_6_a_reset_is_written_once_and_not_held() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        for _ in 0..2 {
            plant.machine().trip(support::drives::a_trip(family));
            plant
                .motor()
                .wait_until(|snapshot| snapshot.status.as_ref().is_some_and(|status| status.value.is_fault()))
                .await;
            plant.machine().wait_until(|machine| machine.shaft_frequency == 0).await;
            assert!(plant.motor().reset_faults().await.is_confirmed(), "{family}");
            plant.motor().wait_until(|snapshot| snapshot.link == Link::Connected).await;
            sleep(10 * SECOND).await;
            let writes = Plant::writes(plant.machine());
            sleep(60 * SECOND).await;
            assert_eq!(Plant::writes(plant.machine()), writes, "{family}: nothing is held");
            // A bit that was held could not rise a second time.
            assert_eq!(plant.machine().observe().trip, None, "{family}");
        }
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_7_a_running_state_is_adopted_and_nothing_is_written_until_somebody_commands() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let writes = Plant::writes(plant.machine());
        let plant = plant.restarted().await;
        let adopted = plant.motor().wait_until(|snapshot| snapshot.status.is_some()).await;
        assert_eq!(
            adopted.status.as_ref().map(|status| status.value.state),
            Some(State::Running),
            "{family}"
        );
        sleep(60 * SECOND).await;
        assert_eq!(Plant::writes(plant.machine()), writes, "{family}");
        assert_eq!(plant.machine().observe().output_frequency, 3_000, "{family}");
        assert!(!plant.motor().snapshot().started_here(), "{family}");
        assert!(plant.motor().set_setpoint(Frequency::from_hertz(25)).await.is_confirmed(), "{family}");
        plant.machine().wait_until(|machine| machine.output_frequency == 2_500).await;
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_8_on_exit_what_was_started_here_stops_and_what_was_not_is_left() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let actions = plant.fleet.shutdown(60 * SECOND).await;
        let [(name, ExitAction::Stopped(outcome))] = &*actions else { panic!("{family}: {actions:?}") };
        assert!(**name == *MOTOR && outcome.is_confirmed(), "{family}: {outcome}");
        assert!(!plant.machine().observe().running, "{family}");

        let plant = Plant::single(family, |settings| settings.on_exit = OnExit::Leave);
        plant.run_at(30).await;
        let actions = plant.fleet.shutdown(60 * SECOND).await;
        assert_eq!(actions, [(MOTOR.into(), ExitAction::Left)], "{family}");
        assert!(plant.machine().observe().running, "{family}");

        let mut plant = plant.restarted().await;
        plant.event("the adoption", |kind| matches!(kind, EventKind::Connected(_))).await;
        let actions = plant.fleet.shutdown(60 * SECOND).await;
        assert_eq!(actions, [(MOTOR.into(), ExitAction::Left)], "{family}: it was not started here");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_8_on_exit_control_is_released_where_the_family_can() {
    each(async |family| {
        let plant = Plant::single(family, |settings| settings.on_exit = OnExit::Release(StopMode::Ramp));
        plant.run_at(30).await;
        let actions = plant.fleet.shutdown(60 * SECOND).await;
        let [(_, ExitAction::Released(outcome))] = &actions[..] else { panic!("{family}: {actions:?}") };
        assert_eq!(outcome.is_confirmed(), family.capabilities().release, "{family}: {outcome}");
        assert!(!plant.machine().observe().running, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_9_a_watchdog_is_armed_verified_fed_and_trips_in_its_time_when_the_line_is_lost() {
    each(async |family| {
        let Some(contract) = contract(family) else { return };
        let mut plant = Plant::single(family, |_| {});
        let verified =
            plant.event("the contract", |kind| matches!(kind, EventKind::WatchdogVerified { .. })).await;
        let EventKind::WatchdogVerified { watchdog, written, .. } = verified else { unreachable!() };
        assert_eq!(watchdog.timeout, Some(contract.timeout), "{family}");
        let settable = family.capabilities().watchdog.is_some_and(|watchdog| watchdog.settable);
        assert_eq!(written, settable, "{family}");
        plant.run_at(30).await;
        sleep(600 * SECOND).await;
        assert_eq!(plant.machine().observe().trip, None, "{family}: it is fed");

        plant.machine().mute();
        let cut = Instant::now();
        plant.machine().wait_until(|machine| machine.trip.is_some()).await;
        assert!(
            cut.elapsed() <= contract.timeout + Duration::from_millis(5),
            "{family}: {:?}",
            cut.elapsed()
        );
        plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
        plant.machine().unmute();
        let tripped = plant.event("the trip", |kind| matches!(kind, EventKind::Tripped(_))).await;
        let EventKind::Tripped(trip) = tripped else { unreachable!() };
        assert!(trip.watchdog_after.is_some_and(|silence| silence >= contract.timeout), "{family}: {trip:?}");
        sleep(60 * SECOND).await;
        assert!(plant.machine().observe().trip.is_some(), "{family}: it waits for a hand");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_9_a_watchdogs_trip_is_reset_by_the_policy_that_says_so_and_the_motor_stays() {
    each(async |family| {
        // Of an Altivar 58 nobody can say by what it tripped.
        if contract(family).is_none() || family == Family::ATV58 {
            return;
        }
        let mut plant = Plant::single(family, |settings| settings.on_fault = OnFault::ResetWatchdogTrip);
        plant.run_at(30).await;
        plant.machine().mute();
        plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
        plant.machine().wait_until(|machine| machine.trip.is_some() && machine.shaft_frequency == 0).await;
        plant.machine().unmute();
        plant.machine().wait_until(|machine| machine.trip.is_none()).await;
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_9_a_watchdog_that_the_line_cannot_feed_is_refused_with_the_arithmetic() {
    let timeout = Duration::from_millis(500);
    let members = (1..=31)
        .map(|address| {
            let periods =
                Periods { running: 2 * SECOND, rest: 2 * SECOND, max_age: 5 * SECOND, ..Periods::default() };
            let watchdog = Some(WatchdogContract { timeout, reaction: Reaction::Ramp });
            let name = format!("drive {address}");
            (Family::ATV312, address, DriveSettings { periods, watchdog, ..DriveSettings::controlled(name) })
        })
        .collect();
    let Err(error) = Plant::open(vec![Site::new(SerialSettings::MODBUS_DEFAULT, members)]) else {
        panic!("31 watchdogs of 500 ms cannot be fed at 19200 bit/s")
    };
    let text = error.to_string();
    assert!(
        text.contains("the watchdog of drive 1 is 500ms") && text.contains("31 watched drives"),
        "{text}"
    );
}

#[tokio::test(start_paused = true)]
async fn rule_10_eeprom_is_written_only_when_asked_refused_when_nothing_changed_and_counted() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        let written = plant.machine().observe().eeprom_writes;
        for hertz in 20..30 {
            assert!(
                plant.motor().set_setpoint(Frequency::from_hertz(hertz)).await.is_confirmed(),
                "{family}"
            );
        }
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}");
        plant.run_at(30).await;
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}");
        sleep(600 * SECOND).await;
        assert_eq!(plant.machine().observe().eeprom_writes, written, "{family}");
        let outcome = plant.motor().persist().await;
        let counted = plant.motor().snapshot().counters.saves;
        if outcome.is_confirmed() {
            assert_eq!(counted, 1, "{family}: the watchdog was set up and is saved");
            assert_eq!(plant.machine().observe().eeprom_writes, written + 1, "{family}");
            let again = plant.motor().persist().await;
            let nothing = Outcome::Refused(Refused::Because(Refusal::NothingToSave));
            assert_eq!(again, nothing, "{family}");
        } else {
            assert!(matches!(outcome, Outcome::Refused(_)), "{family}: {outcome}");
            assert_eq!((counted, plant.machine().observe().eeprom_writes), (0, written), "{family}");
        }
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_11_without_control_nothing_is_ever_written() {
    each(async |family| {
        let plant = Plant::single(family, |settings| {
            settings.control = false;
            settings.on_fault = OnFault::ResetWatchdogTrip;
            settings.on_loss = drive_fleet::OnLoss::Stop(StopMode::Ramp);
        });
        sleep(10 * SECOND).await;
        let motor = plant.motor();
        for outcome in [
            motor.run(Direction::Forward, Frequency::from_hertz(20)).await,
            motor.stop(StopMode::Ramp).await,
            motor.reset_faults().await,
            motor.release().await,
            motor.persist().await,
        ] {
            assert_eq!(outcome, Outcome::Refused(Refused::ReadOnly), "{family}");
        }
        plant.machine().mute();
        sleep(10 * SECOND).await;
        plant.machine().unmute();
        sleep(10 * SECOND).await;
        plant.machine().trip(support::drives::a_trip(family));
        sleep(10 * SECOND).await;
        assert_eq!(plant.fleet.shutdown(SECOND).await, [(MOTOR.into(), ExitAction::Left)], "{family}");
        assert_eq!(Plant::writes(plant.machine()), 0, "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_9_the_watchdog_of_an_altivar_58_on_ascii_is_fed_within_its_second_or_the_line_is_refused() {
    let family = Family::ATV58;
    let settings = SerialSettings::new(19_200, CharacterFormat::F7E1).expect("it is a speed");
    let wiring = Wiring { protocol: drive_sim::Protocol::Ascii, ..Wiring::rtu(settings) };
    let fleet_of = |drives: u8| {
        let simulated = SimLine::new(wiring);
        let protocol = Protocol::Ascii(AsciiSettings::default());
        let config = LineConfig {
            protocol,
            response_timeout: Duration::from_millis(150),
            ..LineConfig::stream(settings)
        };
        let line = Line::over(simulated.in_memory(), config);
        let builder = (1..=drives).fold(Fleet::builder().line("ascii", line), |builder, address| {
            simulated.add_boxed(address, drives::machine(family)).expect("the address is free");
            let settings = DriveSettings::controlled(format!("fan {address}"));
            builder.drive("ascii", address, settings, |port, slave| family.open(port, slave))
        });
        (simulated, builder.start())
    };
    let (simulated, fleet) = fleet_of(3);
    let fleet = fleet.expect("three can be fed");
    let _witnesses = Witnesses::of_fleet(&fleet, [("ascii", &simulated)]);
    for drive in fleet.drives() {
        drive.ready(60 * SECOND).await.expect("it gets ready");
        assert!(drive.run(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
    }
    sleep(600 * SECOND).await;
    for machine in simulated.slaves() {
        let seen = machine.observe();
        assert_eq!((seen.trip, seen.running), (None, true), "{}", machine.name());
    }
    let (_, refused) = fleet_of(16);
    let text = refused.expect_err("16 cannot be fed").to_string();
    assert!(text.contains("the watchdog of fan 1 is 1s"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn rule_1_a_stop_that_is_the_first_thing_a_drive_hears_is_confirmed_when_the_motor_stands_and_not_before()
 {
    for mode in StopMode::ALL {
        each(async |family| {
            let plant = Plant::single(family, |_| {});
            plant.run_at(30).await;
            let plant = plant.restarted().await;
            let outcome = plant.motor().stop(mode).await;
            assert!(outcome.is_confirmed(), "{family} {mode}: {outcome}");
            let seen = plant.machine().observe();
            assert_eq!((seen.running, seen.output_frequency), (false, 0), "{family} {mode}");
        })
        .await;
    }
}

#[tokio::test(start_paused = true)]
async fn rule_12_an_injection_is_held_for_as_long_as_the_motors_owner_says() {
    each(async |family| {
        if !family.capabilities().stop_modes.contains(&StopMode::DcInjection) {
            return;
        }
        for (injection, held) in [(None, 5), (Some(2 * SECOND), 2), (Some(9 * SECOND), 9)] {
            let plant = Plant::single(family, |settings| settings.injection = injection);
            plant.run_at(30).await;
            let stopped = Instant::now();
            let outcome = plant.motor().stop(StopMode::DcInjection).await;
            assert!(outcome.is_confirmed(), "{family}: {outcome}");
            let took = stopped.elapsed();
            let expected = held * SECOND..(held + 3) * SECOND;
            assert!(expected.contains(&took), "{family}, {injection:?}: it was held for {took:?}");
        }
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn rule_12_a_motor_whose_output_was_cut_is_at_rest_only_once_its_owners_coast_time_is_over() {
    each(async |family| {
        for coast in [None, Some(20 * SECOND)] {
            let plant = Plant::single(family, |settings| settings.coast = coast);
            plant.run_at(30).await;
            if !family.capabilities().stop_modes.contains(&StopMode::Freewheel) {
                return;
            }
            let outcome = plant.motor().stop(StopMode::Freewheel).await;
            assert!(outcome.is_confirmed(), "{family}: {outcome}");
            let motion = || plant.motor().snapshot().status.as_ref().map(|status| status.value.motion);
            assert_eq!(motion(), Some(Motion::Coasting), "{family}: the shaft was at 30 Hz a moment ago");
            sleep(30 * SECOND).await;
            let rests = if coast.is_some() { Motion::AtRest } else { Motion::Coasting };
            assert_eq!(motion(), Some(rests), "{family}, {coast:?}");
        }
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn the_reset_of_an_altivar_21_gives_command_back_and_nobody_has_taken_it() {
    // Modbus §6.4: a reset zeroes FA00, and with it the priority by which the bus commands: the terminals command again.
    let mut plant = Plant::single(Family::ATV21, |_| {});
    plant.run_at(30).await;
    plant.happens("trip OC1");
    plant.event("the trip", |kind| matches!(kind, EventKind::Tripped { .. })).await;
    sleep(5 * SECOND).await;
    plant.events_so_far().await;
    assert!(plant.motor().reset_faults().await.is_confirmed());
    plant.event("command given back", |kind| matches!(kind, EventKind::ControlElsewhere(_))).await;
    sleep(5 * SECOND).await;
    let others = plant.events_so_far().await;
    assert!(!others.iter().any(|kind| matches!(kind, EventKind::ControlTaken(_))), "{others:?}");
    let concerns = plant.motor().snapshot().concerns(Instant::now());
    // Nobody saw the shaft come to rest behind the trip.
    assert!(concerns.iter().all(|concern| concern.kind == ConcernKind::Coasting), "{concerns:?}");
}

#[tokio::test(start_paused = true)]
async fn a_start_after_a_power_cut_says_that_its_setpoint_is_zero_and_that_the_motor_does_not_turn() {
    each(async |family| {
        let plant = Plant::single(family, |_| {});
        plant.run_at(30).await;
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}");
        plant.machine().power_cycle();
        sleep(30 * SECOND).await;
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        let outcome = plant.motor().start(Direction::Forward).await;
        let turned = plant.machine().observe().output_frequency;
        let zero = "confirmed: started forward at 0.00 Hz: its setpoint is zero";
        assert_eq!((outcome.to_string().as_str(), turned), (zero, 0), "{family}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_that_is_changed_in_run_is_told_and_the_next_start_has_that_of_the_contract() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.run_at(30).await;
    let register = drive_atv312::registers::TTO.address();
    let set = plant.machine().peek(register);
    assert!(plant.machine().poke(register, 300));
    plant.event("told", |kind| *kind == EventKind::ContractChanged(Ground::Watchdog)).await;
    plant.event("the alarm", |kind| matches!(kind, EventKind::WatchdogNotInForce(_))).await;
    assert!(!matches!(plant.motor().snapshot().watchdog, WatchdogCheck::Verified(_)));
    assert_eq!(plant.machine().peek(register), Some(300), "a motor that turns is not disturbed");
    assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed());
    let outcome = plant.motor().start(Direction::Forward).await;
    assert!(outcome.is_confirmed(), "{outcome}");
    assert_eq!(plant.machine().peek(register), set);
}

#[tokio::test(start_paused = true)]
async fn limits_that_are_lowered_at_the_keypad_in_run_are_told_and_followed() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.run_at(30).await;
    assert!(plant.machine().poke(drive_atv312::registers::HSP.address(), 400));
    plant.event("told", |kind| *kind == EventKind::ContractChanged(Ground::Limits)).await;
    assert!(plant.motor().snapshot().setpoint.is_some(), "it is what was asked");
    sleep(10 * SECOND).await;
    let outcome = plant.motor().set_setpoint(Frequency::from_hertz(45)).await;
    assert!(matches!(outcome, Outcome::Refused(_)), "{outcome}");
    let outcome = plant.motor().set_setpoint(Frequency::from_hertz(35)).await;
    assert!(outcome.is_confirmed(), "{outcome}");
}

#[tokio::test(start_paused = true)]
async fn units_that_another_master_changes_in_run_are_told_and_no_setpoint_is_taken_for_another() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.run_at(30).await;
    // Bit 9 of CMI: LFR counts in other units than 0.1 Hz.
    assert!(plant.machine().poke(drive_atv312::registers::CMI.address(), 1 << 9));
    plant.event("told", |kind| *kind == EventKind::ContractChanged(Ground::Units)).await;
    assert_eq!(plant.motor().snapshot().setpoint, None, "it may be another now");
    let outcome = plant.motor().set_setpoint(Frequency::from_hertz(20)).await;
    sleep(10 * SECOND).await;
    let output = plant.machine().observe().output_frequency;
    assert!(!outcome.is_confirmed() || output.abs_diff(2_000) <= 20, "{outcome}, {output}");
}

#[tokio::test(start_paused = true)]
async fn an_altivar_21_whose_limit_or_regulator_overrides_the_setpoint_is_told_and_brought_to_rest() {
    let drives =
        [("LL", Atv21::new().with_lower_limit(Frequency::from_hertz(30))), ("PI", Atv21::new().regulated())];
    for (name, machine) in drives {
        let settings = controlled(Family::ATV21, MOTOR);
        let simulated = SimLine::new(Wiring::rtu(common_settings()));
        simulated.add(ADDRESS, machine).expect("the address is free");
        let site = Site { simulated, members: vec![(Family::ATV21, ADDRESS, settings)] };
        let mut plant = Plant::open(vec![site]).unwrap().without_witnesses();
        plant.motor().ready(60 * SECOND).await.expect("it gets ready");
        assert!(plant.motor().set_setpoint(Frequency::from_hertz(10)).await.is_confirmed());
        let outcome = plant.motor().start(Direction::Forward).await;
        assert_eq!(
            outcome.to_string(),
            "confirmed: started forward at 10.00 Hz",
            "{name}: it is on its way there"
        );
        let told = plant.event("told", |kind| matches!(kind, EventKind::ReferenceTaken(_))).await;
        assert!(format!("{told:?}").contains("FD00 comes no nearer to FE02"), "{name}: {told:?}");
        sleep(30 * SECOND).await;
        assert!(!plant.machine().observe().running, "{name}: its run command is taken back");
        assert!(!plant.motor().snapshot().started_here(), "{name}");
    }
}
