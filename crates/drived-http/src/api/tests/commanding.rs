//! Commands and their outcomes.

use std::time::Duration;

use axum::http::Method;
use drive_core::{Frequency, Identity, State};
use drive_fleet::{Band, DriveSettings, FrequencyLimits};
use serde_json::json;
use tokio::time::{Instant, sleep, timeout};

use super::*;
use drived_config::config::Group;
use drived_doors::Scope;
use drived_words::json::unix;

const RUN: &str = "/api/v1/drives/pump%201/start";
const STOP: &str = "/api/v1/drives/pump%201/stop";

pub(super) fn is_running(plant: &TestPlant, number: usize) -> bool {
    plant.machines[number].observe().running
}

fn requests(plant: &TestPlant) -> u64 {
    plant.machines[0].requests(6) + plant.machines[0].requests(16)
}

#[tokio::test(start_paused = true)]
async fn every_verb_is_carried_out_and_its_outcome_told() {
    let plant = TestPlant::of(1).await;
    let body = json!({"id": "a-1", "direction": "reverse", "setpoint": {"frequency_hz": 30.5}});
    let (status, start) = command(&plant.plant, RUN, &body).await;
    assert_eq!(status, StatusCode::OK, "{start}");
    assert_eq!((&start["id"], &start["outcome"]), (&"a-1".into(), &"confirmed".into()));
    assert_eq!((&start["caller"], &start["action"]), (&"operator".into(), &"start".into()));
    assert_eq!(start["command"], "start reverse at 30.50 Hz");
    assert_eq!(start["status"]["state"], "running");
    assert!(is_running(&plant, 0));

    let setpoint = "/api/v1/drives/pump%201/setpoint";
    let (status, changed) =
        command(&plant.plant, setpoint, &json!({"setpoint": {"frequency_hz": 20.0}})).await;
    assert_eq!((status, &changed["outcome"]), (StatusCode::OK, &"confirmed".into()), "{changed}");
    let (_, drive) = get(&plant.plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["setpoint"]["frequency_hz"], 20.0);

    let (status, stop) = send(api(&plant.plant, "operator", ALL), {
        let path = format!("{STOP}?wait=20s");
        post(&path, &json!({"mode": "fast"}))
    })
    .await;
    assert_eq!((status, &stop["outcome"]), (StatusCode::OK, &"confirmed".into()), "{stop}");
    assert_eq!(plant.machines[0].observe().output_frequency, 0);

    plant.machines[0].trip(9);
    sleep(Duration::from_secs(3)).await;
    let (status, refused) = command(&plant.plant, RUN, &json!({})).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::CONFLICT, &"fault".into()), "{refused}");
    let (status, reset) = command(&plant.plant, "/api/v1/drives/pump%201/reset", &json!({})).await;
    assert_eq!((status, &reset["outcome"]), (StatusCode::OK, &"confirmed".into()), "{reset}");

    let (status, release) = command(&plant.plant, "/api/v1/drives/pump%201/release", &json!({})).await;
    let told = get(&plant.plant, &format!("/api/v1/commands/{}", release["id"].as_str().unwrap())).await.1;
    assert_eq!(told["outcome"], release["outcome"], "{status} {release}");
}

/// A start that a network has kept: nobody knows when it was wished but by what it says itself.
#[tokio::test(start_paused = true)]
async fn a_start_that_says_when_it_was_issued_is_not_begun_behind_a_stop_since_nor_when_its_time_is_over() {
    let plant = TestPlant::of(1).await;
    let issued = |ago: u64| json!({"issued_unix_ms": unix(Instant::now()) - ago, "expires_in_ms": 5_000});
    let (_, stop) =
        send(api(&plant.plant, "another", ALL), post(&format!("{STOP}?wait=20s"), &json!({}))).await;
    assert_eq!(stop["outcome"], "confirmed", "{stop}");
    sleep(Duration::from_millis(1_000)).await;
    let (status, late) = command(&plant.plant, RUN, &issued(2_000)).await;
    assert_eq!((status, &late["outcome"]), (StatusCode::CONFLICT, &"superseded".into()), "{late}");
    for verb in ["start", "setpoint", "reset", "release", "save"] {
        let mut body = issued(5_500);
        if verb == "setpoint" {
            body["setpoint"] = json!({"frequency_hz": 20.0});
        }
        let (status, old) = command(&plant.plant, &format!("/api/v1/drives/pump%201/{verb}"), &body).await;
        assert_eq!((status, &old["outcome"]), (StatusCode::CONFLICT, &"expired".into()), "{verb}: {old}");
    }
    assert!(!is_running(&plant, 0));
    let (status, ahead) =
        command(&plant.plant, RUN, &json!({"issued_unix_ms": unix(Instant::now()) + 60_000})).await;
    assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{ahead}");
    sleep(Duration::from_millis(5_000)).await;
    let (status, start) = command(&plant.plant, RUN, &issued(500)).await;
    assert_eq!((status, &start["outcome"]), (StatusCode::OK, &"confirmed".into()), "{start}");
}

