//! The drive against its simulated counterpart, over a real line in virtual time.

use std::time::Duration;

use drive_atv28::{Atv28, CAPABILITIES, ROWS};
use drive_bus::{Line, Slave};
use drive_core::{
    Command, Control, Direction, Drive, Error, ErrorKind, ExceptionMeaning, Frequency, Motion, Reaction,
    Refusal, Row, Setpoint, SetpointProblem, Speed, State, StopMode,
};
use drive_sim::{Panel, SimSlave, models};
use drive_testing::{bench, truth::Judged};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));

/// A line with one drive, and the machine beside it.
fn rig() -> (Judged<Atv28<Slave>>, SimSlave, Line) {
    bench::on_a_line(&CAPABILITIES, models::atv28::Atv28::new(), Atv28::new)
}

async fn running() -> (Judged<Atv28<Slave>>, SimSlave, Line) {
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

#[tokio::test(start_paused = true)]
async fn a_start_is_confirmed_and_the_motor_reaches_its_setpoint() {
    let (mut drive, machine, _line) = rig();
    assert_eq!(drive.status().await.unwrap().state, State::Ready, "operation is enabled at power-up");
    drive.set_setpoint(FIFTY).await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!((status.state, status.direction), (State::Running, Some(Direction::Forward)));
    assert_eq!(commands(&machine), [0x000F]);
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(50)));
    assert_eq!((status.at_reference, status.control), (Some(true), Some(Control::Bus)));
    assert!(status.current.unwrap().deciamperes() > 0);
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
async fn each_stop_mode_is_seen_at_once_and_ends_at_standstill() {
    for (mode, word, state) in [
        (StopMode::Ramp, 0x100F, State::Stopping),
        (StopMode::Fast, 0x400F, State::Stopping),
        (StopMode::DcInjection, 0x200F, State::Stopping),
        (StopMode::Freewheel, 0x0000, State::Disabled),
    ] {
        let (mut drive, machine, _line) = running().await;
        let status = drive.stop(mode).await.unwrap().status;
        assert_eq!(status.state, state, "{mode}");
        assert_eq!(commands(&machine).last(), Some(&word), "{mode}");
        assert!(machine.observe().shaft_frequency > 0, "{mode}: a stop takes its time");
        // A fast stop is told from a cut by looks that see it come down: it is faster than the factory's ramp.
        machine.wait_until(|seen| seen.shaft_frequency < 4_000).await;
        drive.status().await.unwrap();
        // The injection lasts as long as its bit.
        let injects = mode == StopMode::DcInjection;
        machine.wait_until(|seen| seen.shaft_frequency == 0 && seen.running == injects).await;
        // Of a motor that was cut nothing tells when it has come to rest, and direct current has a time for it.
        let motion = match mode {
            StopMode::Ramp | StopMode::Fast => Motion::AtRest,
            StopMode::Freewheel => Motion::Coasting,
            StopMode::DcInjection => Motion::Braking,
        };
        assert_eq!(drive.status().await.unwrap().motion, motion, "{mode}");
        // And it starts again, through the chart where the stop left it.
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_written_before_anything_is_read() {
    let (mut drive, machine, _line) = running().await;
    let before = machine.received().len();
    drive.stop(StopMode::Ramp).await.unwrap();
    let functions: Vec<u8> = machine.received()[before..].iter().map(|request| request.pdu[0]).collect();
    assert_eq!(functions, [0x06, 0x03, 0x03]);
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_with_its_meaning_and_reset_without_a_restart() {
    let (mut drive, machine, _line) = running().await;
    machine.trip(18);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.fault_code), (State::Fault, Some(18)));
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present[0].to_string(), "18 ObF: DC bus overvoltage while braking");
    assert!(faults.present[0].remedy().is_some());
    assert_eq!(faults.reset_allowed, Some(true));

    let written = commands(&machine).len();
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Fault(18), .. }), "{error}");
    assert_eq!(commands(&machine).len(), written, "nothing is written to a tripped drive");

    assert_eq!(drive.reset_faults().await.unwrap().state, State::Disabled);
    assert_eq!(commands(&machine)[written..], [0x0080, 0x0000]);
    machine.wait_until(|seen| seen.shaft_frequency == 0).await;
    assert!(!machine.observe().running);
    assert!(drive.faults().await.unwrap().present.is_empty());

    // A drive without a fault is left alone.
    drive.reset_faults().await.unwrap();
    assert_eq!(commands(&machine).len(), written + 2);
}

