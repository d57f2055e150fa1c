//! Alarms, and what is done about them.

use std::time::Duration;

use serde_json::json;
use tokio::time::sleep;

use super::*;
use drived_doors::Scope;
use drived_plant::plant::revisions::Next;

const LIST: &str = "/api/v1/alarms";

/// A drive that has tripped, with the address of its alarm.
async fn tripped() -> (TestPlant, String) {
    let plant = TestPlant::of(2).await;
    plant.machines[0].trip(9);
    sleep(Duration::from_secs(5)).await;
    let (status, all) = get(&plant.plant, LIST).await;
    assert_eq!((status, all["alarms"].as_array().unwrap().len()), (StatusCode::OK, 1), "{all}");
    let alarm = &all["alarms"][0];
    assert_eq!((&alarm["kind"], &alarm["drive"]), (&"tripped".into(), &"pump 1".into()));
    assert_eq!((&alarm["state"], &alarm["severity"]), (&"unacknowledged".into(), &"alarm".into()));
    assert_eq!(alarm["count"], 1);
    let address = format!("{LIST}/{}", alarm["id"]);
    (plant, address)
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_acknowledged_with_a_note_by_whoever_asks_and_once_more_without_a_change() {
    let (plant, address) = tripped().await;
    let mut reader = plant.plant.revisions().reader(None);
    let path = format!("{address}/acknowledge");
    let (status, alarm) = command(&plant.plant, &path, &json!({"note": "belt", "count": 1})).await;
    assert_eq!((status, &alarm["state"]), (StatusCode::OK, &"acknowledged".into()), "{alarm}");
    assert_eq!(
        (&alarm["acknowledged"]["by"], &alarm["acknowledged"]["note"]),
        (&"operator".into(), &"belt".into())
    );
    let Next::Frames(frames) = plant.plant.revisions().next(&mut reader).await else { panic!("frames") };
    let told = String::from_utf8_lossy(&frames[0]).into_owned();
    assert!(told.contains("event: alarm") && told.contains("\"state\":\"acknowledged\""), "{told}");
    let (status, again) = command(&plant.plant, &path, &json!({"note": "another"})).await;
    assert_eq!((status, &again["acknowledged"]["note"]), (StatusCode::OK, &"belt".into()));
    let (status, refused) = command(&plant.plant, &path, &json!({"count": 2})).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::CONFLICT, &"came_again".into()), "{refused}");
    let (_, state) = get(&plant.plant, "/api/v1/state").await;
    assert_eq!(state["alarms"][0]["state"], "acknowledged");
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_shelved_for_a_time_with_a_reason_and_taken_back() {
    let (plant, address) = tripped().await;
    let path = format!("{address}/shelve");
    for wrong in [
        json!({"minutes": 120}),
        json!({"minutes": 120, "why": ""}),
        json!({"minutes": 1_441, "why": "x"}),
        json!({"minutes": 0, "why": "x"}),
    ] {
        let (status, refused) = command(&plant.plant, &path, &wrong).await;
        assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{wrong}: {refused}");
    }
    let (status, alarm) =
        command(&plant.plant, &path, &json!({"minutes": 120, "why": "is being repaired"})).await;
    assert_eq!((status, &alarm["state"]), (StatusCode::OK, &"shelved".into()), "{alarm}");
    let until = |key: &str| alarm["shelved"][key].as_u64().unwrap();
    assert_eq!(until("until_unix_ms") - until("unix_ms"), 7_200_000);
    let (status, alarm) = command(&plant.plant, &format!("{address}/unshelve"), &json!({})).await;
    assert_eq!((status, &alarm["state"]), (StatusCode::OK, &"unacknowledged".into()), "{alarm}");
}

#[tokio::test(start_paused = true)]
async fn an_alarm_about_a_motor_that_may_turn_is_not_shelved_and_says_why() {
    let plant = TestPlant::of(2).await;
    let (_, _) =
        command(&plant.plant, "/api/v1/drives/pump%201/start", &json!({"setpoint": {"frequency_hz": 30.0}}))
            .await;
    plant.machines[0].mute();
    sleep(Duration::from_secs(20)).await;
    let (_, all) = get(&plant.plant, LIST).await;
    let alarms = all["alarms"].as_array().unwrap();
    let lost = alarms.iter().find(|alarm| alarm["kind"] == "lost_running").unwrap();
    assert_eq!(lost["of_motion"], true);
    let path = format!("{LIST}/{}/shelve", lost["id"]);
    let (status, refused) = command(&plant.plant, &path, &json!({"minutes": 60, "why": "loud"})).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::CONFLICT, &"of_motion".into()), "{refused}");
}

#[tokio::test(start_paused = true)]
async fn who_may_not_operate_the_drive_does_nothing_about_its_alarm() {
    let (plant, address) = tripped().await;
    let path = format!("{address}/acknowledge");
    let viewer = api(&plant.plant, "viewer", Rights { operate: false, engineer: false, ..ALL });
    let (status, refused) = send(viewer, post(&path, &json!({}))).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::FORBIDDEN, &"no_right".into()), "{refused}");
    let scope = Scope::of(vec!["pump 2".to_owned()], Vec::new());
    let other = Caller { scope, ..Caller::new("other", "test", ALL) };
    let other = router(plant.plant.clone()).layer(Extension(other));
    let (status, refused) = send(other, post(&path, &json!({}))).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::FORBIDDEN, &"no_right".into()), "{refused}");
    let (status, _) = command(&plant.plant, "/api/v1/alarms/7/acknowledge", &json!({})).await;
    assert_eq!(status, StatusCode::NOT_FOUND);
    let (status, _) = command(&plant.plant, "/api/v1/alarms/nix/acknowledge", &json!({})).await;
    assert_eq!(status, StatusCode::NOT_FOUND);
}
