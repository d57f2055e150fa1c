//! The life of alarms, told in looks.

#[cfg(feature = "serde")]
mod reference;
mod seen;

use super::*;
use crate::concern::ConcernKind;

const SECOND: u64 = 1_000;
const HOUR: u64 = 3_600 * SECOND;

const TRIPPED: AlarmKind = AlarmKind::Drive(ConcernKind::Tripped);
const LOST: AlarmKind = AlarmKind::Drive(ConcernKind::Lost);
const LOST_RUNNING: AlarmKind = AlarmKind::Drive(ConcernKind::LostRunning);
const NOBODY: (Option<&str>, Option<&str>) = (None, None);

/// A look at which all is seen, and this is so.
fn look(drive: Option<&str>, line: Option<&str>, there: &[AlarmKind]) -> Look {
    let condition = |kind: &AlarmKind| Condition {
        kind: *kind,
        mark: None,
        since_unix_ms: None,
        detail: None,
        remedy: None,
        faults: Vec::new(),
        because: None,
    };
    Look {
        drive: drive.map(str::to_owned),
        line: line.map(str::to_owned),
        there: there.iter().map(condition).collect(),
        seen: AlarmKind::all().collect(),
    }
}

fn pump(there: &[AlarmKind]) -> Look {
    look(Some("pump 1"), Some("north"), there)
}

/// The same where nothing is known of what is not so.
fn unseen(look: Look) -> Look {
    Look { seen: Vec::new(), ..look }
}

/// Looks at these, and there is nobody else.
fn look_at_all(alarms: &mut Alarms, looks: &[Look], now: u64) -> Vec<AlarmChange> {
    alarms.look_at_all(looks, |name| looks.iter().any(|look| look.drive.as_deref() == Some(name)), now)
}

fn states(alarms: &Alarms) -> Vec<(AlarmKind, AlarmState)> {
    alarms.all().iter().map(|alarm| (alarm.kind, alarm.state())).collect()
}

fn became(changes: &[AlarmChange]) -> Vec<Became> {
    changes.iter().map(|change| change.became).collect()
}

/// A line with so many drives, all of which do not answer.
fn dead_line(drives: usize, kind: AlarmKind) -> Vec<Look> {
    let drive = |number| look(Some(&format!("pump {number}")), Some("north"), &[kind]);
    let line = look(None, Some("north"), &[AlarmKind::LineSilent]);
    (1..=drives).map(drive).chain([line]).collect()
}

#[test]
fn what_has_returned_stays_until_somebody_has_taken_note_of_it() {
    let mut alarms = Alarms::default();
    assert_eq!(became(&alarms.look(&[pump(&[TRIPPED])], 10)), [Became::Came]);
    assert_eq!(became(&alarms.look(&[pump(&[TRIPPED])], 20)), [], "it is so still");
    assert_eq!(became(&alarms.look(&[pump(&[])], 30)), [Became::Returned]);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Returned)]);
    let id = alarms.all()[0].id;
    assert_eq!(became(&alarms.acknowledge(id, "anna", Some("reset"), 40).unwrap()), [Became::Over]);
    assert_eq!(alarms.all(), []);
    assert_eq!(alarms.acknowledge(id, "anna", None, 50), Err(AlarmRefused::NoSuchAlarm(id)));
}

#[test]
fn what_is_acknowledged_and_still_so_stays_and_is_over_when_it_returns() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[LOST])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "anna", Some("fuse"), 20).unwrap();
    assert_eq!(alarms.acknowledge(id, "bert", None, 30), Ok(Vec::new()), "the first note stays");
    alarms.look(&[pump(&[LOST])], HOUR);
    assert_eq!(states(&alarms), [(LOST, AlarmState::Acknowledged)]);
    let Acknowledged { by, unix_ms, note } = alarms.all()[0].acknowledged.clone().unwrap();
    assert_eq!((&*by, unix_ms, note.as_deref()), ("anna", 20, Some("fuse")));
    assert_eq!(became(&alarms.look(&[pump(&[])], 2 * HOUR)), [Became::Over]);
    assert_eq!(alarms.all(), []);
}

