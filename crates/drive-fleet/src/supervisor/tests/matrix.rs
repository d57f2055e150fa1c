//! What becomes of each operation, whatever happens to it: a table whose words come from the rules of motion, not from the code.
//! Rule 1: a stop is repeated until the drive shows it. Rule 2: nothing is sent late or twice. Rule 3: nothing is called done because
//! it was sent. Rule 5: a start that is not confirmed is taken back. Rule 6: an edge is written once. Rule 10: an EEPROM is not written
//! again and again.

use Became::{Confirmed, Expired, NotConfirmed, Refused as No, Unknown as Nobody};

use super::*;
use crate::outcome::Became;

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Start,
    Stop,
    Setpoint,
    Reset,
    Release,
    Save,
}

/// What happens to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// It is carried out and answered.
    Obeyed,
    /// It is carried out, and its answer is lost.
    AnswerLost,
    /// Its answer is lost, and the drive has not taken it.
    LostAndNotTaken,
    /// It never left: the port is not there.
    NeverSent,
    /// It waited too long for the line.
    Late,
    /// The drive says no, by an exception.
    Refused,
    /// Its answer was damaged on the line.
    Damaged,
    /// It was carried out, and nothing is heard of the drive from then on.
    Mute,
}

use Asked::{Release, Reset, Save, Setpoint, Start, Stop};
use Fate::{AnswerLost, Damaged, Late, LostAndNotTaken, Mute, NeverSent, Obeyed, Refused as Denied};

/// Of each operation and fate: the word of its outcome, how often it is written, and whether a stop follows it.
const TABLE: &[(Asked, Fate, Became, Times, bool)] = &[
    (Start, Obeyed, Confirmed, Once, false),
    (Start, AnswerLost, Confirmed, Once, false),
    (Start, LostAndNotTaken, NotConfirmed, Once, true),
    // It may be on the line still, and is taken back all the same.
    (Start, NeverSent, No, Once, false),
    (Start, Late, Expired, Once, false),
    (Start, Denied, No, Once, false),
    (Start, Damaged, Confirmed, Once, false),
    (Start, Mute, Nobody, Once, true),
    (Stop, Obeyed, Confirmed, Once, true),
    (Stop, AnswerLost, Confirmed, AtLeastOnce, true),
    (Stop, LostAndNotTaken, Confirmed, More, true),
    (Stop, NeverSent, Confirmed, More, true),
    (Stop, Late, Confirmed, More, true),
    (Stop, Denied, Confirmed, More, true),
    (Stop, Damaged, Confirmed, AtLeastOnce, true),
    (Stop, Mute, Nobody, More, true),
    (Setpoint, Obeyed, Confirmed, Once, false),
    (Setpoint, AnswerLost, Confirmed, Once, false),
    (Setpoint, LostAndNotTaken, NotConfirmed, Once, false),
    (Setpoint, NeverSent, No, Once, false),
    (Setpoint, Late, Expired, Once, false),
    (Setpoint, Denied, No, Once, false),
    (Setpoint, Damaged, Confirmed, Once, false),
    (Setpoint, Mute, Nobody, Once, false),
    (Reset, Obeyed, Confirmed, Once, false),
    (Reset, AnswerLost, Confirmed, Once, false),
    (Reset, LostAndNotTaken, NotConfirmed, Once, false),
    (Reset, NeverSent, No, Once, false),
    (Reset, Late, Expired, Once, false),
    (Reset, Denied, No, Once, false),
    (Reset, Damaged, Confirmed, Once, false),
    (Reset, Mute, Nobody, Once, false),
    (Release, Obeyed, Confirmed, Once, false),
    (Release, AnswerLost, Confirmed, Once, false),
    (Release, LostAndNotTaken, NotConfirmed, Once, false),
    (Release, NeverSent, No, Once, false),
    (Release, Late, Expired, Once, false),
    (Release, Denied, No, Once, false),
    (Release, Damaged, Confirmed, Once, false),
    (Release, Mute, Nobody, Once, false),
    (Save, Obeyed, Confirmed, Once, false),
    // An edge that cannot be read back.
    (Save, AnswerLost, Nobody, Once, false),
    (Save, LostAndNotTaken, Nobody, Once, false),
    (Save, NeverSent, No, Once, false),
    (Save, Late, Expired, Once, false),
    (Save, Denied, No, Once, false),
    (Save, Damaged, Nobody, Once, false),
    (Save, Mute, Nobody, Once, false),
];

/// How often something is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Times {
    Once,
    AtLeastOnce,
    More,
}

use Times::{AtLeastOnce, More, Once};

impl Fate {
    /// The error of the first call.
    fn error(self) -> Option<Error> {
        let exchange = Exchange { function: 6, register: Some(8501) };
        Some(match self {
            Self::Obeyed => return None,
            Self::AnswerLost | Self::LostAndNotTaken | Self::Mute => {
                port_error(PortError::OutcomeUnknown("no answer"))
            }
            Self::NeverSent => port_error(PortError::LineDown("unplugged".to_owned())),
            Self::Late => port_error(PortError::Expired),
            Self::Refused => {
                let meaning = drive_core::ExceptionMeaning::NotNow;
                Error::Exception { slave: slave(), exchange, code: 4, meaning }
            }
            Self::Damaged => port_error(PortError::OutcomeUnknown("a damaged answer")),
        })
    }

    const fn is_carried_out(self) -> bool {
        matches!(self, Self::Obeyed | Self::AnswerLost | Self::Damaged | Self::Mute)
    }
}

