//! The alarms of a simulated plant, in virtual time.

use std::{fs, time::Duration};

use drive_fleet::{ConcernKind, Place, alarms::AlarmState};
use drive_sim::SimSlave;
use tokio::time::sleep;

use super::*;
use crate::plant::testing::TestPlant;
use drived_config::{
    places::Places,
    rights::{Rights, Role, Scope},
    testing::Folder,
};

fn operator() -> Caller {
    Caller::new("anna", "test", Role::Operate.rights())
}

fn acknowledge(note: &str) -> AlarmAct {
    AlarmAct::Acknowledge { note: Some(note.to_owned()), count: None }
}

async fn tripped(test: &TestPlant) -> AlarmView {
    test.machines[0].trip(9);
    sleep(Duration::from_secs(5)).await;
    one(&test.plant)
}

fn one(plant: &Plant) -> AlarmView {
    let AlarmsView { alarms, .. } = plant.alarms();
    assert_eq!(alarms.len(), 1, "{alarms:#?}");
    alarms[0].clone()
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_an_alarm_of_its_drive_until_it_is_reset_and_acknowledged() {
    let test = TestPlant::of(1).await;
    let alarm = tripped(&test).await;
    assert_eq!((alarm.alarm.drive.as_deref(), alarm.alarm.line.as_deref()), (Some("pump 1"), Some("north")));
    assert_eq!(alarm.alarm.kind, AlarmKind::Drive(ConcernKind::Tripped));
    assert!(alarm.text.starts_with("tripped: ") && alarm.state == AlarmState::Unacknowledged, "{alarm:?}");
    let pump = test.plant.fleet().drive("pump 1").unwrap();
    let _ = pump.order(drive_fleet::Order::ResetFaults).await;
    sleep(Duration::from_secs(5)).await;
    assert_eq!(one(&test.plant).state, AlarmState::Returned);
    let over = test.plant.act_on_alarm(&operator(), alarm.alarm.id, &acknowledge("fan cleaned")).unwrap();
    assert_eq!(over.state, AlarmState::Over);
    assert_eq!(test.plant.alarms().alarms, []);
}

#[tokio::test(start_paused = true)]
async fn a_dead_line_is_one_alarm_that_stands_for_its_drives_and_goes_with_them() {
    let test = TestPlant::of(4).await;
    test.machines.iter().for_each(SimSlave::mute);
    sleep(Duration::from_secs(30)).await;
    let waiting = |plant: &Plant| -> Vec<AlarmView> {
        plant.alarms().alarms.into_iter().filter(|alarm| alarm.state.waits()).collect()
    };
    let waits = waiting(&test.plant);
    assert_eq!((waits.len(), waits[0].alarm.kind, waits[0].members), (1, AlarmKind::LineSilent, 4));
    test.machines.iter().for_each(SimSlave::unmute);
    sleep(Duration::from_secs(120)).await;
    // Their watchdogs have tripped them meanwhile, which is an alarm of each.
    let is_of_loss = |alarm: &AlarmView| alarm.alarm.kind != AlarmKind::Drive(ConcernKind::Tripped);
    let left: Vec<_> = test.plant.alarms().alarms.into_iter().filter(is_of_loss).collect();
    let states: Vec<_> = left.iter().map(|alarm| (alarm.alarm.kind, alarm.state)).collect();
    assert_eq!(states, [(AlarmKind::LineSilent, AlarmState::Returned)]);
}

#[tokio::test(start_paused = true)]
async fn who_may_not_operate_the_drive_does_nothing_about_its_alarm() {
    let test = TestPlant::of(2).await;
    let id = tripped(&test).await.alarm.id;
    let act = acknowledge("");
    let viewer = Caller::new("vera", "test", Role::Stop.rights());
    assert_eq!(test.plant.act_on_alarm(&viewer, id, &act), Err(AlarmRejected::NoRight("vera".to_owned())));
    let scope = Scope::of(vec!["pump 2".to_owned()], Vec::new());
    let other = Caller { scope, ..operator() };
    let refused = test.plant.act_on_alarm(&other, id, &act);
    assert!(matches!(refused, Err(AlarmRejected::OutOfScope { .. })), "{refused:?}");
    assert_eq!(one(&test.plant).state, AlarmState::Unacknowledged);
    // What was seen before it came again is not what is acknowledged.
    let stale = AlarmAct::Acknowledge { note: None, count: Some(2) };
    assert_eq!(test.plant.act_on_alarm(&operator(), id, &stale), Err(AlarmRejected::CameAgain));
    assert!(test.plant.act_on_alarm(&operator(), id, &act).is_ok());
    assert!(test.plant.act_on_alarm(&operator(), id, &act).is_ok(), "once more changes nothing");
    assert_eq!(one(&test.plant).state, AlarmState::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_program_that_is_started_anew_has_the_alarms_with_their_notes_and_a_trip_counts_once() {
    let folder = Folder::new("alarms");
    let kept = || KeptAlarms::in_folder(Some(&folder.file("")), &Places::default());
    let test = TestPlant::keeping(1, &kept()).await;
    let keeping = test.plant.keep_alarms(kept());
    let before = tripped(&test).await.alarm;
    test.plant.act_on_alarm(&operator(), before.id, &acknowledge("mechanic comes")).unwrap();
    test.plant.close_alarms();
    keeping.await.unwrap();
    let plant = Plant::start_with(test.plant.fleet(), Vec::new(), false, &kept(), Default::default());
    sleep(Duration::from_secs(20)).await;
    let after = one(&plant).alarm;
    assert_eq!((after.id, after.count, after.first_unix_ms), (before.id, 1, before.first_unix_ms));
    assert_eq!(after.acknowledged.unwrap().note.as_deref(), Some("mechanic comes"));
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_of_its_machine_where_the_names_were_exchanged_in_the_file_behind_a_kill() {
    // Where the plant of the tests has them.
    const ONE: &str = "north atv312@1";
    const TWO: &str = "north atv312@2";
    let folder = Folder::new("alarms-exchanged");
    let places = |drives: &[(&str, &str)]| {
        let drives = drives.iter().map(|(name, place)| ((*name).to_owned(), Place::from(*place)));
        drives.collect::<Places>().after([ONE, TWO].map(Place::from))
    };
    let kept = |there: &Places| KeptAlarms::in_folder(Some(&folder.file("")), there);
    let drives = |kept: &KeptAlarms| -> Vec<String> {
        kept.alarms.all().iter().filter_map(|alarm| alarm.drive.clone()).collect()
    };
    let there = places(&[("pump 1", ONE), ("pump 2", TWO)]);
    let test = TestPlant::keeping(2, &kept(&there)).await;
    let keeping = test.plant.keep_alarms(kept(&there));
    tripped(&test).await;
    test.plant.close_alarms();
    keeping.await.unwrap();
    assert_eq!(drives(&kept(&there)), ["pump 1"]);
    let exchanged = kept(&places(&[("pump 2", ONE), ("pump 1", TWO)]));
    assert_eq!(drives(&exchanged), ["pump 2"]);
    // The name is another machine's now, and nobody is where it was.
    let other = kept(&places(&[("pump 1", TWO)]));
    assert_eq!(drives(&other), ["pump 1 at north atv312@1"]);
    // Neither is there.
    let neither = kept(&places(&[("pump 2", TWO)]));
    assert_eq!(drives(&neither), ["pump 1"]);
}

#[test]
fn a_damaged_file_is_put_aside_and_keeps_nobody_from_being_watched() {
    let folder = Folder::new("alarms-damaged");
    let file = folder.file("alarms.json");
    for text in [
        "{\"schema\":1,\"alarms\":{",
        "{\"schema\":2,\"alarms\":{\"last_id\":1,\"dropped\":0,\"alarms\":[]}}",
    ] {
        fs::write(&file, text).unwrap();
        let kept = KeptAlarms::in_folder(Some(&folder.file("")), &Places::default());
        assert_eq!(kept.alarms, Alarms::default());
        assert!(!file.exists());
        assert_eq!(fs::read_to_string(folder.file("alarms.json.damaged")).unwrap(), text);
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_wrong_with_the_program_is_an_alarm_until_it_is_well_again() {
    let test = TestPlant::of(1).await;
    let notice =
        |is_wrong| super::super::views::NoticeView::new("reload", is_wrong, "line 7: no such family");
    test.plant.tell_notice(notice(true));
    sleep(Duration::from_secs(2)).await;
    let alarm = one(&test.plant);
    assert_eq!((alarm.alarm.kind, alarm.alarm.drive), (AlarmKind::Reload, None));
    assert_eq!(alarm.alarm.detail.as_deref(), Some("line 7: no such family"));
    test.plant.tell_notice(notice(false));
    sleep(Duration::from_secs(2)).await;
    assert_eq!(one(&test.plant).state, AlarmState::Returned);
    let all = Caller::new("anna", "test", Rights::ALL);
    let scoped = Caller { scope: Scope::of(vec!["pump 1".to_owned()], Vec::new()), ..all.clone() };
    let act = acknowledge("");
    let refused = test.plant.act_on_alarm(&scoped, alarm.alarm.id, &act);
    assert!(matches!(refused, Err(AlarmRejected::OutOfScope { .. })), "it is of no drive: {refused:?}");
    assert!(test.plant.act_on_alarm(&all, alarm.alarm.id, &act).is_ok());
}

#[tokio::test(start_paused = true)]
async fn a_run_command_that_is_nobodys_is_an_alarm_of_a_motor_that_may_turn() {
    let folder = Folder::new("alarms-run-left");
    let file = folder.file("runs.json");
    let lease = drive_core::Lease::new(drive_core::Direction::Forward, 15);
    let record = serde_json::json!({ "identity": "ATV312HU22N4", "lease": lease });
    let written = serde_json::json!({ "/dev/ttyUSB0 atv312@7": { "drive": "mixer", "record": record } });
    fs::write(&file, written.to_string()).unwrap();
    let runs = Records::<RunRecord>::open(Some(&file), &Places::default());
    let test = TestPlant::keeping(1, &KeptAlarms::default().with_runs_of(runs)).await;
    sleep(Duration::from_secs(3)).await;
    let alarm = one(&test.plant);
    assert_eq!((alarm.alarm.kind.word(), alarm.state), ("run_left", AlarmState::Unacknowledged));
    assert!(alarm.alarm.kind.wakes(), "somebody is called for it");
    assert!(alarm.text.contains("the motor may turn") && alarm.text.contains("mixer"), "{alarm:?}");
    // Where it is not to be there again nothing but a person can tell.
    let seen_to = AlarmAct::Done { note: Some("it stands, I saw it".to_owned()) };
    let noted = test.plant.act_on_alarm(&operator(), alarm.alarm.id, &seen_to).unwrap();
    assert_eq!(noted.state, AlarmState::Acknowledged);
    sleep(Duration::from_secs(3)).await;
    assert_eq!(test.plant.alarms().alarms, []);
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_nobodys_is_an_alarm_through_restarts_until_its_drive_is_there_again() {
    const PLACE: &str = "/dev/ttyUSB0 atv312@7";
    let folder = Folder::new("alarms-stop-left");
    let file = folder.file("runs.json");
    let lease = drive_core::Lease::new(drive_core::Direction::Forward, 15);
    let record = serde_json::json!({ "identity": "ATV312HU22N4", "lease": lease, "stop": "ramp" });
    let written = serde_json::json!({ PLACE: { "drive": "mixer", "record": record } });
    fs::write(&file, written.to_string()).unwrap();
    let runs = || Records::<RunRecord>::open(Some(&file), &Places::default());
    let kept = || KeptAlarms::in_folder(Some(&folder.file("")), &Places::default()).with_runs_of(runs());
    let test = TestPlant::keeping(1, &kept()).await;
    let keeping = test.plant.keep_alarms(kept());
    sleep(Duration::from_secs(3)).await;
    let before = one(&test.plant);
    assert_eq!((before.alarm.kind, before.state), (AlarmKind::StopLeft, AlarmState::Unacknowledged));
    assert_eq!((before.alarm.drive.as_deref(), before.alarm.of()), (None, "the program".to_owned()));
    assert!(before.text.contains("the motor may turn") && before.text.contains("mixer"), "{before:?}");
    let shelve = AlarmAct::Shelve { time: Duration::from_secs(600), why: "later".to_owned() };
    let refused = test.plant.act_on_alarm(&operator(), before.alarm.id, &shelve);
    assert_eq!(refused, Err(AlarmRejected::Refused(AlarmRefused::OfMotion)));
    test.plant.close_alarms();
    keeping.await.unwrap();

    // The program is started anew: it is the same, and waits for somebody until he has taken note of it.
    let again = kept();
    let runs = again.runs.clone().unwrap();
    let plant = Plant::start_with(test.plant.fleet(), Vec::new(), false, &again, Default::default());
    sleep(Duration::from_secs(20)).await;
    let after = one(&plant);
    assert_eq!((after.alarm.id, after.alarm.count, after.state), (before.alarm.id, 1, before.state));
    let noted = plant.act_on_alarm(&operator(), after.alarm.id, &acknowledge("it stands, I saw it")).unwrap();
    assert_eq!(noted.state, AlarmState::Acknowledged);
    // Its drive is in the configuration again, and is given the stop.
    assert!(runs.call(&PLACE.into(), "mixer"));
    sleep(Duration::from_secs(3)).await;
    assert_eq!(plant.alarms().alarms, []);
}

#[tokio::test(start_paused = true)]
async fn a_run_or_a_stop_that_may_be_lost_is_an_alarm_through_restarts_until_somebody_has_seen_to_it() {
    let folder = Folder::new("alarms-records-lost");
    let file = folder.file("runs.json");
    fs::write(&file, "{ \"/dev/ttyUSB0 atv312@7\": { \"drive\": \"mixer\", \"rec").unwrap();
    let runs = || Records::<RunRecord>::open(Some(&file), &Places::default());
    let kept = || KeptAlarms::default().with_runs_of(runs());
    drop(TestPlant::keeping(1, &kept()).await);
    let test = TestPlant::keeping(1, &kept()).await;
    sleep(Duration::from_secs(3)).await;
    let alarm = one(&test.plant);
    assert_eq!((alarm.alarm.kind, alarm.state), (AlarmKind::RecordsLost, AlarmState::Unacknowledged));
    assert!(alarm.alarm.kind.wakes(), "somebody is called for it");
    assert!(alarm.text.contains("a motor may turn") && alarm.text.contains("atv312@7"), "{alarm:?}");
    let seen_to = AlarmAct::Done { note: Some("all stand, I saw it".to_owned()) };
    test.plant.act_on_alarm(&operator(), alarm.alarm.id, &seen_to).unwrap();
    sleep(Duration::from_secs(3)).await;
    assert_eq!(test.plant.alarms().alarms, []);
    assert_eq!(runs().lost(), None);
}
