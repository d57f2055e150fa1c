//! Why something happened, as its event says it, and what troubles the drive meanwhile.

use drive_core::{Lack, RawWord, Verdict};

use super::*;
use crate::ConcernKind;

fn word(value: u16) -> Vec<RawWord> {
    vec![RawWord { address: 3_201, code: "ETA", value }, RawWord { address: 3_202, code: "RFR", value: 7 }]
}

fn by_policy(policy: Policy) -> Option<Cause> {
    Some(Cause::Policy { policy })
}

fn by_the_tester() -> Option<Cause> {
    Some(Cause::Command(Act::of("tester")))
}

fn worst(rig: &Rig) -> Option<ConcernKind> {
    rig.snapshot().concern(rig.now).map(|concern| concern.kind)
}

#[test]
fn what_the_drive_does_by_a_command_names_the_command_and_what_it_does_by_itself_does_not() {
    let mut rig = Rig::ready();
    rig.drive.status.raw = word(0x23);
    rig.pass(1_000 * MS);
    rig.order(run_at(30));
    rig.drive.status.raw = word(0x27);
    rig.pass(1_000 * MS);
    assert_eq!(rig.cause_of("state changed"), by_the_tester(), "{:?}", rig.outputs);
    let start = rig.happened().find_map(|happened| match &happened.kind {
        EventKind::Command { setpoint, .. } => Some(*setpoint),
        _ => None,
    });
    assert_eq!(start, Some(Some(Frequency::from_hertz(30).into())));
    rig.outputs.clear();
    rig.drive.stand();
    rig.drive.status.raw = word(0x23);
    rig.pass(1_000 * MS);
    assert_eq!(rig.cause_of("state changed"), Some(Cause::Drive), "it came to a stop by itself");
    let shown = rig.happened().find(|happened| matches!(happened.kind, EventKind::StateChanged { .. }));
    let changed = shown.map(|happened| happened.words.to_vec()).unwrap_or_default();
    assert_eq!(changed.len(), 1, "only the word that changed: {changed:?}");
    assert_eq!((changed[0].word.value, changed[0].before), (0x23, Some(0x27)));
}

#[test]
fn a_reset_at_the_drive_is_not_the_doing_of_the_policy_that_withdrew_the_run_command() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.trip(9);
    rig.pass(2_000 * MS);
    assert!(rig.drive.log.contains(&Job::Withdraw), "{:?}", rig.drive.log);
    rig.outputs.clear();
    rig.drive.stand();
    rig.drive.status.fault_code = None;
    rig.pass(1_000 * MS);
    for event in ["state changed", "fault cleared"] {
        assert_eq!(rig.cause_of(event), Some(Cause::Drive), "{event}: {:?}", rig.outputs);
    }
}

#[test]
fn an_output_that_is_released_at_the_drive_is_not_the_doing_of_the_policy_that_withdrew_the_run_command() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.stand();
    rig.drive.status.state = State::NotReady;
    rig.pass(2_000 * MS);
    assert!(rig.drive.log.contains(&Job::Withdraw), "{:?}", rig.drive.log);
    rig.outputs.clear();
    rig.drive.stand();
    rig.pass(1_000 * MS);
    assert_eq!(rig.cause_of("state changed"), Some(Cause::Drive), "{:?}", rig.outputs);
}

#[test]
fn a_motor_that_was_stopped_at_the_drive_was_not_stopped_by_the_withdrawal_behind_it() {
    let guard = drive_core::Refusal::Overridden { by: "a guard", remedy: "close it" };
    let lacking = |lack: Lack| move |drive: &mut Paper| drive.says = Some(Verdict::lacks(lack, guard));
    let panel = |drive: &mut Paper| drive.status.control = Some(Control::Panel);
    let panel_stops = |drive: &mut Paper| {
        drive.status.control = Some(Control::Panel);
        drive.status.state = State::Stopping;
        drive.status.motion = drive_core::Motion::Braking;
    };
    type Case<'a> = (&'a str, &'a dyn Fn(&mut Paper), Option<Cause>);
    let is_ours = by_policy(Policy::ReferenceTaken);
    let cases: [Case<'_>; 4] = [
        ("its output is cut", &lacking(Lack::Output), Some(Cause::Drive)),
        ("the panel has it, and brings it down", &panel, Some(Cause::Drive)),
        ("the panel has brought it down already", &panel_stops, Some(Cause::Drive)),
        ("it turns by another reference", &lacking(Lack::Reference), is_ours),
    ];
    for (what, at_the_drive, cause) in cases {
        let mut rig = Rig::ready();
        rig.order(START);
        rig.pass(2_000 * MS);
        at_the_drive(&mut rig.drive);
        rig.pass(1_000 * MS);
        assert!(rig.drive.log.contains(&Job::Withdraw), "{what}: {:?}", rig.drive.log);
        rig.outputs.clear();
        rig.drive.stand();
        rig.pass(1_000 * MS);
        assert_eq!(rig.cause_of("state changed"), cause, "{what}: {:?}", rig.outputs);
    }
}

