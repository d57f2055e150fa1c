//! Orders and their outcomes.

use super::*;
use crate::LimitProblem;

#[test]
fn a_start_gives_the_setpoint_first_and_is_confirmed_at_the_reference() {
    let rig = Rig::running_at(40);
    let setpoint = Frequency::from_hertz(40).into();
    assert_eq!(
        rig.drive.writes(),
        // Seen at rest it has no speed that the setpoint of a refused start could change.
        [Job::SetSetpoint(setpoint, None), Job::Start(Direction::Forward)]
    );
    assert!(rig.snapshot().started_here());
    assert_eq!(rig.snapshot().setpoint, Some(setpoint));
}

/// A drive that another runs, and that would refuse that start, keeps its speed: it is asked, and not only what was read of it.
#[test]
fn the_setpoint_of_a_group_that_starts_is_given_as_that_of_a_start_in_its_direction() {
    let mut rig = Rig::ready();
    rig.drive.run();
    rig.pass(1_500 * MS);
    let leave = rig.machine.leave(rig.now, "tester", Direction::Reverse, None).unwrap();
    let (asker, setpoint) = (rig.asker(), Frequency::from_hertz(40).into());
    let order = Order::Setpoint { setpoint, until: Until::InForce };
    rig.machine.handle_order(rig.now, asker, order, Some(leave), None);
    rig.pass(500 * MS);
    assert_eq!(rig.drive.writes(), [Job::SetSetpoint(setpoint, Some(Direction::Reverse))]);
}

/// Whoever asked for it later does not get the older one.
#[test]
fn the_setpoint_of_a_group_does_not_take_the_place_of_one_that_was_asked_for_since_nor_is_that_one_started_at()
 {
    for is_given in [false, true] {
        let mut rig = Rig::ready();
        let twenty = Frequency::from_hertz(20).into();
        let leave = rig.machine.leave(rig.now, "tester", Direction::Forward, Some(twenty)).unwrap();
        let order = |rig: &mut Rig, order| {
            let asker = rig.asker();
            let id = asker.id().expect("it is a caller's");
            rig.machine.handle_order(rig.now, asker, order, Some(leave), None);
            rig.pass(500 * MS);
            rig.outcome(id).cloned()
        };
        if is_given {
            assert!(order(&mut rig, setpoint(20)).is_some_and(|outcome| outcome.is_confirmed()));
        }
        rig.pass(100 * MS);
        let later = rig.order(setpoint(45));
        rig.pass(500 * MS);
        assert!(rig.outcome(later).is_some_and(Outcome::is_confirmed));
        let next = if is_given { START } else { setpoint(20) };
        assert_eq!(order(&mut rig, next), Some(Outcome::Refused(Refused::Superseded)));
        assert_eq!(rig.snapshot().setpoint, Some(Frequency::from_hertz(45).into()));
        assert!(!rig.drive.log.contains(&Job::Start(Direction::Forward)));
    }
}

/// A group start that has given its setpoint, and a start of one of its drives before the group's turn comes.
#[test]
fn a_group_starts_no_drive_that_was_started_since() {
    for brought in [None, Some(Frequency::from_hertz(20).into())] {
        let mut rig = Rig::ready();
        let leave = rig.machine.leave(rig.now, "tester", Direction::Reverse, brought).unwrap();
        rig.pass(100 * MS);
        let started = rig.order(START);
        rig.pass(500 * MS);
        assert!(rig.outcome(started).is_some_and(Outcome::is_confirmed));
        let reverse = Order::Start { direction: Direction::Reverse, setpoint: None, until: Until::InForce };
        let asker = rig.asker();
        let id = asker.id().expect("it is a caller's");
        rig.machine.handle_order(rig.now, asker, reverse, Some(leave), None);
        rig.pass(500 * MS);
        assert_eq!(rig.outcome(id), Some(&Outcome::Refused(Refused::Superseded)));
        assert!(!rig.drive.log.contains(&Job::Start(Direction::Reverse)));
    }
}

#[test]
fn a_setpoint_that_is_being_sent_gives_its_place_to_a_later_one_and_a_stream_of_them_comes_to_the_drive() {
    let mut rig = Rig::ready();
    rig.drive.log.clear();
    let first = rig.order(setpoint(31));
    assert!(matches!(rig.next(), Step::Do { job: Job::SetSetpoint(..), .. }));
    // It is on its way, and its answer is lost.
    let asker = rig.asker();
    let second = asker.id().expect("it is a caller's");
    assert!(rig.machine.handle_order(rig.now, asker, setpoint(22), None, None), "the first is dropped");
    rig.machine.handle_dropped(rig.now);
    assert!(matches!(rig.next(), Step::Do { job: Job::SetSetpoint(..), .. }));
    let asker = rig.asker();
    let third = asker.id().expect("it is a caller's");
    assert!(!rig.machine.handle_order(rig.now, asker, setpoint(23), None, None), "the second is carried out");
    rig.machine.handle_reply(rig.now, Reply::Setpoint(Ok(())));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(first), Some(&Outcome::NotConfirmed(Unconfirmed::Superseded)));
    for id in [second, third] {
        assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    }
    assert_eq!(rig.snapshot().setpoint, Some(Frequency::from_hertz(23).into()));
}

