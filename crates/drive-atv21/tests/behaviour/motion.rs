//! Starts, stops, resets, setpoints, and who may.

use std::time::Duration;

use drive_atv21::{Alarms, Atv21, Authority, CAPABILITIES, CommandWord, ROWS};
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, Frequency, Motion, PortError, Refusal, Row, SetpointProblem,
    Speed, State, StopMode,
};
use drive_sim::{Panel, models::atv21::Atv21 as Model};
use drive_testing::{bench, words::Words};

use crate::support::{HALF_SPEED, Rig, SECOND, refusal, state};

#[tokio::test(start_paused = true)]
async fn it_starts_reverses_and_stops_along_the_ramp() {
    let (rig, mut drive) = Rig::factory();
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Ready, Some(Control::Terminals)));
    rig.at_speed(&mut drive).await;
    let status = drive.status().await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Forward)));
    assert_eq!((status.output_frequency, status.control), (Some(HALF_SPEED), Some(Control::Bus)));
    drive.start(Direction::Reverse).await.unwrap();
    rig.until(|seen| seen.output_frequency == -2_500).await;
    let status = drive.status().await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Reverse)));
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().status.state, State::Stopping);
    rig.until(|seen| !seen.running).await;
    let status = drive.status().await.unwrap();
    assert!(status.is_standstill(), "{status}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_confirmed_by_its_order_where_run_shows_until_standstill() {
    let (rig, mut drive) = Rig::new(Model::new().running_until_standstill());
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().status.state, State::Stopping);
    drive.start(Direction::Reverse).await.unwrap();
    rig.until(|seen| seen.output_frequency < 0).await;
}

#[tokio::test(start_paused = true)]
async fn freewheel_and_dc_injection_hold_until_the_next_command() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::Freewheel).await.unwrap().status.state, State::Disabled);
    assert!(!rig.machine.observe().running);
    rig.at_speed(&mut drive).await;
    assert_eq!(drive.stop(StopMode::DcInjection).await.unwrap().status.state, State::Stopping);
    rig.until(|seen| seen.shaft_frequency == 0).await;
    assert!(rig.machine.observe().running, "the injection goes on at rest");
    drive.stop(StopMode::Ramp).await.unwrap();
    // How long an injection takes to bring it to rest nobody has said.
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
    drive.set_coast_time(Some(SECOND));
    tokio::time::sleep(SECOND).await;
    assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn an_emergency_stop_trips_once_and_leaves_no_edge() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert!(drive.emergency_stop().await.unwrap().is_fault());
    assert_eq!((rig.machine.observe().trip, rig.machine.peek(0xFA00)), (Some(17), Some(0xC000)));
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::Fault(17));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_mute_after_a_reset_is_reported_as_unknown_and_found_reset_later() {
    let (rig, mut drive) = Rig::new(Model::new().restarting_in(10 * SECOND));
    rig.machine.trip(10);
    assert_eq!(drive.status().await.unwrap().state, State::Fault);
    let error = drive.reset_faults().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    tokio::time::sleep(15 * SECOND).await;
    assert_eq!(drive.status().await.unwrap().state, State::Ready);
    assert_eq!(rig.machine.observe().trip, None);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_answers_at_once_is_seen_reset_and_does_not_start() {
    let (rig, mut drive) = Rig::new(Model::new().restarting_in(Duration::ZERO));
    rig.at_speed(&mut drive).await;
    rig.machine.trip(14);
    assert_eq!(drive.reset_faults().await.unwrap().state, State::Ready);
    assert!(!rig.machine.observe().running);
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC000));
    let resets =
        rig.machine.received().iter().filter(|request| request.pdu[..] == [6, 0xFA, 0, 0xE0, 0]).count();
    assert_eq!(resets, 1);
    // Nothing to reset: nothing is written.
    let writes = rig.machine.requests(6);
    drive.reset_faults().await.unwrap();
    assert_eq!(rig.machine.requests(6), writes);
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_while_somebody_else_has_the_drive() {
    let (rig, mut drive) = Rig::factory();
    rig.machine.panel(Panel::TakeControl);
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Panel));
    rig.machine.panel(Panel::ReleaseControl);
    // The terminals run the motor.
    rig.machine.poke(0xFD06, 1);
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Terminals));
    rig.machine.poke(0xFD06, 0);
    rig.until(|seen| !seen.running).await;
    // Without the priorities a drive that listens to its terminals is not ours.
    let mut drive = drive.with(|drive| drive.with_authority(Authority::Settings));
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::NotInControl(Control::Terminals));
    assert_eq!(rig.machine.requests(6), 0);
    rig.machine.poke(0x0003, 2);
    rig.machine.poke(0x0004, 4);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0x0400));
}

