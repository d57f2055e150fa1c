//! What a command says that was shown: it is carried out so, or refused.

use drive_fleet::DriveSettings;
use serde_json::json;
use tokio::time::Instant;

use super::{commanding::is_running, *};
use drived_config::config::Group;
use drived_plant::plant::commands::{Action, LIFETIME, Otherwise, Rejected, Request, Target};

const START: &str = "/api/v1/drives/pump%201/start";

/// A drive as the state shows it, as a command says it.
async fn shown(plant: &TestPlant, name: &str) -> Value {
    let (_, drive) = get(&plant.plant, &format!("/api/v1/drives/{}", name.replace(' ', "%20"))).await;
    json!({"name": name, "place": drive["place"]})
}

async fn shown_at(plant: &TestPlant, name: &str, hertz: f64) -> Value {
    let mut shown = shown(plant, name).await;
    shown["setpoint"] = json!({"frequency_hz": hertz});
    shown
}

async fn give(plant: &TestPlant, name: &str, hertz: f64) {
    let path = format!("/api/v1/drives/{}/setpoint", name.replace(' ', "%20"));
    let (status, told) = command(&plant.plant, &path, &json!({"setpoint": {"frequency_hz": hertz}})).await;
    assert_eq!(status, StatusCode::OK, "{told}");
}

/// The names of both drives are exchanged, as a reload exchanges them.
fn exchange_names(plant: &TestPlant) {
    for (old, new) in [("pump 1", "aside"), ("pump 2", "pump 1"), ("aside", "pump 2")] {
        plant.plant.fleet().rename(old, DriveSettings::controlled(new)).unwrap();
    }
}

fn assert_refused(told: &(StatusCode, Value), detail: &str) {
    let (status, problem) = told;
    assert_eq!(*status, StatusCode::CONFLICT, "{problem}");
    assert_eq!((&problem["reason"], &problem["outcome"]), (&"not_as_shown".into(), &"refused".into()));
    assert_eq!(problem["type"], "urn:drived:refused");
    assert_eq!(problem["detail"], format!("it is not as it was shown: {detail}"));
}

#[tokio::test(start_paused = true)]
async fn a_start_at_the_setpoint_that_was_shown_is_refused_when_somebody_has_given_another() {
    let plant = TestPlant::of(1).await;
    give(&plant, "pump 1", 20.0).await;
    let body = json!({"expects": {"drives": [shown_at(&plant, "pump 1", 20.0).await]}});
    give(&plant, "pump 1", 45.0).await;
    let told = command(&plant.plant, START, &body).await;
    assert_refused(&told, "the setpoint of pump 1 is 45.00 Hz now");
    assert!(!is_running(&plant, 0));
    let body = json!({"expects": {"drives": [shown_at(&plant, "pump 1", 45.0).await]}});
    assert_eq!(command(&plant.plant, START, &body).await.0, StatusCode::OK);
}

