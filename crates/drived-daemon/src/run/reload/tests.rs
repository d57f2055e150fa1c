//! What holds when a reload fails.

use std::{fs, time::Duration};

use drive_bus::Line;
use drive_families::{Family, simulated};
use drive_fleet::{DriveSettings, Fleet, Left};
use http_body_util::BodyExt as _;
use tower::ServiceExt as _;

use super::*;
use drived_config::{config::State, names::Names, places::Places};
use drived_doors::{Caller, Rights, audit::Audit};
use drived_face::Surroundings;
use drived_plant::plant::revisions::Next;

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

/// A daemon of this configuration that has no face.
fn begun(file: &std::path::Path) -> (Fleet, Reloader) {
    let config = Config::load_to_begin(file, None).unwrap();
    let lines: Vec<Line> =
        config.lines.iter().map(|part| Line::start(part.config.clone()).unwrap()).collect();
    begun_with(file, config, &lines)
}

/// The same on these lines.
fn begun_with(file: &std::path::Path, config: Config, lines: &[Line]) -> (Fleet, Reloader) {
    let fleet = super::super::build(&config, lines, |_| Left::default()).start().unwrap();
    let plant = Plant::start(fleet.clone(), Vec::new(), false);
    let around = Surroundings::new(plant.clone(), Audit::default(), Names::default());
    let faces = Faces::open(Vec::new(), around);
    let opened = Opened::default();
    let kept = Kept::open(&State::default(), &Places::default());
    let (notify, file) = (Notify::start(), file.to_owned());
    let reloader = Reloader::new(plant, notify, Names::default(), faces, opened, kept, (file, config));
    (fleet, reloader)
}

/// A running drive is taken out of the file, and its cable is cut.
#[tokio::test(start_paused = true)]
async fn a_reload_that_waits_for_a_silent_drive_says_in_time_for_which_and_goes_on() {
    let folder = drived_config::testing::Folder::new("silent");
    let file = folder.file("drives.toml");
    let controlled = |drives: &[(&str, u8, &str)]| format!("{}control = true\n", text(drives));
    fs::write(&file, controlled(&[("south", 1, "other"), ("north", 2, "beside"), ("north", 1, "pump")]))
        .unwrap();
    let config = Config::load_to_begin(&file, None).unwrap();
    let sim = drive_sim::SimLine::default();
    let machine = sim.add(1, drive_sim::models::atv312::Atv312::under_bus_control()).unwrap();
    let settings = drive_core::SerialSettings::MODBUS_DEFAULT;
    let line = |part: &drived_config::config::LinePart| match &*part.name {
        "north" => Line::over(sim.in_memory(), drive_bus::LineConfig::stream(settings)),
        _ => Line::start(part.config.clone()).unwrap(),
    };
    let lines: Vec<Line> = config.lines.iter().map(line).collect();
    let (fleet, reloader) = begun_with(&file, config, &lines);
    let pump = fleet.drive("pump").unwrap();
    pump.ready(Duration::from_secs(10)).await.unwrap();
    let run = pump.run(drive_core::Direction::Forward, drive_core::Frequency::from_hertz(20)).await;
    assert!(run.is_confirmed(), "{run}");
    machine.mute();
    fs::write(&file, text(&[("south", 1, "other"), ("north", 2, "beside")])).unwrap();
    // The door closes after forty seconds.
    let told = tokio::time::timeout(Duration::from_secs(40), reloader.reload(false)).await;
    let Ok(Err(Failure::Drive(told))) = told else { panic!("{told:?}") };
    assert!(told.contains("that goes on: THE MOTOR MAY TURN: pump: STOP NOT CONFIRMED"), "{told}");
    assert!(fleet.drive("pump").is_some(), "its stop is under way");
    machine.unmute();
    tokio::time::sleep(Duration::from_secs(25)).await;
    assert!(fleet.drive("pump").is_none() && !machine.observe().running, "{:?}", machine.observe());
}