#[test]
fn a_setpoint_that_gave_its_place_to_one_that_is_never_sent_is_not_told_as_superseded() {
    let mut rig = Rig::ready();
    let first = rig.order(setpoint(31));
    assert!(matches!(rig.next(), Step::Do { job: Job::SetSetpoint(..), .. }));
    let asker = rig.asker();
    let second = asker.id().expect("it is a caller's");
    let soon = Some(Expiry::at(rig.now + 10 * MS));
    assert!(rig.machine.handle_order(rig.now, asker, setpoint(22), None, soon), "the first is dropped");
    rig.machine.handle_dropped(rig.now);
    assert_eq!(rig.outcome(first), None);
    rig.now += 20 * MS;
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(second), Some(&Outcome::Expired));
    assert!(matches!(rig.outcome(first), Some(Outcome::OutcomeUnknown(_))), "{:?}", rig.outcome(first));

    // Nor where its driver had no time to write it.
    let mut rig = Rig::ready();
    let first = rig.order(setpoint(31));
    assert!(matches!(rig.next(), Step::Do { job: Job::SetSetpoint(..), .. }));
    let second = rig.order(setpoint(22));
    rig.machine.handle_dropped(rig.now);
    assert!(matches!(rig.next(), Step::Do { job: Job::SetSetpoint(..), .. }));
    rig.machine.handle_reply(rig.now, Reply::Setpoint(Err(port_error(PortError::Expired))));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(second), Some(&Outcome::Expired));
    assert!(matches!(rig.outcome(first), Some(Outcome::OutcomeUnknown(_))), "{:?}", rig.outcome(first));
}

/// What is shown as its setpoint is what it is started at, whoever has written the reference since; a group has just given it.
#[test]
fn a_start_without_a_setpoint_gives_the_one_that_is_shown_anew_and_that_of_a_group_once() {
    let twenty = Frequency::from_hertz(20).into();
    let mut rig = Rig::ready();
    rig.order(setpoint(20));
    rig.pass(500 * MS);
    rig.drive.reference = Some(Frequency::from_hertz(40).into());
    rig.drive.log.clear();
    rig.order(START);
    rig.pass(500 * MS);
    assert_eq!(rig.drive.writes(), [Job::SetSetpoint(twenty, None), Job::Start(Direction::Forward)]);

    let mut rig = Rig::ready();
    let leave = rig.machine.leave(rig.now, "tester", Direction::Forward, Some(twenty)).unwrap();
    for order in [setpoint(20), START] {
        let asker = rig.asker();
        rig.machine.handle_order(rig.now, asker, order, Some(leave), None);
        rig.pass(500 * MS);
    }
    assert_eq!(rig.drive.writes(), [Job::SetSetpoint(twenty, None), Job::Start(Direction::Forward)]);
}

/// A drive from a file whose register of the setpoint does no more than read back.
#[test]
fn a_start_goes_on_behind_a_setpoint_that_only_a_start_shows_and_behind_no_other_that_is_not_confirmed() {
    let setpoint = Frequency::from_hertz(40).into();
    for (because, starts) in
        [(Refusal::OnlyAStartShows("a test"), true), (Refusal::Settings("a test"), false)]
    {
        let mut rig = Rig::ready();
        rig.drive.denies_setpoints = Some(because);
        let id = rig.order(run_at(40));
        rig.pass(500 * MS);
        assert_eq!(rig.outcome(id).is_some_and(Outcome::is_confirmed), starts, "{because}");
        let mut writes = vec![Job::SetSetpoint(setpoint, None)];
        writes.extend(starts.then_some(Job::Start(Direction::Forward)));
        assert_eq!(rig.drive.writes(), writes, "{because}");
        // Alone it is what it is.
        let id = rig.order(Order::Setpoint { setpoint, until: Until::InForce });
        rig.pass(500 * MS);
        assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(Unconfirmed::Denied(_)))), "{because}");
    }
}

#[test]
fn an_order_that_was_not_sent_in_its_lifetime_expires_and_is_never_sent() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    rig.now += 1_001 * MS;
    rig.pass(20_000 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::Expired));
    assert_eq!(rig.drive.writes(), []);
}

