//! Starts, stops, setpoints: what moves the motor and what refuses to.

use drive_atv312::Atv312;
use drive_core::{
    Control, Direction, Drive, Error, ErrorKind, Frequency, Motion, Refusal, Setpoint, SetpointProblem,
    Speed, State, StopMode,
};
use drive_sim::{Exception, Panel};
use drive_testing::bench::{self, writes};

use crate::support::{FIFTY, commands, factory, refusal, rig, row, running};

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

/// With bLC assigned the brake is released before the motor turns, which takes brt, 5.00 s at the most (BBV51701 p. 47). A start that is
/// taken for one that failed meanwhile is taken back, and no such hoist ever starts.
#[tokio::test(start_paused = true)]
async fn a_hoist_whose_brake_takes_its_time_to_be_released_is_started() {
    for release in [0, 50, 250, 500] {
        let (mut drive, machine, _line) = rig();
        for (code, value) in [("bLC", 2), ("bEn", 0), ("brt", release)] {
            assert!(machine.poke(row(code).address, value), "{code}");
        }
        drive.set_setpoint(FIFTY).await.unwrap();
        let status =
            drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{release}: {error}"));
        assert!(status.output_frequency > Some(Frequency::ZERO), "{release}: {status:?}");
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
        assert_eq!(commands(&machine), [0x0006, 0x0007, 0x000F], "{release}");
    }
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
        let status = drive.stop(mode).await.unwrap().status;
        assert_eq!(machine.all_requests() - before, 2, "{mode}: one write, one status");
        assert_eq!(status.state, state, "{mode}");
        assert_eq!(commands(&machine).last(), Some(&word), "{mode}");
        assert!(machine.observe().shaft_frequency > 0, "{mode}: a stop takes its time");
        // A fast stop is told from a cut by looks that see it come down: it is four times as fast as the factory's ramp (dCF, BBV51701 p. 40).
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
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_was_adopted_running_is_stopped_in_each_mode() {
    for mode in StopMode::ALL {
        let (mut drive, machine, _line) = running().await;
        drive.forget();
        let stopped = drive.stop(mode).await.unwrap();
        // A quick stop locks: an injection that is asked for behind it does not begin (BBV51701 p. 11).
        assert_ne!(stopped.mode, StopMode::DcInjection);
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
        let quick_stop = commands(&machine).last() == Some(&0x0002);
        assert_eq!(quick_stop, mode != StopMode::Freewheel, "no word but these is sure without the settings");
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    }
}

/// The next program knows no setting of it. 0002h would end the direct current, and a motor without output coasts (BBV51701 p. 11, 40);
/// it would bring it down four times as fast as its ramp (dCF, p. 40).
#[tokio::test(start_paused = true)]
async fn a_stop_of_before_that_is_given_anew_goes_on_at_whatever_access_level() {
    for (mode, word) in [(StopMode::DcInjection, 0x200F), (StopMode::Ramp, 0x100F)] {
        for (mut drive, machine, line) in [rig(), factory()] {
            bench::run_at_fifty(&mut drive, &machine).await;
            drive.stop(mode).await.unwrap();
            let mut next = Atv312::new(line.slave(1), bench::address(1));
            assert_eq!(next.status().await.unwrap().motion, Motion::Braking);
            let before = commands(&machine).len();
            let stopped = next.stop(mode).await.unwrap();
            assert_eq!((stopped.mode, stopped.instead), (mode, None));
            assert_eq!(commands(&machine)[before..], [word]);
            assert_eq!(next.status().await.unwrap().motion, Motion::Braking);
        }
    }
}

/// Each comes down: to a lower setpoint by a run command, and by a fast stop, which no ramp takes the place of.
#[tokio::test(start_paused = true)]
async fn a_stop_by_ramp_of_a_motor_that_is_not_stopped_by_one_already_waits_for_no_settings() {
    for stops_fast in [false, true] {
        let (mut drive, machine, line) = rig();
        bench::run_at_fifty(&mut drive, &machine).await;
        if stops_fast {
            assert!(machine.poke(row("FSt").address, 174), "Cd14");
            drive.forget();
            drive.may_start(Direction::Forward, None).await.unwrap();
            drive.stop(StopMode::Fast).await.unwrap();
            assert_eq!(commands(&machine).last(), Some(&0x400F));
        } else {
            drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(10))).await.unwrap();
        }
        machine.wait_until(|seen| seen.output_frequency < 4_900).await;
        let mut next = Atv312::new(line.slave(1), bench::address(1));
        next.status().await.unwrap();
        let before = machine.received().len();
        assert_eq!(next.stop(StopMode::Ramp).await.unwrap().mode, StopMode::Fast);
        let first = &machine.received()[before].pdu;
        // The bits above the chart's stay as the drive holds them.
        assert_eq!((&first[..3], first[4]), (&[0x06, 0x21, 0x35][..], 0x02), "CMD, the quick stop");
    }
}

