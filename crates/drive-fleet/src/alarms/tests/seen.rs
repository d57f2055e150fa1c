//! What is seen of a drive and of a line.

use std::{sync::Arc, time::Duration};

use drive_core::{Error, Exchange, Motion, PortError, SlaveAddress, State, Status};
use tokio::time::Instant;

use super::*;
use crate::snapshot::{Counters, IdentityCheck, Link, Snapshot, Timed, WatchdogCheck};

/// A drive that answers and shows this state.
fn showing(state: State, motion: Motion, now: Instant) -> Snapshot {
    let status = Status { state, motion, at: Some(now), ..Status::default() };
    Snapshot {
        name: "pump 1".into(),
        link: Link::Connected,
        error: None,
        status: Some(Timed { value: Arc::new(status), at: now }),
        retracted: false,
        measurements: None,
        setpoint: None,
        identity: IdentityCheck::CannotSay,
        watchdog: WatchdogCheck::NoContract { found: None },
        self_restarts: None,
        restarts_accepted: true,
        control_taken: None,
        run_command_stands: None,
        eeprom_worn: None,
        exceeded: Vec::new(),
        unmet: None,
        off_setpoint: None,
        stop: None,
        lease: None,
        suspended: None,
        start_refused: None,
        trips: Arc::default(),
        counters: Counters::default(),
        since: Vec::new(),
        max_age: Duration::from_secs(3),
        measurements_max_age: Duration::from_secs(13),
    }
}

fn moment(at: Instant) -> Moment {
    Moment { at, unix_ms: 1_700_000_000_000 }
}

fn lost(mut drive: Snapshot) -> Snapshot {
    drive.link = Link::Lost;
    drive.error = Some(Error::Unsupported { what: "a test", reason: "it is one" });
    drive
}

/// The program before had an alarm of this kind.
fn with(kind: ConcernKind) -> Alarms {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[AlarmKind::Drive(kind)])], 10);
    alarms
}

fn is_active(alarms: &Alarms, kind: ConcernKind) -> bool {
    alarms.all().iter().any(|alarm| alarm.kind == AlarmKind::Drive(kind) && alarm.is_active())
}

#[test]
fn a_motor_that_was_stopping_when_it_was_lost_may_turn_until_it_is_seen_again() {
    let now = Instant::now();
    for state in [State::Running, State::Stopping, State::QuickStop] {
        let mut alarms = Alarms::default();
        let drive = lost(showing(state, Motion::Braking, now));
        for hours in 0..24 {
            let later = now + Duration::from_secs(hours * 3_600);
            alarms.look(&[Look::at_drive("north", &drive, moment(later))], hours * HOUR);
            assert!(is_active(&alarms, ConcernKind::LostRunning), "{state} after {hours} h");
        }
        let back = showing(State::Ready, Motion::AtRest, now);
        alarms.look(&[Look::at_drive("north", &back, moment(now))], 24 * HOUR);
        assert_eq!(states(&alarms), [(LOST_RUNNING, AlarmState::Returned)], "{state}");
    }
}

/// Which question ends in which error, and when the next one is due, is of the line: nothing of it is news of the drive.
#[test]
fn a_loss_is_one_text_for_as_long_as_its_cause_is_the_same() {
    let (now, mut alarms) = (Instant::now(), Alarms::default());
    let silent = |milliseconds| PortError::Timeout { after: Duration::from_millis(milliseconds) };
    let off_line = |milliseconds| PortError::Offline { retry_in: Duration::from_millis(milliseconds) };
    let mut told = |problem: PortError| {
        let mut drive = lost(showing(State::Running, Motion::Driven, now));
        let exchange = Exchange { function: 3, register: Some(3201) };
        drive.error = Some(Error::Port { slave: SlaveAddress::try_from(7).unwrap(), exchange, problem });
        let changes = alarms.look(&[Look::at_drive("north", &drive, moment(now))], 10);
        changes.into_iter().map(|change| change.alarm.detail.unwrap()).collect::<Vec<_>>()
    };
    let head = "slave 7, reading register 3201 (0C81h): ";
    assert_eq!(told(PortError::Expired), [format!("{head}expired before it was sent")]);
    assert_eq!(told(silent(100)), [format!("{head}no answer within 100 ms")], "that is more than was known");
    for problem in [off_line(4_100), off_line(3_100), off_line(0), PortError::Expired, silent(112)] {
        assert_eq!(told(problem.clone()), [""; 0], "{problem}");
    }
    let damaged = PortError::Damaged("CRC");
    assert_eq!(told(damaged.clone()), [format!("{head}the answer was damaged (CRC)")]);
    assert_eq!(told(damaged), [""; 0]);
    assert_eq!(told(off_line(2_000)), [format!("{head}the slave is off-line")]);
    assert_eq!(told(off_line(1_900)), [""; 0]);
}