/// A drive that runs at 40 Hz or stands, and a start at 10 Hz whose setpoint it has been given.
fn given_behind_forty_hertz(runs: bool, answered_after: Duration) -> (Rig, CallId) {
    let mut rig = Rig::ready();
    if runs {
        rig.order(run_at(40));
        rig.pass(1_000 * MS);
    }
    rig.drive.log.clear();
    let (asker, expires) = (rig.asker(), Expiry::at(rig.now + 1_000 * MS));
    let ten = Some(Frequency::from_hertz(10).into());
    // One that runs this way gets no run word.
    let direction = if runs { Direction::Reverse } else { Direction::Forward };
    let start = Order::Start { direction, setpoint: ten, until: Until::AtReference };
    rig.machine.handle_order(rig.now, asker, start, None, Some(expires));
    let id = CallId(rig.next_call);
    let step = rig.next();
    let Step::Do { job: job @ Job::SetSetpoint(..), .. } = step else { panic!("{step:?}") };
    let reply = rig.drive.answer(job);
    rig.now += answered_after;
    rig.machine.handle_reply(rig.now, reply);
    (rig, id)
}

/// Its setpoint, and why its run word was not sent.
fn not_started(outcome: Option<&Outcome>) -> Option<(drive_core::Setpoint, Option<Refused>)> {
    match outcome? {
        Outcome::NotConfirmed(Unconfirmed::NotStarted { setpoint, why, last: Some(_) }) => {
            Some((*setpoint, why.clone()))
        }
        _ => None,
    }
}

/// `Expired`: "Its lifetime ran out before it was sent. It never will be." Its setpoint was, and a motor that runs follows it.
#[test]
fn a_start_whose_time_is_over_behind_its_setpoint_tells_that_the_drive_has_that_and_that_it_was_not_started()
{
    let ten = Frequency::from_hertz(10).into();
    for runs in [true, false] {
        let (mut rig, id) = given_behind_forty_hertz(runs, 1_001 * MS);
        rig.pass(3_000 * MS);
        let writes = rig.drive.writes();
        assert!(
            matches!(writes[..], [Job::SetSetpoint(given, _)] if given == ten),
            "runs: {runs}, {writes:?}"
        );
        assert_eq!(not_started(rig.outcome(id)), Some((ten, None)), "runs: {runs}, {:?}", rig.outcome(id));
        let told = rig.outcome(id).map(ToString::to_string).unwrap_or_default();
        assert!(told.contains("its setpoint of 10.00 Hz is in the drive"), "{told}");
        assert_eq!(rig.snapshot().setpoint, Some(ten));
    }
}

/// Nobody has said a time: what has begun within the lifetime of the settings has 2 s more, and no longer.
#[test]
fn a_start_waits_for_others_of_its_line_and_its_drive_is_polled_meanwhile() {
    let mut rig = Rig::ready();
    rig.others_start = true;
    let start = rig.order(run_at(30));
    rig.pass(2_900 * MS);
    assert_eq!((rig.outcome(start), rig.drive.writes()), (None, vec![]));
    let polled = rig.drive.log.iter().filter(|job| matches!(job, Job::Status { .. })).count();
    assert!(polled >= 5, "{polled}");
    rig.others_start = false;
    rig.pass(200 * MS);
    assert!(rig.outcome(start).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_start_whose_turn_on_its_line_does_not_come_expires_and_neither_a_setpoint_nor_a_stop_waits_for_one() {
    let mut rig = Rig::ready();
    rig.others_start = true;
    let start = rig.order(run_at(30));
    rig.pass(3_100 * MS);
    assert_eq!((rig.outcome(start), rig.drive.writes()), (Some(&Outcome::Expired), vec![]));
    let setpoint = rig.order(setpoint(20));
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(setpoint), Some(&Outcome::Confirmed));
    let start = rig.order(run_at(30));
    rig.pass(100 * MS);
    let stop = rig.stop(StopMode::Ramp);
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::Stopped)));
    assert!(rig.outcome(stop).is_some_and(Outcome::is_confirmed));
}

#[test]
fn a_start_that_waits_as_its_drive_ends_is_refused_and_never_sent() {
    type Waits = fn(&mut Rig);
    let for_its_turn: Waits = |rig| rig.others_start = true;
    // The last status is older than a command may be, and the next has not come yet.
    let for_a_status: Waits = |rig| {
        rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
        rig.pass(3_500 * MS);
    };
    for (waits, policy) in [for_its_turn, for_a_status]
        .into_iter()
        .flat_map(|waits| [Policy::Exit, Policy::Removal].map(|policy| (waits, policy)))
    {
        let mut rig = Rig::ready();
        waits(&mut rig);
        let start = rig.order(run_at(30));
        rig.pass(100 * MS);
        rig.machine.handle_exit(rig.now, policy);
        rig.others_start = false;
        rig.drive.failing = None;
        rig.pass(3_000 * MS);
        assert!(matches!(rig.outcome(start), Some(Outcome::Refused(_))), "{:?}", rig.outcome(start));
        let moves = |job: &Job| matches!(job, Job::Start(_) | Job::SetSetpoint(..));
        assert!(!rig.drive.log.iter().any(moves), "{:?}", rig.drive.log);
    }
}

