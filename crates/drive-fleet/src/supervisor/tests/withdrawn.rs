//! Orders that nobody waits for any more: "What is unsent of it never is; a start whose run command was sent, or may have been, is taken
//! back." And what an order makes room for.

use super::*;

impl Rig {
    fn withdraw(&mut self, id: CallId) -> bool {
        let drops = self.machine.handle_withdrawal(self.now, id);
        if drops {
            self.machine.handle_dropped(self.now);
        }
        drops
    }

    /// Begins the next job, and does not answer it.
    fn begins(&mut self) -> Job {
        let step = self.next();
        let Step::Do { job, .. } = step else { panic!("{step:?}") };
        job
    }
}

#[test]
fn what_is_withdrawn_unsent_is_never_sent_and_nothing_else_goes_with_it() {
    let mut rig = Rig::ready();
    let (kept, gone) = (rig.order(setpoint(20)), rig.order(START));
    assert!(!rig.withdraw(gone));
    rig.pass(2_000 * MS);
    assert_eq!(rig.outcome(gone), Some(&Outcome::Refused(Refused::Withdrawn)));
    assert!(rig.outcome(kept).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(kept));
    assert_eq!(rig.drive.writes(), [Job::SetSetpoint(Frequency::from_hertz(20).into(), None)]);
}

#[test]
fn a_start_that_is_withdrawn_behind_its_run_command_is_taken_back_and_by_nobody_elses_withdrawal() {
    let mut rig = Rig::ready();
    let other = rig.order(setpoint(30));
    rig.pass(500 * MS);
    let id = rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    assert!(!rig.withdraw(other));
    rig.pass(2_000 * MS);
    assert_eq!((rig.drive.writes(), rig.snapshot().started_here()), (vec![], true));
    rig.withdraw(id);
    rig.pass(2_000 * MS);
    assert!(matches!(rig.drive.writes().first(), Some(Job::Stop(_))), "{:?}", rig.drive.writes());
    rig.drive.stand();
    rig.pass(2_000 * MS);
    assert!(!rig.snapshot().started_here());
    // It is over: who withdraws it once more stops nobody else's run.
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.drive.log.clear();
    rig.withdraw(id);
    rig.pass(1_000 * MS);
    assert_eq!(rig.drive.writes(), []);
}

#[test]
fn a_start_that_is_withdrawn_while_its_run_command_is_sent_is_taken_back() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    assert!(matches!(rig.begins(), Job::Start(_)));
    assert!(rig.withdraw(id), "a stop does not wait for it");
    rig.pass(1_000 * MS);
    assert!(matches!(rig.drive.writes().first(), Some(Job::Stop(_))), "{:?}", rig.drive.writes());
}

/// "So is one of which no more than the setpoint was sent, or may have been, where the motor ran by this side: it goes to that setpoint."
#[test]
fn a_start_that_is_withdrawn_behind_its_setpoint_is_taken_back_where_the_motor_runs_and_not_where_it_stands()
{
    for (runs, answered) in [(true, false), (true, true), (false, false), (false, true)] {
        let mut rig = Rig::ready();
        if runs {
            rig.order(START);
            rig.pass(3_000 * MS);
            assert!(rig.snapshot().started_here());
            rig.drive.log.clear();
        }
        let id = rig.order(run_at(45));
        let job = rig.begins();
        assert!(matches!(job, Job::SetSetpoint(..)), "{job:?}");
        if answered {
            let reply = rig.drive.answer(job);
            rig.machine.handle_reply(rig.now, reply);
        }
        rig.withdraw(id);
        rig.pass(1_000 * MS);
        let writes = rig.drive.writes();
        let stops = writes.iter().any(|job| matches!(job, Job::Stop(_)));
        assert_eq!(stops, runs, "runs: {runs}, answered: {answered}: {writes:?}");
        assert!(!writes.iter().any(|job| matches!(job, Job::Start(_))), "{writes:?}");
    }
}

