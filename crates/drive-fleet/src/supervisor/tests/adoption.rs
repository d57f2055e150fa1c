//! A run command of an earlier run of the program, and drives that are none of their family.

use super::*;
use crate::{ConcernKind, settings::RunRecord};

const RUN: Lease = Lease::new(Direction::Forward, 0x000F);

/// A motor that turns, a record of before, and what stands in the drive.
fn restarted(record: Option<RunRecord>, stands: Option<Lease>) -> Rig {
    let mut rig = Rig::new(DriveSettings { run_before: record, ..settings() });
    rig.drive.run();
    rig.stands = stands;
    rig.pass(2_000 * MS);
    rig
}

/// As the program of before has kept it.
fn record(rig: &Rig) -> Option<RunRecord> {
    RunRecord::of(|| Some(rig.drive.identity.to_string()), Some(RUN), None)
}

fn exits(rig: &mut Rig) -> Option<ExitAction> {
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.pass(3_000 * MS);
    rig.machine.exit_action().cloned()
}

#[test]
fn a_run_is_ours_again_where_record_identity_and_the_drives_own_words_agree_and_the_exit_stops_it() {
    let mut rig = restarted(record(&Rig::controlled()), Some(RUN));
    assert_eq!(rig.times_told(&EventKind::RunAdopted(RUN)), 1, "{:?}", rig.events());
    assert!(rig.snapshot().started_here());
    assert_eq!(rig.drive.writes(), [], "nothing is written for it");
    assert!(matches!(exits(&mut rig), Some(ExitAction::Stopped(outcome)) if outcome.is_confirmed()));
    assert!(rig.drive.writes().contains(&Job::Stop(StopMode::Ramp)));
}

#[test]
fn a_run_whose_record_the_drives_word_denies_is_not_ours_is_not_withdrawn_and_left_at_the_exit() {
    for stands in [None, Some(Lease::new(Direction::Reverse, 0x080F))] {
        let mut rig = restarted(record(&Rig::controlled()), stands);
        assert!(rig.events().contains(&"run not adopted"), "{:?}", rig.events());
        assert!(!rig.snapshot().started_here());
        assert_eq!(exits(&mut rig), Some(ExitAction::LeftTurning));
        assert_eq!(rig.drive.writes(), [], "whoever has started it goes on");
    }
}

#[test]
fn who_ends_before_a_drive_was_heard_of_whose_run_there_is_a_record_tells_that_its_motor_may_turn() {
    let ran = record(&Rig::controlled());
    let to_be_stopped = ran.clone().map(|run| run.stopped_by(Some(StopOrder::from(StopMode::Ramp))));
    let turning = ExitAction::LeftTurning;
    for (record, on_exit, told) in [
        (ran.clone(), OnExit::default(), turning.clone()),
        (None, OnExit::default(), ExitAction::Left),
        // To leave a motor as it is leaves no stop ungiven.
        (ran, OnExit::Leave, ExitAction::Left),
        (to_be_stopped, OnExit::Leave, turning),
    ] {
        let is_kept = record.is_some();
        let mut rig = Rig::new(DriveSettings { run_before: record, on_exit, ..settings() });
        rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
        rig.pass(1_000 * MS);
        assert_eq!(exits(&mut rig), Some(told.clone()));
        rig.machine.handle_leave();
        rig.pass(100 * MS);
        assert_eq!(rig.machine.exit_action(), Some(&told));
        assert_eq!(rig.machine.left().run.is_some(), is_kept, "the next run adopts it");
    }
}

#[test]
fn a_stop_of_before_waits_while_its_drive_is_only_read_and_is_given_once_it_may_be() {
    let stop = Some(StopOrder::from(StopMode::Ramp));
    let identity = Rig::controlled().drive.identity.to_string();
    let record = RunRecord::of(|| Some(identity), Some(RUN), stop);
    let read = DriveSettings { control: false, run_before: record, ..settings() };
    let mut rig = Rig::new(read.clone());
    rig.drive.run();
    rig.stands = Some(RUN);
    rig.pass(2_000 * MS);
    assert_eq!(rig.drive.writes(), []);
    assert!(rig.machine.left().run.is_some_and(|run| run.stop.is_some()), "it is kept");
    rig.machine.handle_settings(rig.now, &DriveSettings { control: true, ..read });
    rig.pass(1_000 * MS);
    assert!(rig.drive.writes().contains(&Job::Stop(StopMode::Ramp)), "{:?}", rig.drive.writes());
}

