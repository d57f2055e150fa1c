//! What becomes of each operation, whatever happens to it: a table whose words come from the rules of motion, not from the code.
//! Rule 1: a stop is repeated until the drive shows it. Rule 2: nothing is sent late or twice. Rule 3: nothing is called done because
//! it was sent. Rule 5: a start that is not confirmed is taken back, and a run command that is not in force any more is withdrawn.
//! Rule 6: an edge is written once. Rule 9: a watchdog is what the contract says, or that is told. Rule 10: an EEPROM is not
//! written again and again. No operation but the stop of a group is ever broadcast: `tests/fleet_broadcasts.rs`.

use Became::{Confirmed, Expired, NotConfirmed, Refused as No, Unknown as Nobody};

use super::*;
use crate::outcome::Became;

/// What is asked, by somebody or by a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Start,
    Stop,
    Setpoint,
    Reset,
    Release,
    Save,
    /// Of a run command that stands while somebody else has control.
    Withdraw,
    /// The watchdog is set up as the contract says.
    Arm,
    /// At the exit it is put back to what was found.
    Restore,
}

/// What happens to the first attempt of it.
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
    /// It is answered, and the drive does not do it.
    Disobeyed,
    /// The drive trips by it, or just then.
    Trips,
    /// Somebody else takes control just then.
    ControlTaken,
    /// The motor turns the other way.
    OtherDirection,
}

use Asked::{Arm, Release, Reset, Restore, Save, Setpoint, Start, Stop, Withdraw};
use Fate::{
    AnswerLost, ControlTaken, Damaged, Disobeyed, Late, LostAndNotTaken, Mute, NeverSent, Obeyed,
    OtherDirection, Refused as Denied, Trips,
};

/// The columns.
const FATES: [Fate; 12] = [
    Obeyed,
    AnswerLost,
    LostAndNotTaken,
    NeverSent,
    Late,
    Denied,
    Damaged,
    Mute,
    Disobeyed,
    Trips,
    ControlTaken,
    OtherDirection,
];

/// How often something is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Times {
    Once,
    AtLeastOnce,
    More,
}

use Times::{AtLeastOnce, More, Once};