/// dCI on LI4 (p. 41): the direct current ends with the input, and a run command that stands may act again.
#[tokio::test(start_paused = true)]
async fn a_stop_of_a_motor_that_an_input_injects_into_waits_for_no_settings() {
    let (mut drive, machine, line) = rig();
    bench::run_at_fifty(&mut drive, &machine).await;
    assert!(machine.poke(row("dCI").address, 132) && machine.poke(row("IOLR").address, 0b1000));
    let mut next = Atv312::new(line.slave(1), bench::address(1));
    assert_eq!(next.status().await.unwrap().motion, Motion::Braking);
    let before = machine.received().len();
    let _ = next.stop(StopMode::DcInjection).await;
    let behind: Vec<_> =
        machine.received().split_off(before).into_iter().map(|request| request.pdu[0]).collect();
    assert_eq!(behind[0], 0x06, "{behind:x?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_the_settings_do_not_have_is_replaced_and_the_motor_stops() {
    for (code, value, mode, used, why) in [
        ("Stt", 2, StopMode::Ramp, StopMode::Freewheel, "freewheel"),
        ("Stt", 1, StopMode::Ramp, StopMode::Fast, "fast"),
        ("Stt", 3, StopMode::Ramp, StopMode::Fast, "injection"),
        ("PS2", 172, StopMode::Ramp, StopMode::Fast, "bit 12"),
        ("dCI", 0, StopMode::DcInjection, StopMode::Ramp, "dCI"),
    ] {
        let (mut drive, machine, _line) = rig();
        drive.write_parameter(row(code), value).await.unwrap();
        drive.set_setpoint(FIFTY).await.unwrap();
        drive.start(Direction::Forward).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 5_000).await;
        let stopped = drive.stop(mode).await.unwrap();
        assert_eq!(stopped.mode, used, "{code}");
        assert!(stopped.instead.unwrap().contains(why), "{stopped}");
        machine.wait_until(|seen| seen.shaft_frequency == 0 && !seen.running).await;
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
async fn a_start_that_somebody_takes_back_at_the_drive_is_not_confirmed_and_not_given_again() {
    for panel in [Panel::TakeControl, Panel::Stop] {
        let (mut drive, machine, _line) = rig();
        let started = bench::start_taken_back(&mut drive, &machine, panel).await;
        assert_eq!(started.unwrap_err().kind(), ErrorKind::NotConfirmed, "{panel:?}");
        assert_eq!(commands(&machine), [6, 7, 15], "{panel:?}");
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
    let error = drive.set_setpoint(FIFTY).await.unwrap_err();
    assert!(matches!(refusal(&error), Some(Refusal::Overridden { .. })), "{error}");
    assert_eq!(writes(&machine), before);
}

/// Somebody at the keypad of a motor that stands sets Fr1 to AI1 (1), which was Mdb (164), and back (BBV51701 p. 35).
#[tokio::test(start_paused = true)]
async fn a_setpoint_is_refused_where_the_reference_was_set_elsewhere_since_the_drive_was_asked() {
    let channel = |because: Option<Refusal>| match because {
        Some(Refusal::Overridden { by, .. }) => by,
        other => panic!("{other:?}"),
    };
    let (mut drive, machine, _line) = rig();
    drive.set_setpoint(FIFTY).await.unwrap();
    assert!(machine.poke(row("Fr1").address, 1));
    let before = writes(&machine);
    let error = drive.set_setpoint(FIFTY).await.unwrap_err();
    assert_eq!(channel(refusal(&error)), "the reference channel Fr1, which is not Mdb,");
    // The motor would run at what AI1 says.
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Refused, "{error}");
    assert_eq!(writes(&machine), before);
    assert!(machine.poke(row("Fr1").address, 164));
    drive.set_setpoint(FIFTY).await.unwrap();
}

/// Set at the keypad of a motor that stands, where no word tells it: the PI regulator on AI2 (p. 45), whose error would take the motor to HSP, a
/// preset speed on LI3, which is closed (p. 43), jog operation on LI5 (p. 44), the bus summed to Fr1, which it is (p. 42).
#[tokio::test(start_paused = true)]
async fn what_was_set_to_take_the_place_of_the_setpoint_while_the_motor_stood_lets_no_setpoint_and_no_start_pass()
 {
    for (code, value, inputs, by) in [
        ("PIF", 2, 0, "PIF"),
        ("PS2", 131, 0b100, "preset"),
        ("JOG", 133, 0b1_0000, "jog"),
        ("SA2", 164, 0, "SA2"),
    ] {
        let (mut drive, machine, _line) = running().await;
        drive.stop(StopMode::Ramp).await.unwrap();
        machine.wait_until(|seen| !seen.running).await;
        let before = commands(&machine).len();
        assert!(
            machine.poke(row("IOLR").address, inputs) && machine.poke(row(code).address, value),
            "{code}"
        );
        let told = |error: Error| match error {
            Error::Refused { reason, .. } => Some(reason),
            Error::NotConfirmed { because, .. } => because,
            _ => None,
        };
        let error = drive.set_setpoint(FIFTY).await.expect_err(code);
        let is_named =
            |reason| matches!(reason, Some(Refusal::Overridden { by: told, .. }) if told.contains(by));
        assert!(is_named(told(error.clone())), "{code}: {error}");
        let error = drive.start(Direction::Forward).await.expect_err(code);
        assert!(error.kind() == ErrorKind::Refused && is_named(told(error.clone())), "{code}: {error}");
        assert_eq!(commands(&machine).len(), before, "{code}");
        assert!(machine.poke(row(code).address, 0));
        drive.set_setpoint(FIFTY).await.unwrap_or_else(|error| panic!("{code}: {error}"));
        drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{code}: {error}"));
    }
}

/// Atr = YES (p. 51), set at the keypad between a stop and the start behind it.
#[tokio::test(start_paused = true)]
async fn a_restart_by_itself_that_was_switched_on_while_the_motor_stood_is_seen_by_the_next_start() {
    let (mut drive, machine, _line) = running().await;
    drive.stop(StopMode::Ramp).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    assert!(machine.poke(row("Atr").address, 1));
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert!(matches!(refusal(&error), Some(Refusal::RestartsItself(_))), "{error}");
}

/// Forced local (ETA bit 9 at 0, p. 21): the reference is that of FLOC (p. 55), AI1 as the drive leaves the factory.
#[tokio::test(start_paused = true)]
async fn a_setpoint_to_a_motor_that_stands_is_not_confirmed_while_its_panel_has_it() {
    let (mut drive, machine, _line) = rig();
    machine.panel(Panel::TakeControl);
    let error = drive.set_setpoint(FIFTY).await.unwrap_err();
    let Error::NotConfirmed { because, .. } = error else { panic!("{error}") };
    assert_eq!(because, Some(Refusal::NotInControl(Control::Local)));
    machine.panel(Panel::ReleaseControl);
    drive.set_setpoint(FIFTY).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_run_command_that_still_stands_shows_when_somebody_else_gives_control_back() {
    let (mut drive, machine, _line) = running().await;
    machine.panel(Panel::TakeControl);
    machine.wait_until(|seen| !seen.running).await;
    assert_eq!(drive.status().await.unwrap().control, Some(Control::Local));
    machine.panel(Panel::ReleaseControl);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Running, Some(Control::Bus)), "CMD holds 000Fh");
    let (mut drive, machine, _line) = running().await;
    machine.panel(Panel::TakeControl);
    machine.wait_until(|seen| !seen.running).await;
    drive.withdraw().await.unwrap();
    machine.panel(Panel::ReleaseControl);
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.control), (State::Ready, Some(Control::Bus)), "withdrawn meanwhile");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_another_master_starts_again_behind_a_stop_is_called_running() {
    let (mut drive, machine, line) = running().await;
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().status.state, State::Stopping);
    machine.wait_until(|seen| seen.output_frequency < 3_000).await;
    bench::write(&line, 8501, 0x000F).await;
    assert_eq!(drive.status().await.unwrap().state, State::Running);
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    assert_eq!(drive.status().await.unwrap().state, State::Running, "also when it speeds up no more");
}