#[test]
fn what_comes_again_before_its_end_is_the_same_alarm_and_is_acknowledged_anew() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    alarms.look(&[pump(&[])], 20);
    assert_eq!(became(&alarms.look(&[pump(&[TRIPPED])], 30)), [Became::CameAgain]);
    let alarm = &alarms.all()[0];
    assert_eq!((alarm.count, alarm.first_unix_ms, alarm.last_unix_ms), (2, 10, 30));
    assert_eq!(alarm.state(), AlarmState::Unacknowledged);
    let id = alarm.id;
    alarms.acknowledge(id, "anna", None, 40).unwrap();
    alarms.look(&[pump(&[])], 50);
    alarms.look(&[pump(&[TRIPPED])], 60);
    let another = &alarms.all()[0];
    assert!(another.id > id && another.count == 1, "its life was over");
}

/// ISA-18.2 and IEC 62682: what was acknowledged, or shelved, is the alarm that was there.
#[test]
fn another_fault_in_the_place_of_one_that_was_acknowledged_or_shelved_is_acknowledged_anew() {
    let tripped_by = |faults: &[u16]| {
        let mut look = pump(&[TRIPPED]);
        look.there[0].faults = faults.to_vec();
        look
    };
    let mut alarms = Alarms::default();
    // It is not read yet by which.
    alarms.look(&[tripped_by(&[])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "Anna", None, 20).unwrap();
    for (at, faults) in [(30, &[5][..]), (40, &[5]), (50, &[])] {
        let changes = alarms.look(&[tripped_by(faults)], at);
        assert_eq!(became(&changes), [], "{faults:?} is known, no other one");
    }
    // In its place, and on top of it.
    for (at, faults) in [(60, &[9][..]), (70, &[9, 5])] {
        assert_eq!(became(&alarms.look(&[tripped_by(faults)], at)), [Became::CameAgain], "{faults:?}");
        assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Unacknowledged)]);
        assert_eq!(alarms.all()[0].last_unix_ms, at);
        alarms.acknowledge(id, "Anna", None, at).unwrap();
    }
    assert_eq!(became(&alarms.look(&[tripped_by(&[9])], 80)), [], "one of them is gone");
    alarms.shelve(id, "Anna", "is being repaired", Duration::from_secs(60), 90).unwrap();
    assert_eq!(became(&alarms.look(&[tripped_by(&[11])], 100)), [Became::CameAgain]);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Unacknowledged)]);
    assert_eq!((alarms.all()[0].id, alarms.all()[0].count), (id, 4));
}

#[test]
fn nothing_goes_away_because_it_is_not_seen() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    alarms.look(&[unseen(pump(&[]))], 20);
    alarms.look(&[look(Some("pump 2"), Some("north"), &[])], 30);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Unacknowledged)]);
}

#[cfg(feature = "serde")]
#[test]
fn a_trip_that_stands_through_a_restart_is_one_alarm_that_came_once_with_its_note() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "anna", Some("mechanic comes"), 20).unwrap();
    let kept = serde_json::to_string(&alarms).unwrap();
    let mut alarms: Alarms = serde_json::from_str(&kept).unwrap();
    // It has not been seen yet, and then it is seen with its trip, which this program finds now.
    assert_eq!(became(&look_at_all(&mut alarms, &[unseen(pump(&[]))], HOUR)), []);
    assert_eq!(became(&look_at_all(&mut alarms, &[pump(&[TRIPPED])], 2 * HOUR)), []);
    let alarm = &alarms.all()[0];
    assert_eq!((alarm.id, alarm.count, alarm.first_unix_ms), (id, 1, 10));
    assert_eq!(alarm.state(), AlarmState::Acknowledged);
}

