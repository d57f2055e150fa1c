//! Stops and the exit.

use super::*;
use crate::outcome::StopModes;

#[test]
fn a_stop_interrupts_whatever_is_in_flight_and_ends_the_orders() {
    let mut rig = Rig::ready();
    let start = rig.order(START);
    assert!(matches!(rig.next(), Step::Do { job: Job::Start(_), .. }));
    let waiting = rig.order(Order::Persist);
    let asker = rig.asker();
    assert!(rig.machine.handle_stop(rig.now, asker, StopMode::Ramp.into(), None));
    rig.machine.handle_dropped(rig.now);
    let stop = CallId(rig.next_call);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::Ramp), .. }));
    let reply = rig.drive.answer(Job::Stop(StopMode::Ramp));
    rig.machine.handle_reply(rig.now, reply);
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::NotConfirmed(Unconfirmed::Stopped)));
    assert_eq!(rig.outcome(waiting), Some(&Outcome::Refused(Refused::Stopped)));
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_stop_is_repeated_until_the_drive_shows_standstill() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    let id = rig.stop(StopMode::Ramp);
    rig.pass(10_000 * MS);
    assert!(matches!(rig.outcome(id), Some(Outcome::OutcomeUnknown(_))));
    assert!(rig.events().contains(&"stop unconfirmed"));
    assert_eq!(rig.events().iter().filter(|name| **name == "stop unconfirmed").count(), 1);
    let attempts = rig.drive.writes().len();
    assert!(attempts >= 10, "{attempts}");
    let start = rig.order(START);
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::StopPending)));
    rig.drive.failing = None;
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"));
    assert_eq!(rig.drive.status.state, State::Ready);
    assert_eq!(rig.snapshot().stop, None);
}

/// Whose guards say that it is another drive gets no stop: that is an alarm at once, and nothing that was sent.
#[test]
fn a_stop_that_its_driver_does_not_send_is_counted_as_none_and_an_alarm_at_once() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.withholds_stops = Some(Refusal::AnotherDrive("another"));
    let id = rig.stop(StopMode::Ramp);
    rig.pass(100 * MS);
    let stop = rig.snapshot().stop.expect("it goes on");
    assert!(rig.events().contains(&"stop unconfirmed") && stop.alarm, "{stop:?}");
    assert_eq!((stop.attempts, stop.taken), (0, false));
    let concern = rig.snapshot().concern(rig.now).expect("it is one").to_string();
    assert!(concern.contains("not sent") && !concern.contains("sent 0"), "{concern}");
    rig.pass(10_000 * MS);
    let outcome = rig.outcome(id).expect("it has ended");
    assert!(
        matches!(outcome, Outcome::NotConfirmed(Unconfirmed::Denied(Error::Refused { .. }))),
        "{outcome}"
    );
    rig.drive.withholds_stops = None;
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"), "it is tried again all the while");
}

#[test]
fn a_stop_that_the_drive_takes_back_is_sent_again() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    let id = rig.stop(StopMode::Ramp);
    // The drive takes the stop, comes down, and is started by somebody else before it stands.
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    let stopping = Status { state: State::Stopping, ..rig.drive.status.clone() };
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(Stopped::by(StopMode::Ramp, stopping))));
    assert_eq!(rig.outcome(id), None);
    rig.pass(2_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)]);
}

#[test]
fn a_ramp_that_hangs_is_an_alarm_after_ten_seconds_and_the_slowest_that_goes_on_is_none() {
    for (falls, is_alarm) in [(false, true), (true, false)] {
        let mut rig = Rig::ready();
        rig.drive.run();
        rig.pass(1_000 * MS);
        rig.stop(StopMode::Ramp);
        assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
        let braking = |centihertz| Status {
            state: State::Stopping,
            motion: Motion::Braking,
            output_frequency: Some(Frequency::from_centihertz(centihertz)),
            ..Status::default()
        };
        let taken = Stopped::by(StopMode::Ramp, braking(3_000));
        rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(taken)));
        // An Altivar 21 ramps for up to 3200 s (ACC, dEC): a tenth of a hertz in 6.4 s from 50 Hz.
        for step in 0..4 {
            rig.drive.status = braking(if falls { 3_000 - 10 * step } else { 3_000 });
            rig.pass(6_400 * MS);
        }
        assert_eq!(rig.events().contains(&"stop unconfirmed"), is_alarm, "{falls}: {:?}", rig.events());
    }
}