#[test]
fn a_program_that_was_started_anew_ends_nothing_before_the_drive_has_shown_it() {
    let now = Instant::now();
    let mut unseen = showing(State::Ready, Motion::AtRest, now);
    (unseen.link, unseen.status) = (Link::Connecting, None);
    for kind in ConcernKind::ALL.iter().filter(|kind| kind.severity().is_trouble()) {
        let mut alarms = with(*kind);
        alarms.look(&[Look::at_drive("north", &unseen, moment(now))], 20);
        assert!(is_active(&alarms, *kind), "{kind:?}");
    }
    let mut found = showing(State::Running, Motion::Driven, now);
    (found.identity, found.watchdog) = (IdentityCheck::Unchecked, WatchdogCheck::Unchecked);
    for kind in [
        ConcernKind::StopUnconfirmed,
        ConcernKind::IdentityChanged,
        ConcernKind::OtherFamily,
        ConcernKind::WatchdogBroken,
        ConcernKind::RestartsItself,
        ConcernKind::LimitExceeded,
        ConcernKind::Warning,
    ] {
        let mut alarms = with(kind);
        alarms.look(&[Look::at_drive("north", &found, moment(now))], 20);
        assert!(is_active(&alarms, kind), "{kind:?}: it has not been looked at yet");
    }
    let mut alarms = with(ConcernKind::StopUnconfirmed);
    let stands = showing(State::Ready, Motion::AtRest, now);
    alarms.look(&[Look::at_drive("north", &stands, moment(now))], 20);
    assert!(!is_active(&alarms, ConcernKind::StopUnconfirmed));
}

#[test]
fn of_a_drive_that_names_another_fault_than_was_acknowledged_somebody_is_told() {
    let now = Instant::now();
    let by = |code| {
        let mut drive = showing(State::Fault, Motion::AtRest, now);
        let status = drive.status.as_mut().unwrap();
        status.value = Arc::new(Status { fault_code: Some(code), ..Status::clone(&status.value) });
        Look::at_drive("north", &drive, moment(now))
    };
    let mut alarms = Alarms::default();
    alarms.look(&[by(5)], 10);
    alarms.acknowledge(alarms.all()[0].id, "Anna", None, 20).unwrap();
    assert_eq!(became(&alarms.look(&[by(5)], 30)), []);
    assert_eq!(became(&alarms.look(&[by(9)], 40)), [Became::CameAgain]);
    assert_eq!(alarms.all()[0].detail.as_deref(), Some("fault 9"));
}

#[test]
fn a_trip_of_a_drive_that_is_lost_stands_until_it_is_seen_without_it() {
    let now = Instant::now();
    let mut alarms = Alarms::default();
    let tripped = showing(State::Fault, Motion::AtRest, now);
    alarms.look(&[Look::at_drive("north", &tripped, moment(now))], 10);
    alarms.look(&[Look::at_drive("north", &lost(tripped), moment(now))], 20);
    assert!(is_active(&alarms, ConcernKind::Tripped) && is_active(&alarms, ConcernKind::Lost));
    let reset = showing(State::Ready, Motion::AtRest, now);
    alarms.look(&[Look::at_drive("north", &reset, moment(now))], 30);
    assert!(!is_active(&alarms, ConcernKind::Tripped) && !is_active(&alarms, ConcernKind::Lost));
}

#[test]
fn a_drive_that_was_never_seen_is_an_alarm_after_a_minute() {
    let now = Instant::now();
    let mut drive = lost(showing(State::Ready, Motion::AtRest, now));
    (drive.link, drive.status) = (Link::Connecting, None);
    drive.since = vec![(ConcernKind::NeverSeen, now)];
    let mut alarms = Alarms::default();
    let after = |seconds| moment(now + Duration::from_secs(seconds));
    alarms.look(&[Look::at_drive("north", &drive, after(59))], 10);
    assert_eq!(alarms.all(), []);
    alarms.look(&[Look::at_drive("north", &drive, after(61))], 20);
    assert!(is_active(&alarms, ConcernKind::NeverSeen));
}

