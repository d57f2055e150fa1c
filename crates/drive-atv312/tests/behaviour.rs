//! The drive against its simulated counterpart, over a real line in virtual time.

use std::time::Duration;

use drive_atv312::{Atv312, CAPABILITIES, ROWS, words::FaultState};
use drive_bus::{Line, Slave};
use drive_core::{
    Command, Control, Direction, Drive, Error, ErrorKind, ExceptionMeaning, Frequency, Reaction, Refusal,
    Row, Setpoint, SetpointProblem, Speed, State, StopMode,
};
use drive_sim::{Exception, Panel, SimSlave, models};
use drive_testing::bench::{self, writes};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));

/// A drive that is set up for the bus.
fn rig() -> (Atv312<Slave>, SimSlave, Line) {
    bench::on_a_line(&CAPABILITIES, models::atv312::Atv312::under_bus_control(), Atv312::new)
}

/// A drive as it leaves the factory.
fn factory() -> (Atv312<Slave>, SimSlave, Line) {
    bench::on_a_line(&CAPABILITIES, models::atv312::Atv312::new(), Atv312::new)
}

/// A drive that runs at 50 Hz.
async fn running() -> (Atv312<Slave>, SimSlave, Line) {
    let (mut drive, machine, line) = rig();
    bench::run_at_fifty(&mut drive, &machine).await;
    (drive, machine, line)
}

fn row(code: &str) -> &'static Row {
    Row::find(ROWS, code).unwrap()
}

fn commands(machine: &SimSlave) -> Vec<u16> {
    bench::written(machine, row("CMD").address)
}

fn refusal(error: &Error) -> Option<Refusal> {
    match error {
        Error::Refused { reason, .. } => Some(*reason),
        _ => None,
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_climbs_the_chart_and_the_motor_reaches_its_setpoint() {
    let (mut drive, machine, _line) = rig();
    assert_eq!(drive.status().await.unwrap().state, State::Disabled);
    drive.set_setpoint(FIFTY).await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!((status.state, status.direction), (State::Running, Some(Direction::Forward)));
    assert_eq!(status.control, Some(Control::Bus));
    assert_eq!(commands(&machine), [0x0006, 0x0007, 0x000F]);
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(50)));
    assert_eq!(status.at_reference, Some(true));
    assert!(status.current.unwrap().deciamperes() > 0);
}

#[tokio::test(start_paused = true)]
async fn a_drive_from_the_factory_is_started_without_the_chart() {
    let (mut drive, machine, _line) = factory();
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Ready, Some(Control::Local)));
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Reverse).await.unwrap();
    assert_eq!(commands(&machine), [0x080F]);
    machine.wait_until(|seen| seen.output_frequency == -5_000).await;
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Bus));
}

#[tokio::test(start_paused = true)]
async fn a_running_motor_turns_to_the_other_direction_through_standstill() {
    let (mut drive, machine, _line) = running().await;
    drive.start(Direction::Reverse).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == -5_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.direction), (State::Running, Some(Direction::Reverse)));
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(50)));
}