/// ETA bit 10, "reference reached (steady state)" (BBV51701 p. 13), and ACC of 0.1 s: no status has shown that it speeds up.
#[tokio::test(start_paused = true)]
async fn a_motor_that_is_at_its_reference_again_before_the_next_status_is_called_running_behind_a_stop() {
    let (mut drive, machine, line) = running().await;
    assert!(machine.poke(9_001, 1));
    assert_eq!(drive.stop(StopMode::Ramp).await.unwrap().status.state, State::Stopping);
    machine.wait_until(|seen| seen.output_frequency < 3_000).await;
    bench::write(&line, 8501, 0x000F).await;
    machine.wait_until(|seen| seen.output_frequency == 5_000).await;
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.motion), (State::Running, Motion::Driven));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_does_not_show_is_corrected_by_the_settings_as_they_are_now() {
    let (mut drive, machine, _line) = running().await;
    // Bit 14 is none of a stop any more.
    assert!(machine.poke(11204, 0));
    drive.stop(StopMode::Fast).await.unwrap();
    assert_eq!(commands(&machine)[3..], [0x400F, 0x0002]);
}

/// Exception 04h: nothing was done. What the word depends on is read for one that the drive has taken and does not show.
#[tokio::test(start_paused = true)]
async fn a_stop_that_the_drive_has_refused_is_written_again_before_its_settings_are_read() {
    let (mut drive, machine, _line) = running().await;
    let before = machine.all_requests();
    machine.refuse_next(Exception::FAILURE);
    drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(commands(&machine)[3..], [0x100F; 2]);
    // The stop, a status, the stop again, and a status that shows it.
    assert_eq!(machine.all_requests() - before, 4);
}

