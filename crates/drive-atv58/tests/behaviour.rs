//! The drive against its simulated counterpart, over a real line in virtual time. The simulated drive has its words
//! where the default map has them, so what is tested here is the driver and not the map.

use std::time::Duration;

use drive_atv58::{Atv58, Atv58Map, CAPABILITIES, ROWS};
use drive_bus::{Line, LineConfig, Protocol, Slave, protocol::UniTelwaySettings};
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, Frequency, Motion, Reaction, Refusal, Row, Setpoint,
    SetpointProblem, Speed, State, StopMode, Watchdog,
};
use drive_sim::{Panel, SimLine, SimSlave, Wiring, models};
use drive_testing::{bench, truth::Judged};

const FIFTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(50));

/// A line with one drive, and the machine beside it.
fn rig_with(map: Atv58Map) -> (Judged<Atv58<Slave>>, SimSlave, Line) {
    let open = |port, slave| Atv58::with_map(port, slave, map);
    bench::on_a_line(&CAPABILITIES, models::atv58::Atv58::new(), open)
}

fn rig() -> (Judged<Atv58<Slave>>, SimSlave, Line) {
    rig_with(Atv58Map::default())
}

async fn running() -> (Judged<Atv58<Slave>>, SimSlave, Line) {
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
async fn a_start_climbs_the_chart_and_the_motor_reaches_its_setpoint() {
    let (mut drive, machine, _line) = rig();
    assert_eq!(drive.status().await.unwrap().state, State::Disabled);
    drive.set_setpoint(FIFTY).await.unwrap();
    let status = drive.start(Direction::Forward).await.unwrap();
    assert_eq!((status.state, status.direction), (State::Running, Some(Direction::Forward)));
    assert_eq!(commands(&machine), [6, 7, 15]);
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(50)));
    assert_eq!((status.at_reference, status.control), (Some(true), None));
}

#[tokio::test(start_paused = true)]
async fn a_running_motor_turns_to_the_other_direction_through_standstill() {
    let (mut drive, machine, _line) = running().await;
    drive.start(Direction::Reverse).await.unwrap();
    machine.wait_until(|seen| seen.output_frequency == -5_000).await;
    assert_eq!(drive.status().await.unwrap().direction, Some(Direction::Reverse));
}

