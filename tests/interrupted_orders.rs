//! Orders that nobody waits for to the end, and orders whose answers the line loses: what is told of them is what the drive was
//! written, and what this side may have written itself is no other master's.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Drive, Frequency, SerialSettings, Verdict};
use drive_families::{Family, SetUp};
use drive_fleet::{DriveSettings, Fleet, FrequencyLimits, Outcome, Unconfirmed};
use drive_sim::{Fault, Faults, SimLine, SimSlave, Wiring};
use tokio::time::{Instant, sleep, timeout};

const FAMILIES: [Family; 5] =
    [Family::ATV21, Family::ATV28, Family::ATV58, Family::ATV312, Family::OMRON_3G3EV];
const TWENTY: Frequency = Frequency::from_hertz(20);
const THIRTY: Frequency = Frequency::from_hertz(30);

fn milliseconds(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// A line with one simulated drive that the bus commands.
fn plant(family: Family) -> (SimLine, SimSlave, Line) {
    // An Altivar 28 has no parity.
    let settings =
        if family == Family::ATV28 { "9600 8N1".parse().unwrap() } else { SerialSettings::MODBUS_DEFAULT };
    let plant = SimLine::new(Wiring::rtu(settings));
    let machine = family.machine(SetUp::ForTheBus).expect("the family has a machine");
    let machine = plant.add_boxed(1, machine).expect("the line is empty");
    let line = Line::over(plant.in_memory(), LineConfig::stream(settings));
    (plant, machine, line)
}

/// The same drive in a fleet, connected.
async fn fleet(family: Family, settings: DriveSettings) -> (SimLine, SimSlave, Fleet) {
    let (plant, machine, line) = plant(family);
    let options = family.simulated_options();
    let fleet = Fleet::builder()
        .line("line", line)
        .drive("line", 1, settings, move |port, slave| family.open_with(port, slave, &options))
        .whatever_the_plan()
        .start()
        .expect("one drive on one line");
    fleet.drive("pump").unwrap().ready(milliseconds(20_000)).await.expect("it answers");
    (plant, machine, fleet)
}

/// From so long from now on, for so long, no answer comes through: what is asked arrives.
fn lose_answers(plant: &SimLine, from: Duration, lasts: Duration) {
    let plant = plant.clone();
    tokio::spawn(async move {
        sleep(from).await;
        plant.set_faults(Faults::seeded(1).with(Fault::Lost, 1_000_000));
        sleep(lasts).await;
        plant.set_faults(Faults::seeded(1));
    });
}

/// Whether anything was written since but the steps of a chart that lead up to a run command, 0006h and 0007h.
fn is_written(machine: &SimSlave, since: Instant) -> bool {
    let received = machine.received_since(since);
    received
        .iter()
        .any(|request| matches!(request.pdu[0], 6 | 16) && !matches!(&request.pdu[3..], [0, 6] | [0, 7]))
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_whose_call_was_dropped_is_no_other_masters() {
    for family in FAMILIES {
        for cut in (0..80).step_by(3) {
            let (_plant, _machine, line) = plant(family);
            let slave = 1.try_into().unwrap();
            let mut drive = family.open_with(line.slave(1), slave, &family.simulated_options());
            drive.set_setpoint(TWENTY.into()).await.unwrap();
            drive.start(Direction::Forward).await.unwrap();
            sleep(milliseconds(1_000)).await;
            for hertz in [31, 17] {
                let call = drive.set_setpoint(Frequency::from_hertz(hertz).into());
                let _ = timeout(milliseconds(cut), call).await;
            }
            for _ in 0..60 {
                sleep(milliseconds(50)).await;
                let verdict = drive.status().await.unwrap().verdict;
                assert!(
                    !matches!(verdict, Some(Verdict::NotInForce { .. }) | None),
                    "{family}, dropped after {cut} ms: {verdict:?}"
                );
            }
        }
    }
}

/// Whoever opens a drive over a line has not to know of its pause.
#[tokio::test(start_paused = true)]
async fn a_drive_that_is_opened_over_a_line_has_its_pause_without_anybody_who_configures_it() {
    for family in FAMILIES {
        let (plant, _machine, line) = plant(family);
        let slave = 1.try_into().unwrap();
        let mut drive = family.open_with(line.slave(1), slave, &family.simulated_options());
        for _ in 0..20 {
            drive.status().await.unwrap();
        }
        assert_eq!(plant.violations(), [], "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_whose_answers_are_lost_does_not_stop_the_motor_that_goes_on() {
    for family in FAMILIES {
        for from in (0..120).step_by(7) {
            let (plant, machine, fleet) = fleet(family, DriveSettings::controlled("pump")).await;
            let pump = fleet.drive("pump").unwrap();
            assert!(pump.run(Direction::Forward, TWENTY).await.is_confirmed());
            sleep(milliseconds(500)).await;
            lose_answers(&plant, milliseconds(from), milliseconds(1_500));
            let outcome = pump.set_setpoint(THIRTY).await;
            sleep(milliseconds(15_000)).await;
            let observed = machine.observe();
            assert!(observed.running, "{family}, lost after {from} ms: {outcome}, and the motor stands");
            let asked = if outcome.is_confirmed() { 3_000 } else { observed.output_frequency };
            assert_eq!(observed.output_frequency, asked, "{family}, {from} ms: {outcome}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_the_other_way_whose_run_word_was_not_sent_is_not_confirmed_by_the_one_that_stands() {
    for family in FAMILIES {
        for from in (0..300).step_by(11) {
            let (plant, machine, fleet) = fleet(family, DriveSettings::controlled("pump")).await;
            let pump = fleet.drive("pump").unwrap();
            assert!(pump.run(Direction::Forward, TWENTY).await.is_confirmed());
            sleep(milliseconds(500)).await;
            lose_answers(&plant, milliseconds(from), milliseconds(100 + from * 37 % 3_900));
            let outcome = pump.start_at(Direction::Reverse, THIRTY).await;
            sleep(milliseconds(30_000)).await;
            let output = machine.observe().output_frequency;
            assert_eq!(
                outcome.is_confirmed(),
                output < 0,
                "{family}, lost after {from} ms: {outcome}, and the motor turns at {output}"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn of_what_was_not_written_nobody_says_that_it_was_sent_nor_of_what_was_that_it_never_will_be() {
    for family in FAMILIES {
        for from in (0..200).step_by(7) {
            for starts in [false, true] {
                let (plant, machine, fleet) = fleet(family, DriveSettings::controlled("pump")).await;
                let pump = fleet.drive("pump").unwrap();
                let first = match starts {
                    true => pump.set_setpoint(TWENTY).await,
                    false => pump.run(Direction::Forward, TWENTY).await,
                };
                assert!(first.lets_a_start_follow_here(), "{family}: {first}");
                sleep(milliseconds(500)).await;
                let before = Instant::now();
                lose_answers(&plant, milliseconds(from), milliseconds(650));
                let outcome = match starts {
                    true => pump.start(Direction::Forward).await,
                    false => pump.set_setpoint(THIRTY).await,
                };
                let written = is_written(&machine, before);
                let told = matches!(outcome, Outcome::Expired | Outcome::Refused(_));
                let what = format!("{family}, start {starts}, lost after {from} ms: {outcome}");
                assert!(written || told, "{what}, and nothing was written");
                assert!(
                    !(written && matches!(outcome, Outcome::Expired)),
                    "{what}, and something was written"
                );
            }
        }
    }
}

/// What a test before a start asks of a setpoint.
trait LetsAStartFollow {
    fn lets_a_start_follow_here(&self) -> bool;
}

impl LetsAStartFollow for Outcome {
    fn lets_a_start_follow_here(&self) -> bool {
        match self {
            Self::NotConfirmed(Unconfirmed::Denied(error)) => error.only_a_start_shows(),
            outcome => outcome.is_confirmed(),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_dropped_order_frees_no_setpoint_of_the_largest_change_per_second() {
    let limits = FrequencyLimits {
        high: Some(Frequency::from_hertz(50)),
        change_per_second: Some(Frequency::from_hertz(2)),
        ..FrequencyLimits::default()
    };
    for family in FAMILIES {
        for cut in (0..300).step_by(13) {
            for order in 0..3 {
                let settings = DriveSettings { limits: limits.clone(), ..DriveSettings::controlled("pump") };
                let (_plant, machine, fleet) = fleet(family, settings).await;
                let pump = fleet.drive("pump").unwrap();
                assert!(pump.run(Direction::Forward, TWENTY).await.is_confirmed());
                sleep(milliseconds(100 + cut)).await;
                let ticket = match order {
                    0 => pump.set_setpoint(TWENTY),
                    1 => pump.start_at(Direction::Forward, TWENTY),
                    _ => pump.start(Direction::Forward),
                };
                sleep(milliseconds(cut)).await;
                drop(ticket);
                let outcome = pump.set_setpoint(Frequency::from_hertz(45)).await;
                sleep(milliseconds(3_000)).await;
                let output = machine.observe().output_frequency;
                assert!(
                    output < 3_000,
                    "{family}, order {order} dropped after {cut} ms: {outcome}, {output} after 3 s"
                );
            }
        }
    }
}