#[test]
fn a_start_that_waits_is_judged_by_the_settings_that_hold_when_it_is_sent() {
    let nobody = Commanders::Only(vec!["somebody else".to_owned()]);
    let for_nobody = DriveSettings { commanders: nobody, ..settings() };
    let lower = FrequencyLimits { high: Some(Frequency::from_hertz(15)), ..FrequencyLimits::default() };
    let limited = DriveSettings { limits: lower.clone(), ..settings() };
    let read = DriveSettings { control: false, ..settings() };
    for (changed, given_before) in [(&for_nobody, false), (&read, false), (&limited, false), (&limited, true)]
    {
        let mut rig = Rig::ready();
        let start = if given_before {
            // As a group does: the setpoint first, and then its start.
            let of_group = Some(Frequency::from_hertz(22).into());
            let leave = rig.machine.leave(rig.now, "tester", Direction::Forward, of_group).ok();
            for order in [setpoint(22), START] {
                rig.others_start = order == START;
                let asker = rig.asker();
                rig.machine.handle_order(rig.now, asker, order, leave, None);
                rig.pass(200 * MS);
            }
            CallId(rig.next_call)
        } else {
            rig.others_start = true;
            rig.order(run_at(22))
        };
        rig.pass(100 * MS);
        rig.machine.handle_settings(rig.now, changed);
        rig.others_start = false;
        rig.pass(500 * MS);
        let by_limit = matches!(rig.outcome(start), Some(Outcome::Refused(Refused::Limit(_))));
        assert_eq!(by_limit, changed.limits == lower, "{:?}", rig.outcome(start));
        assert!(matches!(rig.outcome(start), Some(Outcome::Refused(_))), "{:?}", rig.outcome(start));
        assert!(!rig.drive.log.iter().any(|job| matches!(job, Job::Start(_))), "{:?}", rig.drive.log);
    }
}

#[test]
fn a_start_whose_motor_follows_another_reference_than_it_was_given_is_not_confirmed_and_taken_back() {
    for (follows, is_lost) in [(22, false), (22, true), (40, false), (40, true), (0, false)] {
        let mut rig = Rig::ready();
        let start = rig.order(run_at(22));
        let Step::Do { job: job @ Job::SetSetpoint(..), .. } = rig.next() else { panic!() };
        let reply = rig.drive.answer(job);
        rig.machine.handle_reply(rig.now, reply);
        let Step::Do { job: Job::Start(direction), .. } = rig.next() else { panic!() };
        assert_eq!(rig.machine.starts_at(), Some(Frequency::from_hertz(22).into()));
        rig.drive.run();
        rig.drive.status.reference = Some(Frequency::from_hertz(follows));
        rig.drive.lease = Some(Lease::new(direction, 0x000F));
        rig.machine.handle_lease(rig.drive.lease);
        let shown = rig.drive.status();
        let reply = match is_lost {
            false => Reply::started(slave(), direction, rig.machine.starts_at(), shown),
            true => Reply::Ordered(Err(port_error(PortError::OutcomeUnknown("no answer")))),
        };
        rig.machine.handle_reply(rig.now, reply);
        rig.pass(2_000 * MS);
        let outcome = rig.outcome(start).cloned();
        let is_ours = follows == 22;
        assert_eq!(outcome.as_ref().is_some_and(Outcome::is_confirmed), is_ours, "{outcome:?}");
        assert_eq!(rig.drive.log.contains(&Job::Stop(StopMode::Ramp)), !is_ours, "{:?}", rig.drive.log);
    }
}