#[tokio::test(start_paused = true)]
async fn past_faults_are_the_history() {
    let (mut drive, machine, _line) = rig();
    // The terminals command from power-up on, and a reset takes it from nobody.
    machine.trip(9);
    let error = drive.reset_faults().await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Overridden { .. }, .. }), "{error}");
    assert!(commands(&machine).is_empty());
    drive.stop(StopMode::Ramp).await.unwrap();
    drive.reset_faults().await.unwrap();
    for code in [9, 23] {
        machine.trip(code);
        drive.reset_faults().await.unwrap();
    }
    let faults = drive.faults().await.unwrap();
    assert!(faults.present.is_empty());
    assert_eq!(faults.history.iter().map(|fault| fault.code).collect::<Vec<_>>(), [9, 9]);
}

#[tokio::test(start_paused = true)]
async fn nobody_starts_a_drive_that_is_in_forced_local_control() {
    let (mut drive, machine, _line) = rig();
    machine.panel(Panel::TakeControl);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    let expected = Error::Refused {
        slave: drive.slave(),
        command: Command::Start(Direction::Forward),
        reason: Refusal::NotInControl(Control::Local),
    };
    assert_eq!(error, expected);
    assert!(commands(&machine).is_empty());
    // A stop is sent whatever is known.
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(commands(&machine), [0x100F]);
}