#[tokio::test(start_paused = true)]
async fn each_stop_mode_is_seen_at_once_and_ends_at_standstill() {
    for (mode, word, state) in [
        (StopMode::Ramp, 7, State::Stopping),
        (StopMode::Fast, 2, State::QuickStop),
        (StopMode::Freewheel, 0, State::Disabled),
    ] {
        let (mut drive, machine, _line) = running().await;
        assert_eq!(drive.stop(mode).await.unwrap().status.state, state, "{mode}");
        assert_eq!(commands(&machine).last(), Some(&word), "{mode}");
        assert!(machine.observe().shaft_frequency > 0, "{mode}: a stop takes its time");
        if mode == StopMode::Fast {
            let error = drive.start(Direction::Forward).await.unwrap_err();
            assert!(
                matches!(error, Error::Refused { reason: Refusal::State(State::QuickStop), .. }),
                "{error}"
            );
        }
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
        let motion = if mode == StopMode::Freewheel { Motion::Coasting } else { Motion::AtRest };
        assert_eq!(drive.status().await.unwrap().motion, motion, "{mode}");
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

#[tokio::test(start_paused = true)]
async fn what_the_map_leaves_out_is_unsupported_and_asks_nothing() {
    let map = Atv58Map { reverse_command: 0, ..Atv58Map::default() };
    let (mut drive, machine, _line) = rig_with(map);
    for error in [
        drive.start(Direction::Reverse).await.unwrap_err(),
        drive.set_setpoint(Speed::from_rpm(100).into()).await.unwrap_err(),
        drive.release().await.unwrap_err(),
        drive.persist().await.unwrap_err(),
        drive.arm_watchdog(Duration::from_secs(10), Reaction::Freewheel).await.unwrap_err(),
    ] {
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    }
    assert_eq!(machine.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn over_modbus_the_card_cannot_say_what_it_is() {
    let (mut drive, machine, _line) = rig();
    assert_eq!(drive.identify().await.unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(machine.all_requests(), 1, "asked once, and refused");
}

#[tokio::test(start_paused = true)]
async fn over_uni_telway_the_card_says_its_rating_and_its_version() {
    let simulated = SimLine::new(Wiring {
        protocol: drive_sim::Protocol::UniTelway,
        ..Wiring::rtu(CAPABILITIES.factory)
    });
    simulated.add(1, models::atv58::Atv58::new()).unwrap();
    let protocol = Protocol::UniTelway(UniTelwaySettings::default());
    let config = LineConfig { protocol, ..LineConfig::stream(CAPABILITIES.factory) };
    let line = Line::over(simulated.in_memory(), config);
    let mut drive = Atv58::new(line.slave(1), bench::address(1));
    let identity = drive.identify().await.unwrap();
    // p. 11/35: a chain with its length, and 21h for V2.1.
    assert_eq!(identity.model.as_deref(), Some("ATV58U18N4"));
    assert_eq!(identity.version.as_deref(), Some("V2.1"));
}

#[tokio::test(start_paused = true)]
async fn the_words_that_the_drive_alone_writes_are_read_by_function_04_where_its_owner_says_so() {
    let (mut drive, machine, _line) = rig_with(Atv58Map { input_words: true, ..Atv58Map::default() });
    drive.status().await.unwrap();
    drive.keep_alive().await.unwrap();
    drive.measurements().await.unwrap();
    drive.fault_register().await.unwrap();
    assert_eq!((machine.requests(3), machine.requests(4)), (0, 5));
    drive.set_setpoint(FIFTY).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    assert!(machine.requests(3) > 0, "what a master writes is read by function 03");
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_by_its_bit_and_reset_without_a_restart() {
    let (mut drive, machine, _line) = running().await;
    machine.trip(2);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.fault_code), (State::Fault, Some(2)));
    let faults = drive.faults().await.unwrap();
    assert_eq!(faults.present.iter().map(|fault| (fault.code, fault.entry)).collect::<Vec<_>>(), [(2, None)]);
    assert_eq!(drive.fault_register().await.unwrap().0, 0x0004);

    let written = commands(&machine).len();
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Fault(2), .. }), "{error}");
    assert_eq!(commands(&machine).len(), written, "nothing is written to a tripped drive");

    assert_eq!(drive.reset_faults().await.unwrap().state, State::Disabled);
    assert_eq!(commands(&machine)[written..], [0x0080, 0x0000]);
    machine.wait_until(|seen| seen.shaft_frequency == 0).await;
    assert!(!machine.observe().running);
    assert!(drive.faults().await.unwrap().present.is_empty());
}

#[tokio::test(start_paused = true)]
async fn the_message_watch_trips_a_drive_that_nobody_speaks_to_and_is_recovered_by_a_reset() {
    let (mut drive, machine, _line) = running().await;
    let watchdog = drive.watchdog().await.unwrap();
    assert_eq!(watchdog, Watchdog { timeout: Some(Duration::from_secs(10)), reaction: None });
    for _ in 0..4 {
        drive.keep_alive().await.unwrap();
        tokio::time::sleep(Duration::from_secs(9)).await;
        assert_eq!(machine.observe().trip, None);
    }
    let seen = machine.wait_until(|seen| seen.trip.is_some()).await;
    assert!(!seen.running);
    assert_eq!(drive.status().await.unwrap().state, State::Fault);
    drive.reset_faults().await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn nobody_starts_a_drive_that_is_in_forced_local_control() {
    let (mut drive, machine, _line) = rig();
    machine.panel(Panel::TakeControl);
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::NotInControl(Control::Local), .. }), "{error}");
    assert!(commands(&machine).is_empty());
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
    assert!(machine.poke(row("W401").address, (-200_i16).cast_unsigned()));
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(error, Error::Refused { reason: Refusal::Settings(_), .. }), "{error}");
    assert!(commands(&machine).is_empty());
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_that_the_drive_cannot_hold_is_refused_and_not_sent() {
    let (mut drive, machine, _line) = rig();
    let high = Frequency::from_hertz(50);
    let cases = [
        (Frequency::from_centihertz(1_234), SetpointProblem::Resolution("one count of W401")),
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
    assert_eq!(machine.requests(0x06), 0);
    machine.poke(250, 400);
    assert!(drive.set_setpoint(FIFTY).await.is_ok(), "limits are read once");
    drive.forget();
    assert!(drive.set_setpoint(FIFTY).await.is_err());
}

#[tokio::test(start_paused = true)]
async fn the_unit_of_the_reference_is_a_setting() {
    let map = Atv58Map { reference_counts_per_hertz: 100, speed_limits: None, ..Atv58Map::default() };
    let (mut drive, machine, _line) = rig_with(map);
    drive.set_setpoint(Frequency::from_centihertz(1_234).into()).await.unwrap();
    assert_eq!(machine.peek(401), Some(1_234));
}

#[tokio::test(start_paused = true)]
async fn reading_takes_the_exchanges_that_the_capabilities_say_and_writes_nothing() {
    let (mut drive, machine, _line) = running().await;
    let capabilities = drive.capabilities();
    let written = machine.requests(0x06);
    let before = machine.all_requests();
    drive.status().await.unwrap();
    let after_status = machine.all_requests();
    assert_eq!(after_status - before, u64::from(capabilities.status_exchanges));
    let measurements = drive.measurements().await.unwrap();
    assert_eq!(machine.all_requests() - after_status, u64::from(capabilities.measurement_exchanges));
    assert_eq!(measurements.reference, Some(FIFTY));
    drive.faults().await.unwrap();
    assert_eq!(machine.requests(0x06), written);
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_read_back_and_an_equal_value_is_not_written() {
    let (mut drive, machine, _line) = rig();
    assert!(drive.write_parameter(row("ACC"), 789).await.unwrap().changed);
    assert!(!drive.write_parameter(row("ACC"), 789).await.unwrap().changed);
    assert_eq!((machine.requests(0x06), machine.peek(252)), (1, Some(789)));
    for (code, word) in [("W483", 0), ("W458", 0)] {
        assert!(drive.write_parameter(row(code), word).await.is_err(), "{code}");
    }
    assert_eq!(machine.requests(0x06), 1, "what is refused is not sent");
}

#[tokio::test(start_paused = true)]
async fn what_commands_the_drive_is_no_parameter() {
    let (mut drive, machine, _line) = rig();
    for (code, word) in [("CMD", 15), ("W401", 200), ("W402", 1)] {
        let error = drive.write_parameter(row(code), word).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{code}");
    }
    assert_eq!(machine.all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn a_card_in_listen_only_mode_hears_nothing_but_the_restart_of_its_communication() {
    let (mut drive, machine, _line) = running().await;
    drive.enter_listen_only().await.unwrap();
    assert!(drive.stop(StopMode::Freewheel).await.is_err());
    assert!(machine.observe().running, "not even a stop");
    while drive.status().await.unwrap_err().kind() != ErrorKind::NotSent {}
    // The line has given the slave up, and the restart goes through nevertheless.
    drive.restart_communication().await.unwrap();
    assert!(drive.stop(StopMode::Freewheel).await.is_ok());
}

#[tokio::test(start_paused = true)]
async fn the_cards_counters_count_what_it_was_sent() {
    let (mut drive, _machine, _line) = rig();
    drive.clear_counters().await.unwrap();
    drive.echo(0x1234).await.unwrap();
    drive.status().await.unwrap();
    assert!(drive.read_input_words(600, 1).await.is_err());
    let counters = drive.counters().await.unwrap();
    assert_eq!(counters.exceptions, 1);
    assert!(counters.messages >= 3, "{counters:?}");
    assert_eq!((counters.check_errors, counters.broadcasts, counters.naq, counters.not_ready), (0, 0, 0, 0));
    let events = drive.event_counter().await.unwrap();
    assert!(events >= 2);
    drive.status().await.unwrap();
    assert!(drive.event_counter().await.unwrap() > events);
    drive.change_ascii_delimiter(b'\r').await.unwrap();
    assert_eq!(drive.read_input_words(463, 4).await.unwrap(), [0; 4]);
}

#[tokio::test(start_paused = true)]
async fn a_write_whose_answer_is_lost_is_read_back() {
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(FIFTY).await.unwrap();
    machine.hold_next_answer();
    drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
    assert_eq!(machine.peek(401), Some(200));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_mute_is_never_said_to_have_started_or_stopped() {
    let (mut drive, machine, _line) = running().await;
    machine.mute();
    assert!(drive.start(Direction::Reverse).await.is_err());
    assert!(drive.stop(StopMode::Ramp).await.is_err());
    assert!(machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_stop_stops_every_drive() {
    for mode in [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel] {
        let (drive, machine, line) = running().await;
        let write = drive.broadcast_stop(mode).unwrap();
        bench::broadcast(&line, write).await;
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
    }
}

#[tokio::test(start_paused = true)]
async fn only_control_words_of_the_chart_are_ever_written() {
    let (mut drive, machine, _line) = rig();
    for mode in [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel] {
        for direction in [Direction::Forward, Direction::Reverse] {
            drive.start(direction).await.unwrap();
            drive.stop(mode).await.unwrap();
            machine.trip(9);
            drive.reset_faults().await.unwrap();
        }
    }
    let allowed = [0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x080F, 0x0080];
    assert!(commands(&machine).iter().all(|word| allowed.contains(word)), "{:04X?}", commands(&machine));
}