/// It goes by the names that are kept, and not by what the fleet remembers: that has forgotten who was taken out.
#[tokio::test(start_paused = true)]
async fn a_drive_that_comes_back_by_another_name_is_told_as_the_one_that_it_was() {
    let folder = drived_config::testing::Folder::new("back");
    let file = folder.file("drives.toml");
    let [both, one, back] = [
        text(&[("south", 1, "other"), ("north", 2, "beside"), ("north", 1, "pump")]),
        text(&[("south", 1, "other"), ("north", 2, "beside")]),
        text(&[("south", 1, "another"), ("north", 2, "beside"), ("north", 1, "mill")]),
    ];
    fs::write(&file, &both).unwrap();
    let (_fleet, reloader) = begun(&file);
    let (mut reader, _) = reloader.0.plant.revisions().keeper();
    for text in [both, one, back] {
        fs::write(&file, text).unwrap();
        reloader.reload(false).await.unwrap();
    }
    let (revisions, mut told) = (reloader.0.plant.revisions(), Vec::new());
    let until = tokio::time::Instant::now() + Duration::from_secs(5);
    while let Ok(Next::Frames(frames)) = tokio::time::timeout_at(until, revisions.next(&mut reader)).await {
        let frames = frames.iter().map(|frame| String::from_utf8_lossy(frame).into_owned());
        let data = |frame: String| Some(frame.split_once("\ndata: ")?.1.to_owned());
        let events =
            frames.filter_map(data).filter_map(|data| serde_json::from_str::<serde_json::Value>(&data).ok());
        let renamed = events.filter(|event| event["event"] == "renamed");
        told.extend(renamed.map(|event| format!("{}: {}", event["drive"], event["text"])));
    }
    told.sort();
    // That of the one that went on is told by the fleet, once.
    let expected =
        [r#""another": "renamed: it was called other""#, r#""mill": "renamed: it was called pump""#];
    assert_eq!(told, expected);
}

/// The drives that were added, `two` of them by a guess and under control.
const ADDED: &str = "[lines.a]\nport = \"tcp://192.0.2.1:502\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\nname = \"one\"\n\
    control = false\n[[drives]]\nline = \"a\"\ndrive = \"atv312@2\"\nguessed = true\nname = \"two\"\ncontrol = true\n";

/// Control of a drive, as the page asks for it.
fn wanted(drive: &str, control: bool) -> drived_http::api::setup::ControlWanted {
    serde_json::from_value(serde_json::json!({ "drive": drive, "control": control })).unwrap()
}

#[tokio::test]
async fn the_page_changes_what_it_was_asked_for_and_nothing_that_somebody_else_has_written() {
    use drived_http::api::setup::Setup as _;
    let folder = drived_config::testing::Folder::new("page-changes");
    let (file, added) = (folder.file("drives.toml"), folder.file("added.toml"));
    fs::write(&file, "state = \".\"\n").unwrap();
    fs::write(&added, ADDED).unwrap();
    let (_, reloader) = begun(&file);
    let desk = super::super::setup::Desk::new(reloader.clone());
    // What is a guess is one wherever control is taken.
    let told = |drives: &[drived_http::api::setup::AddedView]| -> Vec<(String, bool, bool)> {
        drives.iter().map(|one| (one.name.clone(), one.guessed, one.control)).collect()
    };
    let (one, two) = ("one".to_owned(), "two".to_owned());
    assert_eq!(told(&desk.view().await.drives), [(one.clone(), false, false), (two.clone(), true, true)]);
    // Somebody else writes that it is polled otherwise, and has not had it read yet.
    let theirs = ADDED.replacen("control = false\n", "control = false\nrunning = \"200ms\"\n", 1);
    fs::write(&added, &theirs).unwrap();
    let drive = serde_json::json!({ "name": "b", "line": "tcp://192.0.2.2:502", "drives": [
        { "address": 3, "family": "atv312", "name": "three" } ] });
    let drive = serde_json::from_value(drive).unwrap();
    let refused = [desk.control(wanted("one", true)).await, desk.add(drive).await];
    for refused in refused {
        let Err(Failure::Input(why)) = refused else { panic!("{refused:?}") };
        assert!(why.contains("one has other settings") && why.contains("drived reload first"), "{why}");
    }
    assert_eq!(fs::read_to_string(&added).unwrap(), theirs, "nothing is written");
    reloader.reload(false).await.unwrap();
    desk.control(wanted("one", true)).await.unwrap();
    assert_eq!(told(&desk.view().await.drives), [(one, false, true), (two, true, true)]);
    // What holds from the next start on is no other's wish that would come to hold now.
    fs::write(&file, "state = \".\"\nsnapshots = \"3s\"\n").unwrap();
    desk.control(wanted("one", false)).await.unwrap();
    assert_eq!(fs::read_to_string(&added).unwrap(), theirs);
}

#[tokio::test]
async fn no_line_is_opened_where_a_scan_asks_by_whatever_door() {
    use drived_http::api::setup::{ScanState, Setup as _};
    let folder = drived_config::testing::Folder::new("page-scanned");
    let (file, added) = (folder.file("drives.toml"), folder.file("added.toml"));
    fs::write(&file, "state = \".\"\n").unwrap();
    fs::write(&added, ADDED).unwrap();
    let (fleet, reloader) = begun(&file);
    let desk = super::super::setup::Desk::new(reloader.clone());
    // A gateway behind which nobody answers, so that the scan is under way for as long as nobody gives it up.
    let gateway = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let line = format!("tcp://{}", gateway.local_addr().unwrap());
    desk.scan(serde_json::from_value(serde_json::json!({ "line": line })).unwrap()).await.unwrap();
    // The same server by another name.
    let theirs = format!(
        "{ADDED}[lines.b]\nport = \"{}\"\n[[drives]]\nline = \"b\"\ndrive = \"atv312@3\"\nname = \"three\"\n",
        line.replace("127.0.0.1", "localhost")
    );
    fs::write(&added, &theirs).unwrap();
    let refused = |told: Result<Vec<String>, Failure>| {
        let Err(Failure::Input(why)) = told else { panic!("{told:?}") };
        assert!(why.contains("the port of line \"b\" is being scanned"), "{why}");
    };
    refused(reloader.reload(false).await);
    refused(reloader.reload(true).await);
    fs::write(&added, ADDED).unwrap();
    let drive = serde_json::json!({ "name": "b", "line": line, "drives": [
        { "address": 3, "family": "atv312", "name": "three" } ] });
    refused(desk.add(serde_json::from_value(drive).unwrap()).await);
    assert_eq!(fs::read_to_string(&added).unwrap(), ADDED, "nothing is written");
    assert!(fleet.drive("three").is_none());
    // Other lines come and go meanwhile.
    let elsewhere = theirs.replace(&line.replace("127.0.0.1", "localhost"), "tcp://192.0.2.2:502");
    fs::write(&added, elsewhere).unwrap();
    reloader.reload(false).await.unwrap();
    desk.cancel();
    while desk.view().await.scan.is_some_and(|scan| scan.state != ScanState::GivenUp) {
        tokio::task::yield_now().await;
    }
    fs::write(&added, theirs).unwrap();
    reloader.reload(false).await.unwrap();
    assert!(fleet.drive("three").is_some());
}

#[tokio::test]
async fn a_drive_with_a_stop_that_is_not_confirmed_stays_within_reach_of_the_page() {
    use drived_http::api::setup::Setup as _;
    let folder = drived_config::testing::Folder::new("page-reach");
    let (file, added) = (folder.file("drives.toml"), folder.file("added.toml"));
    fs::write(&file, "state = \".\"\n").unwrap();
    fs::write(&added, ADDED).unwrap();
    let (fleet, reloader) = begun(&file);
    let desk = super::super::setup::Desk::new(reloader);
    // Nobody answers at the port, so that no stop is confirmed.
    let drive = fleet.drive("two").unwrap();
    drop(drive.stop(drive_core::StopMode::Ramp));
    drive.wait_until(|now| now.stop.is_some()).await;
    let refused = desk.control(wanted("two", false)).await;
    let Err(Failure::Input(why)) = refused else { panic!("{refused:?}") };
    assert!(why.contains("Stop it first"), "{why}");
    assert_eq!(fs::read_to_string(&added).unwrap(), ADDED, "nothing is written");
    assert!(fleet.drive("two").unwrap().settings().control);
}

#[tokio::test]
async fn a_reload_that_fails_halfway_says_what_holds_and_goes_on_from_there() {
    let file = std::env::temp_dir().join(format!("drived-halfway-{}.toml", std::process::id()));
    let write = |drives: &[(&str, u8, &str)]| fs::write(&file, text(drives)).unwrap();
    write(&[("north", 1, "one"), ("north", 2, "two"), ("south", 1, "three")]);
    let (fleet, reloader) = begun(&file);
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