#[test]
fn a_dead_line_with_31_drives_is_one_alarm_and_when_it_is_back_there_is_one_to_acknowledge() {
    let mut alarms = Alarms::default();
    // They are missed one by one, and then all of them.
    for number in 1..=31_u64 {
        alarms.look(&[look(Some(&format!("pump {number}")), Some("north"), &[LOST])], number * SECOND);
    }
    look_at_all(&mut alarms, &dead_line(31, LOST), 32 * SECOND);
    let waits = alarms.all().iter().filter(|alarm| alarm.state().waits()).collect::<Vec<_>>();
    assert_eq!(waits.len(), 1);
    assert_eq!(waits[0].kind, AlarmKind::LineSilent);
    let cause = waits[0].id;
    assert_eq!(alarms.members(cause).count(), 31);
    // They are back one by one as well; until the last of them is, it stands.
    for back in 1..=31 {
        let mut looks = dead_line(31, LOST);
        looks[..back].iter_mut().for_each(|look| look.there.clear());
        looks[31].there.clear();
        look_at_all(&mut alarms, &looks, 40 * SECOND + back as u64);
        assert_eq!(alarms.members(cause).count(), 31 - back);
        assert_eq!(alarms.get(cause).unwrap().is_active(), back < 31, "{back}");
    }
    assert_eq!(states(&alarms), [(AlarmKind::LineSilent, AlarmState::Returned)]);
}

#[test]
fn who_is_missing_a_minute_after_the_line_is_back_is_an_alarm_of_his_own() {
    let mut alarms = Alarms::default();
    look_at_all(&mut alarms, &dead_line(3, LOST_RUNNING), 10 * SECOND);
    let mut looks = dead_line(3, LOST_RUNNING);
    [0, 1, 3].into_iter().for_each(|back| looks[back].there.clear());
    look_at_all(&mut alarms, &looks, 20 * SECOND);
    look_at_all(&mut alarms, &looks, 79 * SECOND);
    assert_eq!(alarms.all().iter().filter(|alarm| alarm.state().waits()).count(), 1, "the line");
    assert_eq!(became(&look_at_all(&mut alarms, &looks, 81 * SECOND)), [Became::Returned, Became::Released]);
    let own = alarms.all().iter().find(|alarm| alarm.kind == LOST_RUNNING).unwrap();
    assert_eq!((own.drive.as_deref(), own.state()), (Some("pump 3"), AlarmState::Unacknowledged));
}

#[test]
fn what_came_long_before_its_cause_is_acknowledged_by_itself() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[LOST])], 10);
    look_at_all(&mut alarms, &dead_line(2, LOST), HOUR);
    assert_eq!(alarms.all().iter().filter(|alarm| alarm.state() == AlarmState::Suppressed).count(), 2);
    let mut looks = dead_line(2, LOST);
    looks.iter_mut().for_each(|look| look.there.clear());
    look_at_all(&mut alarms, &looks, 2 * HOUR);
    let returned = [(LOST, AlarmState::Returned), (AlarmKind::LineSilent, AlarmState::Returned)];
    assert_eq!(states(&alarms), returned);
}

#[test]
fn a_shelf_ends_by_itself_and_what_came_again_meanwhile_waits_for_that() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    let id = alarms.all()[0].id;
    let hour = Duration::from_secs(3_600);
    alarms.shelve(id, "anna", "is being repaired", hour, 20).unwrap();
    alarms.look(&[pump(&[])], 30);
    alarms.look(&[pump(&[TRIPPED])], 40);
    let alarm = &alarms.all()[0];
    assert_eq!((alarm.state(), alarm.count), (AlarmState::Shelved, 2));
    assert_eq!(became(&alarms.look(&[pump(&[TRIPPED])], HOUR + 20)), [Became::Unshelved]);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Unacknowledged)]);
    // A clock that is set back does not make it longer.
    alarms.shelve(id, "anna", "once more", hour, 100 * HOUR).unwrap();
    alarms.look(&[pump(&[TRIPPED])], HOUR);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Unacknowledged)]);
}

