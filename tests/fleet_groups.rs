//! Groups and policies of a fleet over the simulator, in virtual time.

use std::time::Duration;

use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_families::Family;
use drive_fleet::{
    Band, Commanders, DriveSettings, EventKind, FrequencyLimits, GroupFailure, GroupStart, Limit,
    LimitProblem, Link, OnLoss, Outcome, Received, Refused, Snapshot, Until,
};
use futures_util::StreamExt as _;
use support::{
    drives,
    plant::{ADDRESS, MOTOR, PATIENCE, Plant, Site, common_settings, controlled},
};
use tokio::time::{Instant, sleep, timeout};

const SECOND: Duration = Duration::from_secs(1);

/// Four drives of four families, ready.
async fn four() -> Plant {
    let families = [Family::ATV312, Family::ATV28, Family::ATV21, Family::OMRON_3G3EV];
    let member = |(family, address): (Family, u8)| (family, address, controlled(family, &family.to_string()));
    let site = Site::new(common_settings(), families.into_iter().zip(1..).map(member).collect());
    let plant = Plant::open(vec![site]).expect("it can be fed");
    for drive in plant.fleet.drives() {
        drive.ready(60 * SECOND).await.expect("it gets ready");
    }
    plant
}

fn start(spacing: Duration) -> GroupStart {
    let setpoint = Some(Frequency::from_hertz(30).into());
    GroupStart { direction: Direction::Forward, setpoint, spacing, until: Until::AtReference }
}

fn nobody_runs(plant: &Plant) -> bool {
    plant.fleet.drives().iter().all(|drive| !plant.machine_of(drive.name()).observe().running)
}