#[tokio::test(start_paused = true)]
async fn each_stop_mode_is_one_write_seen_at_once_and_ends_at_standstill() {
    for (mode, word, state) in [
        (StopMode::Ramp, 0x100F, State::Stopping),
        (StopMode::Fast, 0x400F, State::Stopping),
        (StopMode::DcInjection, 0x200F, State::Stopping),
        (StopMode::Freewheel, 0x0000, State::Disabled),
    ] {
        let (mut drive, machine, _line) = running().await;
        let before = machine.all_requests();
        let status = drive.stop(mode).await.unwrap();
        assert_eq!(machine.all_requests() - before, 2, "{mode}: one write, one status");
        assert_eq!(status.state, state, "{mode}");
        assert_eq!(commands(&machine).last(), Some(&word), "{mode}");
        assert!(machine.observe().shaft_frequency > 0, "{mode}: a stop takes its time");
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
        assert!(drive.status().await.unwrap().is_standstill(), "{mode}");
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_was_adopted_running_is_stopped_in_each_mode() {
    for mode in StopMode::ALL {
        let (mut drive, machine, _line) = running().await;
        drive.forget();
        drive.stop(mode).await.unwrap();
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
        let quick_stop = commands(&machine).last() == Some(&0x0002);
        assert_eq!(
            quick_stop,
            mode == StopMode::Fast,
            "without the settings the fast stop is the quick stop"
        );
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_the_settings_do_not_have_is_unsupported_with_the_reason_and_nothing_is_written() {
    for (code, value, mode, word) in [
        ("Stt", 2, StopMode::Ramp, "freewheel"),
        ("Stt", 1, StopMode::Ramp, "fast"),
        ("PS2", 172, StopMode::Ramp, "bit 12"),
        ("rFC", 188, StopMode::Ramp, "bit 12"),
        ("dCI", 0, StopMode::DcInjection, "dCI"),
    ] {
        let (mut drive, machine, _line) = rig();
        drive.write_parameter(row(code), value).await.unwrap();
        let before = writes(&machine);
        let error = drive.stop(mode).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{code}");
        assert!(error.to_string().contains(word), "{error}");
        assert_eq!(writes(&machine), before);
        drive.stop(StopMode::Fast).await.unwrap();
        drive.stop(StopMode::Freewheel).await.unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_never_enables_a_drive_that_is_only_ready() {
    for mode in [StopMode::Fast, StopMode::Freewheel] {
        let (drive, machine, line) = rig();
        let write = drive.broadcast_stop(mode).unwrap();
        for step in [0x0006, 0x0007] {
            bench::write(&line, 8501, step).await;
        }
        bench::broadcast(&line, write).await;
        assert_eq!(machine.peek(3201).unwrap() & 0x006F, 0x0040, "{mode}");
        assert!(drive.capabilities().broadcast_stops.contains(&mode));
    }
    let (drive, _machine, _line) = rig();
    assert_eq!(drive.broadcast_stop(StopMode::Ramp), None);
    assert_eq!(drive.broadcast_stop(StopMode::DcInjection), None);
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_before_anything_is_written() {
    // A tripped drive names its fault.
    let (mut drive, machine, _line) = rig();
    machine.trip(9);
    assert_eq!(refusal(&drive.start(Direction::Forward).await.unwrap_err()), Some(Refusal::Fault(9)));
    assert!(commands(&machine).is_empty());

    // Somebody at the machine has taken control.
    let (mut drive, machine, _line) = rig();
    machine.panel(Panel::TakeControl);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::NotInControl(Control::Local)));
    assert!(commands(&machine).is_empty());

    // At L3 the terminals are the command channel.
    let (mut drive, machine, _line) = rig();
    drive.write_parameter(row("Cd1"), 1).await.unwrap();
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::NotInControl(Control::Local)));
    assert!(commands(&machine).is_empty());

    // Locked by CMI, a bit that does not reverse, a reference with a sign.
    for (address, value, direction) in [
        (8504, 1 << 13, Direction::Forward),
        (8504, 1 << 15, Direction::Forward),
        (8502, 0xFF00, Direction::Forward),
        (8602, 0xFF00, Direction::Forward),
        (11402, 171, Direction::Reverse),
    ] {
        let (mut drive, machine, _line) = rig();
        assert!(machine.poke(address, value));
        let error = drive.start(direction).await.unwrap_err();
        assert!(matches!(refusal(&error), Some(Refusal::Settings(_))), "{error}");
        assert!(commands(&machine).is_empty());
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_out_of_a_quick_stop_waits_for_standstill() {
    let (mut drive, machine, line) = running().await;
    bench::write(&line, 8501, 0x0002).await;
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(refusal(&error), Some(Refusal::State(State::QuickStop)));
    assert_eq!(drive.status().await.unwrap().state, State::QuickStop);
    machine.wait_until(|seen| !seen.running).await;
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_outside_the_limits_or_the_resolution_is_refused() {
    let (mut drive, machine, _line) = rig();
    let too_fast = Setpoint::Frequency(Frequency::from_hertz(51));
    let error = drive.set_setpoint(too_fast).await.unwrap_err();
    let (low, high) = (Frequency::ZERO, Frequency::from_hertz(50));
    let problem = SetpointProblem::OutsideFrequencyLimits { low, high };
    assert!(matches!(error, Error::Setpoint { problem: told, .. } if told == problem), "{error}");
    let odd = Setpoint::Frequency(Frequency::from_centihertz(1_234));
    assert!(matches!(
        drive.set_setpoint(odd).await,
        Err(Error::Setpoint { problem: SetpointProblem::Resolution("0.1 Hz"), .. })
    ));
    assert!(matches!(
        drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(1_501))).await,
        Err(Error::Setpoint { problem: SetpointProblem::OutsideSpeedLimits { .. }, .. })
    ));
    assert_eq!(writes(&machine), 0);
    // A new limit holds at once, because a parameter that was written is read again.
    drive.write_parameter(row("HSP"), 400).await.unwrap();
    assert!(drive.set_setpoint(FIFTY).await.is_err());
}

#[tokio::test(start_paused = true)]
async fn a_speed_is_a_setpoint_too() {
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(900))).await.unwrap();
    drive.start(Direction::Reverse).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == -3_000).await;
    let measured = drive.measurements().await.unwrap();
    assert_eq!(measured.speed, Some(Speed::from_rpm(900)));
    assert_eq!(measured.reference, Some(Setpoint::Frequency(Frequency::from_hertz(30))));
}

#[tokio::test(start_paused = true)]
async fn at_high_resolution_frequencies_count_otherwise_and_speeds_are_unsupported() {
    let (mut drive, machine, _line) = rig();
    drive.write_parameter(row("CMI"), 1 << 9).await.unwrap();
    assert!(matches!(drive.set_setpoint(FIFTY).await, Err(Error::Setpoint { .. })));
    // 2184 counts are 39.99 Hz.
    drive.set_setpoint(Setpoint::Frequency(Frequency::from_centihertz(3_999))).await.unwrap();
    assert_eq!(machine.peek(8502), Some(2_184));
    let speed = drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(900))).await.unwrap_err();
    assert_eq!(speed.kind(), ErrorKind::Unsupported);
    drive.start(Direction::Forward).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == seen.setpoint).await;
    let status = drive.status().await.unwrap();
    assert!(status.output_frequency.unwrap().centihertz().abs_diff(3_999) <= 2, "{status}");
    assert_eq!(drive.measurements().await.unwrap().speed, None);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_is_refused_where_the_reference_comes_from_elsewhere() {
    let (mut drive, machine, _line) = rig();
    drive.write_parameter(row("Fr1"), 1).await.unwrap();
    let before = writes(&machine);
    assert!(matches!(refusal(&drive.set_setpoint(FIFTY).await.unwrap_err()), Some(Refusal::Settings(_))));
    assert_eq!(writes(&machine), before);
}