#[test]
fn a_start_whose_driver_reads_for_it_is_broken_off_by_settings_that_refuse_it_and_one_that_turns_goes_on() {
    let nobody = Commanders::Only(vec!["somebody else".to_owned()]);
    let for_nobody = DriveSettings { commanders: nobody, ..settings() };
    let lower = FrequencyLimits { high: Some(Frequency::from_hertz(15)), ..FrequencyLimits::default() };
    let limited = DriveSettings { limits: lower, ..settings() };
    let other = DriveSettings { name: "another name".to_owned(), ..settings() };
    for (changed, forbids) in [(&for_nobody, true), (&limited, true), (&other, false)] {
        let mut rig = Rig::ready();
        let start = rig.order(run_at(22));
        let Step::Do { job: job @ Job::SetSetpoint(..), .. } = rig.next() else { panic!() };
        assert_eq!(rig.machine.handle_settings(rig.now, changed), forbids);
        match forbids {
            true => rig.machine.handle_dropped(rig.now),
            false => {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
        }
        rig.pass(100 * MS);
        let outcome = rig.outcome(start);
        assert_eq!(outcome.is_some_and(|outcome| !outcome.is_confirmed()), forbids);
        let starts = rig.drive.log.iter().filter(|job| matches!(job, Job::Start(_))).count();
        assert_eq!(starts == 0, forbids, "{:?}", rig.drive.log);
        // Its run word may be on the wire: the motor is brought down, whatever it does.
        let mut rig = Rig::ready();
        let start = rig.order(run_at(22));
        let mut step = rig.next();
        while !matches!(step, Step::Do { job: Job::Start(_), .. }) {
            let Step::Do { job, .. } = step else { panic!("{step:?}") };
            let reply = rig.drive.answer(job);
            rig.machine.handle_reply(rig.now, reply);
            step = rig.next();
        }
        let drops = rig.machine.handle_settings(rig.now, changed);
        if drops {
            rig.machine.handle_dropped(rig.now);
        }
        let step = rig.next();
        assert_eq!(matches!(step, Step::Do { job: Job::Stop(_), .. }), forbids, "{step:?}");
        assert_eq!(drops, forbids, "{:?}", rig.outcome(start));
    }
    let mut rig = Rig::ready();
    rig.order(run_at(22));
    rig.pass(2_000 * MS);
    assert!(!rig.machine.handle_settings(rig.now, &limited) && rig.machine.stopping.is_none());
}

#[test]
fn a_start_whose_setpoint_is_sent_as_its_drive_is_left_gets_no_run_word() {
    let on_exit = OnExit::Leave;
    let mut rig = Rig::new(DriveSettings { on_exit, ..settings() });
    rig.pass(1_500 * MS);
    let start = rig.order(run_at(30));
    let step = rig.next();
    assert!(matches!(step, Step::Do { job: Job::SetSetpoint(..), .. }), "{step:?}");
    rig.machine.handle_exit(rig.now, Policy::Exit);
    rig.machine.handle_reply(rig.now, Reply::Setpoint(Ok(())));
    rig.pass(1_000 * MS);
    assert!(rig.outcome(start).is_some_and(|outcome| !outcome.is_confirmed()), "{:?}", rig.outcome(start));
    assert!(!rig.drive.log.iter().any(|job| matches!(job, Job::Start(_))), "{:?}", rig.drive.log);
}

#[test]
fn a_start_that_has_begun_within_its_lifetime_goes_on_for_two_seconds_more_and_is_never_sent_behind_them() {
    for (answered_after, is_sent) in [(1_500 * MS, true), (2_900 * MS, true), (3_001 * MS, false)] {
        let mut rig = Rig::ready();
        rig.machine.settings.periods.max_age = 10_000 * MS;
        rig.drive.log.clear();
        let id = rig.order(run_at(10));
        let Step::Do { job: job @ Job::SetSetpoint(..), .. } = rig.next() else { panic!() };
        let reply = rig.drive.answer(job);
        rig.now += answered_after;
        rig.machine.handle_reply(rig.now, reply);
        rig.pass(3_000 * MS);
        let was_sent = rig.drive.log.iter().any(|job| matches!(job, Job::Start(_)));
        assert_eq!(was_sent, is_sent, "{answered_after:?}: {:?}", rig.outcome(id));
    }
}

#[test]
fn a_start_whose_run_word_waits_too_long_for_the_line_behind_its_setpoint_is_told_so_too() {
    let ten = Frequency::from_hertz(10).into();
    let (mut rig, id) = given_behind_forty_hertz(false, 20 * MS);
    rig.drive.failing = Some(PortError::Expired);
    rig.pass(20 * MS);
    rig.drive.failing = None;
    rig.pass(3_000 * MS);
    assert_eq!(not_started(rig.outcome(id)), Some((ten, None)), "{:?}", rig.outcome(id));
}

/// As by another master's run command amid its ramp.
#[test]
fn a_start_until_its_reference_is_not_confirmed_by_a_motor_that_turns_the_other_way_at_it() {
    for turns in [Direction::Forward, Direction::Reverse] {
        let mut rig = Rig::ready();
        let start = rig.order(run_at(25));
        loop {
            let Step::Do { job, .. } = rig.next() else { panic!() };
            let mut reply = rig.drive.answer(job);
            if let Reply::Ordered(Ok(status)) = &mut reply {
                // It is on its way there.
                status.at_reference = Some(false);
                rig.drive.status.direction = Some(turns);
                rig.machine.handle_lease(rig.drive.lease);
                rig.machine.handle_reply(rig.now, reply);
                break;
            }
            rig.machine.handle_reply(rig.now, reply);
        }
        rig.pass(2_000 * MS);
        let is_confirmed = rig.outcome(start).is_some_and(Outcome::is_confirmed);
        assert_eq!(is_confirmed, turns == Direction::Forward, "{:?}", rig.outcome(start));
    }
}

/// As at the STOP key of its panel, between the setpoint of a start and its run word.
#[test]
fn a_motor_that_somebody_stops_behind_a_start_is_not_started_again_by_it_and_one_that_runs_this_way_gets_no_run_word()
 {
    for (direction, is_stopped) in [
        (Direction::Forward, false),
        (Direction::Forward, true),
        (Direction::Reverse, false),
        (Direction::Reverse, true),
    ] {
        let mut rig = Rig::running_at(25);
        rig.drive.log.clear();
        let setpoint = Some(Frequency::from_hertz(30).into());
        let start = rig.order(Order::Start { direction, setpoint, until: Until::InForce });
        let Step::Do { job: job @ Job::SetSetpoint(..), .. } = rig.next() else { panic!() };
        let reply = rig.drive.answer(job);
        if is_stopped {
            rig.drive.stand();
        }
        rig.machine.handle_reply(rig.now, reply);
        rig.pass(1_000 * MS);
        let starts = rig.drive.log.iter().filter(|job| matches!(job, Job::Start(_))).count();
        assert_eq!(
            starts,
            usize::from(!is_stopped && direction == Direction::Reverse),
            "{:?}",
            rig.drive.log
        );
        let outcome = rig.outcome(start).cloned();
        assert_eq!(outcome.as_ref().is_some_and(Outcome::is_confirmed), !is_stopped, "{outcome:?}");
    }
}

/// `Refused`: "It was refused; nothing moved because of it."
#[test]
fn a_start_that_the_drive_refuses_behind_its_setpoint_is_refused_where_its_motor_stands_and_nowhere_else() {
    let (ten, reason) = (Frequency::from_hertz(10).into(), Refusal::Settings("a test"));
    for runs in [true, false] {
        let (mut rig, id) = given_behind_forty_hertz(runs, 20 * MS);
        rig.drive.withholds_starts = Some(reason);
        rig.pass(1_000 * MS);
        let refused = Refused::Because(reason);
        if runs {
            assert_eq!(not_started(rig.outcome(id)), Some((ten, Some(refused))), "{:?}", rig.outcome(id));
        } else {
            assert_eq!(rig.outcome(id), Some(&Outcome::Refused(refused)));
        }
    }
}

#[test]
fn a_start_whose_answer_was_lost_is_read_back_and_confirmed() {
    let mut rig = Rig::ready();
    rig.drive.loses_answer = true;
    let id = rig.order(START);
    rig.pass(500 * MS);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.writes(), [Job::Start(Direction::Forward)], "it is not written twice");
}

