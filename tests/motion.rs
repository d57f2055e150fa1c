//! Starts and stops in every family in whose midst the line fails, the drive is busy, the caller gives up, somebody else
//! stops the motor, or a start comes that was late: between any two of their exchanges.

use std::time::Duration;

use drive_core::{Direction, Drive, Error, ErrorKind, Frequency, SlaveAddress, Status, StopMode};
use drive_families::Family;
use drive_testing::{
    bench,
    rig::{ADDRESS, Rig},
    truth::contradiction,
};
use support::{
    contracts::contract,
    drives,
    interrupted::{Event, Interrupted},
};
use tokio::time::{Instant, sleep};
use tokio_modbus::Request;

/// More exchanges than a start or a stop has.
const MANY: usize = 100;

/// Longer than any ramp here.
const A_RAMP: Duration = Duration::from_secs(20);

/// The register of the control word, a run command, and the bits that tell it from the other words.
fn run_command(family: Family) -> (u16, u16, u16) {
    match drives::five(family) {
        drives::Five::Atv21 => (0xFA00, 0xC400, 0x0400),
        drives::Five::Atv28 | drives::Five::Atv58 => (400, 0x000F, 0x700F),
        drives::Five::Atv312 => (8501, 0x000F, 0x700F),
        drives::Five::Omron3g3ev => (0x0001, 0x0001, 0x0001),
    }
}

/// What a start or a stop meets in front of one of its exchanges.
const FAILURES: [fn() -> Event; 2] = [|| Event::Expiry, || Event::Busy];

/// A rig whose motor stands ready to run at 25 Hz, and another driver of its drive on a port where something may happen.
async fn ready(family: Family) -> (Rig, Box<dyn Drive>, Interrupted) {
    let mut rig = contract(family).rig();
    rig.drive.set_setpoint(Frequency::from_hertz(25).into()).await.expect("it takes 25 Hz");
    let port = Interrupted::new(rig.line.slave(ADDRESS));
    let drive = another(family, port.clone());
    (rig, drive, port)
}

fn another(family: Family, port: Interrupted) -> Box<dyn Drive> {
    drives::drive(family, port, SlaveAddress::try_from(ADDRESS).expect("it is one"))
}

/// Whether a run command was ever written.
fn is_run_given(family: Family, rig: &Rig) -> bool {
    let (register, word, mask) = run_command(family);
    bench::written(&rig.machine, register).iter().any(|written| written & mask == word & mask)
}

/// Whether the motor runs when any ramp is over.
async fn runs(rig: &mut Rig) -> bool {
    // Its words are not judged: of a motor that another has started and stopped meanwhile nobody here has seen that it ran.
    let end = Instant::now() + A_RAMP;
    while Instant::now() < end {
        rig.drive.status().await.expect("it answers");
        sleep(Duration::from_millis(50)).await;
    }
    rig.machine.observe().running
}

#[tokio::test(start_paused = true)]
async fn a_start_that_fails_behind_its_run_command_is_unknown_and_one_that_fails_before_starts_nothing() {
    for family in Family::BUILT_IN {
        for failure in FAILURES {
            let mut unknown = 0;
            for exchanges in 0..MANY {
                let (mut rig, mut drive, port) = ready(family).await;
                port.after(exchanges, failure());
                let outcome = drive.start(Direction::Forward).await;
                if port.calm().is_none() {
                    outcome.expect("nothing has happened");
                    break;
                }
                let Err(error) = outcome else { continue };
                if is_run_given(family, &rig) {
                    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{family}, {exchanges}: {error}");
                    unknown += 1;
                } else {
                    assert!(!runs(&mut rig).await, "{family}, {exchanges}: {error}");
                }
            }
            assert!(unknown > 0, "{family}");
        }
    }
}