#[tokio::test(start_paused = true)]
async fn a_fault_is_read_with_its_meaning_reset_once_and_nothing_restarts() {
    let (mut drive, machine, _line) = running().await;
    machine.trip(17);
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(drive_core::Fault::mnemonic).collect::<Vec<_>>(), ["OLF"]);
    assert!(faults.present[0].remedy().is_some());
    assert_eq!(faults.reset_allowed, Some(true));
    assert_eq!(drive.error_code().await.unwrap(), 0x1000);
    let before = commands(&machine).len();
    let status = drive.reset_faults().await.unwrap();
    assert_eq!(status.state, State::Disabled);
    assert_eq!(commands(&machine)[before..], [0x0080, 0x0000]);
    assert!(!machine.observe().running);
    let faults = drive.faults().await.unwrap();
    assert!(faults.present.is_empty(), "LFt stays, but it is not present");
    assert_eq!(faults.reset_allowed, None);
    machine.trip(9);
    let past = drive.past_faults().await.unwrap();
    assert_eq!(past[0].fault.map(|fault| fault.code), Some(17));
    assert!(past[0].state.contains(FaultState::MOTOR_RUNNING));
    assert_eq!(past[0].state.control(), Control::Bus);
    assert_eq!(past[1].fault, None);
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_a_fault_is_not_reset() {
    let (mut drive, machine, _line) = running().await;
    let before = writes(&machine);
    drive.reset_faults().await.unwrap();
    assert_eq!(writes(&machine), before);
    assert!(machine.observe().running);
}

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