#[test]
fn what_was_shelved_with_a_note_and_returned_meanwhile_is_over_with_its_shelf() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "anna", None, 15).unwrap();
    alarms.shelve(id, "anna", "is being repaired", Duration::from_secs(60), 20).unwrap();
    alarms.look(&[pump(&[])], 30);
    assert_eq!(states(&alarms), [(TRIPPED, AlarmState::Shelved)]);
    assert_eq!(became(&alarms.unshelve(id).unwrap()), [Became::Over]);
    assert_eq!(alarms.all(), []);
}

#[test]
fn no_alarm_about_a_motor_that_may_turn_is_shelved_nor_folded_into_one_that_is() {
    let hour = Duration::from_secs(3_600);
    let mut alarms = Alarms::default();
    for kind in AlarmKind::all().filter(|kind| kind.is_of_motion()) {
        alarms.look(&[pump(&[kind])], 10);
        let id = alarms.all().last().unwrap().id;
        assert_eq!(alarms.shelve(id, "anna", "it is loud", hour, 20), Err(AlarmRefused::OfMotion));
        assert!(alarms.acknowledge(id, "anna", None, 20).is_ok());
    }
    // The cause of one neither.
    let mut alarms = Alarms::default();
    look_at_all(&mut alarms, &dead_line(2, LOST_RUNNING), 10);
    let cause = alarms.all().last().unwrap().id;
    assert_eq!(alarms.shelve(cause, "anna", "cable is being laid", hour, 20), Err(AlarmRefused::OfMotion));
    // One that was shelved before stands for none.
    let mut alarms = Alarms::default();
    look_at_all(&mut alarms, &dead_line(2, LOST), 10);
    let cause = alarms.all().last().unwrap().id;
    alarms.shelve(cause, "anna", "cable is being laid", hour, 20).unwrap();
    look_at_all(&mut alarms, &dead_line(2, LOST_RUNNING), 30);
    let own = alarms.all().iter().filter(|alarm| alarm.kind == LOST_RUNNING);
    assert!(own.clone().count() == 2 && own.into_iter().all(|alarm| alarm.state().waits()));
}

#[test]
fn a_motor_that_may_turn_and_joins_a_cause_is_told_to_whoever_has_acknowledged_that() {
    let mut alarms = Alarms::default();
    look_at_all(&mut alarms, &dead_line(2, LOST), 10);
    let cause = alarms.all().last().unwrap().id;
    alarms.acknowledge(cause, "anna", None, 20).unwrap();
    look_at_all(&mut alarms, &dead_line(2, LOST), 30);
    assert_eq!(alarms.get(cause).unwrap().state(), AlarmState::Acknowledged);
    let mut looks = dead_line(2, LOST);
    looks[0] = look(Some("pump 1"), Some("north"), &[LOST_RUNNING]);
    look_at_all(&mut alarms, &looks, 40);
    assert_eq!(alarms.get(cause).unwrap().state(), AlarmState::Unacknowledged);
}

