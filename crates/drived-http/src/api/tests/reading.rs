//! What is read.

use std::time::Duration;

use drive_core::{Direction, Frequency, StopMode};
use drive_fleet::DriveSettings;
use serde_json::json;

use super::*;

#[tokio::test(start_paused = true)]
async fn the_state_has_every_line_drive_and_group() {
    let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(3).await;
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
    let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    let (status, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    assert_eq!((status, &drive["name"]), (StatusCode::OK, &Value::from("pump 1")));
    assert_eq!(get(&plant, "/api/v1/drives/pump%202").await.0, StatusCode::NOT_FOUND);
}

#[tokio::test(start_paused = true)]
async fn a_value_behind_a_cut_cable_is_stale_and_never_shown_as_live() {
    let TestPlant { plant, line, witnesses: _witnesses, .. } = TestPlant::of(1).await;
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
    let TestPlant { plant, machines, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    machines[0].trip(9);
    tokio::time::sleep(Duration::from_secs(3)).await;
    let (_, drive) = get(&plant, "/api/v1/drives/pump%201").await;
    // BBV51701, fault codes of LFT: 9 = overcurrent OCF.
    assert_eq!((&drive["fault"]["code"], &drive["fault"]["mnemonic"]), (&9.into(), &"OCF".into()), "{drive}");
    assert!(drive["fault"]["remedy"].is_string() && drive["start_refused"].is_string(), "{drive}");
    assert!(drive["fault"]["at_trip"]["age_ms"].is_u64(), "the freeze-frame says how old it is: {drive}");
}

#[tokio::test(start_paused = true)]
async fn a_value_behind_a_cut_cable_is_in_no_output_shown_as_live() {
    let TestPlant { plant, line, witnesses: _witnesses, .. } = TestPlant::of(2).await;
    let start = json!({"id": "run", "setpoint": {"frequency_hz": 30.0}});
    assert_eq!(command(&plant, "/api/v1/drives/pump%201/start", &start).await.0, StatusCode::OK);
    tokio::time::sleep(Duration::from_secs(15)).await;
    let (_, before) = get(&plant, "/api/v1/drives/pump%201/history").await;
    assert_eq!(before["frequency_hz"].as_array().unwrap().last().unwrap(), &json!(30.0), "{before}");
    line.cut();
    tokio::time::sleep(Duration::from_secs(10)).await;
    for path in [
        "/api/v1/state",
        "/api/v1/drives",
        "/api/v1/drives/pump%201",
        "/api/v1/commands/run",
        "/api/v1/drives/pump%201/history",
    ] {
        let (status, told) = get(&plant, path).await;
        assert_eq!(status, StatusCode::OK);
        nothing_is_live(&told, path);
    }
    let (_, history) = get(&plant, "/api/v1/drives/pump%201/history").await;
    for column in ["frequency_hz", "setpoint_hz", "current_a", "torque_percent"] {
        assert!(history[column].as_array().unwrap().last().unwrap().is_null(), "{column}");
    }
    assert_eq!(get(&plant, "/api/v1/drives/pump%201/faults").await.0, StatusCode::CONFLICT);
    let (_, parameters) = get(&plant, "/api/v1/drives/pump%201/parameters").await;
    assert!(parameters.as_array().unwrap().iter().all(|row| row["value"].is_null()), "never read, so none");
}

#[tokio::test(start_paused = true)]
async fn a_line_shows_its_last_hundred_exchanges_its_load_now_and_when_who_is_off_line_is_asked_next() {
    let TestPlant { plant, line, witnesses: _witnesses, .. } = TestPlant::of(2).await;
    tokio::time::sleep(Duration::from_secs(60)).await;
    let (_, north) = get(&plant, "/api/v1/lines/north").await;
    let last = north["last"].as_array().unwrap();
    assert_eq!(last.len(), 100);
    assert!(last.iter().is_sorted_by_key(|exchange| exchange["time_unix_ms"].as_u64()), "the newest is last");
    for exchange in last {
        // A read of holding registers, and an answer that begins as the request does (Modbus Application Protocol, 6.3).
        let (request, answer) = (exchange["request"].as_str().unwrap(), exchange["answer"].as_str().unwrap());
        assert!(
            request.starts_with(&format!("{:02X} 03 ", exchange["slave"].as_u64().unwrap())),
            "{exchange}"
        );
        assert_eq!((request.len(), &answer[..5]), (8 * 3 - 1, &request[..5]), "{exchange}");
        assert_eq!(exchange["result"], "ok");
        assert!(exchange["took_ms"].as_f64().unwrap() > 8.0, "{exchange}");
    }
    assert!(north["utilisation_percent"].as_f64().unwrap() > 1.0, "{north}");
    assert!(north["slaves"][0]["next_probe_ms"].is_null());
    line.cut();
    tokio::time::sleep(Duration::from_secs(30)).await;
    let (_, north) = get(&plant, "/api/v1/lines/north").await;
    let newest = north["last"].as_array().unwrap().last().unwrap();
    assert_eq!((&newest["result"], &newest["answer"]), (&"no_answer".into(), &"".into()), "{newest}");
    let slave = &north["slaves"][0];
    assert_eq!(slave["off_line"], true, "{slave}");
    assert!(slave["next_probe_ms"].as_u64().is_some_and(|next| next <= 10_000), "{slave}");
    assert!(get(&plant, "/api/v1/lines").await.1[0]["last"].is_null(), "the list is short");
}

#[tokio::test(start_paused = true)]
async fn a_line_tells_its_plan_beside_what_was_measured_with_the_answer_times_of_each_slave() {
    let TestPlant { plant, line, machines, witnesses: _witnesses } = TestPlant::of(2).await;
    for machine in &machines {
        machine.set_turnaround(Some(Duration::from_millis(30)));
    }
    let _ = command(&plant, "/api/v1/drives/pump%201/stop", &json!({})).await;
    tokio::time::sleep(Duration::from_secs(60)).await;
    let (_, north) = get(&plant, "/api/v1/lines/north").await;
    let measured = &north["measured"];
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{measured}"));
    // The silence of Modbus over serial line V1.02, 2.5.1.1: 3.5 characters of 11 bits at 19200 bit/s.
    assert!((number(&measured["needed_silence_ms"]) - 2.01).abs() < 0.01, "{measured}");
    assert!(number(&measured["silence_ms"]["min"]) >= 2.0, "{measured}");
    for answers in measured["answers"].as_array().unwrap() {
        let steps = answers["times"].as_array().unwrap();
        let counted: f64 = steps.iter().map(|step| number(&step["count"])).sum();
        assert_eq!(counted, number(&answers["answered"]), "{answers}");
        let most = steps.iter().max_by_key(|step| step["count"].as_u64()).unwrap();
        // As the simulator is set.
        assert!((30.0..=34.0).contains(&number(&most["up_to_ms"])), "{answers}");
    }
    // Of each drive a request of 8 characters, its answer of 7 at least, and the silence.
    let least = 2.0 * (30.0 + 18.5 * 11.0 / 19.2);
    let exchanges = north["last"].as_array().unwrap().iter().map(|exchange| number(&exchange["took_ms"]));
    let longest = 2.0 * (exchanges.fold(0.0, f64::max) + number(&measured["silence_ms"]["min"]));
    assert!((least..longest).contains(&number(&measured["cycle_ms"])), "{measured}");
    assert!(number(&measured["stop_wait_ms"]["max"]) <= number(&north["planned"]["stop_ms"]), "{measured}");
    assert!(number(&measured["stop_ms"]) <= number(&north["planned"]["stop_ms"]), "{measured}");
    assert!(number(&north["planned"]["cycle_ms"]) > 0.0);
    line.cut();
    tokio::time::sleep(Duration::from_secs(30)).await;
    let (_, north) = get(&plant, "/api/v1/lines/north").await;
    assert_eq!(north["measured"]["answers"][0]["went_offline"], 1);
    assert!(north["measured"]["cycle_ms"].is_null(), "nobody is there to be asked: {}", north["measured"]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_tells_its_settings_and_how_its_watchdog_is_fed_as_it_was_found() {
    let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    tokio::time::sleep(Duration::from_secs(15)).await;
    let (_, told) = get(&plant, "/api/v1/drives/pump%201/settings").await;
    assert_eq!(told["settings"]["control"], true, "{told}");
    assert_eq!(
        told["settings"]["periods"]["rest_ms"],
        json!(DriveSettings::watched("").periods.rest.as_millis())
    );
    // BBV51701 p. 55: ttO is 10.0 s from the factory.
    assert_eq!(
        (&told["feed"]["time_ms"], &told["feed"]["in_time"]),
        (&json!(10_000.0), &json!(true)),
        "{told}"
    );
    assert!(told["feed"]["heard_within_ms"].as_f64().is_some_and(|within| within < 10_000.0), "{told}");
    assert_eq!(get(&plant, "/api/v1/drives/pump%202/settings").await.0, StatusCode::NOT_FOUND);
}

/// Whatever has a quality says that it is old, and how old.
fn nothing_is_live(told: &Value, path: &str) {
    if let Some(quality) = told.get("quality") {
        assert!(quality == "stale" || quality == "missing", "{path}: {told}");
        assert_eq!(quality == "stale", told["age_ms"].is_u64(), "{path}: {told}");
    }
    assert_ne!(told.get("reached"), Some(&Value::Bool(true)), "{path}");
    match told {
        Value::Array(all) => all.iter().for_each(|one| nothing_is_live(one, path)),
        Value::Object(all) => all.values().for_each(|one| nothing_is_live(one, path)),
        _ => {}
    }
}

#[tokio::test(start_paused = true)]
async fn the_history_is_ten_minutes_long_and_no_longer() {
    let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    tokio::time::sleep(Duration::from_secs(700)).await;
    let (_, history) = get(&plant, "/api/v1/drives/pump%201/history").await;
    for column in ["time_unix_ms", "frequency_hz", "setpoint_hz", "current_a", "torque_percent"] {
        assert_eq!(history[column].as_array().unwrap().len(), 1_200, "{column}");
    }
    assert_eq!(history["step_ms"], 500);
}

#[tokio::test(start_paused = true)]
async fn a_small_curve_of_every_drive_is_its_history_in_steps_with_gaps_where_nothing_was_known() {
    let TestPlant { plant, machines, witnesses: _witnesses, .. } = TestPlant::of(2).await;
    let drive = plant.fleet().drive("pump 1").unwrap();
    assert!(drive.start_at(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
    tokio::time::sleep(Duration::from_secs(300)).await;
    machines[1].mute();
    tokio::time::sleep(Duration::from_secs(310)).await;
    let (_, curves) = get(&plant, "/api/v1/curves").await;
    assert_eq!(curves["step_ms"], 15_000);
    let of = |name: &str| curves["frequency_hz"][name].as_array().unwrap().clone();
    assert_eq!([of("pump 1").len(), of("pump 2").len()], [40, 40]);
    assert!(of("pump 1")[1..].iter().all(|hertz| *hertz == 20.0), "{curves}");
    assert_eq!(of("pump 2")[5], 0.0);
    // It is not what it was last that goes on.
    assert!(of("pump 2")[22..].iter().all(Value::is_null), "{curves}");
}

#[tokio::test(start_paused = true)]
async fn the_faults_and_their_history_are_read_from_the_drive() {
    let TestPlant { plant, machines, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    machines[0].trip(9);
    tokio::time::sleep(Duration::from_secs(3)).await;
    let (status, faults) = get(&plant, "/api/v1/drives/pump%201/faults").await;
    assert_eq!(status, StatusCode::OK, "{faults}");
    assert_eq!(
        (&faults["present"][0]["mnemonic"], &faults["present"][0]["code"]),
        (&"OCF".into(), &9.into())
    );
    assert!(faults["present"][0]["remedy"].is_string() && faults["history"].is_array(), "{faults}");
}

fn put(path: &str, body: &Value) -> Request<Body> {
    let request = Request::put(path).header("content-type", "application/json");
    request.body(Body::from(body.to_string())).unwrap()
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_read_and_written_by_an_engineer_and_kept_from_everybody_else() {
    let plant = TestPlant::with(2, |name| match name.as_str() {
        "pump 2" => DriveSettings::watched(name),
        _ => DriveSettings::controlled(name),
    })
    .await;
    let path = "/api/v1/drives/pump%201/parameters/ACC";
    let (status, row) = get(&plant.plant, path).await;
    // BBV51701 p. 38, 39: ACC, 9001, factory setting 3.0 s, counted in 0.1 s as Inr is 1.
    assert_eq!(
        (status, &row["value"], &row["address"]),
        (StatusCode::OK, &3.0.into(), &9001.into()),
        "{row}"
    );
    assert_eq!((&row["unit"], &row["access"]), (&"s".into(), &"read_write".into()), "{row}");
    let operator = Rights { engineer: false, ..ALL };
    let (status, _) = send(api(&plant.plant, "operator", operator), put(path, &json!({"value": "50"}))).await;
    assert_eq!((status, plant.machines[0].peek(9001)), (StatusCode::FORBIDDEN, Some(30)));
    for value in [json!("5.0 s"), json!(5.0)] {
        let (status, told) = send(api(&plant.plant, "chief", ALL), put(path, &json!({"value": value}))).await;
        assert_eq!((status, plant.machines[0].peek(9001)), (StatusCode::OK, Some(50)), "{told}");
    }
    for (path, body, status) in [
        (path, json!({"value": "fast"}), StatusCode::UNPROCESSABLE_ENTITY),
        (path, json!({"value": "40000"}), StatusCode::UNPROCESSABLE_ENTITY),
        // LSP ≤ HSP ≤ tFr (BBV51701 p. 27, 47): tFr is 60 Hz from the factory.
        ("/api/v1/drives/pump%201/parameters/HSP", json!({"value": "70"}), StatusCode::UNPROCESSABLE_ENTITY),
        ("/api/v1/drives/pump%201/parameters/ETA", json!({"value": "1"}), StatusCode::UNPROCESSABLE_ENTITY),
        ("/api/v1/drives/pump%201/parameters/NIX", json!({"value": "1"}), StatusCode::NOT_FOUND),
        ("/api/v1/drives/pump%201/parameters/CMD", json!({"value": "000Fh"}), StatusCode::CONFLICT),
        ("/api/v1/drives/pump%202/parameters/ACC", json!({"value": "50"}), StatusCode::CONFLICT),
    ] {
        let (told, problem) = send(api(&plant.plant, "chief", ALL), put(path, &body)).await;
        assert_eq!(told, status, "{path} {body}: {problem}");
    }
    let (_, rows) = get(&plant.plant, "/api/v1/drives/pump%201/parameters").await;
    let rows = rows.as_array().unwrap();
    let unread = rows
        .iter()
        .filter(|row| row["value"].is_null() && row["error"].is_null() && row["access"] != "write");
    assert_eq!(unread.count(), 0, "half a minute is enough for one drive");
}

// In real time: a thread writes the file, and a paused clock would not wait for it.
#[tokio::test]
async fn a_capture_is_a_file_that_begins_as_pcapng_and_ends_in_time() {
    let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    let request = Request::get("/api/v1/lines/north/capture?seconds=2").body(Body::empty()).unwrap();
    let response = api(&plant, "reader", ALL).oneshot(request).await.unwrap();
    assert_eq!(response.headers()["content-type"], "application/x-pcapng");
    let file = response.into_body().collect().await.unwrap().to_bytes();
    let frames = drive_bus::capture::read(&file).unwrap().frames;
    assert!(!frames.is_empty());
    assert_eq!(get(&plant, "/api/v1/lines/north/capture?seconds=0").await.0, StatusCode::BAD_REQUEST);
}

#[tokio::test(start_paused = true)]
async fn the_program_is_ready_while_its_lines_are_asked_whether_or_not_anybody_answers() {
    let TestPlant { plant, line, witnesses: _witnesses, .. } = TestPlant::of(1).await;
    assert_eq!(get(&plant, "/healthz").await.0, StatusCode::OK);
    line.cut();
    tokio::time::sleep(Duration::from_secs(60)).await;
    assert_eq!(get(&plant, "/readyz").await.0, StatusCode::OK, "a cut cable is no standstill of the program");
    plant.fleet().lines().remove(0).1.close().await;
    let _ = plant.fleet().shutdown(Duration::from_secs(1)).await;
    tokio::time::sleep(Duration::from_secs(60)).await;
    let (status, problem) = get(&plant, "/readyz").await;
    assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE, "{problem}");
}

#[tokio::test(start_paused = true)]
async fn a_register_is_written_only_at_standstill_where_that_is_asked_for() {
    let plant = TestPlant::of(1).await;
    let path = "/api/v1/drives/pump%201/parameters/ACC";
    let drive = plant.plant.fleet().drive("pump 1").unwrap();
    assert!(drive.start_at(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
    let body = json!({ "value": "5.0 s", "only_at_standstill": true });
    let (status, told) = send(api(&plant.plant, "chief", ALL), put(path, &body)).await;
    assert_eq!((status, plant.machines[0].peek(9001)), (StatusCode::CONFLICT, Some(30)), "{told}");
    assert!(drive.stop(StopMode::Ramp).await.is_confirmed());
    let (status, told) = send(api(&plant.plant, "chief", ALL), put(path, &body)).await;
    assert_eq!((status, plant.machines[0].peek(9001)), (StatusCode::OK, Some(50)), "{told}");
}

#[tokio::test(start_paused = true)]
async fn a_write_whose_answer_is_lost_is_unknown_and_not_called_refused() {
    let plant = TestPlant::of(1).await;
    let machine = plant.machines[0].clone();
    let written = machine.requests(0x06);
    let losing = tokio::spawn(async move {
        machine.wait_until(|_| machine.requests(0x06) > written).await;
        machine.mute();
    });
    let path = "/api/v1/drives/pump%201/parameters/ACC";
    let (status, told) = send(api(&plant.plant, "chief", ALL), put(path, &json!({ "value": 5.0 }))).await;
    losing.await.unwrap();
    assert_eq!(status, StatusCode::GATEWAY_TIMEOUT, "{told}");
    assert!(told["detail"].as_str().unwrap().contains("read it back"), "{told}");
}