#[test]
fn a_stop_mode_that_the_drive_replaces_is_told_with_the_reason_and_confirmed() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    let why = "its setting Stt is freewheel";
    rig.drive.stops_by = Some((StopMode::Freewheel, why));
    let id = rig.stop(StopMode::DcInjection);
    rig.pass(100 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::DcInjection)]);
    let (asked, used) = (StopMode::DcInjection, StopMode::Freewheel);
    let told = EventKind::StopModeReplaced { asked, used, why: Some(why) };
    assert!(rig.times_told(&told) == 1, "{:?}", rig.outputs);
}

#[test]
fn whoever_stops_by_injection_ends_it_once_the_motor_is_held_and_not_when_the_output_is_at_zero() {
    for (state, motion) in
        [(State::Stopping, Motion::Held), (State::Ready, Motion::AtRest), (State::Ready, Motion::Coasting)]
    {
        let mut rig = Rig::ready();
        rig.drive.run();
        rig.pass(1_000 * MS);
        rig.drive.log.clear();
        let id = rig.stop(StopMode::DcInjection);
        assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::DcInjection), .. }));
        let output_frequency = Some(Frequency::ZERO);
        let braking = Status {
            state: State::Stopping,
            motion: Motion::Braking,
            output_frequency,
            ..rig.drive.status.clone()
        };
        let stopped = Stopped::by(StopMode::DcInjection, braking.clone());
        rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(stopped)));
        rig.drive.status = braking;
        rig.pass(5_000 * MS);
        assert_eq!(rig.drive.writes(), [], "no output is no standstill: it is braked still");
        rig.drive.status = Status { state, motion, ..rig.drive.status.clone() };
        rig.pass(1_000 * MS);
        assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)], "{state}");
        assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed), "{state}");
    }
}

#[test]
fn an_injection_of_which_nobody_knows_when_the_motor_stands_is_ended_before_it_heats_it() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.stop(StopMode::DcInjection);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::DcInjection), .. }));
    let braking = Status { state: State::Stopping, motion: Motion::Braking, ..rig.drive.status.clone() };
    let stopped = Stopped::by(StopMode::DcInjection, braking.clone());
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(stopped)));
    rig.drive.status = braking;
    rig.pass(25_000 * MS);
    // It is held as it was asked to be, at an output that cannot come down any more.
    let is_alarm = |rig: &Rig| rig.snapshot().stop.is_some_and(|stop| stop.alarm);
    assert!(!is_alarm(&rig), "{:?}", rig.outputs);
    rig.pass(15_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)]);
}

/// A stop that the drive has taken, of a motor at 50 Hz that comes down from now on.
fn coming_down() -> (Rig, CallId) {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.outputs.clear();
    let id = rig.stop(StopMode::Ramp);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    let braking = Status {
        state: State::Stopping,
        motion: Motion::Braking,
        output_frequency: Some(Frequency::from_hertz(50)),
        ..rig.drive.status.clone()
    };
    rig.drive.status = braking.clone();
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(Stopped::by(StopMode::Ramp, braking))));
    (rig, id)
}

#[test]
fn a_ramp_of_three_minutes_is_no_alarm_as_long_as_the_motor_comes_down() {
    let (mut rig, id) = coming_down();
    for hertz in (0..50).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(3_600 * MS);
    }
    assert!(!rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    rig.drive.stand();
    rig.pass(1_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_ramp_that_hangs_is_an_alarm_in_its_time() {
    let (mut rig, id) = coming_down();
    rig.drive.status.output_frequency = Some(Frequency::from_hertz(7));
    rig.pass(70_000 * MS);
    assert!(rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))));
}

/// A motor on its way to a lower setpoint, whose drive says nothing of a stop before it stands, as a Siemens V20 does.
fn slowing(from: u16) -> (Rig, CallId) {
    let mut rig = Rig::ready();
    rig.drive.run();
    (rig.drive.status.output_frequency, rig.drive.denies_stops) =
        (Some(Frequency::from_hertz(from)), Some(None));
    rig.pass(1_000 * MS);
    rig.outputs.clear();
    let id = rig.stop(StopMode::Ramp);
    (rig, id)
}

