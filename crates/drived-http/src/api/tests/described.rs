//! The description of the API, held against the answers.

use axum::http::Method;
use serde_json::json;

use super::*;
use crate::api::testing::validate;

/// What is served elsewhere: [`super::doors`] and the tests of reloading and of the first hour hold it against the document.
const ELSEWHERE: [&str; 11] = [
    "/api/v1/links",
    "/api/v1/login",
    "/api/v1/logout",
    "/api/v1/reload",
    "/api/v1/setup",
    "/api/v1/setup/control",
    "/api/v1/setup/drives",
    "/api/v1/setup/scan",
    "/api/v1/setup/scan/cancel",
    "/api/v1/tokens",
    "/api/v1/tokens/{name}",
];

/// Sends a request and holds the answer against what the document says of its status.
async fn held(plant: &Plant, document: &Value, path: &str, request: Request<Body>) -> u16 {
    let method = request.method().as_str().to_lowercase();
    let what = format!("{method} {}", request.uri());
    let response = api(plant, "operator", ALL).oneshot(request).await.unwrap();
    let status = response.status().as_u16();
    let kind = response.headers()["content-type"].to_str().unwrap().to_owned();
    let described = &document["paths"][path][&method]["responses"][status.to_string()]["content"][&kind];
    assert!(described.is_object(), "{what}: {status} {kind} is not described");
    if kind.ends_with("json") {
        let body = response.into_body().collect().await.unwrap().to_bytes();
        let answer: Value = serde_json::from_slice(&body).unwrap();
        validate(document, &described["schema"], &answer, &what);
    }
    status
}

