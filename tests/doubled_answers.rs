//! An answer that comes twice, and what another one withdraws.

use std::time::Duration;

use drive_bus::{Line, LineConfig, exchange::rtu};
use drive_core::{Direction, Drive, Frequency, State, StopMode, Verdict};
use drive_families::{Family, Options};
use drive_fleet::{DriveSettings, Fleet, Periods};
use drive_sim::{SimLine, Wiring, models::atv21::Atv21};
use support::{
    doubling::Doubling,
    drives,
    plant::{self, ADDRESS, MOTOR, PATIENCE, Site},
};
use tokio::time::sleep;

const MS: Duration = Duration::from_millis(1);
/// Within the next exchange, at any place of which such a stream can answer.
const AGAIN: Duration = Duration::from_millis(5);

/// An Altivar 21 that reads its words one by one and runs at 20 Hz by a command of this side.
async fn running() -> (Line, Doubling, Box<dyn Drive>) {
    let settings = Family::ATV21.capabilities().factory;
    let simulated = SimLine::new(Wiring::rtu(settings));
    simulated.add(1, Atv21::new()).expect("the address is free");
    let (cable, end) = Doubling::to(&simulated);
    let line = Line::over(end, LineConfig::stream(settings));
    let slave = 1.try_into().expect("it is one");
    let mut drive = Family::ATV21.open_with(line.slave(1), slave, &Options::default());
    drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect("it is taken");
    drive.start(Direction::Forward).await.expect("it starts");
    for _ in 0..60 {
        sleep(500 * MS).await;
        drive.status().await.expect("it answers");
    }
    (line, cable, drive)
}

#[tokio::test(start_paused = true)]
async fn of_a_running_21_whatever_answer_comes_twice_each_status_is_that_of_its_machine_and_the_run_stays_its_own()
 {
    // Twelve statuses and the four words that take turns behind them.
    for place in 0..52 {
        let (_line, cable, mut drive) = running().await;
        cable.double(place, AGAIN);
        for look in 0..14 {
            let status = drive.status().await.expect("it answers");
            assert_eq!(
                status.output_frequency,
                Some(Frequency::from_hertz(20)),
                "{place}, {look}: {status:?}"
            );
            assert_eq!(status.state, State::Running, "{place}, {look}: {status:?}");
            assert_eq!(status.verdict, Some(Verdict::InForce), "{place}, {look}: {status:?}");
            assert!(drive.lease().is_some(), "{place}, {look}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_a_21_is_confirmed_by_a_motor_that_has_it_whatever_answer_comes_twice() {
    for place in 0..12 {
        let (_line, cable, mut drive) = running().await;
        cable.double(place, AGAIN);
        let stopped = drive.stop(StopMode::Ramp).await.expect("it is confirmed");
        let output = stopped.status.output_frequency.expect("it is told");
        assert!(output <= Frequency::from_hertz(20), "{place}: {stopped:?}");
        assert!(drive.lease().is_none(), "{place}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_status_that_another_answer_withdraws_is_good_for_nobody_from_then_on() {
    let periods = Periods { running: 5_000 * MS, rest: 5_000 * MS, slow: 60_000 * MS, max_age: 20_000 * MS };
    let settings = DriveSettings { periods, watchdog: None, ..plant::controlled(Family::ATV312, MOTOR) };
    let site = Site::new(plant::common_settings(), vec![(Family::ATV312, ADDRESS, settings.clone())]);
    let (cable, end) = Doubling::to(&site.simulated);
    let line = Line::over(end, site.config());
    let build = |port, slave| drives::drive(Family::ATV312, port, slave);
    let fleet = Fleet::builder().line("bench", line.clone()).drive("bench", ADDRESS, settings, build);
    let fleet = fleet.start().expect("it can be fed");
    let motor = fleet.drive(MOTOR).expect("it is there");
    motor.ready(PATIENCE).await.expect("it gets ready");
    sleep(61_000 * MS).await;
    let before = motor.snapshot().status.as_ref().map(|status| status.at);
    let snapshot =
        motor.wait_until(|snapshot| snapshot.status.as_ref().map(|status| status.at) != before).await;
    sleep(100 * MS).await;
    assert!(!motor.snapshot().retracted);
    // Its last answer once more, with another word in it.
    let mut pdu = cable.last()[1..].to_vec();
    pdu.truncate(pdu.len() - 2);
    *pdu.last_mut().expect("it is an answer") ^= 1;
    cable.say(&rtu::frame(ADDRESS, &pdu));
    sleep(5 * MS).await;
    assert!(
        motor.snapshot().retracted,
        "known for 5 ms, and the next is asked for in 4.9 s: {:?}, {:?}",
        snapshot.status,
        line.stats().slaves[&ADDRESS]
    );
    drop(fleet);
    line.close().await;
}