#[test]
fn a_start_that_the_drive_denies_is_not_confirmed_not_repeated_and_taken_back_by_a_stop() {
    let mut rig = Rig::ready();
    rig.drive.loses_answer = true;
    rig.drive.obeys = false;
    let id = rig.order(START);
    rig.pass(8_000 * MS);
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(Unconfirmed::Denied(_)))));
    assert_eq!(rig.drive.writes(), [Job::Start(Direction::Forward), Job::Stop(StopMode::Ramp)]);
}

/// A reading that comes before the first write was not answered: nothing stands in the drive that would have to be taken back.
#[test]
fn an_order_that_fails_before_anything_is_written_is_refused_and_takes_nothing_back() {
    for order in [START, setpoint(30), Order::ResetFaults] {
        let mut rig = Rig::ready();
        rig.drive.reads_in_vain = true;
        let id = rig.order(order);
        rig.pass(8_000 * MS);
        assert!(
            matches!(rig.outcome(id), Some(Outcome::Refused(Refused::Drive(_)))),
            "{:?}",
            rig.outcome(id)
        );
        assert_eq!(rig.drive.writes().len(), 1, "it is not asked for again, and no stop takes it back");
    }
}

/// What runs by a command of before shows nothing of a start the other way that the line has lost.
#[test]
fn a_lost_start_the_other_way_is_not_confirmed_by_the_run_command_that_stands() {
    let mut rig = Rig::running_at(25);
    // No setpoint goes before its run word.
    rig.machine.handle_changed(rig.now, drive_core::Ground::Units);
    rig.drive.obeys = false;
    let id = rig.order(Order::Start { direction: Direction::Reverse, setpoint: None, until: Until::InForce });
    loop {
        let Step::Do { job, .. } = rig.next() else { panic!() };
        rig.drive.loses_answer = matches!(job, Job::Start(_));
        let reply = rig.drive.answer(job);
        rig.machine.handle_reply(rig.now, reply);
        if matches!(job, Job::Start(_)) {
            break;
        }
    }
    rig.pass(8_000 * MS);
    assert!(matches!(rig.outcome(id), Some(Outcome::NotConfirmed(_))), "{:?}", rig.outcome(id));
}

#[test]
fn a_start_whose_drive_goes_mute_has_an_unknown_outcome_and_the_drive_is_stopped_when_it_is_back() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
    rig.pass(8_000 * MS);
    assert!(matches!(rig.outcome(id), Some(Outcome::OutcomeUnknown(_))), "{:?}", rig.outcome(id));
    assert!(rig.snapshot().stop.is_some());
    rig.drive.failing = None;
    rig.pass(20_000 * MS);
    let (start, stops) =
        rig.drive.writes().split_first().map(|(first, rest)| (*first, rest.to_vec())).unwrap();
    assert_eq!(start, Job::Start(Direction::Forward));
    assert!(
        !stops.is_empty() && stops.iter().all(|job| *job == Job::Stop(StopMode::Ramp)),
        "nothing is replayed"
    );
    assert_eq!(rig.snapshot().stop, None);
}