#[test]
fn a_drive_that_leaves_the_configuration_is_told_as_gone_once_and_one_that_is_reloaded_is_not() {
    let mut alarms = Alarms::default();
    look_at_all(&mut alarms, &[pump(&[LOST])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "anna", None, 20).unwrap();
    // A reload takes it out and puts it in again.
    assert_eq!(became(&look_at_all(&mut alarms, &[], 1_000)), []);
    assert_eq!(became(&look_at_all(&mut alarms, &[pump(&[LOST])], 2_000)), []);
    assert_eq!(became(&look_at_all(&mut alarms, &[], 20_000)), []);
    assert_eq!(became(&look_at_all(&mut alarms, &[], 31_000)), [Became::Gone]);
    assert_eq!(became(&look_at_all(&mut alarms, &[], 90_000)), []);
    assert_eq!(states(&alarms), [(LOST, AlarmState::Gone)]);
    assert_eq!(became(&alarms.acknowledge(id, "anna", None, 95_000).unwrap()), [Became::Over]);
    assert_eq!(alarms.all(), []);
}

#[test]
fn of_those_that_have_returned_the_newest_are_kept_and_the_others_told_as_dropped() {
    let mut alarms = Alarms::default();
    let mut dropped = Vec::new();
    for number in 0..RETURNED + 3 {
        let drive = format!("pump {number}");
        alarms.look(&[look(Some(&drive), None, &[TRIPPED])], number as u64);
        let changes = alarms.look(&[look(Some(&drive), None, &[])], number as u64);
        dropped.extend(changes.into_iter().filter(|change| change.became == Became::Dropped));
    }
    let names: Vec<_> = dropped.iter().filter_map(|change| change.alarm.drive.as_deref()).collect();
    assert_eq!(names, ["pump 0", "pump 1", "pump 2"]);
    assert_eq!((alarms.all().len(), alarms.dropped()), (RETURNED, 3));
}

#[test]
fn what_is_noted_has_its_bounds() {
    let mut alarms = Alarms::default();
    let (drive, line) = NOBODY;
    alarms.look(&[look(drive, line, &[AlarmKind::AuditLog])], 10);
    let id = alarms.all()[0].id;
    let long = "x".repeat(LONGEST_NOTE + 1);
    let second = Duration::from_secs(1);
    assert_eq!(alarms.acknowledge(id, "anna", Some(&long), 20), Err(AlarmRefused::TooLong));
    assert_eq!(alarms.shelve(id, "anna", &long, second, 20), Err(AlarmRefused::TooLong));
    assert_eq!(alarms.shelve(id, "anna", " ", second, 20), Err(AlarmRefused::NoReason));
    for time in [Duration::ZERO, LONGEST_SHELF + second] {
        assert_eq!(alarms.shelve(id, "anna", "why", time, 20), Err(AlarmRefused::Time));
    }
    assert_eq!(states(&alarms), [(AlarmKind::AuditLog, AlarmState::Unacknowledged)]);
}

#[test]
fn a_drive_that_is_called_otherwise_keeps_its_alarms_with_their_notes() {
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[TRIPPED])], 10);
    let id = alarms.all()[0].id;
    alarms.acknowledge(id, "anna", Some("belt"), 20).unwrap();
    let mixer = look(Some("mixer"), Some("north"), &[TRIPPED]);
    // Somebody may have looked at it by its new name already.
    alarms.look(std::slice::from_ref(&mixer), 30);
    alarms.rename("pump 1", "mixer");
    look_at_all(&mut alarms, &[mixer], HOUR);
    let [alarm] = alarms.all() else { panic!("{alarms:?}") };
    assert_eq!((alarm.id, alarm.count, alarm.drive.as_deref()), (id, 1, Some("mixer")));
    assert_eq!(alarm.state(), AlarmState::Acknowledged);
}

#[test]
fn an_alarm_that_came_while_the_clock_was_ahead_has_stood_since_it_came_when_that_is_set_right() {
    let mut alarms = Alarms::default();
    let since = |unix_ms| {
        let mut look = pump(&[TRIPPED]);
        look.there[0].since_unix_ms = Some(unix_ms);
        look
    };
    alarms.look(&[since(1_000 * HOUR)], 1_000 * HOUR);
    // Set right 30 s later, by which the drive has tripped 30 s ago still.
    let now = 10 * HOUR;
    let changes = alarms.look(&[since(now - 30 * SECOND)], now);
    assert_eq!(became(&changes), [Became::Explained], "whoever reads along is told");
    let alarm = &alarms.all()[0];
    let came = now - 30 * SECOND;
    assert_eq!((alarm.first_unix_ms, alarm.last_unix_ms, alarm.count), (came, came, 1));
    assert_eq!(alarms.look(&[since(came)], now + SECOND), [], "and once");
    // Of what nobody knows since when it is so it is known from now on.
    let mut alarms = Alarms::default();
    alarms.look(&[pump(&[LOST])], 1_000 * HOUR);
    for later in [0, SECOND, HOUR] {
        alarms.look(&[pump(&[LOST])], now + later);
        assert_eq!(alarms.all()[0].last_unix_ms, now);
    }
}
