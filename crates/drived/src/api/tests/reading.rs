//! What is read.

use std::time::Duration;

use super::*;

#[tokio::test(start_paused = true)]
async fn the_state_has_every_line_drive_and_group() {
    let TestPlant { plant, .. } = TestPlant::of(3).await;
    let (status, state) = get(&plant, "/api/v1/state").await;
    assert_eq!(status, StatusCode::OK);
    assert_eq!(state["lines"][0]["name"], "north");
    assert_eq!(state["drives"].as_array().unwrap().len(), 3);
    assert_eq!(state["drives"][2]["name"], "pump 3");
    assert_eq!(state["drives"][2]["status"]["quality"], "good");
    assert_eq!(state["drives"][2]["line"], "north");
    assert_eq!(state["groups"][0]["drives"][1], "pump 2");
    assert_eq!(state["daemon"]["caller"], "reader");
}

#[tokio::test(start_paused = true)]
async fn a_drive_is_found_by_its_name_and_no_other_is() {
    let TestPlant { plant, .. } = TestPlant::of(1).await;
    let (status, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    assert_eq!((status, &drive["name"]), (StatusCode::OK, &Value::from("pump 1")));
    assert_eq!(get(&plant, "/api/v1/drives/pump%202").await.0, StatusCode::NOT_FOUND);
}

#[tokio::test(start_paused = true)]
async fn a_value_behind_a_cut_cable_is_stale_and_never_shown_as_live() {
    let TestPlant { plant, line, .. } = TestPlant::of(1).await;
    tokio::time::sleep(Duration::from_secs(15)).await;
    let (_, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["measurements"]["quality"], "good", "{drive}");
    line.cut();
    tokio::time::sleep(Duration::from_secs(5)).await;
    let (_, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    assert_eq!((&drive["status"]["quality"], &drive["link"]), (&"stale".into(), &"lost".into()), "{drive}");
    assert_eq!(drive["measurements"]["quality"], "stale");
    assert!(drive["status"]["age_ms"].as_u64().unwrap() >= 5_000, "{drive}");
    assert!(drive["start_refused"].is_string() && drive["reached"].is_null(), "{drive}");
}

#[tokio::test(start_paused = true)]
async fn a_tripped_drive_says_what_the_fault_means_and_what_to_do() {
    let TestPlant { plant, machines, .. } = TestPlant::of(1).await;
    machines[0].trip(9);
    tokio::time::sleep(Duration::from_secs(3)).await;
    let (_, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    // BBV51701, fault codes of LFT: 9 = overcurrent OCF.
    assert_eq!((&drive["fault"]["code"], &drive["fault"]["mnemonic"]), (&9.into(), &"OCF".into()), "{drive}");
    assert!(drive["fault"]["remedy"].is_string() && drive["start_refused"].is_string(), "{drive}");
    assert!(drive["fault"]["at_trip"]["age_ms"].is_u64(), "the freeze-frame says how old it is: {drive}");
}