#[test]
fn a_run_of_before_is_told_as_ours_once_the_drives_words_tell_anything_of_it() {
    let mut rig = Rig::new(DriveSettings { run_before: record(&Rig::controlled()), ..settings() });
    rig.drive.run();
    (rig.stands, rig.drive.says) = (Some(RUN), Some(Verdict::NotKnown));
    rig.pass(3_000 * MS);
    assert_eq!(rig.times_told(&EventKind::RunAdopted(RUN)), 0, "{:?}", rig.events());
    rig.drive.says = Some(Verdict::InForce);
    rig.pass(1_000 * MS);
    assert_eq!(rig.times_told(&EventKind::RunAdopted(RUN)), 1, "{:?}", rig.events());
}

#[test]
fn a_run_without_a_record_is_somebody_elses_whatever_word_stands() {
    let mut rig = restarted(None, Some(RUN));
    assert!(!rig.snapshot().started_here());
    assert_eq!(exits(&mut rig), Some(ExitAction::LeftTurning));
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn a_record_of_another_drive_makes_no_run_ours() {
    let other = RunRecord::of(|| Some("two".to_owned()), Some(RUN), None);
    let mut rig = restarted(other, Some(RUN));
    assert!(rig.events().contains(&"run not adopted"), "{:?}", rig.events());
    assert!(!rig.snapshot().started_here());
    assert_eq!(exits(&mut rig), Some(ExitAction::LeftTurning));
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn a_run_that_is_ours_again_and_not_in_force_is_withdrawn() {
    let mut rig = Rig::new(DriveSettings { run_before: record(&Rig::controlled()), ..settings() });
    rig.stands = Some(RUN);
    rig.drive.says = Some(Verdict::lacks(Lack::Output, ANOTHER_WORD));
    rig.pass(2_000 * MS);
    assert_eq!(rig.times_told(&EventKind::RunAdopted(RUN)), 1);
    assert!(rig.drive.writes().contains(&Job::Withdraw), "{:?}", rig.drive.writes());
    assert!(!rig.snapshot().started_here());
}

#[test]
fn a_record_waits_for_a_drive_that_is_away_when_the_program_starts() {
    let mut rig = Rig::new(DriveSettings { run_before: record(&Rig::controlled()), ..settings() });
    rig.stands = Some(RUN);
    rig.drive.run();
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(20_000 * MS);
    assert!(rig.machine.is_adopting());
    rig.drive.failing = None;
    rig.pass(2_000 * MS);
    assert!(rig.snapshot().started_here(), "{:?}", rig.events());
}

/// As a program that was killed with a stop under way has kept it.
fn to_be_stopped(mode: StopMode) -> DriveSettings {
    let run_before = record(&Rig::controlled()).map(|record| record.stopped_by(Some(mode.into())));
    DriveSettings { run_before, ..settings() }
}

#[test]
fn a_stop_of_before_that_was_not_confirmed_is_given_anew_and_the_run_does_not_go_on() {
    for (mode, stands) in [(StopMode::Ramp, Some(RUN)), (StopMode::Fast, Some(RUN)), (StopMode::Ramp, None)] {
        let mut rig = Rig::new(to_be_stopped(mode));
        rig.drive.run();
        rig.stands = stands;
        rig.pass(3_000 * MS);
        assert!(rig.drive.writes().starts_with(&[Job::Stop(mode)]), "{:?}", rig.drive.writes());
        let cause = Cause::Policy { policy: Policy::StopOfBefore };
        assert_eq!(rig.cause_of("stop confirmed"), Some(cause), "{:?}", rig.events());
        assert!(!rig.snapshot().started_here());
        assert_eq!(rig.machine.left().run, None);
    }
}

#[test]
fn a_stop_of_before_is_repeated_until_it_is_confirmed_and_kept_until_then() {
    let mut rig = Rig::new(to_be_stopped(StopMode::Ramp));
    rig.drive.run();
    rig.stands = Some(RUN);
    rig.drive.refuses_stops = true;
    rig.pass(60_000 * MS);
    assert!(rig.drive.writes().len() > 10, "{:?}", rig.drive.writes());
    assert!(rig.events().contains(&"stop unconfirmed"), "{:?}", rig.events());
    let kept = rig.machine.left().run.expect("it stands");
    assert_eq!((kept.lease, kept.stop), (Some(RUN), Some(StopMode::Ramp)));
    rig.drive.refuses_stops = false;
    rig.pass(3_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"), "{:?}", rig.events());
    assert_eq!(rig.machine.left().run, None);
}

#[test]
fn a_stop_of_before_waits_for_a_drive_that_is_away_and_goes_to_whatever_drive_has_come_to_its_motor() {
    let mut rig = Rig::new(to_be_stopped(StopMode::Ramp));
    rig.stands = Some(RUN);
    rig.drive.run();
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(20_000 * MS);
    let kept = rig.machine.left().run.expect("nobody has stopped it");
    assert_eq!(kept.stop, Some(StopMode::Ramp));
    rig.drive.failing = None;
    rig.pass(2_000 * MS);
    assert!(rig.events().contains(&"stop confirmed"), "{:?}", rig.events());

    let other = Identity { model: Some("two".to_owned()), ..Identity::default() };
    let mut rig = Rig::new(to_be_stopped(StopMode::Ramp));
    rig.drive.identity = other;
    rig.drive.run();
    rig.pass(3_000 * MS);
    assert!(rig.drive.writes().starts_with(&[Job::Stop(StopMode::Ramp)]), "{:?}", rig.drive.writes());
    assert!(rig.events().contains(&"run not adopted"), "{:?}", rig.events());
    assert!(!rig.snapshot().started_here());
}

/// As a program that was killed has kept a stop of a motor that it had not started.
fn somebody_elses_to_be_stopped(identity: Option<&str>) -> DriveSettings {
    let identity = identity.map(str::to_owned);
    DriveSettings { run_before: RunRecord::of(|| identity, None, Some(StopMode::Fast.into())), ..settings() }
}

#[test]
fn a_stop_of_before_of_a_motor_that_was_not_started_here_is_given_anew_and_kept_until_it_is_confirmed() {
    let one = Rig::controlled().drive.identity.to_string();
    // One that had never said which it was is whoever is there.
    for identity in [Some(&*one), None] {
        let mut rig = Rig::new(somebody_elses_to_be_stopped(identity));
        rig.drive.run();
        rig.drive.refuses_stops = true;
        rig.pass(10_000 * MS);
        let kept = rig.machine.left().run.expect("it is not confirmed");
        assert_eq!((kept.lease, kept.stop), (None, Some(StopMode::Fast)));
        rig.drive.refuses_stops = false;
        rig.pass(3_000 * MS);
        let cause = Cause::Policy { policy: Policy::StopOfBefore };
        assert_eq!(rig.cause_of("stop confirmed"), Some(cause), "{:?}", rig.events());
        assert!(rig.drive.writes().starts_with(&[Job::Stop(StopMode::Fast)]), "{:?}", rig.drive.writes());
        assert!(!rig.events().contains(&"run not adopted"), "there was none: {:?}", rig.events());
        assert_eq!(rig.machine.left().run, None);
    }
}

#[test]
fn a_stop_of_before_of_a_motor_that_was_not_started_here_goes_to_another_drive_there_and_says_so() {
    let mut rig = Rig::new(somebody_elses_to_be_stopped(Some("two")));
    rig.drive.run();
    rig.pass(3_000 * MS);
    assert!(rig.drive.writes().starts_with(&[Job::Stop(StopMode::Fast)]), "{:?}", rig.drive.writes());
    assert!(rig.events().contains(&"run not adopted"), "{:?}", rig.events());
}

#[test]
fn a_stop_by_direct_current_is_left_with_its_seconds_and_then_with_the_ramp_that_ends_it() {
    let held = StopOrder::injecting(Duration::from_secs(20));
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_000 * MS);
    rig.stop(held);
    assert!(matches!(rig.next(), Step::Do { job: Job::Stop(StopMode::DcInjection), .. }));
    // It brakes: the run command has gone already.
    rig.drive.status.state = State::Stopping;
    rig.drive.status.motion = Motion::Braking;
    let stopped = Stopped::by(StopMode::DcInjection, rig.drive.status.clone());
    rig.machine.handle_reply(rig.now, Reply::Stopped(Ok(stopped)));
    let left = |rig: &Rig| rig.machine.left().run.map(|run| (run.lease, run.stop_order()));
    assert_eq!(left(&rig), Some((None, Some(held))), "nobody else ends it");
    rig.drive.status.motion = Motion::Held;
    let status = rig.drive.status();
    rig.machine.handle_reply(rig.now, Reply::Status(status));
    assert_eq!(left(&rig), Some((None, Some(StopMode::Ramp.into()))));
}

#[test]
fn a_stop_of_before_by_direct_current_has_its_seconds_and_is_ended() {
    let held = StopOrder::injecting(Duration::from_secs(20));
    let identity = Rig::controlled().drive.identity.to_string();
    let run_before = RunRecord::of(|| Some(identity), None, Some(held));
    let mut rig = Rig::new(DriveSettings { run_before, ..settings() });
    rig.drive.status.state = State::Stopping;
    rig.drive.status.motion = Motion::Braking;
    let until = rig.now + 3_000 * MS;
    while !rig.drive.log.contains(&Job::Stop(StopMode::DcInjection)) {
        assert!(rig.now < until, "{:?}", rig.events());
        rig.pass(10 * MS);
    }
    assert_eq!(rig.machine.injection(), held.injection);
    rig.pass(3_000 * MS);
    let writes = rig.drive.writes();
    let injected = [Job::Stop(StopMode::DcInjection), Job::Stop(StopMode::Ramp)];
    assert!(writes.starts_with(&injected), "it would heat a motor that stands: {writes:?}");
    assert!(rig.events().contains(&"stop confirmed"), "{:?}", rig.events());
}

const AN_ATV71: Recognised = Recognised::NotMine { it_is: "an Altivar 71, which no family here fits" };

/// A drive that says it is of another family.
fn stranger() -> Rig {
    let mut rig = Rig::controlled();
    rig.drive.recognised = AN_ATV71;
    rig.pass(2_000 * MS);
    rig
}

#[test]
fn a_drive_of_another_family_is_read_and_stopped_and_nothing_else_is_written_to_it() {
    let mut rig = stranger();
    let told = rig.happened().find_map(|happened| match &happened.kind {
        kind @ EventKind::OtherFamily { .. } => Some((kind.to_string(), kind.is_alarm())),
        _ => None,
    });
    assert_eq!(told, Some(("other family: an Altivar 71, which no family here fits".to_owned(), true)));
    assert_eq!(rig.snapshot().concern(rig.now).map(|worst| worst.kind), Some(ConcernKind::OtherFamily));
    rig.drive.run();
    rig.pass(2_000 * MS);
    assert_eq!(rig.snapshot().status.as_ref().map(|status| status.value.state), Some(State::Running));
    for order in [START, setpoint(20), Order::ResetFaults, Order::Release, Order::Persist, accept_of("")] {
        let id = rig.order(order);
        rig.pass(1_500 * MS);
        assert!(
            matches!(rig.outcome(id), Some(Outcome::Refused(Refused::OtherFamily(_)))),
            "{order:?}: {:?}",
            rig.outcome(id)
        );
    }
    assert_eq!(rig.drive.writes(), [], "neither orders nor the watchdog of the contract");
    let stop = rig.stop(StopMode::Ramp);
    rig.pass(1_500 * MS);
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)]);
}

