//! The watchdog, who commands, parameters and their EEPROM.

use std::time::Duration;

use drive_core::{
    Command, Control, Direction, Drive, Error, ErrorKind, ExceptionMeaning, Reaction, Refusal, State,
    StopMode,
};
use drive_testing::bench::writes;

use crate::support::{FIFTY, factory, refusal, rig, row, running};

#[tokio::test(start_paused = true)]
async fn the_watchdog_is_armed_once_trips_a_silent_drive_and_is_recovered() {
    let (mut drive, machine, _line) = rig();
    let watchdog = drive.watchdog().await.unwrap();
    assert_eq!(
        (watchdog.timeout, watchdog.reaction),
        (Some(Duration::from_secs(10)), Some(Reaction::Freewheel))
    );
    let armed = drive.arm_watchdog(Duration::from_millis(1_500), Reaction::Ramp).await.unwrap();
    assert_eq!((armed.timeout, armed.reaction), (Some(Duration::from_millis(1_500)), Some(Reaction::Ramp)));
    let before = writes(&machine);
    drive.arm_watchdog(Duration::from_millis(1_500), Reaction::Ramp).await.unwrap();
    assert_eq!(writes(&machine), before, "what is set already is not written again");

    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    machine.wait_until(|seen| seen.trip.is_some()).await;
    assert_eq!(machine.observe().trip, Some(5));
    machine.wait_until(|seen| !seen.running).await;
    assert_eq!(drive.faults().await.unwrap().present[0].mnemonic(), "SLF");
    drive.reset_faults().await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_kept_alive_drive_does_not_trip() {
    let (mut drive, machine, _line) = running().await;
    for _ in 0..30 {
        drive.keep_alive().await.unwrap();
        tokio::time::sleep(Duration::from_secs(2)).await;
    }
    assert_eq!(machine.observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn a_watchdog_is_not_armed_with_what_the_drive_cannot_keep() {
    let (mut drive, machine, _line) = running().await;
    let before = writes(&machine);
    for timeout in [Duration::ZERO, Duration::from_millis(150), Duration::from_millis(10_100)] {
        let error = drive.arm_watchdog(timeout, Reaction::Ramp).await.unwrap_err();
        assert!(matches!(error, Error::WatchdogTime { .. }), "{error}");
    }
    let second = Duration::from_secs(1);
    let error = drive.arm_watchdog(second, Reaction::DcInjection).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    let error = drive.arm_watchdog(second, Reaction::Ramp).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::MotorRunning));
    assert_eq!(writes(&machine), before);
}

#[tokio::test(start_paused = true)]
async fn a_watch_that_nto_switched_off_is_switched_on() {
    let (mut drive, machine, _line) = rig();
    drive.write_parameter(row("CMI"), 1 << 14).await.unwrap();
    assert_eq!(drive.watchdog().await.unwrap().timeout, None);
    drive.arm_watchdog(Duration::from_secs(2), Reaction::Fast).await.unwrap();
    assert_eq!(machine.peek(8504), Some(0));
    assert_eq!(drive.watchdog().await.unwrap().timeout, Some(Duration::from_secs(2)));
}

#[tokio::test(start_paused = true)]
async fn control_goes_to_the_bus_only_when_asked_and_back_to_the_terminals() {
    let (mut drive, machine, _line) = factory();
    let error = drive.release().await;
    assert!(error.is_ok(), "the terminals have control already");
    let status = drive.set_up_bus_control().await.unwrap();
    assert_eq!((status.control, status.state), (Some(Control::Bus), State::Disabled));
    let before = writes(&machine);
    drive.set_up_bus_control().await.unwrap();
    assert_eq!(writes(&machine), before + 1, "only CMD: nothing of the set-up differs");
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    for mode in StopMode::ALL {
        drive.stop(mode).await.unwrap();
    }
    machine.wait_until(|seen| !seen.running).await;
    let status = drive.release().await.unwrap();
    assert_eq!(status.control, Some(Control::Local));
    assert!(matches!(
        refusal(&drive.start(Direction::Forward).await.unwrap_err()),
        Some(Refusal::NotInControl(Control::Local))
    ));
}

/// What stops it is read anew behind a release, so that its first stop is the quick stop, which means nothing where the terminals command.
#[tokio::test(start_paused = true)]
async fn every_stop_of_a_drive_at_rest_that_was_released_is_confirmed() {
    for mode in StopMode::ALL {
        let (mut drive, machine, _line) = running().await;
        drive.stop(StopMode::Ramp).await.unwrap();
        machine.wait_until(|seen| !seen.running).await;
        drive.release().await.unwrap();
        let stopped = drive.stop(mode).await.unwrap();
        assert_eq!(
            stopped.status.control,
            Some(Control::Local),
            "{mode}: it was not taken from the terminals"
        );
    }
}

/// Somebody sets it at the keypad while the drive is watched (BBV51701 p. 51): the drive would restart by itself behind a fault.
#[tokio::test(start_paused = true)]
async fn an_automatic_restart_that_was_switched_on_since_the_settings_were_read_refuses_a_start() {
    let (mut drive, machine, _line) = running().await;
    drive.stop(StopMode::Ramp).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    machine.poke(row("Atr").address, 1);
    // Its last look is older than a start takes it for.
    watch(&mut *drive, 32).await;
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(refusal(&error), Some(Refusal::RestartsItself(_))), "{error}");
    machine.poke(row("Atr").address, 0);
    watch(&mut *drive, 32).await;
    drive.start(Direction::Forward).await.unwrap();
}