#[tokio::test(start_paused = true)]
async fn a_group_starts_together_and_reaches_its_reference() {
    let plant = four().await;
    let started = plant.fleet.all().start(start(Duration::ZERO)).await.expect("all start");
    assert_eq!(started.len(), 4);
    for (name, outcome) in started {
        assert_eq!(outcome.to_string(), "confirmed: started forward at 30.00 Hz", "{name}");
    }
    for drive in plant.fleet.drives() {
        // Where no bit tells it, it counts as reached a little before.
        let output = plant.machine_of(drive.name()).observe().output_frequency;
        assert!(output.abs_diff(3_000) <= 50, "{}: {output}", drive.name());
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_lost_on_its_way_to_its_reference_reaches_it_all_the_same() {
    let settings = DriveSettings::controlled(MOTOR);
    let site = Site::new(common_settings(), vec![(Family::ATV21, ADDRESS, settings)]);
    let mut plant = Plant::open(vec![site]).expect("it can be");
    plant.motor().ready(60 * SECOND).await.expect("it gets ready");
    let group = plant.fleet.all();
    let started = tokio::spawn(async move { group.start(start(Duration::ZERO)).await });
    plant.event("the start", |kind| matches!(kind, EventKind::StateChanged { .. })).await;
    plant.machine().mute();
    plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
    plant.machine().unmute();
    started.await.expect("it ends").expect("the motor runs at 30 Hz");
}

#[tokio::test(start_paused = true)]
async fn a_staggered_group_starts_one_after_the_other() {
    let plant = four().await;
    let fleet = plant.fleet.clone();
    let begin = Instant::now();
    let started = tokio::spawn(async move { fleet.all().start(start(5 * SECOND)).await });
    for (drive, number) in plant.fleet.drives().iter().zip(0..) {
        plant.machine_of(drive.name()).wait_until(|machine| machine.running).await;
        assert!(begin.elapsed() >= 5 * SECOND * number, "{}", drive.name());
        let late = begin.elapsed().saturating_sub(5 * SECOND * number);
        // An Altivar 312 reads anew all that decides a setpoint and a start.
        assert!(late <= SECOND + SECOND / 4, "{}: {late:?}", drive.name());
    }
    started.await.expect("it ends").expect("all start");
}

#[tokio::test(start_paused = true)]
async fn when_one_is_not_ready_it_is_named_and_nobody_starts() {
    let mut plant = four().await;
    plant.machine_of("atv28").trip(drives::a_trip(Family::ATV28));
    plant.event("the trip", |kind| matches!(kind, EventKind::Tripped(_))).await;
    let failure = plant.fleet.all().start(start(Duration::ZERO)).await.expect_err("one has tripped");
    let GroupFailure::NotReady(unready) = failure else { panic!("{failure}") };
    let names: Vec<_> = unready.iter().map(|(name, _)| name.to_string()).collect();
    assert_eq!(names, ["atv28"]);
    sleep(5 * SECOND).await;
    assert!(nobody_runs(&plant));
}

#[tokio::test(start_paused = true)]
async fn when_one_does_not_start_the_others_are_stopped_again() {
    let plant = four().await;
    // It trips after everybody was asked, before its own start.
    let machine = plant.machine_of("3g3ev").clone();
    let others = plant.machine_of("atv312").clone();
    tokio::spawn(async move {
        others.wait_until(|machine| machine.running).await;
        machine.trip(drives::a_trip(Family::OMRON_3G3EV));
    });
    let failure = plant.fleet.all().start(start(2 * SECOND)).await.expect_err("one trips");
    let GroupFailure::Failed { outcomes, stopped } = failure else { panic!("{failure}") };
    let names: Vec<_> = outcomes.iter().map(|(name, _)| name.to_string()).collect();
    assert_eq!(names, ["3g3ev"]);
    assert!(stopped.is_confirmed(), "{stopped}");
    assert!(nobody_runs(&plant));
}

/// What has the terminals of the Altivar 21 turn its motor at 20 Hz: they command, and the bus gives the reference (its Modbus manual, §6.2).
const TERMINALS_RUN: [&str; 4] = ["set CMOD 0", "set FMOD 4", "master FA01 2000", "terminal F on"];

#[tokio::test(start_paused = true)]
async fn a_motor_that_its_terminals_turn_is_not_ready_and_is_left_alone() {
    let plant = four().await;
    let others = plant.machine_of("atv21").clone();
    TERMINALS_RUN.iter().for_each(|deed| plant.happens_to("atv21", deed));
    others.wait_until(|machine| machine.output_frequency == 2_000).await;
    sleep(2 * SECOND).await;
    let failure = plant.fleet.all().start(start(Duration::ZERO)).await.expect_err("one is in other hands");
    let GroupFailure::NotReady(unready) = failure else { panic!("{failure}") };
    assert_eq!(unready.len(), 1);
    assert!(unready[0].1.to_string().contains("terminals"), "{}", unready[0].1);
    sleep(5 * SECOND).await;
    assert_eq!(others.observe().output_frequency, 2_000);
    assert!(!plant.machine_of("atv312").observe().running);
}

#[tokio::test(start_paused = true)]
async fn nothing_is_written_to_a_drive_that_stands_and_that_somebody_else_commands() {
    let plant = Plant::single(Family::ATV312, |_| {});
    // BBV51701 p. 44: LI5 forces local, the terminals' channel.
    ["set FLO 133", "set FLOC 1", "terminal LI5 on"].iter().for_each(|deed| plant.happens(deed));
    plant.motor().ready(60 * SECOND).await.expect("it gets ready");
    sleep(3 * SECOND).await;
    let before = plant.machine().received().len();
    let outcome = plant.motor().start_at(Direction::Forward, Frequency::from_hertz(20)).await;
    assert!(matches!(outcome, Outcome::Refused(_)), "{outcome}");
    let writes = |pdu: &[u8]| matches!(pdu.first(), Some(6 | 16));
    let received = plant.machine().received();
    assert!(!received[before..].iter().any(|request| writes(&request.pdu)), "{outcome}");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_its_terminals_turn_before_its_turn_comes_is_left_alone_when_the_group_is_stopped() {
    let plant = std::sync::Arc::new(four().await);
    let (first, around) = (plant.machine_of("atv312").clone(), plant.clone());
    tokio::spawn(async move {
        first.wait_until(|machine| machine.running).await;
        TERMINALS_RUN.iter().for_each(|deed| around.happens_to("atv21", deed));
    });
    let failure = plant.fleet.all().start(start(2 * SECOND)).await.expect_err("one refuses");
    let GroupFailure::Failed { outcomes, stopped } = failure else { panic!("{failure}") };
    assert_eq!(outcomes[0].0.as_ref(), "atv21");
    assert_eq!(stopped.confirmed.len(), 2, "{stopped}");
    sleep(10 * SECOND).await;
    assert_eq!(plant.machine_of("atv21").observe().output_frequency, 2_000);
    assert!(!plant.machine_of("atv312").observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_group_that_failed_to_start_does_not_slow_a_freewheel_that_is_under_way() {
    let plant = four().await;
    let (stopped, tripped) = (plant.drive("atv312"), plant.machine_of("3g3ev").clone());
    let machine = plant.machine_of("atv312").clone();
    let motor = stopped.clone();
    tokio::spawn(async move {
        machine.wait_until(|machine| machine.running).await;
        sleep(SECOND).await;
        machine.mute();
        let freewheel = motor.stop(StopMode::Freewheel);
        tripped.trip(drives::a_trip(Family::OMRON_3G3EV));
        let _outcome = freewheel.await;
    });
    plant.fleet.all().start(start(2 * SECOND)).await.expect_err("one trips");
    assert_eq!(stopped.snapshot().stop.map(|stop| stop.mode), Some(StopMode::Freewheel));
}

#[tokio::test(start_paused = true)]
async fn a_group_takes_a_setpoint_and_each_drives_outcome_is_told() {
    let plant = four().await;
    plant.fleet.all().start(start(Duration::ZERO)).await.expect("all start");
    let group = plant.fleet.group(["atv312", "atv21"]).expect("they are there");
    let outcomes = group.set_setpoint(Frequency::from_hertz(20)).await;
    assert!(outcomes.iter().all(|(_, outcome)| outcome.is_confirmed()), "{outcomes:?}");
    plant.machine_of("atv312").wait_until(|machine| machine.output_frequency == 2_000).await;
    plant.machine_of("atv21").wait_until(|machine| machine.output_frequency == 2_000).await;
    assert_eq!(plant.machine_of("atv28").observe().output_frequency, 3_000);
    assert!(plant.fleet.group(["nobody"]).is_err());
}

#[tokio::test(start_paused = true)]
async fn limits_bands_and_rates_keep_a_setpoint_from_the_machine() {
    let hertz = Frequency::from_hertz;
    let plant = Plant::single(Family::ATV312, |settings| {
        settings.limits = FrequencyLimits {
            low: Some(hertz(10)),
            high: Some(hertz(45)),
            forbidden: vec![Band { low: hertz(20), high: hertz(25) }],
            change_per_second: Some(hertz(2)),
        };
    });
    plant.run_at(30).await;
    let motor = plant.motor();
    for (asked, expected) in [(46, "outside"), (9, "outside"), (22, "forbidden band")] {
        let outcome = motor.set_setpoint(hertz(asked)).await;
        assert!(outcome.to_string().contains(expected), "{asked} Hz: {outcome}");
    }
    sleep(SECOND).await;
    assert!(motor.set_setpoint(hertz(32)).await.is_confirmed());
    let outcome = motor.set_setpoint(hertz(44)).await;
    assert!(matches!(outcome, Outcome::Refused(Refused::Limit(LimitProblem::TooFast { .. }))), "{outcome}");
    sleep(10 * SECOND).await;
    assert!(motor.set_setpoint(hertz(44)).await.is_confirmed());
}

#[tokio::test(start_paused = true)]
async fn only_those_who_may_command_do_and_anybody_may_stop() {
    let plant = Plant::single(Family::ATV312, |settings| {
        settings.commanders = Commanders::Only(vec!["operator".to_owned()]);
    });
    let operator = plant.motor().commanded_by("operator");
    operator.ready(60 * SECOND).await.expect("it gets ready");
    let visitor = plant.motor().commanded_by("visitor");
    let outcome = visitor.start(Direction::Forward).await;
    assert_eq!(outcome, Outcome::Refused(Refused::Commander("visitor".to_owned())));
    assert!(operator.run(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
    assert!(visitor.stop(StopMode::Ramp).await.is_confirmed());
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_was_lost_is_stopped_on_its_return_where_its_policy_says_so() {
    let mut plant = Plant::single(Family::ATV28, |settings| settings.on_loss = OnLoss::Stop(StopMode::Ramp));
    plant.run_at(30).await;
    plant.machine().mute();
    plant.event("the loss", |kind| matches!(kind, EventKind::Lost { .. })).await;
    sleep(10 * SECOND).await;
    assert!(plant.machine().observe().running, "it has no watchdog");
    plant.machine().unmute();
    plant.event("the stop", |kind| matches!(kind, EventKind::StopConfirmed { .. })).await;
    assert!(!plant.machine().observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_current_above_its_alarm_is_told_and_told_when_it_is_back() {
    let mut plant = Plant::single(Family::ATV312, |settings| {
        settings.alarms.current = Some(drive_core::Current::from_deciamperes(20));
    });
    plant.run_at(30).await;
    plant.machine().set_load(100);
    let told = plant.event("too much", |kind| matches!(kind, EventKind::Limit { exceeded: true, .. })).await;
    assert!(matches!(told, EventKind::Limit { limit: Limit::Current { .. }, .. }));
    plant.machine().set_load(0);
    plant.event("enough", |kind| matches!(kind, EventKind::Limit { exceeded: false, .. })).await;
}

/// The limits of a fleet may be lowered under a motor that runs, and another master may give it a reference.
#[tokio::test(start_paused = true)]
async fn a_motor_that_runs_above_the_limit_of_its_setpoints_is_told_whoever_made_it() {
    let mut plant = Plant::single(Family::ATV312, |settings| {
        settings.limits.high = Some(Frequency::from_hertz(35));
        settings.on_control_taken = drive_fleet::OnControlTaken::Report;
    });
    plant.run_at(30).await;
    plant.machine().written_by_another(8_502, 480).expect("LFr is written");
    let told = plant.event("above", |kind| matches!(kind, EventKind::Limit { exceeded: true, .. })).await;
    let EventKind::Limit { limit: Limit::Frequency { measured, limit }, .. } = told else { panic!("{told}") };
    assert!(limit == Frequency::from_hertz(35) && measured > limit, "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_panel_that_takes_a_running_drive_is_told() {
    let mut plant = Plant::single(Family::ATV312, |_| {});
    plant.run_at(30).await;
    plant.machine().panel(drive_sim::Panel::TakeControl);
    plant.event("the panel", |kind| matches!(kind, EventKind::ControlTaken(_))).await;
    plant.machine().panel(drive_sim::Panel::ReleaseControl);
    plant.event("the bus again", |kind| *kind == EventKind::ControlReturned).await;
}

#[tokio::test(start_paused = true)]
async fn two_drives_at_one_address_or_of_one_name_are_refused() {
    let settings = |name: &str| DriveSettings::watched(name);
    let site = Site::new(SerialSettings::MODBUS_DEFAULT, vec![(Family::ATV312, ADDRESS, settings(MOTOR))]);
    let mut twice = site.members.clone();
    twice.push((Family::ATV312, ADDRESS, settings("another")));
    let Err(error) = Plant::open(vec![Site { members: twice, ..site }]) else {
        panic!("one address, two drives")
    };
    assert_eq!(error.to_string(), "another: address 5 of line \"line 0\" is taken");
    let members = vec![(Family::ATV312, 1, settings(MOTOR)), (Family::ATV312, 2, settings(MOTOR))];
    let Err(error) = Plant::open(vec![Site::new(SerialSettings::MODBUS_DEFAULT, members)]) else {
        panic!("one name, two drives")
    };
    assert_eq!(error.to_string(), "\"motor\": the name is taken");
}

#[tokio::test(start_paused = true)]
async fn a_start_at_a_setpoint_is_confirmed_in_force_and_not_only_at_its_reference() {
    for family in Family::BUILT_IN {
        let plant = Plant::single(family, |_| {});
        assert_eq!(plant.motor().ready(PATIENCE).await, Ok(()), "{family}");
        let setpoint = Frequency::from_hertz(30);
        let outcome = plant.motor().start_at(Direction::Forward, setpoint).await;
        assert_eq!(outcome.to_string(), "confirmed: started forward at 30.00 Hz", "{family}");
        let started = plant.machine().observe();
        assert!(started.running && started.output_frequency < 2_900, "{family}: {started:?}, on its way");
        let is_there = |snapshot: &Snapshot| snapshot.has_reached_setpoint(Instant::now()) == Some(true);
        let snapshot = plant.motor().wait_until(is_there).await;
        assert_eq!(snapshot.setpoint, Some(setpoint.into()), "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_stream_of_events_tells_what_recv_tells_and_ends_with_the_fleet() {
    let plant = Plant::single(Family::ATV312, |_| {});
    let read = tokio::spawn(plant.fleet.events().collect::<Vec<Received>>());
    plant.motor().wait_until(|snapshot| snapshot.link == Link::Connected).await;
    let _ = plant.fleet.shutdown(PATIENCE).await;
    drop(plant);
    let read = timeout(PATIENCE, read).await.expect("it ends").expect("no panic");
    let is = |received: &Received, is_it: fn(&EventKind) -> bool| matches!(received, Received::Event(event) if is_it(&event.kind));
    assert!(
        read.iter().any(|received| is(received, |kind| matches!(kind, EventKind::Connected(_)))),
        "{read:?}"
    );
    assert!(is(read.last().expect("events"), |kind| matches!(kind, EventKind::Exit(_))), "{read:?}");
    assert!(!read.contains(&Received::End));
}

/// A line of drives, of which these may not be commanded.
async fn line_of(families: &[Family], read_only: &[u8]) -> Plant {
    let member = |(family, address): (&Family, u8)| {
        let name = address.to_string();
        let settings = match read_only.contains(&address) {
            true => DriveSettings::watched(name),
            false => controlled(*family, &name),
        };
        (*family, address, settings)
    };
    let site = Site::new(common_settings(), families.iter().zip(1..).map(member).collect());
    let plant = Plant::open(vec![site]).expect("it can be fed");
    for drive in plant.fleet.drives() {
        match drive.settings().control {
            true => {
                drive.ready(PATIENCE).await.expect("it gets ready");
                let started = drive.start_at(Direction::Forward, Frequency::from_hertz(20)).await;
                assert!(started.is_confirmed(), "{started}");
            }
            false => drop(drive.wait_until(|snapshot| snapshot.link == Link::Connected).await),
        }
    }
    plant
}

#[tokio::test(start_paused = true)]
async fn a_stop_by_broadcast_reaches_only_a_line_whose_drives_are_all_meant_may_all_be_commanded_and_all_take_it()
 {
    let mut broadcast = 0;
    for family in Family::BUILT_IN {
        let Some(mode) = family.capabilities().broadcast_stops.first().copied() else { continue };
        let plant = line_of(&[family, family], &[]).await;
        let report = plant.fleet.all().stop(mode).await;
        assert_eq!(report.broadcasts.len(), 1, "{family}: all of a line");
        assert!(report.is_confirmed() && nobody_runs(&plant), "{family}: {report}");
        broadcast += 1;

        let plant = line_of(&[family, family], &[]).await;
        let report = plant.fleet.group(["1"]).expect("it is there").stop(mode).await;
        assert_eq!(report.broadcasts.len(), 0, "{family}: one of two is not meant");
        assert!(plant.machine_of("2").observe().running, "{family}: and is left alone");

        let plant = line_of(&[family, family], &[2]).await;
        let writes = Plant::writes(plant.machine_of("2"));
        let report = plant.fleet.all().stop(mode).await;
        assert_eq!(report.broadcasts.len(), 0, "{family}: one of two is only read");
        assert_eq!(Plant::writes(plant.machine_of("2")), writes, "{family}");

        let other = if family == Family::OMRON_3G3EV { Family::ATV312 } else { Family::OMRON_3G3EV };
        let plant = line_of(&[family, other], &[]).await;
        let report = plant.fleet.all().stop(mode).await;
        assert_eq!(report.broadcasts.len(), 0, "{family}: to {other} the word means something else");
        assert!(report.is_confirmed(), "{family}: {report}");
    }
    assert!(broadcast > 0, "no family takes one");
}