#[tokio::test(start_paused = true)]
async fn the_same_id_and_body_is_answered_and_not_repeated() {
    let plant = TestPlant::of(1).await;
    let body = json!({"id": "once", "setpoint": {"frequency_hz": 30.0}});
    let (_, first) = command(&plant.plant, RUN, &body).await;
    let (_, stop) = command(&plant.plant, &format!("{STOP}?wait=20s"), &json!({})).await;
    assert_eq!(stop["outcome"], "confirmed", "{stop}");
    let before = requests(&plant);
    let (status, again) = command(&plant.plant, RUN, &body).await;
    assert_eq!((status, &again["time_unix_ms"]), (StatusCode::OK, &first["time_unix_ms"]));
    sleep(Duration::from_secs(5)).await;
    assert_eq!(requests(&plant), before, "nothing was written again");
    assert!(!is_running(&plant, 0), "and nothing moves");
}

#[tokio::test(start_paused = true)]
async fn an_id_with_another_body_is_refused_and_another_callers_is_his_own() {
    let plant = TestPlant::of(2).await;
    let body = json!({"id": "once", "setpoint": {"frequency_hz": 30.0}});
    assert_eq!(command(&plant.plant, RUN, &body).await.0, StatusCode::OK);
    let other = json!({"id": "once", "setpoint": {"frequency_hz": 31.0}});
    let (status, refused) = command(&plant.plant, RUN, &other).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::CONFLICT, &"id_reused".into()), "{refused}");
    let (status, _) = command(&plant.plant, "/api/v1/drives/pump%202/start", &body).await;
    assert_eq!((status, is_running(&plant, 1)), (StatusCode::CONFLICT, false));
    // Two that count their commands alike: each is answered for his own, and by the id alone neither is.
    assert_eq!(get(&plant.plant, "/api/v1/commands/once").await.0, StatusCode::OK);
    for _ in 0..2 {
        let (status, his) = send(api(&plant.plant, "somebody else", ALL), post(RUN, &other)).await;
        assert_eq!((status, &his["caller"]), (StatusCode::OK, &"somebody else".into()), "{his}");
    }
    let (status, again) = command(&plant.plant, RUN, &body).await;
    assert_eq!((status, again["caller"] != "somebody else"), (StatusCode::OK, true), "{again}");
    assert_eq!(get(&plant.plant, "/api/v1/commands/once").await.0, StatusCode::NOT_FOUND);
}

#[tokio::test(start_paused = true)]
async fn a_stop_with_a_used_id_still_stops() {
    let plant = TestPlant::of(1).await;
    let id = json!({"id": "again"});
    for _ in 0..2 {
        let start = json!({"setpoint": {"frequency_hz": 30.0}});
        assert_eq!(command(&plant.plant, RUN, &start).await.0, StatusCode::OK);
        assert!(is_running(&plant, 0));
        let (status, stop) = command(&plant.plant, &format!("{STOP}?wait=20s"), &id).await;
        assert_eq!((status, &stop["outcome"]), (StatusCode::OK, &"confirmed".into()), "{stop}");
        assert!(!is_running(&plant, 0), "each stop is carried out");
    }
    // Also by the id of a start.
    let start = json!({"id": "again too", "setpoint": {"frequency_hz": 30.0}});
    let start = json!({"id": "again-too", "setpoint": start["setpoint"]});
    assert_eq!(command(&plant.plant, RUN, &start).await.0, StatusCode::OK);
    let stop = json!({"id": "again-too"});
    assert_eq!(command(&plant.plant, &format!("{STOP}?wait=20s"), &stop).await.0, StatusCode::OK);
    assert!(!is_running(&plant, 0));
    assert_eq!(command(&plant.plant, RUN, &start).await.0, StatusCode::CONFLICT, "the start is not repeated");
}