#[test]
fn a_stop_in_which_the_output_sinks_without_a_word_by_what_is_repeated_and_no_alarm_while_it_does() {
    let (mut rig, id) = slowing(45);
    for hertz in (10..45).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(700 * MS);
    }
    assert!(!rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    assert_eq!(rig.outcome(id), None);
    assert!(rig.drive.log.iter().filter(|job| matches!(job, Job::Stop(_))).count() > 20, "it is repeated");
    rig.drive.stand();
    rig.drive.denies_stops = None;
    rig.pass(1_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_motor_that_only_went_to_its_lower_setpoint_is_an_unconfirmed_stop_once_it_is_there() {
    let (mut rig, id) = slowing(45);
    for hertz in (40..45).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(700 * MS);
    }
    assert!(!rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))));
}

#[test]
fn a_motor_that_sinks_for_longer_than_a_stop_has_is_an_unconfirmed_stop() {
    let (mut rig, id) = slowing(80);
    for hertz in (0..80).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz + 1));
        rig.pass(1_000 * MS);
    }
    assert!(rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))));
}

#[test]
fn a_stop_that_somebody_else_keeps_from_the_motor_is_an_alarm_in_its_time_however_the_output_sinks() {
    let (mut rig, id) = slowing(45);
    rig.drive.denies_stops = Some(Some(ANOTHER_WORD));
    for hertz in (42..45).rev() {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(700 * MS);
    }
    assert!(rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))));
}

#[test]
fn a_freewheel_is_confirmed_as_an_output_that_is_off_and_a_shaft_that_may_coast() {
    let (mut rig, id) = coming_down();
    rig.drive.status.motion = Motion::Coasting;
    rig.pass(1_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    let told = rig.outputs.iter().find_map(|output| match output {
        Output::Event(Happened { kind: kind @ EventKind::StopConfirmed { .. }, .. }) => {
            Some(kind.to_string())
        }
        _ => None,
    });
    assert_eq!(told.as_deref(), Some("stop confirmed: output off, the shaft may coast"));
}

#[test]
fn a_stop_that_never_left_for_the_line_is_no_attempt_and_is_sent_when_the_port_is_back() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.drive.failing = Some(PortError::LineDown("unplugged".to_owned()));
    let id = rig.stop(StopMode::Ramp);
    rig.pass(300 * MS);
    assert!(rig.drive.log.len() >= 3, "it is tried meanwhile: {:?}", rig.drive.log);
    assert_eq!(rig.snapshot().stop.map(|stop| stop.attempts), Some(0));
    rig.drive.failing = None;
    rig.pass(1_000 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
}

#[test]
fn the_alarm_of_a_stop_over_a_cut_cable_says_what_is_not_known_and_how_old_the_last_status_is() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    let id = rig.stop(StopMode::Ramp);
    // The call takes as long as it likes: no error is known yet.
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    rig.now = rig.machine.stop_alarm_at().unwrap();
    rig.machine.handle_stop_alarm(rig.now);
    rig.collect();
    let Some(outcome) = rig.outcome(id) else { panic!("no outcome") };
    let said = outcome.to_string();
    assert!(
        said.starts_with("outcome unknown: nothing has confirmed it yet; the drive was last seen running, "),
        "{said}"
    );
    assert!(said.ends_with(" s ago"), "{said}");
    let alarm = rig.outputs.iter().find_map(|output| match output {
        Output::Event(Happened { kind: kind @ EventKind::StopUnconfirmed { .. }, .. }) => {
            Some(kind.to_string())
        }
        _ => None,
    });
    assert!(alarm.is_some_and(|alarm| alarm.contains("outcome unknown")), "{said}");
}

#[test]
fn a_cable_that_is_cut_while_the_motor_comes_down_leaves_its_stop_unknown() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    let id = rig.stop(StopMode::Ramp);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    (rig.drive.status.state, rig.drive.status.motion) = (State::Stopping, Motion::Braking);
    let stopping = rig.drive.status.clone();
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(Stopped::by(StopMode::Ramp, stopping))));
    rig.pass(200 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(60_000 * MS);
    let said = rig.outcome(id).map(ToString::to_string).unwrap_or_default();
    assert!(said.starts_with("outcome unknown: slave 1, reading"), "{said}");
    assert!(said.contains("the drive was last seen stopping") && said.ends_with(" s ago"), "{said}");
}

/// How a stop without an injection was asked for, and done.
const fn modes(asked: StopMode, used: Option<StopMode>, why: Option<&'static str>) -> StopModes {
    StopModes { asked, used, why, injection_asked: None, injection_used: None }
}