#[test]
fn a_setpoint_whose_answer_was_lost_is_read_back() {
    for (obeys, confirmed) in [(true, true), (false, false)] {
        let mut rig = Rig::ready();
        rig.drive.reference = Some(Frequency::from_hertz(10).into());
        rig.drive.loses_answer = true;
        rig.drive.obeys = obeys;
        let id = rig.order(setpoint(30));
        rig.pass(1_000 * MS);
        assert_eq!(rig.outcome(id).map(Outcome::is_confirmed), Some(confirmed));
        assert!(rig.drive.log.contains(&Job::Measurements));
    }
}

#[test]
fn only_the_latest_setpoint_that_was_not_sent_is_sent() {
    let mut rig = Rig::ready();
    let ids = [20, 30, 40].map(|hertz| rig.order(setpoint(hertz)));
    rig.pass(500 * MS);
    assert_eq!(rig.outcome(ids[0]), Some(&Outcome::Refused(Refused::Superseded)));
    assert_eq!(rig.outcome(ids[1]), Some(&Outcome::Refused(Refused::Superseded)));
    assert_eq!(rig.outcome(ids[2]), Some(&Outcome::Confirmed));
    assert_eq!(rig.drive.writes(), [Job::SetSetpoint(Frequency::from_hertz(40).into(), None)]);
}

#[test]
fn motion_is_refused_without_connection_fault_free_state_control_or_permission() {
    let refused_after = |prepare: fn(&mut Rig), expected: Refused| {
        let mut rig = Rig::ready();
        prepare(&mut rig);
        rig.pass(2_000 * MS);
        rig.drive.log.clear();
        let id = rig.order(START);
        rig.pass(1_500 * MS);
        assert_eq!(rig.drive.writes(), []);
        assert_eq!(rig.outcome(id), Some(&Outcome::Refused(expected)));
    };
    refused_after(
        |rig| rig.drive.failing = Some(PortError::Offline { retry_in: 500 * MS }),
        Refused::NotConnected,
    );
    refused_after(|rig| rig.drive.trip(7), Refused::Because(Refusal::Fault(7)));
    refused_after(
        |rig| rig.drive.status.state = State::Unknown,
        Refused::Because(Refusal::State(State::Unknown)),
    );
    refused_after(
        |rig| rig.machine.settings.commanders = Commanders::Only(vec!["operator".to_owned()]),
        Refused::Commander("tester".to_owned()),
    );
}

#[test]
fn limits_and_bands_refuse_a_setpoint_before_anything_is_sent() {
    let limits = FrequencyLimits {
        high: Some(Frequency::from_hertz(45)),
        forbidden: vec![Band { low: Frequency::from_hertz(20), high: Frequency::from_hertz(25) }],
        ..FrequencyLimits::default()
    };
    let mut rig = Rig::new(DriveSettings { limits, ..settings() });
    rig.pass(1_500 * MS);
    rig.drive.log.clear();
    let ids = [run_at(50), run_at(22), START].map(|order| rig.order(order));
    rig.pass(500 * MS);
    for id in ids {
        assert!(
            matches!(rig.outcome(id), Some(Outcome::Refused(Refused::Limit(_)))),
            "{:?}",
            rig.outcome(id)
        );
    }
    assert_eq!(rig.drive.writes(), []);
}

/// What stands in the drive nobody knows: what it turns at counts.
#[test]
fn a_setpoint_that_was_withdrawn_on_its_way_frees_none_of_the_largest_change_per_second() {
    let mut rig = Rig::running_at(25);
    rig.pass(2_000 * MS);
    rig.machine.settings.limits.change_per_second = Some(Frequency::from_hertz(2));
    let id = rig.order(setpoint(26));
    loop {
        match rig.next() {
            Step::Do { job: Job::SetSetpoint(..), .. } => break,
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
            step => panic!("{step:?}"),
        }
    }
    assert!(rig.machine.handle_withdrawal(rig.now, id), "its job is dropped");
    let id = rig.order(setpoint(40));
    rig.pass(500 * MS);
    let outcome = rig.outcome(id);
    assert!(
        matches!(outcome, Some(Outcome::Refused(Refused::Limit(LimitProblem::TooFast { .. })))),
        "{outcome:?}"
    );
}

