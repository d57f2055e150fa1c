//! What only an Altivar 312 has of who moves the motor, beside what it shares with its kin in `tests/altivars.rs`: its units, its
//! watchdog, its channels, its identity. Expected from BBV51701 (page at each test).

use std::time::Duration;

use drive_atv312::{Atv312, ROWS};
use drive_bus::{Line, Slave};
use drive_core::{
    Control, Direction, Drive, Error, Frequency, Ground, Identity, Motion, Reaction, Recognised, Refusal,
    Row, STATUSES_PER_TURN, Setpoint, StopMode, Verdict,
};
use drive_sim::{SimSlave, models};
use drive_testing::bench;

type Drive312 = drive_testing::truth::Judged<Atv312<Slave>>;

const CMD: u16 = 8501;
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

/// InH on LI6 (BBV51701 p. 54): while it is closed the drive has no faults, SLF among them, and its motor goes on without its line.
#[tokio::test(start_paused = true)]
async fn a_watchdog_whose_fault_an_input_inhibits_is_neither_found_nor_set_up() {
    const LI6: u16 = 1 << 5;
    let (mut drive, machine, _line) = running().await;
    drive.stop(StopMode::Ramp).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    let armed = drive.arm_watchdog(Duration::from_secs(5), Reaction::Ramp).await.unwrap();
    assert!(machine.poke(row("InH").address, 134));
    assert_eq!(drive.watchdog().await.unwrap(), armed, "assigned, and open");
    // Behind a parameter that was written everything is read anew.
    drive.write_parameter(row("ACC"), 31).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    assert!(machine.poke(row("IOLR").address, LI6));
    let mut found = None;
    for _ in 0..3 * STATUSES_PER_TURN {
        drive.status().await.unwrap();
        found = found.or(drive.take_changed());
    }
    assert_eq!(found, Some(Ground::Watchdog), "the motor turns");
    let named = |error: Error| error.to_string().contains("InH");
    assert!(named(drive.watchdog().await.unwrap_err()));
    drive.stop(StopMode::Ramp).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    let before = bench::writes(&machine);
    assert!(named(drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await.unwrap_err()));
    assert_eq!(bench::writes(&machine), before);
    // What was found is put back all the same.
    let off = drive_core::Watchdog { timeout: None, reaction: Some(Reaction::Ignore) };
    drive.restore_watchdog(off).await.unwrap();
    assert!(machine.poke(row("IOLR").address, 0));
    drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await.unwrap();
}

/// p. 20: the same word is another frequency then, and nobody has asked for that one.
#[tokio::test(start_paused = true)]
async fn a_motor_whose_reference_another_master_counts_otherwise_is_not_in_force_until_its_setpoint_is_given_again()
 {
    for (before, after) in [(0, 1 << 9), (1 << 9, 0)] {
        let model = models::atv312::Atv312::under_bus_control();
        let (mut drive, machine, line) = bench::on_a_line(&drive_atv312::CAPABILITIES, model, Atv312::new);
        bench::write(&line, 8504, before).await;
        drive.set_setpoint(Frequency::from_hertz(10).into()).await.unwrap();
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency.abs_diff(1_000) < 5).await;
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
        bench::write(&line, 8504, after).await;
        let mut verdict = None;
        for _ in 0..100 {
            tokio::time::sleep(Duration::from_millis(100)).await;
            verdict = drive.status().await.unwrap().verdict;
            if matches!(verdict, Some(Verdict::NotInForce { .. })) {
                break;
            }
        }
        let Some(Verdict::NotInForce { because: Refusal::Overridden { by, .. }, .. }) = verdict else {
            panic!("CMI {after:04X}h: {verdict:?}, {:?}", machine.observe());
        };
        assert!(by.contains("CMI bit 9"), "{by}");
        drive.set_setpoint(Frequency::from_hertz(10).into()).await.unwrap();
        assert_eq!(drive.status().await.unwrap().verdict, Some(Verdict::InForce));
    }
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