#[tokio::test(start_paused = true)]
async fn every_answer_and_every_refusal_is_as_the_document_says() {
    let test = TestPlant::of(2).await;
    let plant = &test.plant;
    let (status, document) = get(plant, "/api/v1/openapi.json").await;
    assert_eq!((status, &document["openapi"]), (StatusCode::OK, &"3.1.0".into()));
    assert!(document["paths"].as_object().unwrap().len() >= 20);
    let known = json!({"id": "known", "setpoint": {"frequency_hz": 30.0}});
    let _ = command(plant, "/api/v1/drives/pump%201/start", &known).await;
    tokio::time::sleep(std::time::Duration::from_secs(12)).await;
    for round in 0..3 {
        for (path, methods) in document["paths"].as_object().unwrap() {
            if ELSEWHERE.contains(&path.as_str()) {
                continue;
            }
            for method in methods.as_object().unwrap().keys() {
                let name = if path.contains("/drives/") {
                    "pump%201"
                } else if path.contains("/lines/") {
                    "north"
                } else {
                    "pumps"
                };
                let asked =
                    path.replace("{name}", name).replace("{id}", "known").replace("{register}", "ACC");
                // All of them take a while, and their shape is seen in a few.
                let asked = if path.ends_with("/parameters") { format!("{asked}?wait=500ms") } else { asked };
                // No history is kept of this plant, and that is answered.
                let is_past =
                    ["/past", "/why", "/frames", "/frames/capture"].iter().any(|end| path.ends_with(end))
                        || path.contains("/v1/history/");
                let time = "value=state&from_unix_ms=0&to_unix_ms=1&at_unix_ms=0&every_ms=60000";
                let asked = if is_past { format!("{asked}?{time}") } else { asked };
                let method = Method::from_bytes(method.to_uppercase().as_bytes()).unwrap();
                let is_read = method == Method::GET;
                let request = |path: &str, kind: &str, body: Value| {
                    let body = if is_read { Body::empty() } else { Body::from(body.to_string()) };
                    let request = Request::builder().method(method.clone()).uri(path);
                    request.header("content-type", kind).body(body).unwrap()
                };
                let json = "application/json";
                let body = match path.rsplit('/').next() {
                    Some("start" | "setpoint") => json!({"setpoint": {"frequency_hz": 20.0}}),
                    Some("shelve") => json!({"minutes": 5, "why": "a test"}),
                    Some("{register}") => json!({"value": "50"}),
                    Some("accept") => json!({"identity": {"model": "ATV312HU15N4", "codes": []}}),
                    _ => json!({}),
                };
                let (mut body, mut odd) = (body, json!({"id": 7}));
                if path.contains("/selected/") {
                    body["drives"] = json!(["pump 1"]);
                    odd["drives"] = json!(["pump 1"]);
                }
                let good = held(plant, &document, path, request(&asked, json, body.clone())).await;
                let expected = if is_past { 404 } else { 200 };
                assert!(round > 0 || !is_read || good == expected, "{asked}: {good}");
                let nowhere =
                    path.replace("{name}", "nobody").replace("{id}", "none").replace("{register}", "NIX");
                let nowhere = if is_past { format!("{nowhere}?{time}") } else { nowhere };
                if nowhere != *path && !path.contains("/v1/history/") {
                    let missing = held(plant, &document, path, request(&nowhere, json, body.clone())).await;
                    assert_eq!(missing, 404, "{nowhere}");
                }
                if !is_read {
                    assert_eq!(held(plant, &document, path, request(&asked, "text/plain", body)).await, 415);
                    let odd = request(&asked, json, odd);
                    let told = held(plant, &document, path, odd).await;
                    // A stop is one whatever its body says.
                    assert_eq!(told == 422, !path.ends_with("/stop"), "{asked}: {told}");
                    if method == Method::POST && !path.contains("/alarms/") {
                        let waits = request(&format!("{asked}?wait=1h"), json, json!({}));
                        let told = held(plant, &document, path, waits).await;
                        assert_eq!(told == 400, !path.ends_with("/stop"), "{asked}: {told}");
                    }
                }
            }
        }
        // Then with a drive that has tripped, then with a cut cable: what is stale or refused has its shape, too.
        match round {
            0 => test.machines[0].trip(9),
            _ => test.line.cut(),
        }
        tokio::time::sleep(std::time::Duration::from_secs(12)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn what_the_document_says_of_a_body_is_what_is_taken() {
    let test = TestPlant::of(1).await;
    let (_, document) = get(&test.plant, "/api/v1/openapi.json").await;
    let body = &document["paths"]["/api/v1/drives/{name}/start"]["post"]["requestBody"];
    let schema = &body["content"]["application/json"]["schema"];
    for taken in [
        json!({}),
        json!({"id": "a", "expires_in_ms": 500, "direction": "reverse", "until": "at_reference"}),
        json!({"setpoint": {"frequency_hz": 30.05}}),
        json!({"setpoint": {"speed_rpm": 900}}),
    ] {
        validate(&document, schema, &taken, "a body that is taken");
    }
    let mut schema = schema.clone();
    schema["components"] = document["components"].clone();
    let validator = jsonschema::draft202012::options().build(&schema).unwrap();
    for refused in [
        json!({"direction": "up"}),
        json!({"setpoint": {"frequency_hz": "30"}}),
        json!({"setpoint": 30}),
        json!({"expires_in_ms": 20_000}),
        json!({"speed": 1}),
    ] {
        assert!(!validator.is_valid(&refused), "{refused}");
        let (status, _) = command(&test.plant, "/api/v1/drives/pump%201/start", &refused).await;
        assert_eq!(status, StatusCode::UNPROCESSABLE_ENTITY, "{refused}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_demonstration_has_is_described_and_there_only_in_a_demonstration() {
    let test = TestPlant::of(1).await;
    let stage = crate::api::demo::Stage {
        machines: [("pump 1".to_owned(), (test.machines[0].clone(), 9))].into(),
        lines: [("north".to_owned(), test.line.clone())].into(),
    };
    let demo = || {
        let caller = Caller::new("guest", "test", ALL);
        crate::api::demo_router(test.plant.clone(), stage.clone()).layer(Extension(caller))
    };
    let trip = || post("/api/v1/demo/trip", &json!({"drive": "pump 1"}));
    assert_eq!(send(api(&test.plant, "guest", ALL), trip()).await.0, StatusCode::NOT_FOUND);
    assert_eq!(send(demo(), trip()).await.0, StatusCode::NO_CONTENT);
    tokio::time::sleep(std::time::Duration::from_secs(3)).await;
    let (_, drive) = get(&test.plant, "/api/v1/drives/pump%201").await;
    assert_eq!(drive["fault"]["code"], 9);
    let pull =
        |connected: bool| post("/api/v1/demo/cable", &json!({"line": "north", "connected": connected}));
    assert_eq!(send(demo(), pull(false)).await.0, StatusCode::NO_CONTENT);
    tokio::time::sleep(std::time::Duration::from_secs(5)).await;
    assert_eq!(get(&test.plant, "/api/v1/drives/pump%201").await.1["link"], "lost");
    assert_eq!(send(demo(), pull(true)).await.0, StatusCode::NO_CONTENT);
    let other = post("/api/v1/demo/trip", &json!({"drive": "pump 7"}));
    assert_eq!(send(demo(), other).await.0, StatusCode::NOT_FOUND);
    let document = Request::get("/api/v1/openapi.json").body(Body::empty()).unwrap();
    assert!(send(demo(), document).await.1["paths"]["/api/v1/demo/trip"].is_object());
    let (_, document) = get(&test.plant, "/api/v1/openapi.json").await;
    assert!(document["paths"]["/api/v1/demo/trip"].is_null());
}