#[test]
fn a_shaft_that_direct_current_holds_for_longer_than_any_stop_of_here_is_an_alarm() {
    let now = Instant::now();
    let mut drive = showing(State::Stopping, Motion::Held, now);
    drive.since = vec![(ConcernKind::Held, now)];
    // The longest time for which anybody can have it injected here.
    for (seconds, is_alarm) in [(29, false), (31, true)] {
        let at = now + Duration::from_secs(seconds);
        drive.status = showing(State::Stopping, Motion::Held, at).status;
        let mut alarms = Alarms::default();
        alarms.look(&[Look::at_drive("north", &drive, moment(at))], 10);
        assert_eq!(is_active(&alarms, ConcernKind::Held), is_alarm, "after {seconds} s");
    }
}

#[test]
fn a_line_is_silent_when_nobody_of_several_answers_and_back_when_one_does() {
    let now = Instant::now();
    let (dead, living) =
        (lost(showing(State::Ready, Motion::AtRest, now)), showing(State::Ready, Motion::AtRest, now));
    let seen = LineSeen::default();
    let kinds = |drives: &[&Snapshot], seen: &LineSeen<'_>| {
        let look = Look::at_line("north", drives, seen, moment(now));
        let there: Vec<AlarmKind> = look.there.iter().map(|there| there.kind).collect();
        (there, look.seen.contains(&AlarmKind::LineSilent))
    };
    assert_eq!(kinds(&[&dead, &dead], &seen), (vec![AlarmKind::LineSilent], false));
    assert_eq!(kinds(&[&dead, &living], &seen), (vec![], true));
    assert_eq!(kinds(&[&dead], &seen), (vec![], true), "a drive alone is one alarm");
    let mut unasked = dead.clone();
    (unasked.link, unasked.error) = (Link::Connecting, None);
    assert_eq!(kinds(&[&dead, &unasked], &seen), (vec![], false), "it is not known yet");
    let away = LineSeen { away: Some("no such device".to_owned()), findings: None };
    assert_eq!(kinds(&[&dead, &dead], &away), (vec![AlarmKind::LineAway], false));
}

#[test]
fn a_drive_that_answers_by_exceptions_does_not_count_as_silent() {
    let now = Instant::now();
    let mut alarms = Alarms::default();
    let slave = drive_core::SlaveAddress::try_from(1).unwrap();
    let exchange = drive_core::Exchange { function: 3, register: Some(3201) };
    let meaning = drive_core::ExceptionMeaning::NoSuchRegister;
    let silent = lost(showing(State::Ready, Motion::AtRest, now));
    let error = Some(Error::Exception { slave, exchange, code: 2, meaning });
    let refusing = Snapshot { error, ..silent.clone() };
    alarms.look(&[Look::at_drive("north", &silent, moment(now))], 10);
    alarms.look(&[Look::at_drive("north", &refusing, moment(now))], 20);
    assert!(!is_active(&alarms, ConcernKind::Lost) && is_active(&alarms, ConcernKind::Refuses));
    let line = Look::at_line("north", &[&silent, &refusing], &LineSeen::default(), moment(now));
    assert!(line.there.is_empty() && line.seen.contains(&AlarmKind::LineSilent), "{line:?}");
    alarms.look(&[Look::at_drive("north", &silent, moment(now))], 30);
    assert!(is_active(&alarms, ConcernKind::Lost) && !is_active(&alarms, ConcernKind::Refuses));
}

#[test]
fn a_port_that_is_opened_anew_because_nobody_answers_is_not_away() {
    let mut stats = drive_bus::stats::Stats::default();
    assert_eq!(stats.port_known_away(), None, "it is opened for the first time");
    (stats.opened, stats.lost) = (3, 3);
    // As in the night whose line was cut: the adapter was there all the time.
    stats.away = Some("nothing was heard for 8.0 s, whoever was asked".to_owned());
    assert_eq!(stats.port_away(), None);
    stats.away = Some("there is no serial port /dev/ttyUSB0".to_owned());
    assert_eq!(stats.port_away(), Some("there is no serial port /dev/ttyUSB0"));
    assert_eq!(stats.port_known_away(), stats.port_away());
    stats.opened = 4;
    assert_eq!(stats.port_away(), None, "it is open");
}