impl Asked {
    const fn is_it(self, job: Job) -> bool {
        matches!(
            (self, job),
            (Self::Start, Job::Start(_))
                | (Self::Stop, Job::Stop(_))
                | (Self::Setpoint, Job::SetSetpoint(_))
                | (Self::Reset, Job::ResetFaults)
                | (Self::Release, Job::Release)
                | (Self::Save, Job::Persist)
        )
    }
}

fn with_error(reply: Reply, error: Error) -> Reply {
    match reply {
        Reply::Stopped(_) => Reply::Stopped(Err(error)),
        Reply::Setpoint(_) => Reply::Setpoint(Err(error)),
        Reply::Saved(_) => Reply::Saved(Err(error)),
        _ => Reply::Ordered(Err(error)),
    }
}

/// What became of it, how often it was written, and whether a stop was.
fn carried_out(asked: Asked, fate: Fate) -> (Option<Became>, usize, bool) {
    let mut rig = Rig::ready();
    rig.drive.reference = Some(Frequency::from_hertz(10).into());
    match asked {
        Asked::Stop => rig.drive.run(),
        Asked::Reset => rig.drive.trip(9),
        _ => {}
    }
    rig.pass(1_500 * MS);
    rig.outputs.clear();
    rig.drive.log.clear();
    let id = match asked {
        Asked::Start => rig.order(START),
        Asked::Stop => rig.stop(StopMode::Ramp),
        Asked::Setpoint => rig.order(setpoint(30)),
        Asked::Reset => rig.order(Order::ResetFaults),
        Asked::Release => rig.order(Order::Release),
        Asked::Save => rig.order(Order::Persist),
    };
    let job = loop {
        match rig.machine.next(rig.now) {
            Step::Do { job, .. } if asked.is_it(job) => break job,
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.now += 20 * MS;
                rig.machine.handle_reply(rig.now, reply);
            }
            _ => panic!("{asked:?} is not sent"),
        }
    };
    let untouched = (rig.drive.status.clone(), rig.drive.lease, rig.drive.reference);
    let reply = rig.drive.answer(job);
    if !fate.is_carried_out() {
        (rig.drive.status, rig.drive.lease, rig.drive.reference) = untouched;
    }
    let reply = match fate.error() {
        Some(error) => with_error(reply, error),
        None => reply,
    };
    if fate == Fate::Mute {
        rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    }
    rig.now += 20 * MS;
    rig.machine.handle_lease(rig.drive.lease);
    rig.machine.handle_reply(rig.now, reply);
    rig.collect();
    rig.pass(70_000 * MS);
    let written = rig.drive.log.iter().filter(|job| asked.is_it(**job)).count();
    let stopped = rig.drive.log.iter().any(|job| matches!(job, Job::Stop(_)));
    (rig.outcome(id).map(Outcome::became), written, stopped)
}

#[test]
fn every_operation_ends_as_the_rules_of_motion_say_whatever_happens_to_it() {
    let mut wrong = Vec::new();
    for (asked, fate, became, times, stops) in TABLE {
        let (told, written, stopped) = carried_out(*asked, *fate);
        let as_often = match times {
            Times::Once => written == 1,
            Times::AtLeastOnce => written >= 1,
            Times::More => written > 1,
        };
        if told != Some(*became) || !as_often || stopped != *stops {
            wrong.push(format!(
                "{asked:?}, {fate:?}: {became:?}, {times:?}, a stop: {stops}; it is {told:?}, {written} times, a stop: {stopped}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_start_whose_answer_was_lost_is_not_confirmed_by_a_motor_that_turns_the_other_way() {
    let mut rig = Rig::ready();
    let id = rig.order(START);
    rig.drive.loses_answer = true;
    rig.drive.says = Some(Verdict::lacks(Lack::Reference, ANOTHER_WORD));
    rig.pass(5_000 * MS);
    assert_eq!(rig.outcome(id).map(Outcome::became), Some(Became::NotConfirmed));
    assert_eq!(rig.drive.writes(), [Job::Start(Direction::Forward), Job::Stop(StopMode::Ramp)]);
}

#[test]
fn an_order_given_during_the_exit_is_refused_and_a_watchdog_with_another_reaction_is_not_the_contracts() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.pass(1_000 * MS);
    rig.machine.handle_exit(rig.now, Policy::Exit);
    let late = rig.order(setpoint(20));
    rig.pass(100 * MS);
    assert_eq!(rig.outcome(late), Some(&Outcome::Refused(Refused::ShutDown)));

    let mut rig = Rig::controlled();
    rig.drive.run();
    rig.drive.watchdog = Watchdog { timeout: Some(CONTRACT.timeout), reaction: Some(Reaction::Ignore) };
    rig.pass(2_000 * MS);
    assert!(
        matches!(rig.snapshot().watchdog, crate::snapshot::WatchdogCheck::WaitsForStandstill(_)),
        "{:?}",
        rig.snapshot().watchdog
    );
}

#[test]
fn an_order_that_waited_is_sent_with_what_is_left_of_its_lifetime() {
    let mut rig = Rig::ready();
    rig.order(START);
    rig.now += 300 * MS;
    let lifetime = loop {
        match rig.machine.next(rig.now) {
            Step::Do { job: Job::Start(_), lifetime, .. } => break lifetime,
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
            step => panic!("{step:?}"),
        }
    };
    assert!(lifetime.is_some_and(|lifetime| lifetime <= 700 * MS), "{lifetime:?}");
}