#[tokio::test(start_paused = true)]
async fn a_start_that_somebody_takes_back_at_the_drive_is_not_confirmed_and_not_given_again() {
    for panel in [Panel::TakeControl, Panel::Stop] {
        let (mut drive, machine, _line) = rig();
        let started = bench::start_taken_back(&mut drive, &machine, panel).await;
        assert_eq!(started.unwrap_err().kind(), ErrorKind::NotConfirmed, "{panel:?}");
        assert_eq!(commands(&machine).last(), Some(&15), "{panel:?}");
        assert_eq!(commands(&machine).iter().filter(|&&word| word == 15).count(), 1, "{panel:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_negative_reference_that_somebody_left_refuses_the_start() {
    let (mut drive, machine, _line) = rig();
    assert!(machine.poke(row("LFr").address, (-200_i16).cast_unsigned()));
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    assert!(commands(&machine).is_empty());
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn after_the_stop_key_a_start_climbs_the_chart() {
    let (mut drive, machine, _line) = running().await;
    machine.panel(Panel::Stop);
    assert_eq!(drive.status().await.unwrap().state, State::Disabled);
    let before = commands(&machine).len();
    drive.start(Direction::Reverse).await.unwrap();
    assert_eq!(commands(&machine)[before..], [0x0006, 0x0007, 0x080F]);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_that_the_drive_cannot_hold_is_refused_and_not_sent() {
    let (mut drive, machine, _line) = rig();
    let high = Frequency::from_hertz(50);
    let cases = [
        (Frequency::from_centihertz(1_234), SetpointProblem::Resolution("0.1 Hz")),
        (
            Frequency::from_centihertz(5_010),
            SetpointProblem::OutsideFrequencyLimits { low: Frequency::ZERO, high },
        ),
        (Frequency::from_centihertz(10_000_000), SetpointProblem::TooLarge),
    ];
    for (frequency, expected) in cases {
        let error = drive.set_setpoint(frequency.into()).await.unwrap_err();
        assert!(matches!(error, Error::Setpoint { problem, .. } if problem == expected), "{error}");
    }
    let error = drive.set_setpoint(Speed::from_rpm(1_501).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Refused);
    assert_eq!(machine.requests(0x06), 0);
}

#[tokio::test(start_paused = true)]
async fn limits_are_read_once_and_again_after_the_drive_may_be_another() {
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.set_setpoint(FIFTY).await.unwrap();
    let limits = |machine: &SimSlave| {
        machine.received().iter().filter(|request| request.pdu.get(..3) == Some(&[0x03, 0, 250])).count()
    };
    assert_eq!(limits(&machine), 1);
    machine.poke(row("HSP").address, 400);
    drive.forget();
    assert!(drive.set_setpoint(FIFTY).await.is_err());
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_in_rpm_turns_the_motor_at_that_speed() {
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(Speed::from_rpm(900).into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == 3_000).await;
    assert_eq!(drive.measurements().await.unwrap().speed, Some(Speed::from_rpm(900)));
}

#[tokio::test(start_paused = true)]
async fn a_run_at_a_setpoint_of_zero_is_a_run() {
    let (mut drive, _machine, _line) = rig();
    drive.set_setpoint(Frequency::ZERO.into()).await.unwrap();
    assert_eq!(drive.start(Direction::Forward).await.unwrap().state, State::Running);
    assert_eq!(drive.status().await.unwrap().state, State::Running);
}

#[tokio::test(start_paused = true)]
async fn reading_takes_the_exchanges_that_the_capabilities_say_and_writes_nothing() {
    let (mut drive, machine, _line) = running().await;
    let capabilities = drive.capabilities();
    let written = machine.requests(0x06);
    let mut before = machine.all_requests();
    let mut exchanges = |machine: &SimSlave| {
        let since = machine.all_requests() - before;
        before += since;
        u8::try_from(since).unwrap()
    };
    drive.status().await.unwrap();
    assert_eq!(exchanges(&machine), capabilities.status_exchanges);
    let measurements = drive.measurements().await.unwrap();
    assert_eq!(exchanges(&machine), capabilities.measurement_exchanges);
    drive.faults().await.unwrap();
    assert_eq!(exchanges(&machine), 5);
    drive.keep_alive().await.unwrap();
    assert_eq!(exchanges(&machine), 1);
    assert_eq!(drive.identify().await.unwrap().codes[0].code, "INV");
    assert_eq!(machine.requests(0x06), written);
    assert_eq!(measurements.reference, Some(FIFTY));
    assert_eq!(measurements.line_voltage.unwrap().decivolts(), 4_000);
    assert_eq!(measurements.outputs, Some(0x0100));
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_read_back_and_an_equal_value_is_not_written() {
    let (mut drive, machine, _line) = rig();
    assert!(drive.write_parameter(row("AC2"), 70).await.unwrap().changed);
    assert_eq!(drive.read_parameter(row("AC2")).await.unwrap(), 70);
    assert!(!drive.write_parameter(row("AC2"), 70).await.unwrap().changed);
    assert_eq!((machine.requests(0x06), machine.observe().eeprom_writes), (1, 1));
    for (code, word) in [("rFr", 0), ("UFt", 4), ("Add", 32)] {
        assert!(drive.write_parameter(row(code), word).await.is_err(), "{code}");
    }
    assert_eq!(machine.requests(0x06), 1, "what is refused is not sent");
}

#[tokio::test(start_paused = true)]
async fn what_commands_the_drive_is_no_parameter() {
    let (mut drive, machine, _line) = rig();
    for (code, word) in [("CMD", 15), ("CMDD", 15), ("LFr", 200), ("LFRD", 600), ("CMI", 1), ("CMI", 2)] {
        let error = drive.write_parameter(row(code), word).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{code}");
    }
    assert_eq!(machine.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn a_configuration_register_is_refused_by_a_drive_that_runs() {
    let (mut drive, _machine, _line) = running().await;
    let error = drive.write_parameter(row("tFr"), 700).await.unwrap_err();
    assert!(matches!(error, Error::Exception { code: 4, meaning: ExceptionMeaning::Failed, .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_write_whose_answer_is_lost_is_read_back() {
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(FIFTY).await.unwrap();
    machine.hold_next_answer();
    drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
    assert_eq!(machine.peek(row("LFr").address), Some(200));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_mute_is_never_said_to_have_started_or_stopped() {
    let (mut drive, machine, _line) = running().await;
    machine.mute();
    assert!(drive.start(Direction::Reverse).await.is_err());
    assert!(drive.stop(StopMode::Ramp).await.is_err());
    assert!(drive.set_setpoint(Frequency::from_hertz(10).into()).await.is_err());
    assert!(machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn what_the_family_cannot_do_is_unsupported() {
    let (mut drive, machine, _line) = rig();
    let kinds = [
        drive.release().await.unwrap_err().kind(),
        drive.watchdog().await.unwrap_err().kind(),
        drive.arm_watchdog(Duration::from_secs(1), Reaction::Ramp).await.unwrap_err().kind(),
        drive.persist().await.unwrap_err().kind(),
    ];
    assert_eq!(kinds, [ErrorKind::Unsupported; 4]);
    assert_eq!(machine.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_stop_stops_every_drive() {
    for mode in [StopMode::Fast, StopMode::Freewheel] {
        let (drive, machine, line) = running().await;
        let write = drive.broadcast_stop(mode).unwrap();
        assert_eq!(write.function, 0x06);
        bench::broadcast(&line, write).await;
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
    }
    let (drive, ..) = rig();
    for mode in [StopMode::Ramp, StopMode::DcInjection] {
        assert_eq!(drive.broadcast_stop(mode), None, "{mode}: it would enable drives that are merely ready");
    }
}

#[tokio::test(start_paused = true)]
async fn only_control_words_that_the_manual_allows_are_ever_written() {
    let (mut drive, machine, _line) = rig();
    for mode in StopMode::ALL {
        for direction in [Direction::Forward, Direction::Reverse] {
            drive.start(direction).await.unwrap();
            drive.stop(mode).await.unwrap();
            machine.trip(9);
            drive.reset_faults().await.unwrap();
        }
    }
    // BBV51701 p. 12 and 19: bits 4 to 6, 8 to 10 and 15 are reserved and 0.
    let allowed = [0x0000, 0x0006, 0x0007, 0x000F, 0x080F, 0x100F, 0x200F, 0x400F, 0x0080];
    assert!(commands(&machine).iter().all(|word| allowed.contains(word)), "{:04X?}", commands(&machine));
}