/// Asked for, and done.
const BY_RAMP: StopModes = modes(StopMode::Ramp, Some(StopMode::Ramp), None);

#[test]
fn the_exit_stops_what_was_started_here_and_leaves_what_was_not() {
    for (started, policy, expected) in [
        (true, OnExit::Stop(StopMode::Ramp), ExitAction::Stopped(Outcome::Stopped(BY_RAMP))),
        (false, OnExit::Stop(StopMode::Ramp), ExitAction::LeftTurning),
        (true, OnExit::Leave, ExitAction::Left),
        (true, OnExit::Release(StopMode::Ramp), ExitAction::Released(Outcome::Confirmed)),
        (false, OnExit::Release(StopMode::Ramp), ExitAction::Left),
    ] {
        let mut rig = Rig::ready();
        rig.machine.settings.on_exit = policy;
        if started {
            rig.order(START);
        } else {
            rig.drive.run();
        }
        rig.pass(2_000 * MS);
        rig.drive.log.clear();
        rig.machine.handle_exit(rig.now, Policy::Exit);
        rig.machine.handle_dropped(rig.now);
        rig.pass(5_000 * MS);
        assert_eq!(rig.machine.exit_action(), Some(&expected), "{started} {policy:?}");
        if matches!(expected, ExitAction::Left | ExitAction::LeftTurning) {
            assert_eq!(rig.drive.writes(), []);
        }
    }
}

/// A drive that runs, and a stop along no ramp that has not reached it yet.
fn unheard(mode: StopMode) -> Rig {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.stop(mode);
    rig.pass(500 * MS);
    rig
}

#[test]
fn a_stop_under_way_keeps_its_mode_whatever_policy_or_group_stops_the_drive_besides() {
    let mode = StopMode::Freewheel;
    for policy in [OnExit::Stop(StopMode::Ramp), OnExit::Release(StopMode::Ramp), OnExit::Leave] {
        let mut rig = unheard(mode);
        rig.machine.settings.on_exit = policy;
        rig.machine.handle_exit(rig.now, Policy::Exit);
        rig.machine.handle_dropped(rig.now);
        rig.pass(1_000 * MS);
        assert_eq!(rig.machine.exit_action(), None, "{policy:?}: the stop goes on");
        rig.drive.failing = None;
        rig.pass(5_000 * MS);
        assert!(rig.machine.exit_action().is_some() && rig.drive.status.is_standstill(), "{policy:?}");
        let stops = rig.drive.writes();
        assert!(
            stops.iter().all(|job| matches!(
                job,
                Job::Stop(StopMode::Freewheel) | Job::Release | Job::RestoreWatchdog(_)
            )),
            "{stops:?}"
        );
    }

    let mut rig = unheard(mode);
    let weaker = rig.stop(StopMode::Ramp);
    rig.drive.failing = None;
    rig.pass(1_000 * MS);
    assert!(rig.drive.writes().iter().all(|job| *job == Job::Stop(mode)));
    let joined = modes(StopMode::Ramp, Some(mode), None);
    assert_eq!(rig.outcome(weaker), Some(&Outcome::Stopped(joined)));

    let mut rig = unheard(StopMode::Ramp);
    rig.drive.failing = None;
    rig.stop(mode);
    rig.pass(1_000 * MS);
    assert_eq!(rig.drive.writes().last(), Some(&Job::Stop(mode)), "what stops harder takes its place");
}

#[test]
fn the_exit_goes_on_stopping_a_mute_drive_until_its_own_limit() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.machine.handle_dropped(rig.now);
    rig.pass(30_000 * MS);
    assert_eq!(rig.machine.exit_action(), None);
    assert!(rig.events().contains(&"stop unconfirmed"));
    rig.machine.handle_exit_time_over();
    assert_eq!(rig.machine.exit_action(), Some(&ExitAction::TimeOver));
}

#[test]
fn a_stop_whose_call_takes_long_is_an_alarm_in_its_time() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    let id = rig.stop(StopMode::Ramp);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    let alarm_at = rig.machine.stop_alarm_at().expect("it waits for its confirmation");
    rig.machine.handle_stop_alarm(alarm_at - MS);
    rig.collect();
    assert_eq!(rig.outcome(id), None);
    rig.machine.handle_stop_alarm(alarm_at);
    rig.collect();
    assert!(rig.events().contains(&"stop unconfirmed"));
    assert!(rig.outcome(id).is_some_and(|outcome| !outcome.is_confirmed()));
    assert_eq!(rig.machine.stop_alarm_at(), None, "it is told once");
}