/// A start at a setpoint, as a fleet gives it: whoever would refuse it is not given its setpoint.
async fn start_at(rig: &mut Rig, direction: Direction, hertz: u16) -> Result<Status, Error> {
    let setpoint = Frequency::from_hertz(hertz).into();
    rig.drive.may_start(direction, Some(setpoint)).await?;
    rig.drive.set_setpoint(setpoint).await?;
    rig.drive.start(direction).await
}

/// The register of the setpoint.
fn setpoint_register(family: Family) -> u16 {
    match drives::five(family) {
        drives::Five::Atv21 => 0xFA01,
        drives::Five::Atv28 | drives::Five::Atv58 => 401,
        drives::Five::Atv312 => 8502,
        drives::Five::Omron3g3ev => 0x0002,
    }
}

/// What stands in the way of a start, as lines of the simulator's text, and the direction of that start. In all but the trips a motor
/// runs, at 20 Hz, by somebody else.
const REFUSED: &[(Family, Direction, &[&str])] = &[
    // §6.2 p. 12: the terminals command, the bus gives the reference.
    (Family::ATV21, Direction::Forward, &["set CMOD 0", "set FMOD 4", "master FA01 2000", "terminal F on"]),
    (Family::ATV21, Direction::Forward, &["trip 000Eh"]),
    // A reference of another master, the other way round.
    (
        Family::ATV28,
        Direction::Forward,
        &["master LFr -20", "master CMD 0006h", "master CMD 0007h", "master CMD 000Fh"],
    ),
    (Family::ATV28, Direction::Forward, &["trip 17"]),
    (
        Family::ATV58,
        Direction::Forward,
        &["master W401 FF38h", "master CMD 0006h", "master CMD 0007h", "master CMD 000Fh"],
    ),
    (Family::ATV58, Direction::Forward, &["trip 2"]),
    // BBV51701 p. 14, 15: the command channel is the terminals, the reference channel is Modbus.
    (Family::ATV312, Direction::Forward, &["set Cd1 1", "master LFr 20", "terminal LI1 on"]),
    (
        Family::ATV312,
        Direction::Forward,
        &["master LFr -20", "master CMD 0006h", "master CMD 0007h", "master CMD 000Fh"],
    ),
    (Family::ATV312, Direction::Forward, &["trip 17"]),
    // §2.1: n02 = 4 takes commands from the terminals and the reference from the bus; n05 = 1 forbids reverse.
    (
        Family::OMRON_3G3EV,
        Direction::Forward,
        &["set n02 4", "power cycle", "master 0002h 200", "terminal SF on"],
    ),
    (Family::OMRON_3G3EV, Direction::Reverse, &["set n05 1", "master 0002h 200", "master 0001h 1"]),
    (Family::OMRON_3G3EV, Direction::Forward, &["trip 9"]),
];

#[tokio::test(start_paused = true)]
async fn a_start_that_is_refused_changes_neither_the_setpoint_nor_the_speed_of_a_motor_that_runs() {
    for (family, direction, deeds) in REFUSED {
        let mut rig = contract(*family).rig();
        rig.drive.status().await.expect("it answers");
        for deed in *deeds {
            let told = rig.simulated.control(&format!("{} {deed}", rig.machine.name()));
            told.unwrap_or_else(|error| panic!("{family}: {deed}: {error}"));
        }
        // It is polled, so that no watchdog trips.
        runs(&mut rig).await;
        let given = |rig: &Rig| bench::written(&rig.machine, setpoint_register(*family));
        let (before, setpoints) = (rig.machine.observe(), given(&rig));
        let is_tripped = deeds.iter().any(|deed| deed.starts_with("trip"));
        let turns = if is_tripped { 0 } else { 2_000 };
        assert_eq!(before.output_frequency.abs(), turns, "{family}: {deeds:?}");
        let refused = start_at(&mut rig, *direction, 40).await.expect_err("it would not come into force");
        assert_eq!(refused.kind(), ErrorKind::Refused, "{family}: {deeds:?}: {refused}");
        assert_eq!(given(&rig), setpoints, "{family}: {deeds:?}");
        runs(&mut rig).await;
        let after = rig.machine.observe();
        assert_eq!(after.output_frequency, before.output_frequency, "{family}: {deeds:?}: {refused}");
        // It is the judgement of the start itself.
        let start = rig.drive.start(*direction).await.expect_err("it is refused too");
        assert_eq!(start, refused, "{family}: {deeds:?}");
    }
}