#[test]
fn a_setpoint_that_is_withdrawn_while_it_is_sent_is_one_that_nobody_knows() {
    let mut rig = Rig::ready();
    rig.order(setpoint(20));
    rig.pass(500 * MS);
    assert!(rig.snapshot().setpoint.is_some());
    let id = rig.order(setpoint(30));
    assert!(matches!(rig.begins(), Job::SetSetpoint(..)));
    assert!(rig.withdraw(id));
    rig.collect();
    assert_eq!(rig.outcome(id), Some(&Outcome::NotConfirmed(Unconfirmed::Withdrawn)));
    assert_eq!(rig.snapshot().setpoint, None, "it may stand in the drive or not");
}

/// `Error::Setpoint`: "The setpoint cannot be given to this drive. Nothing was sent.", and so it is of whatever is refused before.
#[test]
fn a_setpoint_that_cannot_be_given_leaves_the_one_that_the_drive_holds() {
    let problem = drive_core::SetpointProblem::Resolution("a test");
    let given = Frequency::from_hertz(30).into();
    let command = drive_core::Command::Start(Direction::Reverse);
    for error in [
        Error::Setpoint { slave: slave(), setpoint: given, problem },
        // A 3G3EV whose n05 forbids reverse, asked to start so at another setpoint.
        Error::Refused { slave: slave(), command, reason: drive_core::Refusal::DirectionForbidden },
        // An answer: it was not carried out.
        not_now(8502),
    ] {
        let mut rig = Rig::ready();
        rig.order(setpoint(20));
        rig.pass(500 * MS);
        let id = rig.order(setpoint(30));
        assert!(matches!(rig.begins(), Job::SetSetpoint(..)), "it is the next");
        rig.machine.handle_reply(rig.now, Reply::Setpoint(Err(error)));
        rig.collect();
        assert!(matches!(rig.outcome(id), Some(Outcome::Refused(_))), "{:?}", rig.outcome(id));
        assert_eq!(rig.snapshot().setpoint, Some(Frequency::from_hertz(20).into()));
    }
}

#[test]
fn a_later_setpoint_takes_the_place_of_the_earlier_ones_and_of_nothing_else() {
    let mut rig = Rig::ready();
    let (first, start, last) = (rig.order(setpoint(20)), rig.order(START), rig.order(setpoint(30)));
    rig.pass(3_000 * MS);
    assert_eq!(rig.outcome(first), Some(&Outcome::Refused(Refused::Superseded)));
    for id in [start, last] {
        assert!(rig.outcome(id).is_some_and(Outcome::is_confirmed), "{:?}", rig.outcome(id));
    }
    let given = |job: &Job| matches!(job, Job::SetSetpoint(setpoint, _) if *setpoint == Frequency::from_hertz(20).into());
    assert!(!rig.drive.writes().iter().any(given), "{:?}", rig.drive.writes());
}

/// "A poll gives way once; the next waits for its status."
#[test]
fn a_poll_gives_way_to_one_order_and_the_next_waits_for_its_status() {
    let mut rig = Rig::ready();
    let gives_way = |rig: &mut Rig| {
        rig.pass(10 * MS);
        while !rig.machine.in_flight.is_some_and(Job::is_poll) {
            match rig.next() {
                Step::Do { job, .. } if !job.is_poll() => {
                    let reply = rig.drive.answer(job);
                    rig.machine.handle_reply(rig.now, reply);
                }
                Step::Do { .. } | Step::Finished => {}
                Step::Wait(at) => rig.now = at,
            }
        }
        let (asker, now) = (rig.asker(), rig.now);
        let gives_way = rig.machine.handle_order(now, asker, setpoint(20), None, None);
        if gives_way {
            rig.machine.handle_dropped(rig.now);
        }
        gives_way
    };
    assert!(gives_way(&mut rig));
    assert!(!gives_way(&mut rig), "or a stream of orders would blind the fleet");
}