#[test]
fn the_modes_that_were_asked_for_and_used_stand_in_every_outcome_of_a_stop() {
    const WHY: &str = "its settings have no fast stop";
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.drive.stops_by = Some((StopMode::Ramp, WHY));
    let replaced = modes(StopMode::Fast, Some(StopMode::Ramp), Some(WHY));
    let id = rig.stop(StopMode::Fast);
    rig.pass(1_000 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::Stopped(replaced)));
    let said = rig.outcome(id).map(ToString::to_string);
    let words =
        "confirmed: asked for a fast stop, the drive did a ramp stop because its settings have no fast stop";
    assert_eq!(said.as_deref(), Some(words));

    // One that goes on turning.
    let (mut rig, id) = coming_down();
    rig.drive.status.output_frequency = Some(Frequency::from_hertz(7));
    rig.pass(70_000 * MS);
    assert_eq!(rig.outcome(id).and_then(Outcome::stop), Some(BY_RAMP), "{:?}", rig.outcome(id));

    // One of which nothing is heard.
    let mut rig = Rig::ready();
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    let id = rig.stop(StopMode::Freewheel);
    rig.pass(8_000 * MS);
    let unknown = modes(StopMode::Freewheel, None, None);
    assert!(matches!(rig.outcome(id), Some(Outcome::OutcomeUnknown(_))), "{:?}", rig.outcome(id));
    assert_eq!(rig.outcome(id).and_then(Outcome::stop), Some(unknown));

    // An injection is ended along the ramp, and was an injection.
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    let id = rig.stop(StopMode::DcInjection);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::DcInjection), .. }));
    rig.drive.status.motion = Motion::Held;
    let stopped = Stopped::by(StopMode::DcInjection, rig.drive.status.clone());
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(stopped)));
    rig.pass(3_000 * MS);
    let injected = modes(StopMode::DcInjection, Some(StopMode::DcInjection), None);
    assert_eq!(rig.outcome(id), Some(&Outcome::Stopped(injected)));
}

#[test]
fn a_stop_that_never_left_is_not_confirmed_by_a_motor_that_stands_anyway() {
    let mut rig = Rig::ready();
    let id = rig.stop(StopMode::Ramp);
    let step = rig.next();
    assert!(matches!(step, Step::Do { job: Job::Stop(StopMode::Ramp), .. }), "{step:?}");
    let unplugged = port_error(PortError::LineDown("unplugged".to_owned()));
    rig.machine.handle_reply(rig.now, Reply::Stopped(Err(unplugged)));
    let status = rig.drive.status();
    rig.machine.handle_reply(rig.now, Reply::Status(status));
    rig.collect();
    assert_eq!(rig.outcome(id), None, "its run command may stand");
    rig.pass(1_000 * MS);
    assert!(rig.drive.writes().contains(&Job::Stop(StopMode::Ramp)));
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_stop_that_the_drive_refuses_is_not_confirmed_by_a_motor_that_stands_anyway() {
    let mut rig = Rig::ready();
    rig.drive.refuses_stops = true;
    let id = rig.stop(StopMode::Ramp);
    rig.pass(30_000 * MS);
    assert!(rig.events().contains(&"stop unconfirmed"), "a run command may stand in it: {:?}", rig.events());
    let Some(Outcome::NotConfirmed(Unconfirmed::StopDenied { error, .. })) = rig.outcome(id) else {
        panic!("{:?}", rig.outcome(id))
    };
    assert!(matches!(error, Error::Exception { code: 4, .. }), "{error}");
    assert!(!rig.events().contains(&"stop confirmed"));
    rig.drive.refuses_stops = false;
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"), "it was repeated until the drive took it");
}

#[test]
fn an_injection_that_never_left_is_not_over_because_the_motor_stands() {
    let mut rig = Rig::ready();
    rig.drive.expires_stops = true;
    rig.stop(StopMode::DcInjection);
    rig.pass(10_000 * MS);
    let injection = Job::Stop(StopMode::DcInjection);
    assert!(rig.drive.log.contains(&injection) && !rig.drive.log.contains(&Job::Stop(StopMode::Ramp)));
    rig.drive.expires_stops = false;
    rig.pass(10_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"), "{:?}", rig.events());
}

/// A status that was read before now.
fn read_before(rig: &Rig, status: Status) -> Reply {
    Reply::Status(Ok(Status { at: Some(rig.now), ..status }))
}

#[test]
fn a_second_stop_is_taken_into_the_one_under_way_and_confirmed_by_a_status_that_is_newer_than_itself() {
    let (mut rig, first) = coming_down();
    rig.drive.log.clear();
    rig.now += 600 * MS;
    rig.machine.handle_heard(rig.now);
    let step = rig.next();
    assert!(matches!(step, Step::Do { job: Job::Status { .. }, .. }), "{step:?}");
    rig.drive.stand();
    let older = read_before(&rig, rig.drive.status.clone());
    rig.now += 20 * MS;
    let asker = rig.asker();
    let drops = rig.machine.handle_stop(rig.now, asker, StopMode::Ramp.into(), None);
    assert!(!drops, "what confirms the first is not cut for the second");
    let second = CallId(rig.next_call);
    rig.now += 20 * MS;
    rig.machine.handle_reply(rig.now, older);
    rig.collect();
    assert!(rig.outcome(first).is_some_and(Outcome::is_confirmed));
    let in_force = |rig: &Rig| {
        rig.outputs.iter().any(|output| matches!(output, Output::InForce(id, _) if *id == second))
    };
    assert!(rig.outcome(second).is_none() && !in_force(&rig), "that was read before it was asked for");
    rig.pass(100 * MS);
    assert!(rig.outcome(second).is_some_and(Outcome::is_confirmed), "the next status is not far");
    assert!(in_force(&rig));
    assert_eq!(rig.drive.writes(), [], "the stop stood");
}

#[test]
fn a_second_stop_is_written_again_where_the_motor_turns_again_behind_the_first() {
    let (mut rig, _) = coming_down();
    rig.drive.log.clear();
    let second = rig.stop(StopMode::Ramp);
    rig.drive.run();
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)]);
    assert!(rig.outcome(second).is_some_and(Outcome::is_confirmed));
}