#[test]
fn what_somebody_else_starts_and_stops_later_is_not_told_as_the_command_of_before() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.stop(StopMode::Ramp);
    rig.pass(2_000 * MS);
    assert_eq!(rig.cause_of("stop confirmed"), by_the_tester(), "{:?}", rig.outputs);
    let by_another: [fn(&mut Paper); 4] = [Paper::run, Paper::stand, Paper::run, Paper::stand];
    for does in by_another {
        rig.outputs.clear();
        does(&mut rig.drive);
        rig.pass(2_000 * MS);
        assert_eq!(rig.cause_of("state changed"), Some(Cause::Drive), "{:?}", rig.outputs);
    }
}

/// Who has stopped a motor and sees it run again is told that nobody here has started it.
#[test]
fn a_motor_that_another_master_starts_behind_a_confirmed_stop_is_told_as_not_ours_for_as_long_as_it_turns() {
    let told = |rig: &Rig| {
        rig.snapshot().concerns(rig.now).iter().any(|concern| concern.kind == ConcernKind::RunByAnother)
    };
    let mut rig = Rig::running_at(25);
    assert!(!told(&rig));
    let stop = rig.stop(StopMode::Ramp);
    rig.pass(2_000 * MS);
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed) && !told(&rig));
    rig.drive.run();
    rig.pass(1_000 * MS);
    assert!(told(&rig));
    rig.drive.status.control = Some(Control::Terminals);
    rig.pass(1_000 * MS);
    assert!(!told(&rig), "who runs it is told");
    rig.drive.status.control = Some(Control::Bus);
    rig.drive.stand();
    rig.pass(1_000 * MS);
    assert!(!told(&rig));
}

#[test]
fn a_stop_says_who_stopped_and_a_removal_is_no_exit() {
    for (policy, name) in [(Policy::Exit, "exit"), (Policy::Removal, "removed")] {
        let mut rig = Rig::ready();
        rig.order(START);
        rig.pass(1_000 * MS);
        rig.outputs.clear();
        rig.machine.handle_exit(rig.now, policy);
        rig.pass(2_000 * MS);
        rig.machine.handle_leave();
        rig.pass(100 * MS);
        for event in ["state changed", "stop confirmed", "command", name] {
            assert_eq!(rig.cause_of(event), by_policy(policy), "{event}: {:?}", rig.outputs);
        }
        assert_eq!(rig.events().iter().filter(|event| ["exit", "removed"].contains(event)).count(), 1);
    }
}

#[test]
fn what_is_seen_after_a_silence_is_found_and_not_seen_happening() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(5_000 * MS);
    assert_eq!(worst(&rig), Some(ConcernKind::LostRunning));
    rig.outputs.clear();
    rig.drive.failing = None;
    rig.drive.trip(9);
    rig.drive.status.control = Some(Control::Local);
    rig.pass(500 * MS);
    for event in ["connected", "state changed", "tripped", "control elsewhere"] {
        assert_eq!(rig.cause_of(event), Some(Cause::Found), "{event}: {:?}", rig.outputs);
    }
    let trips = rig.snapshot().trips;
    assert!(trips.back().is_some_and(|trip| trip.found), "{trips:?}");
    assert!(!rig.events().contains(&"control taken"), "nobody was seen taking it");
    assert_eq!(worst(&rig), Some(ConcernKind::Tripped));
}

#[test]
fn a_trip_that_stood_at_the_start_is_told_and_counted_by_whoever_saw_it_come() {
    let mut rig = Rig::controlled();
    rig.drive.trip(9);
    rig.pass(1_500 * MS);
    assert_eq!(rig.cause_of("tripped"), Some(Cause::Found));
    let snapshot = rig.snapshot();
    assert_eq!((snapshot.trips.len(), snapshot.counters.trips), (1, 0));
    rig.drive.status = Rig::controlled().drive.status;
    rig.pass(1_500 * MS);
    rig.drive.trip(9);
    rig.pass(1_500 * MS);
    assert_eq!(rig.snapshot().counters.trips, 1, "the next one was seen");
}

#[test]
fn a_trip_that_is_seen_happening_is_not_found() {
    let mut rig = Rig::ready();
    rig.drive.trip(9);
    rig.pass(1_000 * MS);
    assert_eq!(rig.cause_of("tripped"), Some(Cause::Drive));
    assert!(rig.snapshot().trips.back().is_some_and(|trip| !trip.found));
}