/// Two people ask at one time: who answers his question second has not seen that the motor turns.
#[tokio::test(start_paused = true)]
async fn a_motor_that_somebody_else_has_started_meanwhile_is_not_turned_round() {
    let plant = TestPlant::of(1).await;
    give(&plant, "pump 1", 20.0).await;
    let mut shown = shown(&plant, "pump 1").await;
    shown["driven"] = "not".into();
    let body = json!({"expects": {"drives": [shown]}});
    let (status, told) = command(&plant.plant, START, &json!({"direction": "reverse"})).await;
    assert_eq!(status, StatusCode::OK, "{told}");
    let told = command(&plant.plant, START, &body).await;
    assert_refused(&told, "pump 1 is driven in reverse now");
    shown["driven"] = "forward".into();
    let told = command(&plant.plant, START, &json!({"expects": {"drives": [shown]}})).await;
    assert_refused(&told, "pump 1 is driven in reverse now");
    command(&plant.plant, "/api/v1/stop?wait=20s", &json!({})).await;
    tokio::time::sleep(std::time::Duration::from_secs(10)).await;
    let told = command(&plant.plant, START, &json!({"expects": {"drives": [shown]}})).await;
    assert_refused(&told, "pump 1 is not driven any more");
    let (status, told) = command(&plant.plant, START, &body).await;
    assert_eq!((status, is_running(&plant, 0)), (StatusCode::OK, true), "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_that_is_on_its_way_is_not_the_one_that_was_shown() {
    let plant = TestPlant::of(1).await;
    give(&plant, "pump 1", 20.0).await;
    let body = json!({"expects": {"drives": [shown_at(&plant, "pump 1", 20.0).await]}});
    let setpoint = json!({"setpoint": {"frequency_hz": 45.0}});
    let given = command(&plant.plant, "/api/v1/groups/pumps/setpoint?wait=0", &setpoint).await;
    assert_eq!(given.0, StatusCode::ACCEPTED, "{}", given.1);
    let told = command(&plant.plant, START, &body).await;
    assert_refused(&told, "another setpoint is on its way to pump 1: 45.00 Hz");
    assert!(!is_running(&plant, 0));
}

#[tokio::test(start_paused = true)]
async fn the_motor_that_was_shown_is_meant_and_not_the_one_that_has_its_name_now() {
    let plant = TestPlant::of(2).await;
    let drives = json!({"drives": [shown(&plant, "pump 1").await]});
    exchange_names(&plant);
    for action in ["start", "setpoint", "reset", "release", "save"] {
        let mut body = json!({"expects": drives});
        if action == "setpoint" {
            body["setpoint"] = json!({"frequency_hz": 45.0});
        }
        let told = command(&plant.plant, &format!("/api/v1/drives/pump%201/{action}"), &body).await;
        assert_refused(&told, "the drive that was called pump 1 is called pump 2 now");
    }
    let (path, body) = ("/api/v1/drives/pump%201/parameters/ACC", json!({"value": 5, "expects": drives}));
    let mut request = post(path, &body);
    *request.method_mut() = axum::http::Method::PUT;
    let told = send(api(&plant.plant, "operator", ALL), request).await;
    assert_refused(&told, "the drive that was called pump 1 is called pump 2 now");
    assert!(!is_running(&plant, 0) && !is_running(&plant, 1));
}

#[tokio::test(start_paused = true)]
async fn who_is_called_otherwise_or_gone_is_told_by_both_names() {
    let plant = TestPlant::of(2).await;
    let mut elsewhere = shown(&plant, "pump 1").await;
    elsewhere["place"] = "/dev/ttyS9 atv312@1".into();
    let told = command(&plant.plant, START, &json!({"expects": {"drives": [elsewhere]}})).await;
    assert_refused(&told, "pump 1 is the name of another drive now");
    let body = json!({"expects": {"drives": [shown(&plant, "pump 1").await]}});
    plant.plant.fleet().rename("pump 1", DriveSettings::controlled("fan")).unwrap();
    let told = command(&plant.plant, START, &body).await;
    assert_refused(&told, "the drive that was called pump 1 is called fan now");
    let _ = plant.plant.fleet().remove(&["fan"], std::time::Duration::from_secs(1)).await;
    let told = command(&plant.plant, START, &body).await;
    assert_refused(&told, "the drive that was called pump 1 is there no more");
}

#[tokio::test(start_paused = true)]
async fn a_group_is_started_as_it_was_shown_or_nobody_of_it() {
    let plant = TestPlant::of(3).await;
    let of = |drives: &[&str]| {
        vec![Group { name: "pumps".into(), drives: drives.iter().map(|&name| name.into()).collect() }]
    };
    plant.plant.set_groups(of(&["pump 1", "pump 2"]));
    let drives = [shown(&plant, "pump 1").await, shown(&plant, "pump 2").await];
    let body = json!({"setpoint": {"frequency_hz": 20.0}, "expects": {"drives": drives}});
    let start = async || command(&plant.plant, "/api/v1/groups/pumps/start?wait=20s", &body).await;
    plant.plant.set_groups(of(&["pump 1", "pump 2", "pump 3"]));
    assert_refused(&start().await, "pump 3 has come to those that are meant");
    plant.plant.set_groups(of(&["pump 1"]));
    assert_refused(&start().await, "pump 2 is none of those that are meant any more");
    assert!((0..3).all(|number| !is_running(&plant, number)));
    // In whichever order.
    plant.plant.set_groups(of(&["pump 2", "pump 1"]));
    let (status, told) = start().await;
    assert_eq!(
        (status, is_running(&plant, 0), is_running(&plant, 2)),
        (StatusCode::OK, true, false),
        "{told}"
    );
}

#[tokio::test(start_paused = true)]
async fn those_that_somebody_has_selected_are_the_ones_that_were_shown() {
    let plant = TestPlant::of(2).await;
    let drives = [shown(&plant, "pump 1").await, shown(&plant, "pump 2").await];
    let body = json!({"drives": ["pump 1", "pump 2"], "expects": {"drives": drives}});
    exchange_names(&plant);
    let told = command(&plant.plant, "/api/v1/selected/start", &body).await;
    assert_refused(&told, "the drive that was called pump 1 is called pump 2 now");
    assert!(!is_running(&plant, 0) && !is_running(&plant, 1));
}

#[tokio::test(start_paused = true)]
async fn a_stop_stops_whoever_was_shown_and_whoever_has_the_name_now() {
    let plant = TestPlant::of(2).await;
    let body = json!({"expects": {"drives": [shown(&plant, "pump 1").await]}});
    for path in ["/api/v1/drives/pump%201/stop", "/api/v1/selected/stop"] {
        let start = json!({"setpoint": {"frequency_hz": 20.0}});
        let (status, told) = command(&plant.plant, "/api/v1/groups/pumps/start?wait=20s", &start).await;
        assert_eq!(status, StatusCode::OK, "{told}");
        exchange_names(&plant);
        let mut body = body.clone();
        if path.contains("selected") {
            body["drives"] = json!(["pump 1"]);
        }
        // The body was shown when the first had its own name.
        let is_as_before = path.contains("selected");
        let (status, told) = command(&plant.plant, &format!("{path}?wait=20s"), &body).await;
        assert_eq!((status, &told["outcome"]), (StatusCode::OK, &"confirmed".into()), "{told}");
        assert!(!is_running(&plant, 0), "{path}: it was shown");
        assert_eq!(is_running(&plant, 1), is_as_before, "{path}: and this one has its name");
        command(&plant.plant, "/api/v1/stop?wait=20s", &json!({})).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_one_whatever_was_shown_to_whom() {
    let plant = TestPlant::of(1).await;
    for expects in [
        json!(null),
        json!(7),
        json!({"drives": [{"name": 1}]}),
        json!({"drives": [{"name": "a", "place": "b"}]}),
    ] {
        let start = json!({"setpoint": {"frequency_hz": 20.0}});
        assert_eq!(command(&plant.plant, START, &start).await.0, StatusCode::OK);
        let body = json!({"expects": expects});
        let (status, told) = command(&plant.plant, "/api/v1/drives/pump%201/stop?wait=20s", &body).await;
        assert_eq!((status, is_running(&plant, 0)), (StatusCode::OK, false), "{body} {told}");
    }
    // Whoever was shown is stopped, also where nobody is called so any more.
    let shown = shown(&plant, "pump 1").await;
    let start = json!({"setpoint": {"frequency_hz": 20.0}});
    assert_eq!(command(&plant.plant, START, &start).await.0, StatusCode::OK);
    plant.plant.fleet().rename("pump 1", DriveSettings::controlled("fan")).unwrap();
    for path in ["/api/v1/drives/pump%201/stop?wait=20s", "/api/v1/groups/gone/stop?wait=20s"] {
        let (status, told) = command(&plant.plant, path, &json!({"expects": {"drives": [shown]}})).await;
        assert_eq!((status, is_running(&plant, 0)), (StatusCode::OK, false), "{told}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_that_comes_again_is_answered_also_where_it_has_changed_what_was_shown() {
    let plant = TestPlant::of(1).await;
    give(&plant, "pump 1", 20.0).await;
    let body = json!({"id": "once", "setpoint": {"frequency_hz": 30.0},
        "expects": {"drives": [shown_at(&plant, "pump 1", 20.0).await]}});
    let path = "/api/v1/drives/pump%201/setpoint";
    let (_, first) = command(&plant.plant, path, &body).await;
    assert_eq!(first["outcome"], "confirmed", "{first}");
    let (status, again) = command(&plant.plant, path, &body).await;
    assert_eq!((status, &again["time_unix_ms"]), (StatusCode::OK, &first["time_unix_ms"]), "{again}");
}

#[tokio::test(start_paused = true)]
async fn a_command_that_has_to_wait_means_the_motor_that_had_the_name_when_it_came() {
    let plant = TestPlant::of(2).await;
    let target = Target::Drive("pump 1".to_owned());
    let expects = plant.plant.as_it_is(&target);
    assert!(expects.is_some());
    exchange_names(&plant);
    let (caller, action) = (Caller::new("scada", "mqtt", ALL), Action::Reset);
    let request = Request { id: None, target, action, expects, lifetime: LIFETIME, arrived: Instant::now() };
    let (was, now) = ("pump 1".to_owned(), "pump 2".to_owned());
    let refused = plant.plant.begin(&caller, request).err();
    assert_eq!(refused, Some(Rejected::Otherwise(Otherwise::Renamed { was, now })));
    assert!(plant.plant.as_it_is(&Target::Drive("nobody".to_owned())).is_none());
}
