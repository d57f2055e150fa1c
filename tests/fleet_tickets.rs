//! Tickets: a command is on its way when its method returns, a stop that is dropped stops, and a start that is dropped
//! before its outcome was heard does not run.

use std::{future::ready, time::Duration};

use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{EventKind, FrequencyLimits, GroupStart, LimitProblem, Outcome, Refused, Until};
use support::{
    drives,
    plant::{PATIENCE, Plant, Site, common_settings, controlled},
};
use tokio::time::{Instant, sleep, timeout};

const SECOND: Duration = Duration::from_secs(1);

/// How a stop is asked for.
#[derive(Debug, Clone, Copy)]
enum Layer {
    Handle,
    Group,
    Fleet,
}

/// A motor that runs, and a stop of it beside something that is ready at once, as anybody would write it.
async fn stop_beside_what_is_ready(plant: &Plant, layer: Layer, first: bool) {
    let (motor, group, fleet) = (plant.motor(), plant.fleet.all(), &plant.fleet);
    let mode = StopMode::Ramp;
    match (layer, first) {
        (Layer::Handle, true) => tokio::select! { _ = motor.stop(mode) => {} () = ready(()) => {} },
        (Layer::Handle, false) => tokio::select! { () = ready(()) => {} _ = motor.stop(mode) => {} },
        (Layer::Group, true) => tokio::select! { _ = group.stop(mode) => {} () = ready(()) => {} },
        (Layer::Group, false) => tokio::select! { () = ready(()) => {} _ = group.stop(mode) => {} },
        (Layer::Fleet, true) => tokio::select! { _ = fleet.stop_all(mode) => {} () = ready(()) => {} },
        (Layer::Fleet, false) => tokio::select! { () = ready(()) => {} _ = fleet.stop_all(mode) => {} },
    }
}

#[tokio::test(start_paused = true)]
async fn no_stop_is_lost_beside_a_branch_that_is_ready() {
    for layer in [Layer::Handle, Layer::Group, Layer::Fleet] {
        for first in [true, false] {
            let plant = Plant::single(Family::ATV312, |_| {});
            plant.run_at(1).await;
            let motor = plant.motor();
            let mut lost = 0;
            for _ in 0..100 {
                let started = motor.start_at(Direction::Forward, Frequency::from_hertz(1)).await;
                assert!(started.is_confirmed(), "{started}");
                stop_beside_what_is_ready(&plant, layer, first).await;
                let stands = motor.wait_until(|known| known.stop.is_none() && !known.started_here());
                if timeout(5 * SECOND, stands).await.is_err() {
                    lost += 1;
                    assert!(motor.stop(StopMode::Ramp).await.is_confirmed());
                }
                assert!(!plant.machine().observe().running);
            }
            assert_eq!(lost, 0, "stops of 100, {layer:?}, first: {first}");
        }
    }
}