/// A sign that somebody else left in the reference of a motor at rest: a setpoint takes it away, so that the start which it belongs to
/// is not refused for it.
#[tokio::test(start_paused = true)]
async fn a_start_is_not_refused_for_a_sign_that_its_own_setpoint_takes_away() {
    for (family, negative) in
        [(Family::ATV28, "LFr -20"), (Family::ATV58, "W401 FF38h"), (Family::ATV312, "LFr -20")]
    {
        let mut rig = contract(family).rig();
        let told = rig.simulated.control(&format!("{} master {negative}", rig.machine.name()));
        told.unwrap_or_else(|error| panic!("{family}: {error}"));
        rig.drive.may_start(Direction::Forward, None).await.expect_err("as it stands");
        start_at(&mut rig, Direction::Forward, 40).await.unwrap_or_else(|error| panic!("{family}: {error}"));
        runs(&mut rig).await;
        assert_eq!(rig.machine.observe().output_frequency, 4_000, "{family}");
    }
    // Of the two references of an Altivar 28 it takes one away, and the other stays.
    let mut rig = contract(Family::ATV28).rig();
    let told = rig.simulated.control(&format!("{} master LFRD -600", rig.machine.name()));
    told.expect("it takes a speed");
    rig.drive.set_setpoint(Frequency::from_hertz(40).into()).await.ok();
    rig.drive.start(Direction::Forward).await.expect_err("the speed turns the other way");
    assert!(!runs(&mut rig).await);
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_fails_behind_its_word_is_unknown_and_has_stopped_the_motor() {
    for family in Family::BUILT_IN {
        let (register, ..) = run_command(family);
        for failure in FAILURES {
            let mut unknown = 0;
            for exchanges in 0..MANY {
                let (mut rig, mut drive, port) = ready(family).await;
                drive.start(Direction::Forward).await.expect("it starts");
                let before = bench::written(&rig.machine, register).len();
                port.after(exchanges, failure());
                let outcome = drive.stop(StopMode::Ramp).await;
                if port.calm().is_none() {
                    outcome.expect("nothing has happened");
                    break;
                }
                let Err(error) = outcome else { continue };
                if bench::written(&rig.machine, register).len() > before {
                    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{family}, {exchanges}: {error}");
                    assert!(!runs(&mut rig).await, "{family}, {exchanges}");
                    unknown += 1;
                }
            }
            assert!(unknown > 0, "{family}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_whose_caller_gives_up_moves_nothing_before_its_run_command_and_is_stopped_after_it() {
    for family in Family::BUILT_IN {
        for exchanges in 0..MANY {
            let (mut rig, mut drive, port) = ready(family).await;
            port.after(exchanges, Event::Silence);
            let start = drive.start(Direction::Forward);
            let ended = tokio::time::timeout(Duration::from_secs(1), start).await;
            if port.calm().is_none() {
                ended.expect("nothing holds it up").expect("nothing has happened");
                break;
            }
            let given = is_run_given(family, &rig);
            assert_eq!(runs(&mut rig).await, given, "{family}, {exchanges}");
            drive.stop(StopMode::Ramp).await.expect("it stops");
            assert!(!runs(&mut rig).await, "{family}, {exchanges}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_neither_undoes_nor_hides_a_stop_that_somebody_else_gives_on_its_way() {
    for family in Family::BUILT_IN {
        let modes = [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel];
        let has = |mode: &StopMode| family.capabilities().stop_modes.contains(mode);
        for mode in modes.into_iter().filter(has) {
            for exchanges in 0..MANY {
                let (mut rig, mut drive, port) = ready(family).await;
                let somebody = another(family, Interrupted::new(rig.line.slave(ADDRESS)));
                port.after(exchanges, Event::Stop(somebody, mode));
                let outcome = drive.start(Direction::Forward).await;
                if port.calm().is_none() {
                    outcome.expect("nothing has happened");
                    break;
                }
                let words = bench::written(&rig.machine, run_command(family).0);
                assert!(outcome.is_err(), "{family}, {mode}, {exchanges}: {words:04X?}");
                assert!(!runs(&mut rig).await, "{family}, {mode}, {exchanges}: {words:04X?}");
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn whatever_is_ordered_behind_somebody_elses_stop_is_no_part_of_the_order_before() {
    for family in Family::BUILT_IN {
        let (mut rig, mut drive, _) = ready(family).await;
        drive.start(Direction::Forward).await.expect("it starts");
        let mut somebody = another(family, Interrupted::new(rig.line.slave(ADDRESS)));
        somebody.stop(StopMode::Freewheel).await.expect("it stops");
        assert!(!runs(&mut rig).await, "{family}");

        let ten = Frequency::from_hertz(10).into();
        drive.set_setpoint(ten).await.unwrap_or_else(|error| panic!("{family}: {error}"));
        drive.withdraw().await.unwrap_or_else(|error| panic!("{family}: {error}"));
        drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{family}: {error}"));
        drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{family}: {error}"));
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_not_confirmed_while_a_start_that_came_late_runs_the_motor() {
    for family in Family::BUILT_IN {
        let (register, run, _) = run_command(family);
        for exchanges in 1..MANY {
            let (mut rig, mut drive, port) = ready(family).await;
            drive.start(Direction::Forward).await.expect("it starts");
            let late = match drives::five(family) {
                drives::Five::Omron3g3ev => Request::WriteMultipleRegisters(register, vec![run].into()),
                _ => Request::WriteSingleRegister(register, run),
            };
            port.after(exchanges, Event::Late(late));
            drive.stop(StopMode::Ramp).await.expect("it stops");
            if port.calm().is_none() {
                break;
            }
            assert!(!runs(&mut rig).await, "{family}, {exchanges}");
        }
    }
}

/// The words of one status are of different moments where it takes more than one exchange: an Altivar 21 was told at rest at its full
/// speed.
#[tokio::test(start_paused = true)]
async fn a_motor_that_is_let_coast_or_trips_between_any_two_exchanges_behind_its_stop_is_not_told_at_rest() {
    for family in Family::BUILT_IN {
        let lets_go = family.capabilities().stop_modes.contains(&StopMode::Freewheel);
        for (mode, trips) in [(StopMode::Freewheel, false), (StopMode::Ramp, true)] {
            for late in 0..20 {
                if mode == StopMode::Freewheel && !lets_go {
                    break;
                }
                let (rig, mut drive, port) = ready(family).await;
                drive.start(Direction::Forward).await.expect("it starts");
                let end = Instant::now() + A_RAMP;
                while Instant::now() < end {
                    drive.status().await.expect("it answers");
                    sleep(Duration::from_millis(100)).await;
                }
                let machine = rig.machine.clone();
                let trip = move || {
                    if trips {
                        machine.trip(drives::a_trip(family));
                    }
                };
                port.after(0, Event::Slow(late, Box::new(trip)));
                let mut told = drive.stop(mode).await.map(|stopped| stopped.status);
                for _ in 0..40 {
                    let Ok(status) = &told else { panic!("{family}, {mode}, {late}: {told:?}") };
                    let against = contradiction(status, &rig.machine.observe());
                    assert_eq!(against, None, "{family}, {mode}, {late}");
                    sleep(Duration::from_millis(100)).await;
                    told = drive.status().await;
                }
                assert!(!port.keeps(), "{family}, {mode}, {late}");
            }
        }
    }
}
