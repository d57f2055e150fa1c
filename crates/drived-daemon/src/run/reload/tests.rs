//! What holds when a reload fails.

use std::{fs, time::Duration};

use drive_families::{Family, simulated};
use drive_fleet::DriveSettings;
use http_body_util::BodyExt as _;
use tower::ServiceExt as _;

use super::*;
use drived_config::names::Names;
use drived_doors::{Caller, Rights, audit::Audit};
use drived_face::Surroundings;

#[path = "../../../../drived-http/src/api/testing.rs"]
mod described;
use described::validate;

/// Lines whose port is nowhere, with watched drives by line, address and name.
fn text(drives: &[(&str, u8, &str)]) -> String {
    let lines =
        "[lines.north]\nport = \"tcp://192.0.2.1:502\"\n[lines.south]\nport = \"tcp://192.0.2.2:502\"\n";
    let drive = |(line, address, name): &(&str, u8, &str)| {
        format!("[[drives]]\nline = \"{line}\"\ndrive = \"atv312@{address}\"\nname = \"{name}\"\n")
    };
    drives.iter().map(drive).fold(lines.to_owned(), |text, drive| text + &drive)
}

/// The routes answer what the document of the API says, and to whoever is no engineer nothing but how it stands.
async fn answers_as_described(reloader: Reloader) {
    let rights = Rights { engineer: true, view: true, ..Rights::NONE };
    let as_who = |rights| {
        let desk = super::super::setup::Desk::new(reloader.clone());
        let all = drived_http::api::reload_router(reloader.clone());
        let all = all.merge(drived_http::api::setup::setup_router(desk));
        all.layer(axum::Extension(Caller::new("chief", "test", rights)))
    };
    let (router, operator) = (as_who(rights), as_who(Rights { engineer: false, ..Rights::ALL }));
    let document = drived_http::api::described();
    let (good, wrong) = ("application/json", "application/problem+json");
    let drive = r#"{"name": "line", "line": "tcp://192.0.2.9:502", "drives": [{"address": 1, "family": "atv312", "name": "new"}]}"#;
    for (method, path, body, status, kind) in [
        ("post", "/api/v1/reload?dry_run=true", "", 200, good),
        ("post", "/api/v1/reload", "", 200, good),
        ("post", "/api/v1/reload?dry_run=perhaps", "", 400, wrong),
        ("get", "/api/v1/setup", "", 200, good),
        ("post", "/api/v1/setup/scan", r#"{"line": "/dev/ttyUSB0,fast"}"#, 422, wrong),
        // The port of a line that is there.
        ("post", "/api/v1/setup/scan", r#"{"line": "tcp://192.0.2.1:502"}"#, 422, wrong),
        ("post", "/api/v1/setup/scan/cancel", "{}", 200, good),
        // The configuration has drives of its own.
        ("post", "/api/v1/setup/drives", drive, 422, wrong),
        ("post", "/api/v1/setup/control", r#"{"drive": "one", "control": true}"#, 422, wrong),
    ] {
        let at = path.split('?').next().unwrap();
        let request = || {
            let request = axum::http::Request::builder().method(method.to_uppercase().as_str()).uri(path);
            let request = request.header("content-type", "application/json");
            request.body(axum::body::Body::from(body)).unwrap()
        };
        if method == "post" {
            let refused = operator.clone().oneshot(request()).await.unwrap().status().as_u16();
            assert_eq!(refused, 403, "{path}");
        }
        let request = request();
        let answer = router.clone().oneshot(request).await.unwrap();
        assert_eq!(
            (answer.status().as_u16(), answer.headers()["content-type"].to_str().unwrap()),
            (status, kind),
            "{path}"
        );
        let body = answer.into_body().collect().await.unwrap().to_bytes();
        let described = &document["paths"][at][method]["responses"][status.to_string()];
        let schema = &described["content"][kind]["schema"];
        assert!(schema.is_object(), "{path} {status} is not described");
        validate(&document, schema, &serde_json::from_slice(&body).unwrap(), path);
    }
}

#[tokio::test]
async fn a_reload_that_fails_halfway_says_what_holds_and_goes_on_from_there() {
    let file = std::env::temp_dir().join(format!("drived-halfway-{}.toml", std::process::id()));
    let write = |drives: &[(&str, u8, &str)]| fs::write(&file, text(drives)).unwrap();
    write(&[("north", 1, "one"), ("north", 2, "two"), ("south", 1, "three")]);
    let config = Config::load_workable(&file).unwrap();
    let lines: Vec<Line> =
        config.lines.iter().map(|part| Line::start(part.config.clone()).unwrap()).collect();
    let fleet = super::super::build(&config, &lines, |_| Left::default()).start().unwrap();
    let plant = Plant::start(fleet.clone(), Vec::new(), false);
    let around = Surroundings::new(plant.clone(), Audit::default(), Names::default());
    let faces = Faces::open(Vec::new(), around);
    let reloader = Reloader::new(
        plant,
        Notify::start(),
        Names::default(),
        faces,
        Opened::default(),
        file.clone(),
        config,
    );
    // Somebody else in the program has taken a name that the file does not know yet.
    let family = Family::ATV312;
    let stranger = DriveSettings::watched("four".to_owned());
    let options = simulated::options();
    fleet
        .extend(|builder| {
            builder
                .whatever_the_plan()
                .drive("south", 9, stranger, |port, slave| family.open_with(port, slave, &options))
        })
        .unwrap();
    write(&[("north", 1, "one"), ("north", 3, "two"), ("south", 4, "four")]);
    let Err(Failure::Drive(told)) = reloader.reload(false).await else { panic!("it fails") };
    for part in [
        "ONLY IN PART",
        "two ended by its policy of the exit and NOT begun anew",
        "three removed, by its policy of the exit",
        "four NOT added",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let names =
        |fleet: &Fleet| fleet.drives().iter().map(|drive| drive.name().to_string()).collect::<Vec<_>>();
    assert_eq!(names(&fleet), ["one", "four"]);
    let again = reloader.reload(true).await.unwrap();
    assert_eq!(again, ["four added", "two added"], "what it believes is what there is");
    let _ = fleet.remove(&["four"], Duration::from_secs(1)).await;
    assert_eq!(reloader.reload(false).await.unwrap(), ["four added", "two added"]);
    assert_eq!(reloader.reload(true).await.unwrap(), Vec::<String>::new());
    answers_as_described(reloader).await;
    fs::remove_file(&file).unwrap();
}