/// One cell.
#[derive(Debug, Clone, Copy)]
enum Cell {
    /// The word of its outcome, how often it is written, and whether a stop is.
    Ends(Became, Times, bool),
    /// The event that tells it, and how often it is written; no stop is.
    Tells(&'static str, Times),
    /// There is no such thing, because.
    Cannot(&'static str),
}

use Cell::{Cannot, Ends, Tells};

/// The events that tell what became of what nobody has asked for.
const VERIFIED: &str = "watchdog verified";
const BROKEN: &str = "watchdog broken";
const PUT_BACK: &str = "watchdog put back";
const STAYS: &str = "watchdog stays armed";
const STANDS: &str = "run command stands";
const LOST: &str = "lost";

const NO_MOTION: Cell = Cannot("it turns no motor");
const NO_LIFETIME: Cell = Cannot("it never expires");

const TABLE: [(Asked, [Cell; 12]); 9] = [
    (
        Start,
        [
            Ends(Confirmed, Once, false),
            Ends(Confirmed, Once, false),
            Ends(NotConfirmed, Once, true),
            Ends(No, Once, false),
            Ends(Expired, Once, false),
            Ends(No, Once, false),
            Ends(Confirmed, Once, false),
            // It may be on the line still, and is taken back all the same.
            Ends(Nobody, Once, true),
            Ends(NotConfirmed, Once, true),
            Ends(NotConfirmed, Once, true),
            Ends(NotConfirmed, Once, true),
            Ends(NotConfirmed, Once, true),
        ],
    ),
    (
        Stop,
        [
            Ends(Confirmed, Once, true),
            Ends(Confirmed, AtLeastOnce, true),
            Ends(Confirmed, More, true),
            Ends(Confirmed, More, true),
            Ends(Confirmed, More, true),
            // The second attempt is taken.
            Ends(Confirmed, More, true),
            Ends(Confirmed, AtLeastOnce, true),
            Ends(Nobody, More, true),
            Ends(Confirmed, More, true),
            // Its output is off, and no run command stands.
            Ends(Confirmed, Once, true),
            // The motor goes on by another's command.
            Ends(NotConfirmed, More, true),
            Cannot("it is stopped whichever way it turns"),
        ],
    ),
    (
        Setpoint,
        [
            Ends(Confirmed, Once, false),
            Ends(Confirmed, Once, false),
            Ends(NotConfirmed, Once, false),
            Ends(No, Once, false),
            Ends(Expired, Once, false),
            Ends(No, Once, false),
            Ends(Confirmed, Once, false),
            Ends(Nobody, Once, false),
            Ends(NotConfirmed, Once, false),
            // The drive holds it, and the trip is told as such.
            Ends(Confirmed, Once, false),
            // It holds the word, and follows another's.
            Ends(NotConfirmed, Once, false),
            Cannot("a setpoint has no direction"),
        ],
    ),
    (
        Reset,
        [
            Ends(Confirmed, Once, false),
            Ends(Confirmed, Once, false),
            Ends(NotConfirmed, Once, false),
            Ends(No, Once, false),
            Ends(Expired, Once, false),
            Ends(No, Once, false),
            Ends(Confirmed, Once, false),
            Ends(Nobody, Once, false),
            Ends(NotConfirmed, Once, false),
            // Its cause is not gone.
            Ends(NotConfirmed, Once, false),
            // The fault is gone; an Altivar 21 gives command back by it.
            Ends(Confirmed, Once, false),
            NO_MOTION,
        ],
    ),
    (
        Release,
        [
            Ends(Confirmed, Once, false),
            Ends(Confirmed, Once, false),
            Ends(NotConfirmed, Once, false),
            Ends(No, Once, false),
            Ends(Expired, Once, false),
            Ends(No, Once, false),
            Ends(Confirmed, Once, false),
            Ends(Nobody, Once, false),
            Ends(NotConfirmed, Once, false),
            Ends(Confirmed, Once, false),
            Cannot("it gives control away itself"),
            NO_MOTION,
        ],
    ),
    (
        Save,
        [
            Ends(Confirmed, Once, false),
            // An edge that cannot be read back.
            Ends(Nobody, Once, false),
            Ends(Nobody, Once, false),
            Ends(No, Once, false),
            Ends(Expired, Once, false),
            Ends(No, Once, false),
            Ends(Nobody, Once, false),
            Ends(Nobody, Once, false),
            Ends(NotConfirmed, Once, false),
            Ends(Confirmed, Once, false),
            Ends(Confirmed, Once, false),
            NO_MOTION,
        ],
    ),
    (
        Withdraw,
        [
            Ends(Confirmed, Once, false),
            Ends(Confirmed, AtLeastOnce, false),
            Ends(Confirmed, More, false),
            Ends(Confirmed, More, false),
            NO_LIFETIME,
            Ends(Confirmed, More, false),
            Ends(Confirmed, AtLeastOnce, false),
            Tells(STANDS, More),
            Ends(Confirmed, More, false),
            Ends(Confirmed, Once, false),
            Cannot("it is withdrawn because control was taken"),
            NO_MOTION,
        ],
    ),
    (
        Arm,
        [
            Tells(VERIFIED, Once),
            // It is read, and found so.
            Tells(VERIFIED, Once),
            Tells(VERIFIED, More),
            Tells(VERIFIED, More),
            Tells(VERIFIED, More),
            Tells(VERIFIED, More),
            Tells(VERIFIED, Once),
            Tells(LOST, Once),
            // It may wear an EEPROM, and is not tried again.
            Tells(BROKEN, Once),
            Tells(VERIFIED, Once),
            Tells(VERIFIED, Once),
            NO_MOTION,
        ],
    ),
    (
        Restore,
        [
            Tells(PUT_BACK, Once),
            Tells(PUT_BACK, More),
            Tells(PUT_BACK, More),
            Tells(PUT_BACK, More),
            Tells(PUT_BACK, More),
            Tells(STAYS, Once),
            Tells(PUT_BACK, More),
            Tells(STAYS, More),
            Tells(STAYS, Once),
            Tells(PUT_BACK, Once),
            Tells(PUT_BACK, Once),
            NO_MOTION,
        ],
    ),
];

impl Fate {
    /// The error of the first call, where it is one of the line or of the drive's own.
    fn error(self) -> Option<Error> {
        Some(match self {
            AnswerLost | LostAndNotTaken | Mute => port_error(PortError::OutcomeUnknown("no answer")),
            NeverSent => port_error(PortError::LineDown("unplugged".to_owned())),
            Late => port_error(PortError::Expired),
            Denied => not_now(8501),
            Damaged => port_error(PortError::OutcomeUnknown("a damaged answer")),
            Obeyed | Disobeyed | Trips | ControlTaken | OtherDirection => return None,
        })
    }

    const fn is_carried_out(self) -> bool {
        !matches!(self, LostAndNotTaken | NeverSent | Late | Denied | Disobeyed)
    }

    /// What keeps this from being in force then, as a family says it, where something does.
    const fn keeps(self, asked: Asked) -> Option<Refusal> {
        match (self, asked) {
            (Disobeyed, _) => Some(Refusal::State(State::Ready)),
            (Trips, Start | Reset) => Some(Refusal::Tripped),
            (ControlTaken, Start | Stop | Setpoint) => Some(Refusal::NotInControl(Control::Terminals)),
            (OtherDirection, Start) => Some(ANOTHER_WORD),
            _ => None,
        }
    }
}

impl Asked {
    const fn is_it(self, job: Job) -> bool {
        matches!(
            (self, job),
            (Start, Job::Start(_))
                | (Stop, Job::Stop(_))
                | (Setpoint, Job::SetSetpoint(..))
                | (Reset, Job::ResetFaults)
                | (Release, Job::Release)
                | (Save, Job::Persist)
                | (Withdraw, Job::Withdraw)
                | (Arm, Job::ArmWatchdog(..))
                | (Restore, Job::RestoreWatchdog(_))
        )
    }

    /// A drive of which it is asked, and the call that waits for its outcome.
    fn asked(self) -> (Rig, Option<CallId>) {
        let mut rig = Rig::controlled();
        if self == Arm {
            return (rig, None);
        }
        rig.drive.reference = Some(Frequency::from_hertz(10).into());
        match self {
            Stop => rig.drive.run(),
            Reset => rig.drive.trip(9),
            _ => {}
        }
        rig.pass(1_500 * MS);
        if self == Withdraw {
            rig.order(START);
            rig.pass(1_000 * MS);
            rig.drive.stand();
            rig.drive.status.control = Some(Control::Terminals);
        }
        rig.outputs.clear();
        rig.drive.log.clear();
        let id = match self {
            Start => rig.order(START),
            Stop => rig.stop(StopMode::Ramp),
            Setpoint => rig.order(setpoint(30)),
            Reset => rig.order(Order::ResetFaults),
            Release => rig.order(Order::Release),
            Save => rig.order(Order::Persist),
            Restore => {
                rig.machine.handle_exit(rig.now, Policy::Exit);
                return (rig, None);
            }
            Withdraw | Arm => return (rig, None),
        };
        (rig, Some(id))
    }
}

fn with_error(reply: Reply, error: Error) -> Reply {
    match reply {
        Reply::Stopped(_) => Reply::Stopped(Err(error)),
        Reply::Setpoint(_) => Reply::Setpoint(Err(error)),
        Reply::Saved(_) => Reply::Saved(Err(error)),
        Reply::Withdrawn(_) => Reply::Withdrawn(Err(error)),
        Reply::Watchdog(_) => Reply::Watchdog(Err(error)),
        _ => Reply::Ordered(Err(error)),
    }
}

/// What the first attempt of it gives, and the drive behind it.
fn first(rig: &mut Rig, asked: Asked, fate: Fate, job: Job) -> Reply {
    let drive = &mut rig.drive;
    let untouched = (drive.status.clone(), drive.lease, drive.reference, drive.watchdog);
    let reply = drive.answer(job);
    if !fate.is_carried_out() {
        (drive.status, drive.lease, drive.reference, drive.watchdog) = untouched;
    }
    match fate {
        Mute => drive.failing = Some(PortError::Timeout { after: 100 * MS }),
        Trips => drive.trip(9),
        ControlTaken => {
            drive.status.control = Some(Control::Terminals);
            match asked {
                Start => drive.stand(),
                Stop => drive.run(),
                _ => {}
            }
            drive.denies_stops = (asked == Stop).then_some(Some(Refusal::NotInControl(Control::Terminals)));
        }
        OtherDirection => drive.says = Some(Verdict::lacks(Lack::Reference, ANOTHER_WORD)),
        _ => {}
    }
    if let Some(error) = fate.error() {
        return with_error(reply, error);
    }
    let watchdog = drive.watchdog;
    let status = drive.status.clone();
    match (fate.keeps(asked), reply) {
        // What is read back is what is told of it.
        (Some(_), Reply::Watchdog(_)) => Reply::Watchdog(Ok(watchdog)),
        (Some(because), reply) => {
            let (slave, command) = (slave(), Command::Configure("this"));
            let (status, because) = (Box::new(status), Some(because));
            with_error(reply, Error::NotConfirmed { slave, command, status, because })
        }
        (None, Reply::Stopped(_)) => Reply::Stopped(Ok(Stopped::by(StopMode::Ramp, status))),
        (None, Reply::Ordered(_)) => Reply::Ordered(Ok(status)),
        (None, reply) => reply,
    }
}

/// What happened, how often it was written, and whether a stop was.
fn carried_out(asked: Asked, fate: Fate) -> (Rig, Option<CallId>, usize, bool) {
    let (mut rig, id) = asked.asked();
    let job = loop {
        match rig.next() {
            Step::Do { job, .. } if asked.is_it(job) => break job,
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.now += 20 * MS;
                rig.machine.handle_lease(rig.drive.lease);
                rig.machine.handle_reply(rig.now, reply);
            }
            Step::Wait(_) if rig.machine.turn() == Turn::Wanted => rig.machine.grant_turn(),
            Step::Wait(at) => rig.now = at.max(rig.now + MS),
            Step::Finished => panic!("{asked:?} is not sent"),
        }
    };
    let reply = first(&mut rig, asked, fate, job);
    rig.now += 20 * MS;
    rig.machine.handle_lease(rig.drive.lease);
    rig.machine.handle_reply(rig.now, reply);
    rig.collect();
    rig.pass(70_000 * MS);
    let written = rig.drive.log.iter().filter(|job| asked.is_it(**job)).count();
    let stopped = rig.drive.log.iter().any(|job| matches!(job, Job::Stop(_)));
    (rig, id, written, stopped)
}

/// How the command of a rule has ended.
fn withdrawal(rig: &Rig) -> Option<Became> {
    rig.happened()
        .filter_map(|happened| match &happened.kind {
            EventKind::Command { command: Command::Withdraw, outcome, .. } => Some(outcome.became()),
            _ => None,
        })
        .last()
}

#[test]
fn every_operation_ends_as_the_rules_of_motion_say_whatever_happens_to_it() {
    let mut wrong = Vec::new();
    for (asked, cells) in TABLE {
        for (fate, cell) in FATES.into_iter().zip(cells) {
            let (times, stops) = match cell {
                Ends(_, times, stops) => (times, stops),
                Tells(_, times) => (times, false),
                Cannot(why) => {
                    assert!(!why.is_empty(), "{asked:?}, {fate:?}: why not?");
                    continue;
                }
            };
            let (rig, id, written, stopped) = carried_out(asked, fate);
            let is_told = match cell {
                Ends(became, ..) => {
                    let told = match id {
                        Some(id) => rig.outcome(id).map(Outcome::became),
                        None => withdrawal(&rig),
                    };
                    told == Some(became)
                }
                Tells(event, _) => {
                    // Nothing else tells another end of it.
                    let others = [VERIFIED, BROKEN, PUT_BACK, STAYS, STANDS];
                    let told = rig.events();
                    told.contains(&event)
                        && others.iter().all(|other| *other == event || !told.contains(other))
                }
                Cannot(_) => true,
            };
            let as_often = match times {
                Once => written == 1,
                AtLeastOnce => written >= 1,
                More => written > 1,
            };
            if !is_told || !as_often || stopped != stops {
                wrong.push(format!(
                    "{asked:?}, {fate:?}: {cell:?}; {written} times, a stop: {stopped}, {:?}, {:?}",
                    id.and_then(|id| rig.outcome(id)),
                    rig.events()
                ));
            }
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
        match rig.next() {
            Step::Do { job: Job::Start(_), lifetime, .. } => break lifetime,
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
            step => panic!("{step:?}"),
        }
    };
    assert!(lifetime.call.is_some_and(|lifetime| lifetime <= 700 * MS), "{lifetime:?}");
    // What follows the first word has 2 s more, where nobody has said a time.
    assert!(lifetime.all.is_some_and(|lifetime| lifetime <= 2_700 * MS), "{lifetime:?}");
}
