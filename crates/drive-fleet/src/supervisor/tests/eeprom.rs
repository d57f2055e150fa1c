//! What is written to a drive's EEPROM, and how often.

use super::*;
use crate::{ConcernKind, EEPROM_WRITES_A_DAY, EepromLedger, OnExitWatchdog, eeprom::EepromUse};

const HOUR: Duration = Duration::from_secs(3_600);

/// Lets hours pass, in pieces that a machine which spins does not survive.
fn hours(rig: &mut Rig, hours: u32) {
    for _ in 0..hours {
        rig.pass(HOUR);
        rig.outputs.retain(|output| matches!(output, Output::Event(Happened { kind, .. }) if kind.name() == "eeprom written"));
    }
}

fn arms(rig: &Rig) -> usize {
    rig.drive.log.iter().filter(|job| matches!(job, Job::ArmWatchdog(..))).count()
}

/// The ledger as it was told last.
fn ledger(rig: &Rig) -> Option<EepromLedger> {
    rig.happened()
        .filter_map(|happened| match &happened.kind {
            EventKind::EepromWritten { ledger, .. } => Some(EepromLedger::clone(ledger)),
            _ => None,
        })
        .last()
}

#[test]
fn a_watchdog_that_does_not_take_is_written_once_in_28_hours_however_the_drive_says_so() {
    for denies in [false, true] {
        let mut rig = Rig::over(settings(), true);
        (rig.drive.keeps_watchdog, rig.drive.denies_watchdog) = (true, denies);
        hours(&mut rig, 28);
        assert_eq!(arms(&rig), 1, "denies: {denies}");
    }
}

#[test]
fn a_watchdog_that_does_not_take_is_not_tried_again_by_the_next_run_but_on_another_drive_and_for_another_contract()
 {
    let mut rig = Rig::over(settings(), true);
    rig.drive.keeps_watchdog = true;
    rig.pass(60_000 * MS);
    let mut kept = ledger(&rig);
    assert_eq!(kept.as_ref().map(|ledger| (ledger.writes, ledger.in_vain.is_some())), Some((1, true)));
    for _ in 0..10 {
        let mut next = Rig::over(DriveSettings { eeprom_before: kept.clone(), ..settings() }, true);
        next.drive.keeps_watchdog = true;
        next.pass(60_000 * MS);
        assert_eq!(arms(&next), 0, "the same drive and contract");
        kept = ledger(&next).or(kept);
    }
    let before = || DriveSettings { eeprom_before: kept.clone(), ..settings() };
    let mut other = Rig::over(before(), true);
    other.drive.identity = Identity { model: Some("two".to_owned()), ..Identity::default() };
    other.pass(60_000 * MS);
    assert_eq!(arms(&other), 1, "another drive");
    let contract = WatchdogContract { timeout: Duration::from_secs(3), ..CONTRACT };
    let mut other = Rig::over(DriveSettings { watchdog: Some(contract), ..before() }, true);
    other.pass(60_000 * MS);
    assert_eq!(arms(&other), 1, "another contract");
}

#[test]
fn an_eeprom_that_is_written_too_often_in_a_day_is_an_alarm_and_the_fleet_itself_writes_no_more_until_the_next()
 {
    let mut rig = Rig::over(settings(), true);
    // Whatever is set is lost again, with each interruption of the line.
    let interrupt = |rig: &mut Rig, times: u32| {
        for _ in 0..times {
            rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
            rig.pass(5_000 * MS);
            rig.drive.failing = None;
            rig.drive.watchdog = Watchdog { timeout: None, reaction: None };
            rig.pass(5_000 * MS);
        }
    };
    interrupt(&mut rig, 60);
    let a_day = usize::try_from(EEPROM_WRITES_A_DAY).unwrap();
    assert_eq!(arms(&rig), a_day);
    let alarms = rig.happened().filter(|happened| {
        matches!(happened.kind, EventKind::EepromWritten { .. }) && happened.kind.is_alarm()
    });
    assert_eq!(alarms.count(), 1);
    let worn =
        |rig: &Rig| rig.snapshot().concerns(rig.now).iter().any(|one| one.kind == ConcernKind::EepromWorn);
    assert!(worn(&rig));
    let start = rig.order(START);
    rig.pass(1_500 * MS);
    assert_eq!(rig.outcome(start), Some(&Outcome::Refused(Refused::WatchdogUnverified)));
    hours(&mut rig, 24);
    assert!(!worn(&rig));
    assert_eq!(arms(&rig), a_day + 1, "it is another day");
    assert_eq!(ledger(&rig).map(|ledger| (ledger.writes, ledger.today)), Some((a_day as u64 + 1, 1)));
}