#[test]
fn a_stop_that_takes_the_command_is_not_told_as_control_that_comes_back() {
    let mut rig = Rig::controlled();
    rig.pass(1_500 * MS);
    // The terminals turn it.
    rig.drive.run();
    rig.drive.status.control = Some(Control::Terminals);
    rig.pass(2_000 * MS);
    rig.outputs.clear();
    rig.drive.takes_command = true;
    rig.stop(StopMode::Ramp);
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop took command"), "{:?}", rig.outputs);
    assert!(!rig.events().contains(&"control returned"), "nobody has: {:?}", rig.outputs);
    // The panel takes it and gives it back.
    rig.drive.status.control = Some(Control::Panel);
    rig.pass(1_000 * MS);
    rig.drive.status.control = Some(Control::Bus);
    rig.pass(1_000 * MS);
    assert_eq!(rig.events()[rig.events().len() - 2..], ["control taken", "control returned"]);
}

#[test]
fn a_start_that_takes_the_command_is_not_told_as_control_that_comes_back() {
    let mut rig = Rig::controlled();
    // So an Altivar 21 stands until it is started.
    rig.drive.status.control = Some(Control::Local);
    rig.pass(2_000 * MS);
    rig.outputs.clear();
    rig.drive.status.reference = Some(Frequency::from_hertz(25));
    rig.order(START);
    rig.drive.status.control = Some(Control::Bus);
    rig.pass(1_000 * MS);
    assert!(!rig.events().contains(&"control returned"), "{:?}", rig.outputs);
    assert_eq!(rig.cause_of("start took command"), by_the_tester());
    assert_eq!(worst(&rig), None);
    // The panel takes it and gives it back.
    rig.drive.status.control = Some(Control::Panel);
    rig.pass(1_000 * MS);
    assert_eq!(worst(&rig), Some(ConcernKind::ControlTaken));
    rig.drive.status.control = Some(Control::Bus);
    rig.pass(1_000 * MS);
    assert_eq!(rig.cause_of("control returned"), Some(Cause::Drive));
}

#[test]
fn other_settings_are_told_with_their_names_and_the_same_are_not() {
    let mut rig = Rig::ready();
    rig.machine.handle_settings(rig.now, &settings());
    rig.collect();
    assert_eq!(rig.events(), Vec::<&str>::new());
    let other = DriveSettings { on_loss: OnLoss::Stop(StopMode::Ramp), ..settings() };
    rig.machine.handle_settings(rig.now, &other);
    rig.collect();
    assert_eq!(rig.times_told(&EventKind::Reconfigured(vec!["on_loss"])), 1);
    assert_eq!(rig.cause_of("reconfigured"), by_policy(Policy::Settings));
}

#[test]
fn a_stop_whose_first_attempt_is_under_way_was_sent_once() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.stop(StopMode::Ramp);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(_), .. }));
    let later = rig.now + 2_500 * MS;
    rig.machine.handle_stop_alarm(later);
    let snapshot = rig.machine.snapshot(later);
    assert_eq!(snapshot.stop.map(|stop| (stop.attempts, stop.alarm)), Some((1, true)));
    let concern = snapshot.concern(later).unwrap();
    assert_eq!(concern.kind, ConcernKind::StopUnconfirmed);
    assert_eq!(concern.lasts(later), Some(2_500 * MS));
    assert_eq!(concern.to_string(), "STOP NOT CONFIRMED, the motor may turn: ramp stop, sent in 1 attempt");
}

#[test]
fn what_troubles_a_drive_keeps_the_time_since_when_it_does() {
    let mut rig = Rig::ready();
    rig.drive.status.warning = Some(true);
    rig.pass(1_100 * MS);
    let since = |rig: &mut Rig| {
        rig.machine.changed = true;
        let now = rig.now;
        rig.machine.take_snapshot(now).unwrap().concern(now).unwrap().since
    };
    let first = since(&mut rig);
    assert!(first.is_some());
    rig.pass(3_000 * MS);
    assert_eq!(since(&mut rig), first);
}

#[test]
fn an_order_that_waited_is_refused_for_what_is_in_its_way_when_its_time_is_over() {
    let mut rig = Rig::ready();
    rig.machine.active = None;
    let id = rig.order(START);
    // It waits for a watchdog that is not checked yet; the check comes just too late.
    rig.machine.checks.connected(rig.now);
    rig.machine.checks.handle_identity(rig.now, Ok((rig.drive.identity.clone(), Recognised::CannotTell)));
    assert!(matches!(rig.next(), Step::Do { job: Job::Watchdog, .. }));
    rig.now += 1_100 * MS;
    let watchdog = rig.drive.watchdog;
    rig.machine.handle_reply(rig.now, Reply::Watchdog(Ok(watchdog)));
    rig.machine.accept_status(rig.now, rig.drive.status.clone());
    let _ = rig.next();
    rig.collect();
    assert_eq!(rig.outcome(id), Some(&Outcome::Expired), "{:?}", rig.outputs);
}