#[tokio::test(start_paused = true)]
async fn a_start_is_refused_in_undervoltage() {
    let (rig, mut drive) = Rig::factory();
    rig.machine.poke(0xFC91, Alarms::UNDERVOLTAGE_RELAY.bits());
    assert_eq!(refusal(drive.start(Direction::Forward).await), Refusal::State(State::NotReady));
}

#[tokio::test(start_paused = true)]
async fn release_gives_the_command_back_to_the_terminals_at_rest() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    assert_eq!(refusal(drive.release().await), Refusal::MotorRunning);
    drive.stop(StopMode::Ramp).await.unwrap();
    rig.until(|seen| !seen.running).await;
    assert_eq!(drive.release().await.unwrap().control, Some(Control::Terminals));
    assert_eq!(rig.machine.peek(0xFA00), Some(0));
    rig.machine.poke(0x0003, 2);
    assert!(matches!(refusal(drive.release().await), Refusal::Settings(_)));
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_outside_the_limits_is_refused_before_it_is_sent() {
    let (rig, mut drive) = Rig::factory();
    let error = drive.set_setpoint(Frequency::from_centihertz(5_001).into()).await.unwrap_err();
    let Error::Setpoint { problem, .. } = error else { panic!("{error}") };
    let high = Frequency::from_hertz(50);
    assert_eq!(problem, SetpointProblem::OutsideFrequencyLimits { low: Frequency::ZERO, high });
    assert!(drive.set_setpoint(Speed::from_rpm(24_001).into()).await.is_err());
    assert_eq!(rig.machine.requests(6), 0);
    // One that was changed by this value is read again.
    assert!(drive.write_parameter(Row::find(ROWS, "UL").unwrap(), 4_000).await.unwrap().changed);
    let writes = rig.machine.requests(6);
    assert!(drive.set_setpoint(Frequency::from_hertz(45).into()).await.is_err());
    assert_eq!(rig.machine.requests(6), writes);
    // Another UL is found after forget, not before.
    rig.machine.poke(0x0012, 6_000);
    assert!(drive.set_setpoint(Frequency::from_hertz(60).into()).await.is_err());
    drive.forget();
    drive.set_setpoint(Frequency::from_hertz(60).into()).await.unwrap();
    drive.set_setpoint(Speed::from_rpm(1_500).into()).await.unwrap();
    assert_eq!((rig.machine.peek(0xFA01), rig.machine.peek(0xFA13)), (Some(0), Some(1_500)));
}

#[tokio::test(start_paused = true)]
async fn a_preset_speed_that_overrides_the_setpoint_is_noticed() {
    let (rig, mut drive) = Rig::factory();
    drive.select(CommandWord::PRESET_SPEED_2 | CommandWord::RUN);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC402), "only selections are kept");
    assert!(matches!(refusal(drive.set_setpoint(HALF_SPEED.into()).await), Refusal::Overridden { .. }));
    // A start without a preset of our own overwrites that of FA00.
    drive.select(CommandWord::RAMP_2);
    drive.start(Direction::Forward).await.unwrap();
    assert_eq!(rig.machine.peek(0xFA00), Some(0xC440));
    // One that does not come from FA00 stays: no start then.
    drive.select(CommandWord::empty());
    rig.machine.poke(0xFE46, 255);
    assert!(matches!(refusal(drive.start(Direction::Forward).await), Refusal::Overridden { .. }));
}