#[test]
fn direct_current_is_held_for_the_time_of_the_call_and_the_outcome_says_what_was_asked_for_and_used() {
    let second = Duration::from_secs(1);
    let mut rig = Rig::ready();
    rig.machine.settings.injection = Some(4 * second);
    assert_eq!(rig.machine.injection(), Some(4 * second), "without a stop its owner's counts");
    rig.drive.run();
    rig.pass(1_000 * MS);
    let id = rig.stop(StopOrder::injecting(60 * second));
    assert_eq!(rig.machine.injection(), Some(60 * second));
    let again = rig.stop(StopOrder::injecting(2 * second));
    assert_eq!(rig.machine.injection(), Some(60 * second), "the longer brings the motor to rest");
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::DcInjection), .. }));
    rig.drive.status.motion = Motion::Held;
    // The driver holds it for as long as a motor bears.
    let stopped = Stopped {
        injects_for: Some(30 * second),
        ..Stopped::by(StopMode::DcInjection, rig.drive.status.clone())
    };
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(stopped)));
    rig.pass(3_000 * MS);
    let told =
        |id| rig.outcome(id).and_then(Outcome::stop).map(|stop| (stop.injection_asked, stop.injection_used));
    assert_eq!(told(id), Some((Some(60 * second), Some(30 * second))));
    assert_eq!(told(again), Some((Some(2 * second), Some(30 * second))));
    let said = rig.outcome(id).map(ToString::to_string);
    let words = "confirmed: asked for a DC injection stop held for 60s, it is held for 30s";
    assert_eq!(said.as_deref(), Some(words));
    assert_eq!(rig.machine.injection(), Some(4 * second), "and it ends with the stop");
}

#[test]
fn a_stop_that_is_asked_for_again_while_the_motor_comes_down_by_one_is_written_again_at_once() {
    let (mut rig, _) = coming_down();
    for (asked, drops) in [(Job::Measurements, true), (Job::Status { anew: false }, false)] {
        rig.machine.in_flight = Some(asked);
        let asker = rig.asker();
        assert_eq!(rig.machine.handle_stop(rig.now, asker, StopMode::Ramp.into(), None), drops, "{asked:?}");
        rig.machine.in_flight = None;
        let step = rig.next();
        assert!(matches!(step, Step::Do { job: Job::Stop(StopMode::Ramp), .. }), "{step:?}");
        let braking = rig.drive.status.clone();
        rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(Stopped::by(StopMode::Ramp, braking))));
    }
}