/// [`drive_bus::Line::close`]: "what waits ends with `PortError::Closed`, but for the write of a stop, which is sent."
#[tokio::test(start_paused = true)]
async fn a_stop_behind_which_its_line_is_closed_at_once_is_sent() {
    for layer in [Layer::Handle, Layer::Group, Layer::Fleet] {
        let plant = Plant::single(Family::ATV312, |settings| settings.watchdog = None);
        plant.run_at(1).await;
        stop_beside_what_is_ready(&plant, layer, true).await;
        plant.lines[0].close().await;
        // Its own watchdog would stop it after ten.
        sleep(3 * SECOND).await;
        assert!(!plant.machine().observe().running, "{layer:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_whose_time_was_over_before_it_was_heard_leaves_the_motor_at_rest() {
    for late in (0..=160).step_by(4).map(Duration::from_millis) {
        let plant = Plant::single(Family::ATV312, |_| {});
        let motor = plant.motor();
        motor.ready(PATIENCE).await.expect("it gets ready");
        let start = timeout(late, motor.start_at(Direction::Forward, Frequency::from_hertz(50))).await;
        sleep(20 * SECOND).await;
        let seen = plant.machine().observe();
        match start {
            Ok(outcome) => assert_eq!((outcome.is_confirmed(), seen.output_frequency), (true, 5_000)),
            Err(_) => assert_eq!((seen.running, seen.output_frequency), (false, 0), "dropped after {late:?}"),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_in_force_long_before_the_motor_stands() {
    let plant = Plant::single(Family::ATV312, |_| {});
    for several in [false, true] {
        plant.run_at(50).await;
        let begun = Instant::now();
        if several {
            let stop = plant.fleet.stop_all(StopMode::Ramp);
            assert!(stop.in_force().await.is_confirmed());
            assert!(plant.machine().observe().output_frequency > 4_000, "it is on its ramp");
            assert!(stop.finished().await.is_confirmed());
        } else {
            let stop = plant.motor().stop(StopMode::Ramp);
            assert_eq!(stop.in_force().await, Outcome::Confirmed);
            assert!(plant.motor().snapshot().stop.is_some_and(|stop| stop.taken));
            assert!(plant.machine().observe().output_frequency > 4_000, "it is on its ramp");
            // Who comes later hears it at once.
            let second = plant.motor().stop(StopMode::Ramp);
            let at = Instant::now();
            assert_eq!(second.in_force().await, Outcome::Confirmed);
            assert!(at < begun + SECOND && plant.machine().observe().output_frequency > 4_000);
            assert!(stop.finished().await.is_confirmed());
        }
        assert_eq!(plant.machine().observe().output_frequency, 0);
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_is_taken_back_at_any_time_until_it_was_heard_and_not_after_that() {
    for family in Family::BUILT_IN {
        for late in [0, 40, 80, 120, 160, 500, 20_000].map(Duration::from_millis) {
            let plant = Plant::single(family, |_| {});
            let motor = plant.motor();
            motor.ready(PATIENCE).await.expect("it gets ready");
            let start = motor.start_at(Direction::Forward, Frequency::from_hertz(30));
            sleep(late).await;
            drop(start);
            sleep(20 * SECOND).await;
            assert!(!plant.machine().observe().running, "{family}: dropped after {late:?}");

            let run = motor.run(Direction::Forward, Frequency::from_hertz(30));
            assert!(run.in_force().await.started().is_some(), "{family}");
            drop(run);
            sleep(20 * SECOND).await;
            assert!(plant.machine().observe().running, "{family}: it was heard that it is in force");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_dropped_before_it_is_sent_is_never_sent() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.motor().ready(PATIENCE).await.expect("it gets ready");
    let writes = Plant::writes(plant.machine());
    let motor = plant.motor();
    drop(motor.start(Direction::Forward));
    drop(motor.set_setpoint(Frequency::from_hertz(20)));
    motor.run(Direction::Forward, Frequency::from_hertz(20)).withdraw();
    plant.machine().trip(drives::a_trip(Family::ATV312));
    plant.event("the trip", |kind| matches!(kind, EventKind::Tripped(_))).await;
    drop(motor.reset_faults());
    sleep(20 * SECOND).await;
    assert_eq!(Plant::writes(plant.machine()), writes);
    assert!(motor.snapshot().status.as_ref().is_some_and(|status| status.value.is_fault()));
}

#[tokio::test(start_paused = true)]
async fn a_dropped_start_does_not_stop_what_somebody_else_has_started_since() {
    let plant = Plant::single(Family::ATV312, |_| {});
    let motor = plant.motor();
    motor.ready(PATIENCE).await.expect("it gets ready");
    let first = motor.start_at(Direction::Forward, Frequency::from_hertz(20));
    sleep(SECOND).await;
    let second = motor.start_at(Direction::Forward, Frequency::from_hertz(30)).await;
    assert!(second.is_confirmed(), "{second}");
    drop(first);
    sleep(20 * SECOND).await;
    assert_eq!(plant.machine().observe().output_frequency, 3_000);
}

#[tokio::test(start_paused = true)]
async fn a_start_of_a_group_that_is_dropped_leaves_nobody_running_and_one_that_was_heard_goes_on() {
    let names = ["1", "2", "3"];
    let member = |(name, address)| (Family::ATV312, address, controlled(Family::ATV312, name));
    let start = GroupStart {
        direction: Direction::Forward,
        setpoint: Some(Frequency::from_hertz(30).into()),
        spacing: Duration::ZERO,
        until: Until::AtReference,
    };
    for late in [0, 40, 80, 160, 400, 1_000, 20_000].map(Duration::from_millis) {
        let site = Site::new(common_settings(), names.into_iter().zip(1..).map(member).collect());
        let plant = Plant::open(vec![site]).expect("it can be fed");
        for drive in plant.fleet.drives() {
            drive.ready(PATIENCE).await.expect("it gets ready");
        }
        let running = || names.iter().filter(|name| plant.machine_of(name).observe().running).count();
        let starting = plant.fleet.all().start(start);
        sleep(late).await;
        drop(starting);
        sleep(20 * SECOND).await;
        assert_eq!(running(), 0, "dropped after {late:?}");

        let starting = plant.fleet.all().start(start);
        starting.in_force().await.expect("all start");
        drop(starting);
        sleep(20 * SECOND).await;
        assert_eq!(running(), names.len());
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_with_limits_is_ready_and_a_start_is_refused_only_where_its_setpoint_is_not_known() {
    let high = Some(Frequency::from_hertz(45));
    let plant = Plant::single(Family::ATV312, |settings| {
        settings.limits = FrequencyLimits { high, ..FrequencyLimits::default() };
    });
    let motor = plant.motor();
    assert_eq!(motor.unready().await, Some(Refused::NotConnected));
    assert_eq!(motor.ready(PATIENCE).await, Ok(()));
    assert_eq!(motor.unready().await, None);
    let at = |hertz| Some(Frequency::from_hertz(hertz).into());
    assert_eq!(motor.would_refuse(None).await, Some(Refused::Limit(LimitProblem::UnknownSetpoint)));
    assert_eq!(motor.would_refuse(at(30)).await, None);
    assert!(matches!(motor.would_refuse(at(46)).await, Some(Refused::Limit(LimitProblem::Outside { .. }))));
}
