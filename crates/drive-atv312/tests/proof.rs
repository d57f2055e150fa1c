//! Who moves the motor, looked at in every status for as long as a run command of ours stands; what the shaft does; and what
//! starts nobody's motor. Expected from BBV51701 (page at each test).

use std::time::Duration;

use drive_atv312::{Atv312, ROWS};
use drive_bus::{Line, Slave};
use drive_core::{
    Control, Direction, Drive, Error, Frequency, Ground, Identity, Lack, Motion, Reaction, Recognised,
    Refusal, Row, STATUSES_PER_TURN, Setpoint, Status, StopMode, Verdict, Withdrawn,
};
use drive_sim::{Panel, SimSlave, models};
use drive_testing::bench;

type Drive312 = Atv312<Slave>;

const CMD: u16 = 8501;
const LFR: u16 = 8502;
const TWENTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(20));

fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

/// Runs at 20 Hz by our command, all settings known.
async fn running() -> (Drive312, SimSlave, Line) {
    let model = models::atv312::Atv312::under_bus_control();
    let (mut drive, machine, line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
    drive.set_setpoint(TWENTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == 2_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!((status.verdict, status.motion), (Some(Verdict::InForce), Motion::Driven));
    (drive, machine, line)
}

fn lacks(status: &Status) -> Option<Lack> {
    match status.verdict {
        Some(Verdict::NotInForce { lacks, .. }) => Some(lacks),
        _ => None,
    }
}

/// The first status of so many that says what the run command lacks.
async fn told_within(drive: &mut Drive312, statuses: u16) -> Option<(Lack, String)> {
    for _ in 0..statuses {
        let status = drive.status().await.unwrap();
        if let Some(lack) = lacks(&status) {
            return Some((lack, status.verdict.unwrap().to_string()));
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    None
}

#[tokio::test(start_paused = true)]
async fn what_takes_the_run_command_its_output_or_its_reference_is_told_within_a_few_statuses() {
    // p. 8, 20, 38, 40: FSt by LI6, nSt by LI5, the STOP key, forced local, a supply that fails.
    for (what, lack) in [
        ("fast stop", Lack::Output),
        ("freewheel", Lack::Output),
        ("key", Lack::Output),
        ("local", Lack::Command),
        ("supply", Lack::Output),
        ("reference of another master", Lack::Reference),
        ("sign of another master", Lack::Reference),
        ("stop of another master", Lack::Command),
    ] {
        let (mut drive, machine, line) = running().await;
        match what {
            "fast stop" => assert!(machine.poke(11204, 134)),
            "freewheel" => assert!(machine.poke(11202, 133)),
            "key" => machine.panel(Panel::Stop),
            "local" => machine.panel(Panel::TakeControl),
            "supply" => machine.motor_supply(false),
            "reference of another master" => bench::write(&line, LFR, 480).await,
            "sign of another master" => bench::write(&line, LFR, 0xFF38).await,
            _ => bench::write(&line, CMD, 0x100F).await,
        }
        let told = told_within(&mut drive, 40).await;
        assert_eq!(told.as_ref().map(|(lack, _)| *lack), Some(lack), "{what}: {told:?}");
        let ended = what == "stop of another master";
        assert_eq!(drive.lease().is_none(), ended, "{what}: the word stands until it was seen not to");
    }
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_is_first_seen_behind_a_reconnect_is_withdrawn_on_the_wire() {
    let (mut drive, machine, _line) = running().await;
    machine.trip(9);
    drive.forget();
    let status = drive.status().await.unwrap();
    assert_eq!(lacks(&status), Some(Lack::Output), "{:?}", status.verdict);
    let withdrawn = drive.withdraw().await.unwrap();
    assert!(matches!(withdrawn, Withdrawn::Ended(_)));
    assert_eq!(bench::written(&machine, CMD).last(), Some(&0x100F));
    assert_eq!(drive.lease(), None);
    assert!(matches!(drive.withdraw().await.unwrap(), Withdrawn::Nothing(_)), "and then there is nothing");
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_adopted_where_the_drive_holds_it_and_ends_where_it_does_not() {
    let (drive, _machine, line) = running().await;
    let lease = drive.lease().unwrap();
    let again = || Atv312::new(line.slave(1), bench::address(1));
    let mut adopted = again();
    adopted.adopt(lease);
    for _ in 0..3 {
        adopted.status().await.unwrap();
    }
    assert_eq!(adopted.status().await.unwrap().verdict, Some(Verdict::InForce));
    adopted.stop(StopMode::Ramp).await.unwrap();
    let mut late = again();
    late.adopt(lease);
    assert_eq!(lacks(&late.status().await.unwrap()), Some(Lack::Command));
    assert_eq!((late.lease(), late.status().await.unwrap().verdict), (None, None));
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_leaves_the_direction_of_a_motor_whose_reference_another_master_has_turned_round() {
    // LFr and LFRD are signed, p. 16 and 19.
    for (register, word, after) in [(LFR, 0xFF38, -1_000), (8602, 0xFDA8, -1_000)] {
        let (mut drive, machine, line) = running().await;
        bench::write(&line, register, word).await;
        machine.wait_until(|seen| seen.output_frequency < -1_500).await;
        assert_eq!(drive.status().await.unwrap().direction, Some(Direction::Reverse));
        drive.set_setpoint(Frequency::from_hertz(10).into()).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == after).await;
    }
}

#[tokio::test(start_paused = true)]
async fn direct_current_is_held_for_its_time_and_a_freewheel_coasts_until_its_owner_says_that_it_rests() {
    for load in [0, 50] {
        let (mut drive, machine, _line) = running().await;
        machine.set_load(load);
        drive.stop(StopMode::DcInjection).await.unwrap();
        let mut motions = Vec::new();
        for _ in 0..60 {
            let status = drive.status().await.unwrap();
            let stands = machine.observe().shaft_frequency == 0;
            assert!(!status.is_standstill() || stands, "told at rest and turns");
            motions.push(status.motion);
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        assert_eq!((motions[0], motions[59]), (Motion::Braking, Motion::Held));
    }
    let (mut drive, machine, _line) = running().await;
    drive.set_coast_time(Some(Duration::from_secs(30)));
    drive.stop(StopMode::Freewheel).await.unwrap();
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
    machine.wait_until(|seen| seen.shaft_frequency == 0).await;
    tokio::time::sleep(Duration::from_secs(30)).await;
    assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn bit_9_of_cmi_a_changed_watchdog_and_lowered_limits_are_seen_in_their_time() {
    let (mut drive, machine, line) = running().await;
    // p. 20: a count is 600 / 32767 Hz from now on.
    bench::write(&line, 8504, 1 << 9).await;
    for _ in 0..2 {
        let shown = drive.status().await.unwrap().output_frequency.unwrap().centihertz();
        assert!(shown.abs_diff(2_000) <= 4, "{shown}");
    }
    assert_eq!(drive.take_changed(), Some(Ground::Units));

    let (mut armed, machine_2, _line_2) = running().await;
    armed.stop(StopMode::Ramp).await.unwrap();
    machine_2.wait_until(|seen| !seen.running).await;
    armed.arm_watchdog(Duration::from_secs(5), Reaction::Ramp).await.unwrap();
    assert!(machine_2.poke(6005, 90));
    let all = 2 * 25 * STATUSES_PER_TURN;
    let mut found = None;
    for _ in 0..all {
        armed.status().await.unwrap();
        found = found.or(armed.take_changed());
    }
    assert_eq!(found, Some(Ground::Watchdog));

    // HSP lowered at the keypad (p. 27): within ten seconds no setpoint above it is taken.
    assert!(machine.poke(3104, 400));
    tokio::time::sleep(Duration::from_secs(10)).await;
    let error = drive.set_setpoint(Frequency::from_hertz(45).into()).await.unwrap_err();
    assert!(matches!(error, Error::Setpoint { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn nothing_is_saved_while_the_motor_runs() {
    // p. 22: while ETI bit 0 is set nothing can be written.
    let (mut drive, machine, _line) = running().await;
    drive.assume_changed();
    let error = drive.persist().await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::MotorRunning, .. }), "{error}");
    assert_eq!(bench::written(&machine, 8504), [0; 0]);
}

#[tokio::test(start_paused = true)]
async fn a_reset_counts_the_inputs_only_where_the_terminals_command_and_takes_command_from_nobody() {
    let model = models::atv312::Atv312::under_bus_control();
    let (mut drive, machine, _line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
    // tCt = LEL and LI1 closed command nothing where Cd1 is Mdb (p. 33, 37).
    assert!(machine.poke(11102, 0) && machine.poke(5240, 1));
    machine.trip(9);
    drive.reset_faults().await.unwrap();
    assert!(!machine.observe().running);

    let model = models::atv312::Atv312::new();
    let (mut drive, machine, _line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
    machine.trip(9);
    let error = drive.reset_faults().await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Overridden { .. }, .. }), "{error}");
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Local), "it keeps its command");
    assert_eq!(bench::written(&machine, CMD), [0; 0]);
}

#[tokio::test(start_paused = true)]
async fn a_setting_that_moves_control_is_not_written_while_a_run_input_is_closed() {
    let model = models::atv312::Atv312::under_bus_control();
    let (mut drive, machine, _line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
    assert!(machine.poke(11102, 0) && machine.poke(5240, 1));
    let error = drive.write_parameter(row("Cd1"), 1).await.unwrap_err();
    assert!(error.to_string().contains("LI1"), "{error}");
    assert_eq!(machine.peek(8423), Some(10));
    assert!(!machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_says_it_is_another_one_is_read_and_stopped_and_nothing_else_is_written() {
    let model = models::atv312::Atv312::under_bus_control().identified_as("ATV71HU15N4", "0102");
    let (mut drive, machine, _line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
    let identity = drive.identify().await.unwrap();
    assert!(matches!(drive.recognise(&identity), Recognised::NotMine { it_is } if it_is.contains("71")));
    for error in [
        drive.start(Direction::Forward).await.unwrap_err(),
        drive.set_setpoint(TWENTY).await.unwrap_err(),
        drive.release().await.unwrap_err(),
        drive.write_parameter(row("ACC"), 50).await.unwrap_err(),
    ] {
        assert!(matches!(error, Error::Refused { reason: Refusal::AnotherDrive(_), .. }), "{error}");
    }
    assert_eq!(bench::writes(&machine), 0);
    drive.status().await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    assert!(bench::writes(&machine) > 0);
    let mine = Identity { model: Some("ATV312HU15N4".to_owned()), ..Identity::default() };
    assert_eq!(drive.recognise(&mine), Recognised::Mine);
}

#[tokio::test(start_paused = true)]
async fn a_run_command_costs_one_exchange_more_in_twenty_statuses() {
    let (mut drive, machine, _line) = running().await;
    drive.self_restarts().await.unwrap();
    for _ in 0..40 {
        drive.status().await.unwrap();
    }
    let before = machine.all_requests();
    for _ in 0..200 {
        drive.status().await.unwrap();
    }
    assert_eq!(machine.all_requests() - before, 200 + 200 / u64::from(STATUSES_PER_TURN));
}

#[tokio::test(start_paused = true)]
async fn a_start_says_which_setpoint_it_uses() {
    let (mut drive, _machine, _line) = running().await;
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!(status.reference, Some(Frequency::from_hertz(20)));
}