async fn watch(drive: &mut dyn Drive, seconds: u32) {
    for _ in 0..seconds {
        tokio::time::sleep(Duration::from_secs(1)).await;
        drive.status().await.unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn control_is_not_given_back_while_the_motor_runs_nor_where_the_drive_chooses() {
    let (mut drive, machine, _line) = running().await;
    let error = drive.release().await.unwrap_err();
    assert!(matches!(error, Error::Refused { command: Command::Release, reason: Refusal::MotorRunning, .. }));
    assert!(machine.observe().running);

    let (mut drive, machine, _line) = factory();
    drive.start(Direction::Forward).await.unwrap();
    drive.stop(StopMode::Freewheel).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    assert_eq!(drive.release().await.unwrap_err().kind(), ErrorKind::Unsupported);
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_written_once_verified_and_saved_when_asked() {
    let (mut drive, machine, _line) = rig();
    let error = drive.persist().await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::NothingToSave));
    let saved = machine.observe().eeprom_writes;
    assert!(drive.write_parameter(row("ACC"), 50).await.unwrap().changed);
    assert!(!drive.write_parameter(row("ACC"), 50).await.unwrap().changed);
    assert_eq!(writes(&machine), 1);
    assert_eq!(drive.read_parameter(row("ACC")).await.unwrap(), 50);
    assert_eq!(drive.persist().await.unwrap(), 1);
    assert_eq!(machine.observe().eeprom_writes, saved + 1);
    assert_eq!(machine.peek(8504), Some(0), "the edge is not held");
    machine.power_cycle();
    assert_eq!(drive.read_parameter(row("ACC")).await.unwrap(), 50);
    assert_eq!(refusal(&drive.persist().await.unwrap_err()), Some(Refusal::NothingToSave));
}

#[tokio::test(start_paused = true)]
async fn a_save_that_the_drive_refuses_is_not_confirmed_and_not_left_pending() {
    let (mut drive, machine, _line) = rig();
    drive.write_parameter(row("ACC"), 50).await.unwrap();
    machine.trip(22);
    assert_eq!(drive.persist().await.unwrap_err().kind(), ErrorKind::NotConfirmed);
    assert_eq!(machine.peek(8504), Some(0));
}

#[tokio::test(start_paused = true)]
async fn what_commands_the_drive_or_acts_at_once_is_no_parameter() {
    let (mut drive, machine, _line) = rig();
    for (code, word) in [
        ("CMD", 0x000F),
        ("CMDD", 0x000F),
        ("LFr", 200),
        ("LFRD", 600),
        // The recall of factory settings, the save, and both beside a bit that may be written.
        ("CMI", 1),
        ("CMI", 2),
        ("CMI", 0x4003),
        ("FCS", 64),
        ("CFG", 0),
        ("SCS", 2),
        ("rP", 1),
        ("tUn", 112),
    ] {
        let error = drive.write_parameter(row(code), word).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{code}");
    }
    assert_eq!(machine.all_requests(), 0);
    drive.write_parameter(row("tUn"), 114).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn the_unit_of_the_reference_does_not_change_under_a_motor_that_runs() {
    let (mut drive, machine, _line) = running().await;
    let error = drive.write_parameter(row("CMI"), 1 << 9).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::MotorRunning));
    assert_eq!(machine.peek(8504), Some(0));
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_refused_before_it_is_sent_by_access_range_and_state() {
    let (mut drive, machine, _line) = running().await;
    let before = writes(&machine);
    assert!(matches!(drive.write_parameter(row("rFr"), 0).await, Err(Error::AccessForbidden { .. })));
    assert!(matches!(
        drive.write_parameter(row("ttd"), 119).await,
        Err(Error::ValueNotAllowed { .. }) | Err(Error::Refused { .. })
    ));
    assert!(matches!(
        drive.write_parameter(row("SFr"), 161).await,
        Err(Error::ValueNotAllowed { value: 161, .. })
    ));
    let error = drive.write_parameter(row("Stt"), 1).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::MotorRunning));
    assert_eq!(writes(&machine), before);
    // What only the drive can judge comes back as its exception.
    let error = drive.write_parameter(row("LSP"), 501).await.unwrap_err();
    assert!(matches!(error, Error::Exception { meaning: ExceptionMeaning::ValueRefused, .. }), "{error}");
}