#[tokio::test(start_paused = true)]
async fn it_says_what_it_is() {
    let (mut drive, machine, _line) = rig();
    let identity = drive.identify().await.unwrap();
    assert_eq!(identity.vendor.as_deref(), Some("TELEMECANIQUE"));
    assert_eq!(identity.model.as_deref(), Some("ATV312HU15N4"));
    let codes: Vec<_> = identity.codes.iter().map(|word| (word.code, word.value)).collect();
    let expected = [("ARE", 0), ("NCV", 6), ("VCAL", 3), ("INV", 41), ("UdP", 0x1204), ("TSP", 128)];
    assert_eq!(codes, expected);
    // A drive that refuses function 43 is told by its words.
    machine.refuse_next(Exception::ILLEGAL_FUNCTION);
    let identity = drive.identify().await.unwrap();
    assert_eq!((identity.vendor, identity.codes.len()), (None, 6));
}

#[tokio::test(start_paused = true)]
async fn status_is_one_exchange_and_measurements_are_as_many_as_the_capabilities_say() {
    let (mut drive, machine, _line) = running().await;
    let count = machine.all_requests();
    drive.status().await.unwrap();
    assert_eq!(machine.all_requests() - count, u64::from(drive.capabilities().status_exchanges));
    let count = machine.all_requests();
    let measured = drive.measurements().await.unwrap();
    assert_eq!(machine.all_requests() - count, u64::from(drive.capabilities().measurement_exchanges));
    assert_eq!(measured.line_voltage.unwrap().to_string(), "400.0 V");
    assert_eq!(measured.outputs, Some(0x0100));
    assert_eq!(machine.requests(0x10), 0, "nothing is written by looking");
}

#[tokio::test(start_paused = true)]
async fn a_run_command_does_not_count_as_given_after_somebody_else_had_control() {
    let (mut drive, machine, _line) = running().await;
    machine.panel(Panel::TakeControl);
    machine.wait_until(|seen| !seen.running).await;
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Local));
    machine.panel(Panel::ReleaseControl);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Ready, Some(Control::Bus)));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_does_not_show_is_tried_without_the_old_settings_the_next_time() {
    let (mut drive, machine, _line) = running().await;
    // Somebody at the panel takes bit 14 away.
    assert!(machine.poke(11204, 0));
    let error = drive.stop(StopMode::Fast).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    drive.stop(StopMode::Fast).await.unwrap();
    assert_eq!(commands(&machine)[3..], [0x400F, 0x0002]);
}

#[tokio::test(start_paused = true)]
async fn a_stop_whose_confirmation_is_lost_is_read_back() {
    let (mut drive, machine, _line) = running().await;
    machine.hold_next_answer();
    let status = drive.stop(StopMode::Ramp).await.unwrap();
    assert!(machine.requests(0x03) > 0);
    assert_eq!(status.state, State::Stopping);
    machine.wait_until(|seen| !seen.running).await;
}

#[tokio::test(start_paused = true)]
async fn a_mute_drive_is_no_answer_and_never_a_stop() {
    let (mut drive, machine, _line) = running().await;
    machine.mute();
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert!(
        matches!(error.kind(), ErrorKind::NoAnswer | ErrorKind::OutcomeUnknown | ErrorKind::NotSent),
        "{error}"
    );
    assert!(machine.observe().running);
}