#[test]
fn a_motor_that_is_turned_round_without_a_setpoint_keeps_the_limits_of_its_owner() {
    let mut rig = Rig::ready();
    rig.order(run_at(30));
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    let reverse =
        Order::Start { direction: Direction::Reverse, setpoint: None, until: crate::Until::default() };
    // The limits of the fleet are others while it runs.
    let up_to =
        |hertz| FrequencyLimits { high: Some(Frequency::from_hertz(hertz)), ..FrequencyLimits::default() };
    rig.machine.settings.limits = up_to(20);
    let id = rig.order(reverse);
    rig.pass(500 * MS);
    assert!(matches!(rig.outcome(id), Some(Outcome::Refused(Refused::Limit(_)))), "{:?}", rig.outcome(id));
    assert_eq!(rig.drive.writes(), []);
    // Within them what was given is given again: another master may have written something else meanwhile.
    rig.machine.settings.limits = up_to(35);
    rig.order(reverse);
    rig.pass(500 * MS);
    let writes = rig.drive.writes();
    assert!(
        matches!(writes[..], [Job::SetSetpoint(given, _), Job::Start(Direction::Reverse)] if given == Frequency::from_hertz(30).into()),
        "{writes:?}"
    );
}

#[test]
fn an_overloaded_queue_says_so() {
    let mut rig = Rig::ready();
    let ids: Vec<_> = (0..20).map(|_| rig.order(Order::ResetFaults)).collect();
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(ids[19]), Some(&Outcome::Refused(Refused::QueueFull)));
    assert_eq!(rig.outcome(ids[0]), Some(&Outcome::Confirmed));
}

#[test]
fn a_start_that_the_family_does_not_confirm_stays_so_whatever_state_the_drive_shows_afterwards() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    let step = rig.next();
    assert!(matches!(step, Step::Do { job: Job::Start(_), .. }), "{step:?}");
    rig.drive.lease = Some(Lease::new(Direction::Forward, 0x000F));
    rig.machine.handle_lease(rig.drive.lease);
    rig.drive.run();
    let because = Some(Refusal::Overridden { by: "another reference", remedy: "see to it" });
    let (slave, command) = (slave(), Command::Start(Direction::Forward));
    let status = Box::new(rig.drive.status.clone());
    let error = Error::NotConfirmed { slave, command, status, because };
    rig.machine.handle_reply(rig.now, Reply::Ordered(Err(error.clone())));
    rig.pass(1_000 * MS);
    assert_eq!(rig.outcome(id), Some(&Outcome::NotConfirmed(Unconfirmed::Denied(error))));
    assert_eq!(rig.drive.writes(), [Job::Stop(StopMode::Ramp)], "it is taken back");
}

#[test]
fn a_watchdog_that_keeps_something_else_is_written_once_and_not_for_ever() {
    let mut rig = Rig::controlled();
    rig.drive.keeps_watchdog = true;
    rig.pass(600_000 * MS);
    let written = rig.drive.log.iter().filter(|job| matches!(job, Job::ArmWatchdog(..))).count();
    assert_eq!(written, 1);
    assert!(matches!(rig.snapshot().watchdog, crate::snapshot::WatchdogCheck::Broken(_)));
}

#[test]
fn a_watchdog_that_the_drive_refuses_at_standstill_is_an_alarm_and_not_waited_for_for_ever() {
    let mut rig = Rig::controlled();
    rig.drive.refuses_watchdog = true;
    rig.pass(600_000 * MS);
    assert!(rig.events().contains(&"watchdog broken"), "{:?}", rig.events());
}

#[test]
fn a_start_tells_the_setpoint_that_it_uses_and_that_at_zero_nothing_turns() {
    let zero = "confirmed: started forward at 0.00 Hz: its setpoint is zero";
    for (reference, sentence) in [
        (Some(Frequency::from_hertz(30)), "confirmed: started forward at 30.00 Hz"),
        (Some(Frequency::ZERO), zero),
        (None, "confirmed: started forward"),
    ] {
        for loses_answer in [false, true] {
            for until in [Until::InForce, Until::AtReference] {
                let mut rig = Rig::ready();
                rig.drive.status.reference = reference;
                rig.drive.loses_answer = loses_answer;
                let id = rig.order(Order::Start { direction: Direction::Forward, setpoint: None, until });
                rig.pass(3_000 * MS);
                let told = rig.outcome(id).map(ToString::to_string);
                assert_eq!(told.as_deref(), Some(sentence), "answer lost: {loses_answer}, {until:?}");
            }
        }
    }
}

/// A status is as old as the last poll, and a trip may be younger.
#[test]
fn a_reset_asks_the_drive_itself_whether_there_is_a_fault_and_is_confirmed_by_what_it_says() {
    let mut rig = Rig::ready();
    rig.drive.log.clear();
    rig.drive.trip(9);
    let id = rig.order(Order::ResetFaults);
    rig.pass(100 * MS);
    assert!(rig.drive.log.contains(&Job::ResetFaults), "{:?}", rig.drive.log);
    assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed));
    assert_eq!(rig.drive.status.fault_code, None);

    rig.drive.trip(9);
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    let id = rig.order(Order::ResetFaults);
    rig.pass(6_000 * MS);
    assert!(rig.outcome(id).is_some_and(|outcome| !outcome.is_confirmed()), "{:?}", rig.outcome(id));
}