#[tokio::test(start_paused = true)]
async fn start_at_writes_command_and_reference_in_one_exchange_where_the_block_allows_it() {
    let (rig, drive) = Rig::with_blocks().await;
    let mut drive = drive.with(Atv21::with_write_block);
    let set_up = rig.machine.requests(6);
    let status = drive.start_at(Direction::Reverse, HALF_SPEED).await.unwrap();
    assert_eq!(state(&status), (State::Running, Some(Direction::Reverse)));
    assert_eq!(
        (rig.machine.requests(0x10), rig.machine.requests(6) - set_up),
        (1, 1),
        "the priorities first"
    );
    rig.until(|seen| seen.output_frequency == -2_500).await;

    let (rig, drive) = Rig::factory();
    let mut drive = drive.with(Atv21::with_write_block);
    drive.start_at(Direction::Forward, HALF_SPEED).await.unwrap();
    assert_eq!((rig.machine.requests(0x10), rig.machine.requests(6)), (0, 3));
    rig.until(|seen| seen.output_frequency == 2_500).await;
}

#[tokio::test(start_paused = true)]
async fn start_at_never_writes_the_block_unless_its_owner_says_that_it_is_in_effect() {
    // What is configured would put the reference into FA00; nobody has reset the drive since.
    let (rig, drive) = Rig::with_blocks().await;
    let mut drive = drive.with(Atv21::with_write_block);
    for (register, choice) in [("F870", 3), ("F871", 1)] {
        drive.write_parameter(Row::find(ROWS, register).unwrap(), choice).await.unwrap();
    }
    drive.start_at(Direction::Forward, HALF_SPEED).await.unwrap();
    let mut other = rig.another();
    other.start_at(Direction::Forward, HALF_SPEED).await.unwrap();
    assert_eq!(rig.machine.requests(0x10), 0);
    assert_eq!((rig.machine.peek(0xFA00), rig.machine.peek(0xFA01)), (Some(0xC400), Some(2_500)));
}

#[tokio::test(start_paused = true)]
async fn a_lost_confirmation_of_a_stop_is_read_back() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    rig.machine.hold_next_answer();
    let (status, ()) = tokio::join!(drive.stop(StopMode::Ramp), async {
        rig.machine.wait_until_held().await;
        assert_eq!(rig.machine.peek(0xFA00), Some(0xC000));
        tokio::time::sleep(SECOND).await;
        rig.machine.release();
    });
    assert!(matches!(status.unwrap().status.state, State::Stopping | State::Ready));
    rig.line.close().await;
}