#[test]
fn parameters_and_saves_stand_in_the_same_ledger_and_what_changes_nothing_does_not() {
    let mut rig = Rig::over(settings(), true);
    rig.pass(1_500 * MS);
    assert_eq!(ledger(&rig).map(|ledger| ledger.writes), Some(1), "the watchdog");
    let row: &drive_core::Row = &ROW_IN_EEPROM;
    for (number, word, writes) in [(1, 7, 2), (2, 7, 2), (3, 8, 3)] {
        rig.machine.handle_question(CallId(100 + number), "tester", Question::Write(row, word));
        rig.pass(1_000 * MS);
        assert_eq!(ledger(&rig).map(|ledger| ledger.writes), Some(writes), "{word}");
    }
    rig.machine.handle_question(CallId(200), "tester", Question::Write(&super::questions::ROW, 9));
    rig.order(Order::Persist);
    rig.pass(1_000 * MS);
    assert_eq!(
        ledger(&rig).map(|ledger| ledger.writes),
        Some(4),
        "what is kept in RAM does not wear, a save does"
    );
    assert_eq!(rig.cause_of("eeprom written"), Some(Cause::Command(Act::of("tester"))));
}

const ROW_IN_EEPROM: drive_core::Row = drive_core::Row { storage: Storage::Eeprom, ..super::questions::ROW };

/// Goes on until a job of this kind is in flight, and stops the drive then. Until when it might have gone on.
fn stop_amid(rig: &mut Rig, kind: fn(Job) -> bool) -> Option<Instant> {
    for _ in 0..1_000 {
        match rig.next() {
            Step::Do { job, until, .. } if kind(job) => {
                rig.stop(StopMode::Ramp);
                rig.collect();
                return until;
            }
            Step::Do { job, .. } => {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
            Step::Wait(_) if rig.machine.turn() == Turn::Wanted => rig.machine.grant_turn(),
            Step::Wait(at) => rig.now = at,
            Step::Finished => break,
        }
        rig.collect();
    }
    panic!("no such job in {:?}", rig.drive.log)
}

#[test]
fn a_watchdog_whose_setting_up_is_dropped_for_a_stop_may_be_armed_and_is_counted() {
    let mut rig = Rig::over(settings(), true);
    let until = stop_amid(&mut rig, |job| matches!(job, Job::ArmWatchdog(..)));
    assert_eq!(until, None, "no poll cuts it");
    assert_eq!(ledger(&rig).map(|ledger| ledger.writes), Some(1));
    assert_eq!(rig.snapshot().watchdog, crate::WatchdogCheck::Unchecked, "it is read again");
}

#[test]
fn whatever_write_is_dropped_for_a_stop_is_counted_once_with_who_wanted_it() {
    let parameter = |rig: &mut Rig| {
        rig.machine.handle_question(CallId(100), "tester", Question::Write(&ROW_IN_EEPROM, 7));
        stop_amid(rig, |job| matches!(job, Job::Ask(_)));
    };
    let save = |rig: &mut Rig| {
        rig.order(Order::Persist);
        stop_amid(rig, |job| job == Job::Persist);
    };
    for (by, dropped) in [(EepromUse::Parameter, parameter as fn(&mut Rig)), (EepromUse::Save, save)] {
        let mut rig = Rig::over(settings(), true);
        rig.pass(1_500 * MS);
        dropped(&mut rig);
        assert_eq!(ledger(&rig).map(|ledger| ledger.writes), Some(2), "the watchdog, and this: {by:?}");
        assert!(
            rig.happened().any(|it| matches!(it.kind, EventKind::EepromWritten { by: is, .. } if is == by))
        );
        assert_eq!(rig.cause_of("eeprom written"), Some(Cause::Command(Act::of("tester"))), "{by:?}");
    }
}

#[test]
fn a_putting_back_that_is_dropped_for_a_stop_is_counted_as_the_exits() {
    let mut rig = Rig::over(DriveSettings { on_exit_watchdog: OnExitWatchdog::Restore, ..settings() }, true);
    rig.pass(1_500 * MS);
    rig.machine.handle_exit(rig.now, Policy::Exit);
    stop_amid(&mut rig, |job| matches!(job, Job::RestoreWatchdog(_)));
    assert_eq!(ledger(&rig).map(|ledger| ledger.writes), Some(2));
    assert_eq!(rig.cause_of("eeprom written"), Some(Cause::policy(Policy::Exit)));
}