/// PS2 = Cd12 (BBV51701 p. 42): bit 12 selects a preset speed then, by which 100Fh speeds the motor up in place of stopping it. The drive
/// takes such a setting while its motor stands (p. 42, R/WS).
#[tokio::test(start_paused = true)]
async fn a_function_that_was_set_on_a_bit_while_the_motor_stood_is_known_to_the_stop_behind_the_next_start() {
    const PS2: u16 = 11_401;
    const CD12: u16 = 172;
    let (mut drive, machine, _line) = running().await;
    drive.stop(StopMode::Ramp).await.unwrap();
    machine.wait_until(|seen| !seen.running).await;
    assert!(machine.poke(PS2, CD12));
    drive.start(Direction::Forward).await.unwrap();
    let before = commands(&machine).len();
    let stopped = drive.stop(StopMode::Ramp).await.unwrap();
    assert_eq!(stopped.mode, StopMode::Fast);
    assert!(stopped.instead.is_some_and(|why| why.contains("bit 12")), "{stopped:?}");
    assert!(commands(&machine)[before..].iter().all(|word| word & 0x100F != 0x100F), "{machine:?}");
}

/// With LAC = L3, CHCF = SEP and CCS = C112 bit 12 of CMD leads the command to Cd1, here the terminals, where it is 0, and to Cd2, the bus, where
/// it is 1 (BBV51701 p. 37). Who has read none of that gives it to them by the first word of his stop, and LI1 is closed.
#[tokio::test(start_paused = true)]
async fn a_stop_of_somebody_who_knows_no_setting_has_the_command_back_before_it_reads_the_others() {
    let (mut drive, machine, line) = rig();
    for (code, value) in [("Cd1", 1), ("Cd2", 10), ("CCS", 188), ("tCt", 0)] {
        assert!(machine.poke(row(code).address, value), "{code}");
    }
    bench::write(&line, row("CMD").address, 0x1000).await;
    bench::run_at_fifty(&mut drive, &machine).await;
    assert!(machine.poke(row("IOLR").address, 1));
    let before = machine.received().len();
    let mut other = Atv312::new(line.slave(1), bench::address(1));
    let stopped = other.stop(StopMode::Fast).await.unwrap();
    assert_eq!(stopped.status.control, Some(Control::Bus));
    machine.wait_until(|seen| !seen.running).await;
    let behind: Vec<_> =
        machine.received().split_off(before).into_iter().map(|request| request.pdu).collect();
    let of_bus = behind.iter().position(|pdu| pdu[0] != 0x03 && pdu[3] & 0x10 != 0);
    // The stop, a status, LAC, CCS, Cd1 with Cd2, and CHCF.
    assert_eq!(of_bus, Some(6), "{behind:x?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_whose_confirmation_is_lost_is_read_back() {
    let (mut drive, machine, _line) = running().await;
    machine.hold_next_answer();
    let status = drive.stop(StopMode::Ramp).await.unwrap().status;
    assert!(machine.requests(0x03) > 0);
    assert_eq!(status.state, State::Stopping);
    machine.wait_until(|seen| !seen.running).await;
}