#[test]
fn a_drive_that_is_exchanged_for_one_of_another_family_has_no_run_command_withdrawn_and_no_parameter_written()
{
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.drive.failing = Some(PortError::Offline { retry_in: 500 * MS });
    rig.pass(5_000 * MS);
    rig.drive.failing = None;
    rig.drive.recognised = AN_ATV71;
    rig.drive.says = Some(Verdict::lacks(Lack::Command, ANOTHER_WORD));
    rig.pass(5_000 * MS);
    assert_eq!(rig.drive.writes(), []);
    let id = CallId(1_000);
    rig.machine.handle_question(id, "tester", Question::Write(&super::questions::ROW, 7));
    rig.pass(1_000 * MS);
    assert_eq!(rig.drive.writes(), []);
    let refused = rig
        .outputs
        .iter()
        .any(|output| matches!(output, Output::Told(asked, Err(Refused::OtherFamily(_))) if *asked == id));
    assert!(refused, "{:?}", rig.outputs);
}

#[test]
fn a_drive_of_another_family_that_answers_by_exceptions_is_told_as_such_and_as_no_silence() {
    let mut rig = Rig::ready();
    rig.drive.refuses = Some((3, ExceptionMeaning::ValueRefused));
    rig.drive.recognised = AN_ATV71;
    rig.drive.log.clear();
    rig.pass(50_000 * MS);
    let kinds: Vec<_> = rig.snapshot().concerns(rig.now).into_iter().map(|concern| concern.kind).collect();
    assert_eq!(kinds, [ConcernKind::OtherFamily, ConcernKind::Refuses]);
    assert_eq!(
        rig.events().iter().filter(|event| **event == "other family").count(),
        1,
        "{:?}",
        rig.events()
    );
    assert_eq!(rig.drive.writes(), []);
    assert_eq!(rig.drive.log.iter().filter(|job| **job == Job::Identify).count(), 1, "{:?}", rig.drive.log);
    rig.drive.refuses = None;
    rig.drive.recognised = Recognised::CannotTell;
    rig.pass(3_000 * MS);
    assert_eq!(rig.snapshot().concerns(rig.now), [], "the right one is there again");
}

#[test]
fn a_drive_that_is_busy_for_long_is_not_silent_and_is_asked_nothing_else() {
    let mut rig = Rig::ready();
    rig.drive.refuses = Some((6, ExceptionMeaning::Busy));
    rig.drive.log.clear();
    rig.pass(10_000 * MS);
    let concerns = rig.snapshot().concerns(rig.now);
    let told: Vec<_> = concerns.iter().map(ToString::to_string).collect();
    let text = "answers, and refuses to tell its status: slave 1, reading register 3201 (0C81h): exception 06h, the drive is busy";
    assert_eq!(told, [text]);
    assert!(!rig.drive.log.contains(&Job::Identify), "{:?}", rig.drive.log);
}