/// F207 and F112 = 38 (FCHG) of the Modbus guide's example (§6.2 p. 16): an input of the plant chooses the reference, which bit 14 would
/// override (§8.4).
#[tokio::test(start_paused = true)]
async fn a_stop_leaves_whose_the_reference_is_to_the_plants_own_switch() {
    let words = Words::new(&CAPABILITIES, &[(0xFD01, 0x4000), (0xFE45, 2), (0xFE46, 1)]);
    let mut drive = Atv21::new(words, bench::address(1));
    drive.stop(StopMode::Ramp).await.unwrap();
    let written = drive.into_port().written();
    assert!(
        written.iter().all(|(register, word)| *register == 0xFA00 && word & 0x4000 == 0),
        "{written:04X?}"
    );
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_a_late_start_overtakes_is_written_again_at_once() {
    let (rig, mut drive) = Rig::factory();
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    rig.machine.hold_next_answer();
    let (status, ()) = tokio::join!(drive.stop(StopMode::Ramp), async {
        rig.machine.wait_until_held().await;
        rig.machine.poke(0xFA00, 0xC400);
        rig.machine.release();
    });
    assert_ne!(status.unwrap().status.state, State::Running);
    assert_eq!((rig.machine.peek(0xFA00), bench::written(&rig.machine, 0xFA00).len()), (Some(0x8000), 2));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_revoked_again_and_again_is_not_confirmed() {
    let mut words = Words::new(&CAPABILITIES, &[(0xFD01, 0x6400), (0xFA00, 0xC400), (0xFE45, 2)]);
    words.deaf = true;
    let mut drive = Atv21::new(words, bench::address(1));
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap_err().kind(), ErrorKind::NotConfirmed);
    let written = drive.into_port().written();
    assert!((5..40).contains(&written.len()), "{written:?}");
    assert!(written.iter().all(|write| *write == (0xFA00, 0x8000)), "{written:?}");
}

#[tokio::test(start_paused = true)]
async fn an_emergency_stop_whose_clearing_was_lost_is_cleared_before_it_counts_as_done() {
    let mut words = Words::new(&CAPABILITIES, &[(0xFD01, 0x1003)]);
    words.writes.extend([None, Some((PortError::OutcomeUnknown("test"), false))]);
    let mut drive = Atv21::new(words, bench::address(1));
    assert!(drive.emergency_stop().await.unwrap().is_fault());
    let port = drive.into_port();
    assert_eq!(port.written(), [(0xFA00, 0x9000), (0xFA00, 0x8000), (0xFA00, 0x8000)]);
    assert_eq!(port.words.get(&0xFA00), Some(&0x8000));
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_still_turns_does_not_confirm_a_start_that_was_lost() {
    // FD01 may show "run" until the motor stands; FA00 holds the stop, FA01 the reference that is asked for.
    let turning = [(0xFD01, 0x6400), (0xFD00, 1_000), (0xFA00, 0xC000), (0xFA01, 2_500)];
    let set_up = [(0xFE45, 2), (0xFE46, 4), (0x0012, 5_000), (0x0870, 1), (0x0871, 3)];
    let mut words = Words::new(&CAPABILITIES, &[&turning[..], &set_up].concat());
    words.writes.push_back(Some((PortError::OutcomeUnknown("test"), false)));
    let mut drive = Atv21::new(words, bench::address(1)).with_write_block();
    let error = drive.start_at(Direction::Forward, HALF_SPEED).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
}

/// [`ErrorKind::NotSent`]: "Nothing was sent". A motor that follows the reference in rpm comes down by the zero that is written first.
#[tokio::test(start_paused = true)]
async fn a_setpoint_or_a_release_of_which_a_part_was_written_is_never_told_as_not_sent() {
    // The first so many writes are answered, and the next is not sent in time.
    let answers = |writes| {
        let mut words = Words::new(&CAPABILITIES, &[(0x0012, 5_000), (0xFA13, 600)]);
        words.writes.extend(std::iter::repeat_n(None, writes).chain([Some((PortError::Expired, false))]));
        Atv21::new(words, bench::address(1))
    };
    let mut drive = answers(1);
    let error = drive.set_setpoint(HALF_SPEED.into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    assert_eq!(drive.into_port().written(), [(0xFA13, 0), (0xFA01, 2_500)]);
    for of_release in 0..3 {
        let mut drive = answers(2 + of_release);
        drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
        let error = drive.release().await.unwrap_err();
        let expected = if of_release == 0 { ErrorKind::NotSent } else { ErrorKind::OutcomeUnknown };
        assert_eq!(error.kind(), expected, "behind {of_release}: {error}");
        assert_eq!(drive.into_port().written().len(), 2 + of_release + 1);
    }
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_stop_reaches_the_drive() {
    let (rig, mut drive) = Rig::factory();
    rig.at_speed(&mut drive).await;
    let write = drive.broadcast_stop(StopMode::Freewheel).unwrap();
    bench::broadcast(&rig.line, write).await;
    assert!(!rig.machine.observe().running);
}