#[tokio::test(start_paused = true)]
async fn a_stop_whose_wait_is_not_understood_is_a_stop() {
    let plant = TestPlant::of(1).await;
    for path in [STOP, "/api/v1/stop"] {
        for wait in ["wait=40s", "wait=soon", "wait=2s&wait=3s"] {
            let start = json!({"setpoint": {"frequency_hz": 30.0}});
            assert_eq!(command(&plant.plant, RUN, &start).await.0, StatusCode::OK);
            let (status, stop) = command(&plant.plant, &format!("{path}?{wait}"), &json!({})).await;
            assert!(status.is_success(), "{path}?{wait}: {status} {stop}");
            sleep(Duration::from_secs(20)).await;
            assert!(!is_running(&plant, 0), "{path}?{wait}");
            // Of a start it is none.
            assert_eq!(
                command(&plant.plant, &format!("{RUN}?{wait}"), &start).await.0,
                StatusCode::BAD_REQUEST
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn an_expired_start_is_never_sent() {
    let plant = TestPlant::of(1).await;
    // A first command holds the drive for longer than the second may wait.
    plant.machines[0].mute();
    let held = tokio::spawn({
        let plant = plant.plant.clone();
        async move {
            command(
                &plant,
                "/api/v1/drives/pump%201/setpoint?wait=30s",
                &json!({"setpoint": {"frequency_hz": 10.0}}),
            )
            .await
        }
    });
    sleep(Duration::from_millis(50)).await;
    let body = json!({"expires_in_ms": 200, "setpoint": {"frequency_hz": 30.0}});
    let start = tokio::spawn({
        let plant = plant.plant.clone();
        async move { command(&plant, &format!("{RUN}?wait=30s"), &body).await }
    });
    sleep(Duration::from_millis(250)).await;
    plant.machines[0].unmute();
    let (status, start) = start.await.unwrap();
    assert_eq!((status, &start["outcome"]), (StatusCode::GONE, &"expired".into()), "{start}");
    let (_, held) = held.await.unwrap();
    sleep(Duration::from_secs(10)).await;
    assert!(!is_running(&plant, 0), "{held}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_behind_a_hundred_starts_is_on_the_wire_within_the_bound() {
    let plant = TestPlant::of(4).await;
    let start = json!({"setpoint": {"frequency_hz": 30.0}});
    for number in 0..100 {
        let path = format!("/api/v1/drives/pump%20{}/start?wait=0", number % 4 + 1);
        let _ = command(&plant.plant, &path, &start).await;
    }
    let line = plant.plant.fleet().lines().remove(0).1;
    let stopped = |index: usize| plant.machines[index].observe();
    let (before, asked) =
        (plant.machines.iter().map(drive_sim::SimSlave::all_requests).sum::<u64>(), Instant::now());
    let (status, all) = command(&plant.plant, "/api/v1/stop?wait=0", &Value::Null).await;
    assert_eq!((status, asked.elapsed()), (StatusCode::ACCEPTED, Duration::ZERO), "{all}");
    assert_eq!(all["drives"].as_array().unwrap().len(), 4);
    let stops = line.stats().class(drive_core::Class::Stop).sent;
    while line.stats().class(drive_core::Class::Stop).sent == stops {
        assert!(asked.elapsed() <= line.worst_case_stop(), "{before}");
        sleep(Duration::from_millis(1)).await;
    }
    let id = all["id"].as_str().unwrap();
    let (_, told) = get(&plant.plant, &format!("/api/v1/commands/{id}?wait=30s")).await;
    assert_eq!((&told["outcome"], &told["confirmed"]), (&"confirmed".into(), &4.into()), "{told}");
    assert!((0..4).all(|index| stopped(index).output_frequency == 0));
    sleep(Duration::from_secs(10)).await;
    assert!((0..4).all(|index| !is_running(&plant, index)), "and none of the starts comes later");
}

#[tokio::test(start_paused = true)]
async fn a_client_that_goes_away_leaves_no_half_done_start() {
    let plant = TestPlant::of(3).await;
    let body = json!({"id": "group", "setpoint": {"frequency_hz": 30.0}});
    let path = "/api/v1/groups/pumps/start?wait=30s";
    let gone = timeout(Duration::from_millis(20), command(&plant.plant, path, &body)).await;
    assert!(gone.is_err(), "the client goes before the answer");
    sleep(Duration::from_secs(30)).await;
    assert!((0..3).all(|index| is_running(&plant, index)), "the whole group has started");
    let (_, told) = get(&plant.plant, "/api/v1/commands/group").await;
    assert_eq!((&told["outcome"], &told["confirmed"]), (&"confirmed".into(), &3.into()), "{told}");
}

#[tokio::test(start_paused = true)]
async fn drives_that_are_selected_are_commanded_each_by_itself_and_no_other() {
    let plant = TestPlant::of(4).await;
    plant.machines[1].trip(9);
    let tripped = plant.plant.fleet().drive("pump 2").unwrap();
    let _ = tripped
        .wait_until(|seen| seen.status.as_ref().is_some_and(|seen| seen.value.state == State::Fault))
        .await;
    let three = json!(["pump 1", "pump 2", "pump 3", "pump 1"]);
    let start = json!({"drives": three, "setpoint": {"frequency_hz": 30.0}, "expires_in_ms": 5_000});
    let (status, told) = command(&plant.plant, "/api/v1/selected/start?wait=30s", &start).await;
    // A group would have started nobody.
    assert_eq!(status, StatusCode::CONFLICT, "{told}");
    let outcomes = |told: &Value| {
        let each = told["drives"].as_array().unwrap().iter();
        each.map(|one| format!("{} {}", one["drive"], one["outcome"]).replace('"', "")).collect::<Vec<_>>()
    };
    assert_eq!(outcomes(&told), ["pump 1 confirmed", "pump 2 refused", "pump 3 confirmed"], "{told}");
    assert_eq!(told["selected"], json!(["pump 1", "pump 2", "pump 3"]));
    assert_eq!([0, 1, 2, 3].map(|number| is_running(&plant, number)), [true, false, true, false]);
    // A stop is one whatever else it says, and leaves alone whom it does not name.
    let stop = json!({"drives": ["pump 1", "nobody"], "mode": "no such mode", "more": 1});
    let (status, told) = command(&plant.plant, "/api/v1/selected/stop?wait=30s", &stop).await;
    assert_eq!((status, outcomes(&told)), (StatusCode::OK, vec!["pump 1 confirmed".to_owned()]), "{told}");
    assert_eq!([0, 2].map(|number| is_running(&plant, number)), [false, true]);
    for (body, expected) in [
        (json!({}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"drives": []}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"drives": "pump 1"}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"drives": ["pump 1"], "more": 1}), StatusCode::UNPROCESSABLE_ENTITY),
        (json!({"drives": ["pump 1", "nobody"]}), StatusCode::NOT_FOUND),
    ] {
        let (status, told) = command(&plant.plant, "/api/v1/selected/reset", &body).await;
        assert_eq!(status, expected, "{body}: {told}");
    }
}

/// Every route is asked, and what it did is held against what the doors are told of it.
#[tokio::test(start_paused = true)]
async fn whatever_stops_is_known_to_the_doors_as_a_stop_and_nothing_else_is() {
    let plant = TestPlant::of(1).await;
    let known = crate::api::stops();
    let mut stopped = Vec::new();
    for route in crate::api::routes::routes() {
        if route.method != Method::POST {
            continue;
        }
        let name = if route.path.contains("/groups/") { "pumps" } else { "pump%201" };
        let path = route.path.replace("{name}", name).replace("{id}", "1");
        // As whoever may only stop: what he may do is a stop, and what is a stop he may do.
        let rights = Rights { view: false, stop: true, operate: false, engineer: false };
        let body = if path.contains("/selected/") { json!({"drives": ["pump 1"]}) } else { json!({}) };
        let (status, told) = send(api(&plant.plant, "operator", rights), post(&path, &body)).await;
        let stops = told["action"] == "stop";
        assert_eq!(stops, status.is_success(), "{path}: {told}");
        if stops {
            stopped.push(route.path);
        }
    }
    assert_eq!(stopped, known);
    assert!(known.len() >= 4, "{known:?}");
}

#[tokio::test(start_paused = true)]
async fn a_group_whose_drive_has_left_is_not_started_and_nobody_else_for_it_but_it_is_stopped() {
    let plant = TestPlant::of(3).await;
    let (start, all) = (json!({"setpoint": {"frequency_hz": 30.0}}), "/api/v1/groups/pumps/start");
    // A drive leaves while a start of its group waits for its turn.
    let turn = plant.plant.hold_group_starts().await;
    let late = json!({"id": "late", "setpoint": {"frequency_hz": 30.0}, "expires_in_ms": 10_000});
    let (status, _) = command(&plant.plant, &format!("{all}?wait=0"), &late).await;
    assert_eq!(status, StatusCode::ACCEPTED);
    let _ = plant.plant.fleet().remove(&["pump 1"], Duration::from_secs(30)).await;
    drop(turn);
    sleep(Duration::from_secs(30)).await;
    let (_, told) = get(&plant.plant, "/api/v1/commands/late").await;
    assert_eq!(told["outcome"], "refused", "{told}");
    assert!((0..3).all(|index| !is_running(&plant, index)));
    assert_eq!(command(&plant.plant, all, &start).await.0, StatusCode::NOT_FOUND);
    let path = "/api/v1/drives/pump%202/start";
    assert_eq!(command(&plant.plant, path, &start).await.0, StatusCode::OK);
    let (_, stopped) = command(&plant.plant, "/api/v1/groups/pumps/stop?wait=30s", &Value::Null).await;
    assert_eq!((&stopped["outcome"], &stopped["confirmed"]), (&"confirmed".into(), &2.into()), "{stopped}");
    assert!(!is_running(&plant, 1));
}

#[tokio::test(start_paused = true)]
async fn another_drive_than_before_is_accepted_by_an_engineer_as_it_was_shown_and_started_then() {
    let remembered = Identity { model: Some("another".to_owned()), ..Identity::default() };
    let plant = TestPlant::with(1, |name| DriveSettings {
        identity: Some(remembered.clone()),
        ..DriveSettings::controlled(name)
    })
    .await;
    let accept = "/api/v1/drives/pump%201/accept";
    let (_, drive) = get(&plant.plant, "/api/v1/drives/pump%201").await;
    let shown = drive["identity"].clone();
    assert_eq!(shown["check"], "changed", "{drive}");
    let (status, refused) = command(&plant.plant, RUN, &json!({})).await;
    assert_eq!((status, &refused["reason"]), (StatusCode::CONFLICT, &"identity".into()), "{refused}");
    let operator = api(&plant.plant, "operator", Rights { engineer: false, ..ALL });
    assert_eq!(send(operator, post(accept, &json!({"identity": shown}))).await.0, StatusCode::FORBIDDEN);
    assert_eq!(command(&plant.plant, accept, &json!({})).await.0, StatusCode::UNPROCESSABLE_ENTITY);
    let (status, other) = command(&plant.plant, accept, &json!({"identity": remembered})).await;
    assert_eq!((status, &other["reason"]), (StatusCode::CONFLICT, &"not_as_shown".into()), "{other}");
    let (status, still) = command(&plant.plant, RUN, &json!({})).await;
    assert_eq!((status, &still["reason"]), (StatusCode::CONFLICT, &"identity".into()), "{still}");
    let (status, accepted) = command(&plant.plant, accept, &json!({"identity": shown})).await;
    assert_eq!((status, &accepted["outcome"]), (StatusCode::OK, &"confirmed".into()), "{accepted}");
    assert_eq!(accepted["action"], "accept");
    let (_, drive) = get(&plant.plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["identity"]["check"], "same", "{drive}");
    assert!(!is_running(&plant, 0), "nothing of before is carried out by it");
    let (_, recent) = get(&plant.plant, "/api/v1/events/recent").await;
    let told =
        recent.as_array().unwrap().iter().filter(|one| one.to_string().contains("accepting the identity"));
    assert_eq!(told.count(), 2, "each by its command alone: {recent}");
    assert_eq!(command(&plant.plant, RUN, &json!({})).await.0, StatusCode::OK);
}

#[tokio::test(start_paused = true)]
async fn two_callers_at_once_each_get_their_own_outcome_and_the_newer_setpoint_wins() {
    let plant = TestPlant::of(1).await;
    assert_eq!(
        command(&plant.plant, RUN, &json!({"setpoint": {"frequency_hz": 10.0}})).await.0,
        StatusCode::OK
    );
    let path = "/api/v1/drives/pump%201/setpoint";
    let set = |name: &'static str, hertz: f64| {
        send(api(&plant.plant, name, ALL), post(path, &json!({"setpoint": {"frequency_hz": hertz}})))
    };
    let ((_, first), (_, second), (_, third)) =
        tokio::join!(set("one", 20.0), set("two", 25.0), set("three", 30.0));
    let superseded = [&first, &second].iter().filter(|told| told["outcome"] == "superseded").count();
    assert!(superseded >= 1, "{first} {second}");
    assert_eq!((&third["outcome"], &third["caller"]), (&"confirmed".into(), &"three".into()), "{third}");
    let (_, drive) = get(&plant.plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["setpoint"]["frequency_hz"], 30.0);
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_accounts_for_every_drive() {
    let plant = TestPlant::with(4, |name| match name.as_str() {
        "pump 4" => DriveSettings::watched(name),
        _ => DriveSettings::controlled(name),
    })
    .await;
    for number in 1..=3 {
        let path = format!("/api/v1/drives/pump%20{number}/start");
        assert_eq!(
            command(&plant.plant, &path, &json!({"setpoint": {"frequency_hz": 30.0}})).await.0,
            StatusCode::OK
        );
    }
    plant.machines[2].mute();
    sleep(Duration::from_secs(8)).await;
    let (_, first) = command(&plant.plant, "/api/v1/stop?wait=0", &json!({"id": "all"})).await;
    let count = |told: &Value, key: &str| told[key].as_u64().unwrap();
    let sum = |told: &Value| {
        ["confirmed", "pending", "not_reachable", "refused", "failed"]
            .iter()
            .map(|key| count(told, key))
            .sum::<u64>()
    };
    assert_eq!((sum(&first), count(&first, "not_reachable"), count(&first, "refused")), (4, 1, 1), "{first}");
    assert_eq!(first["drives"][3]["reason"], "read_only");
    sleep(Duration::from_secs(40)).await;
    let (_, told) = get(&plant.plant, "/api/v1/commands/all").await;
    assert_eq!((sum(&told), count(&told, "confirmed"), count(&told, "not_reachable")), (4, 2, 1), "{told}");
    assert_eq!(told["outcome"], "unknown", "one motor may still run");
    // The stop goes on, and what becomes of it is told under the same id.
    plant.machines[2].unmute();
    sleep(Duration::from_secs(40)).await;
    let (_, told) = get(&plant.plant, "/api/v1/commands/all").await;
    assert_eq!((count(&told, "confirmed"), &told["outcome"]), (3, &"confirmed".into()), "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_group_of_which_one_is_not_ready_is_not_started_and_each_says_why() {
    let plant = TestPlant::of(3).await;
    plant.machines[1].trip(9);
    sleep(Duration::from_secs(3)).await;
    let (status, told) =
        command(&plant.plant, "/api/v1/groups/pumps/start", &json!({"setpoint": {"frequency_hz": 30.0}}))
            .await;
    assert_eq!(status, StatusCode::CONFLICT, "{told}");
    let drives = &told["drives"];
    let reasons: Vec<_> = (0..3).map(|index| drives[index]["reason"].as_str().unwrap()).collect();
    assert_eq!(reasons, ["group_not_ready", "fault", "group_not_ready"]);
    assert!((0..3).all(|index| !is_running(&plant, index)));
}

#[tokio::test(start_paused = true)]
async fn what_is_not_allowed_is_refused_with_its_reason() {
    let plant = TestPlant::with(3, |name| match name.as_str() {
        "pump 1" => DriveSettings::watched(name),
        "pump 2" => DriveSettings {
            commanders: drive_fleet::Commanders::Only(vec!["chief".to_owned()]),
            ..DriveSettings::controlled(name)
        },
        _ => DriveSettings {
            limits: FrequencyLimits {
                high: Some(Frequency::from_hertz(40)),
                forbidden: vec![Band { low: Frequency::from_hertz(20), high: Frequency::from_hertz(22) }],
                ..FrequencyLimits::default()
            },
            ..DriveSettings::controlled(name)
        },
    })
    .await;
    let at = |hertz: f64| json!({"setpoint": {"frequency_hz": hertz}});
    for (drive, body, status, reason) in [
        (1, at(30.0), 409, "read_only"),
        (2, at(30.0), 403, "no_right"),
        (3, at(41.0), 409, "limit"),
        (3, at(21.0), 409, "forbidden_band"),
    ] {
        let (told, problem) =
            command(&plant.plant, &format!("/api/v1/drives/pump%20{drive}/start"), &body).await;
        assert_eq!((told.as_u16(), &problem["reason"]), (status, &reason.into()), "{problem}");
        assert_eq!((&problem["status"], &problem["outcome"]), (&status.into(), &"refused".into()));
    }
    assert!((0..3).all(|index| !is_running(&plant, index)));
}

/// Behind its door it waits for the disk of the audit log, for however long that takes.
#[tokio::test(start_paused = true)]
async fn what_came_before_a_stop_is_not_begun_behind_it_and_its_time_runs_from_its_door_on() {
    let plant = TestPlant::of(1).await;
    let came = |ago: Duration| {
        let router = api(&plant.plant, "operator", ALL);
        router.layer(Extension(drived_doors::Arrived(Instant::now() - ago)))
    };
    let start = || post(RUN, &json!({"setpoint": {"frequency_hz": 20.0}, "expires_in_ms": 1_000}));
    let (_, late) = send(came(Duration::from_millis(1_001)), start()).await;
    assert_eq!(late["outcome"], "expired", "{late}");
    assert_eq!(command(&plant.plant, STOP, &json!({})).await.0, StatusCode::OK);
    sleep(Duration::from_millis(100)).await;
    let (status, before) = send(came(Duration::from_millis(400)), start()).await;
    assert_eq!((status, &before["outcome"]), (StatusCode::CONFLICT, &"superseded".into()), "{before}");
    sleep(Duration::from_secs(10)).await;
    assert!(!is_running(&plant, 0));
    assert_eq!(send(came(Duration::from_millis(50)), start()).await.0, StatusCode::OK);
}

#[tokio::test(start_paused = true)]
async fn a_token_for_one_group_moves_its_drives_alone_and_stops_them_all() {
    let plant = TestPlant::with(3, DriveSettings::controlled).await;
    let group = Group { name: "hall".to_owned(), drives: vec!["pump 1".to_owned(), "pump 2".to_owned()] };
    plant.plant.set_groups(vec![group]);
    let scope = Scope::of(vec!["pump 2".to_owned()], Vec::new());
    let in_hall = Scope::of(Vec::new(), vec!["hall".to_owned()]);
    let of = |scope: &Option<Scope>| {
        let caller = Caller { scope: scope.clone(), ..Caller::new("panel", "test", ALL) };
        super::router(plant.plant.clone()).layer(Extension(caller))
    };
    let at = json!({"setpoint": {"frequency_hz": 30.0}});
    let start = |whom: &str| post(&format!("/api/v1/{whom}/start?wait=20s"), &at);
    for (scope, whom) in [(&scope, "drives/pump%201"), (&scope, "groups/hall"), (&in_hall, "drives/pump%203")]
    {
        let (status, problem) = send(of(scope), start(whom)).await;
        assert_eq!((status, &problem["reason"]), (StatusCode::FORBIDDEN, &"no_right".into()), "{problem}");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.starts_with("the token panel is not for pump "), "{detail}");
    }
    assert!((0..3).all(|index| !is_running(&plant, index)));
    for whom in ["parameters/ACC", "parameters/LAC"] {
        let body = Body::from(json!({"value": 3.0}).to_string());
        let put = Request::put(format!("/api/v1/drives/pump%201/{whom}"))
            .header("content-type", "application/json");
        let (status, problem) = send(of(&scope), put.body(body).unwrap()).await;
        assert_eq!((status, &problem["reason"]), (StatusCode::FORBIDDEN, &"no_right".into()), "{problem}");
    }
    assert_eq!(send(of(&scope), start("drives/pump%202")).await.0, StatusCode::OK);
    assert_eq!(send(of(&in_hall), start("drives/pump%201")).await.0, StatusCode::OK);
    let (_, state) = send(of(&in_hall), Request::get("/api/v1/state").body(Body::empty()).unwrap()).await;
    assert_eq!(state["daemon"]["scope"], json!(["pump 1", "pump 2"]));
    // A stop is everybody's who may stop.
    let stop = post("/api/v1/stop?wait=20s", &json!({}));
    assert_eq!(send(of(&scope), stop).await.0, StatusCode::OK);
    assert!((0..3).all(|index| !is_running(&plant, index)));
}

#[tokio::test(start_paused = true)]
async fn each_right_is_asked_for_and_a_stop_is_one_of_its_own() {
    let plant = TestPlant::of(1).await;
    let stop_only = Rights { stop: true, ..Rights::NONE };
    let start = || post(RUN, &json!({"setpoint": {"frequency_hz": 30.0}}));
    let read = || Request::get("/api/v1/state").body(Body::empty()).unwrap();
    for (name, status) in [("panel", StatusCode::FORBIDDEN), ("anonymous", StatusCode::UNAUTHORIZED)] {
        let (told, problem) = send(api(&plant.plant, name, stop_only), start()).await;
        assert_eq!((told, &problem["reason"]), (status, &"no_right".into()), "{problem}");
        assert_eq!(send(api(&plant.plant, name, stop_only), read()).await.0, status);
        let stop = post(&format!("{STOP}?wait=20s"), &Value::Null);
        assert_eq!(send(api(&plant.plant, name, stop_only), stop).await.0, StatusCode::OK);
    }
    let view = Rights { view: true, ..Rights::NONE };
    for asked in [start(), post(STOP, &Value::Null)] {
        assert_eq!(send(api(&plant.plant, "guest", view), asked).await.0, StatusCode::FORBIDDEN);
    }
    assert_eq!(send(api(&plant.plant, "guest", view), read()).await.0, StatusCode::OK);
    assert!(!is_running(&plant, 0));
}

#[tokio::test(start_paused = true)]
async fn what_is_no_command_is_a_problem_document_and_moves_nothing() {
    let plant = TestPlant::of(1).await;
    let raw = |path: &str, kind: &str, body: String| {
        Request::post(path).header("content-type", kind).body(Body::from(body)).unwrap()
    };
    let json = "application/json";
    for (number, (request, status)) in [
        (raw(RUN, json, "{".to_owned()), 400),
        (raw(RUN, json, "[1]".to_owned()), 422),
        (raw(RUN, json, r#"{"setpoint": {"frequency_hz": -5}}"#.to_owned()), 422),
        (raw(RUN, json, r#"{"setpoint": {"frequency_hz": 1e99}}"#.to_owned()), 422),
        (raw(RUN, json, r#"{"setpoint": {"frequency_hz": 30, "speed_rpm": 900}}"#.to_owned()), 422),
        (raw(RUN, json, r#"{"speed": 1}"#.to_owned()), 422),
        (raw(RUN, json, r#"{"expires_in_ms": 0}"#.to_owned()), 422),
        (raw(RUN, json, r#"{"expires_in_ms": 10001}"#.to_owned()), 422),
        (raw(RUN, json, format!(r#"{{"id": "{}"}}"#, "x".repeat(65))), 422),
        (raw(RUN, "text/plain", "{}".to_owned()), 415),
        (Request::post(RUN).body(Body::from("{}")).unwrap(), 415),
        (raw(RUN, json, format!(r#"{{"id": "{}"}}"#, "x".repeat(100_000))), 413),
        (raw(&format!("{RUN}?wait=31s"), json, String::new()), 400),
        (raw("/api/v1/drives/pump%209/start", json, String::new()), 404),
        (raw("/api/v1/groups/fans/start", json, String::new()), 404),
        (raw("/api/v1/nothing", json, String::new()), 404),
        (raw("/api/v1/state", json, String::new()), 405),
        (Request::get("/api/v1/commands/none").body(Body::empty()).unwrap(), 404),
        (Request::get("/api/v1/events?since=x").body(Body::empty()).unwrap(), 400),
    ]
    .into_iter()
    .enumerate()
    {
        let what = format!("{number}: {} {}", request.method(), request.uri());
        let response = api(&plant.plant, "operator", ALL).oneshot(request).await.unwrap();
        assert_eq!(response.status().as_u16(), status, "{what}");
        assert_eq!(response.headers()["content-type"], "application/problem+json", "{what}");
        let body = response.into_body().collect().await.unwrap().to_bytes();
        let problem: Value = serde_json::from_slice(&body).unwrap();
        assert_eq!(problem["status"], status, "{what}");
        assert!(problem["detail"].is_string() && problem["title"].is_string(), "{problem}");
    }
    sleep(Duration::from_secs(5)).await;
    assert!(!is_running(&plant, 0));
}

#[tokio::test(start_paused = true)]
async fn a_body_that_says_two_things_starts_no_motor_and_the_key_is_named() {
    let plant = TestPlant::of(1).await;
    let raw = |path: &str, body: &str| {
        let request = Request::post(path).header("content-type", "application/json");
        request.body(Body::from(body.to_owned())).unwrap()
    };
    for (body, key) in [
        (r#"{"setpoint": {"frequency_hz": 10, "frequency_hz": 50}}"#, "setpoint.frequency_hz"),
        (r#"{"direction": "forward", "direction": "reverse"}"#, "direction"),
        (r#"{"setpoint": null}"#, "setpoint"),
        (r#"{"stop": true}"#, "no stop and no start"),
        (r#"{"action": "stop"}"#, "no stop and no start"),
        ("null", "null"),
    ] {
        let (status, told) = send(api(&plant.plant, "operator", ALL), raw(RUN, body)).await;
        assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{body}: {told}");
        assert!(told["detail"].as_str().unwrap().contains(key), "{body}: {told}");
        sleep(Duration::from_secs(5)).await;
        assert!(!is_running(&plant, 0), "{body}");
    }
    let register = "/api/v1/drives/pump%201/parameters/ACC";
    let twice = Request::put(register).header("content-type", "application/json");
    let twice = twice.body(Body::from(r#"{"value": "5.0", "value": "50.0"}"#)).unwrap();
    let (status, told) = send(api(&plant.plant, "operator", ALL), twice).await;
    assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_stops_whatever_its_body_says() {
    let plant = TestPlant::of(1).await;
    for body in ["", "null", "{", "[1]", r#"{"id": 7}"#, r#"{"mode": "gently"}"#, r#"{"action": "start"}"#] {
        let start = json!({"setpoint": {"frequency_hz": 30.0}});
        assert_eq!(command(&plant.plant, RUN, &start).await.0, StatusCode::OK);
        let stop = Request::post(format!("{STOP}?wait=20s")).header("content-type", "application/json");
        let stop = stop.body(Body::from(body)).unwrap();
        let (status, told) = send(api(&plant.plant, "operator", ALL), stop).await;
        assert_eq!((status, &told["command"]), (StatusCode::OK, &"ramp stop".into()), "{body}: {told}");
        assert!(!is_running(&plant, 0), "{body}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_over_http_is_on_the_wire_within_its_bound_while_a_hundred_starts_wait() {
    let plant = TestPlant::of(4).await;
    let north = plant.plant.fleet().lines().remove(0).1;
    let starts = (0..100).map(|number| {
        let path = format!("/api/v1/drives/pump%20{}/start?wait=0s", number % 4 + 1);
        let body = json!({"id": format!("start-{number}"), "setpoint": {"frequency_hz": 20.0}});
        let plant = &plant.plant;
        async move { command(plant, &path, &body).await.0 }
    });
    let answered = futures_util::future::join_all(starts).await;
    assert!(answered.contains(&StatusCode::ACCEPTED), "they wait: {answered:?}");
    let (status, stopped) = command(&plant.plant, "/api/v1/stop?wait=30s", &json!({})).await;
    assert_eq!((status, &stopped["confirmed"]), (StatusCode::OK, &4.into()), "{stopped}");
    // The line's own count, from the call of each stop to its first bit, in virtual time.
    let stats = north.stats();
    let stops = stats.class(drive_core::Class::Stop);
    assert!(stops.sent >= 4, "{}", stops.sent);
    assert!(stops.wait.max() <= north.worst_case_stop(), "{:?}", stops.wait);
    sleep(Duration::from_secs(10)).await;
    assert!((0..4).all(|number| !is_running(&plant, number)), "no start came after the stop");
}

#[tokio::test(start_paused = true)]
async fn once_the_daemon_is_about_to_end_a_stop_is_carried_out_what_was_begun_is_told_and_nothing_is_started()
{
    let plant = TestPlant::of(2).await;
    let body = json!({"id": "once", "setpoint": {"frequency_hz": 30.0}});
    assert_eq!(command(&plant.plant, RUN, &body).await.0, StatusCode::OK);
    assert_eq!(get(&plant.plant, "/readyz").await.0, StatusCode::OK);
    plant.plant.close();
    let (status, again) = command(&plant.plant, RUN, &body).await;
    assert_eq!((status, &again["outcome"]), (StatusCode::OK, &"confirmed".into()), "{again}");
    for (action, body) in [
        ("start", json!({"setpoint": {"frequency_hz": 30.0}})),
        ("setpoint", json!({"setpoint": {"frequency_hz": 30.0}})),
        ("reset", json!({})),
        ("release", json!({})),
        ("save", json!({})),
    ] {
        let path = format!("/api/v1/drives/pump%202/{action}");
        let (status, refused) = command(&plant.plant, &path, &body).await;
        assert_eq!(status, StatusCode::CONFLICT, "{action}: {refused}");
        assert_eq!(
            (&refused["outcome"], &refused["reason"]),
            (&"refused".into(), &"closing".into()),
            "{action}"
        );
    }
    assert_eq!(get(&plant.plant, "/readyz").await.0, StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(get(&plant.plant, "/api/v1/state").await.0, StatusCode::OK, "what is there is told");
    let (status, stop) = command(&plant.plant, &format!("{STOP}?wait=20s"), &json!({})).await;
    assert_eq!((status, &stop["outcome"]), (StatusCode::OK, &"confirmed".into()), "{stop}");
    assert!(!is_running(&plant, 0) && !is_running(&plant, 1));
}
