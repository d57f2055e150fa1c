//! What is told, read back.

use std::time::Duration;

use drive_core::Direction;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};
use tokio::time::{Instant, sleep};

use super::*;
use crate::{
    client::Heard,
    doors::Caller,
    plant::{
        Plant,
        commands::{Action, LIFETIME, Request, Target, Told},
        testing::TestPlant,
    },
};

/// What was told, and again when it was read.
fn back<T: Serialize + DeserializeOwned>(view: &T) -> Value {
    let told = json!(view);
    let read: T = serde_json::from_value(told.clone()).unwrap_or_else(|error| panic!("{error}: {told}"));
    assert_eq!(json!(read), told);
    told
}

fn caller() -> Caller {
    Caller::new("hmi", "test", Rights::ALL)
}

fn begin(plant: &Plant, target: Target, action: Action) -> Told {
    let request = Request { id: None, target, action, lifetime: LIFETIME, arrived: Instant::now() };
    plant.begin(&caller(), request).unwrap()
}

#[tokio::test(start_paused = true)]
async fn what_is_told_reads_back_as_it_was_told() {
    let test = TestPlant::of(3).await;
    let plant = &test.plant;
    let start =
        Action::Start { direction: Direction::Forward, setpoint: None, until: drive_fleet::Until::default() };
    let started = begin(plant, Target::Group("pumps".to_owned()), start);
    sleep(Duration::from_secs(5)).await;
    test.machines[1].trip(9);
    test.machines[2].mute();
    sleep(Duration::from_secs(10)).await;
    let refused = begin(plant, Target::Drive("pump 2".to_owned()), start);
    let stopped = begin(plant, Target::All, Action::Stop(drive_core::StopMode::Ramp.into()));
    for wait in [0, 5, 60] {
        sleep(Duration::from_secs(wait)).await;
        for told in [&started, &refused, &stopped] {
            let told = back(&**told.borrow());
            assert!(told["open"].is_boolean() && told["time_unix_ms"].is_u64(), "{told}");
        }
        let state = back(&plant.state(&caller()));
        assert_eq!(state["drives"].as_array().unwrap().len(), 3);
        back(&plant.line("north").unwrap());
        back(&plant.settings("pump 1").unwrap());
        back(&plant.history("pump 1", None).unwrap());
        back(&plant.recent());
    }
    assert!(plant.recent().len() > 5);
    let drive = plant.fleet().drive("pump 1").unwrap();
    let parameters = plant.parameters(&drive, Duration::from_secs(2)).await;
    assert!(back(&parameters).as_array().unwrap().len() > 100);
}

/// What somebody who reads the stream understands of an event of this name.
fn heard(name: &str, data: &impl Serialize) -> Heard {
    Heard::of(name, json!(data)).unwrap_or_else(|| panic!("{name}: {}", json!(data)))
}

#[tokio::test(start_paused = true)]
async fn every_event_of_the_stream_is_understood() {
    let test = TestPlant::of(1).await;
    let plant = &test.plant;
    let stopped = begin(plant, Target::All, Action::Stop(drive_core::StopMode::Ramp.into()));
    assert!(matches!(heard("drive", &plant.drive("pump 1")), Heard::Drive(_)));
    assert!(matches!(heard("line", &plant.lines()[0]), Heard::Line(_)));
    assert!(matches!(heard("command", &**stopped.borrow()), Heard::Command(_)));
    let notice = NoticeView::new("audit_log", true, "it cannot be written");
    let Heard::Event(read) = heard("event", &notice) else { panic!("an event") };
    assert_eq!(read, notice.into());
    assert!(matches!(heard("tick", &json!({})), Heard::Other));
    assert!(Heard::of("drive", json!({"name": "pump 1"})).is_none(), "what is no drive is none");
}

/// A daemon of another version tells things that this program does not know, and leaves out what need not be there.
#[tokio::test(start_paused = true)]
async fn what_another_version_adds_is_passed_over_and_what_it_leaves_out_is_missing() {
    fn with_more(value: &mut Value) {
        match value {
            Value::Object(members) => {
                members.values_mut().for_each(with_more);
                members.insert("of_another_version".to_owned(), json!({"new": true}));
            }
            Value::Array(all) => all.iter_mut().for_each(with_more),
            _ => {}
        }
    }
    let test = TestPlant::of(2).await;
    test.machines[0].trip(9);
    sleep(Duration::from_secs(5)).await;
    let mut told = json!(test.plant.state(&caller()));
    let known: StateView = serde_json::from_value(told.clone()).unwrap();
    with_more(&mut told);
    let read: StateView = serde_json::from_value(told).unwrap();
    assert_eq!(read.drives.len(), 2);
    for (read, known) in read.drives.iter().zip(&known.drives) {
        assert_eq!(read.snapshot.concerns, known.snapshot.concerns);
        assert_eq!(read.snapshot.shows, known.snapshot.shows);
        assert!(read.snapshot.status.value.is_some());
    }
    let mut told = crate::plant::testing::told("pump 1");
    for key in ["shows", "concerns"] {
        told.as_object_mut().unwrap().remove(key);
    }
    let read = crate::plant::testing::read(&told);
    assert_eq!((read.snapshot.shows, read.snapshot.concern()), (drive_fleet::Shows::Unknown, None));
    told["shows"] = "in_a_way_that_nobody_knows".into();
    assert_eq!(crate::plant::testing::read(&told).snapshot.shows, drive_fleet::Shows::Unknown);
}

/// The places of a source in which a value is looked up by the name of its key. To set one is none.
fn look_ups(source: &str) -> Vec<&str> {
    let code = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let is_look_up = |line: &&str| {
        let called = [".get(\"", ".get_mut(\"", ".pointer(\"", ".pointer_mut(\"", "[key]", ".get(key)"];
        let indexed = line.match_indices("[\"").any(|(at, _)| {
            let of_something =
                line[..at].ends_with(|last: char| last.is_alphanumeric() || "_)]".contains(last));
            let behind = line[at..].split_once(']').map_or("", |(_, behind)| behind);
            of_something && !(behind.starts_with(" = "))
        });
        indexed || called.iter().any(|call| line.contains(call))
    };
    code.lines().filter(|line| !line.trim_start().starts_with("//")).filter(is_look_up).collect()
}

#[test]
fn no_tool_looks_anything_up_by_its_key_but_reads_it_as_what_it_is() {
    fn sources(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match entry.is_dir() {
                true => sources(&entry, found),
                false => found.push(entry),
            }
        }
    }
    assert_eq!(look_ups("let age = drive[\"status\"][\"age_ms\"].as_u64();").len(), 1);
    assert_eq!(look_ups("told.get(\"reason\")").len(), 1);
    assert!(look_ups("body[\"setpoint\"] = json!(setpoint);\ndaemon.read(&[\"state\"])").is_empty());
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = vec![folder.join("values.rs"), folder.join("doors/audit/show.rs")];
    for of_tools in ["client", "commands", "run", "row"] {
        sources(&folder.join(of_tools), &mut found);
    }
    found.retain(|path| {
        !path.ends_with("tests.rs")
            && !path.iter().any(|part| part == "tests")
            && path.extension().is_some_and(|end| end == "rs")
    });
    assert!(found.len() > 100, "{}", found.len());
    for path in found {
        let source = std::fs::read_to_string(&path).unwrap();
        assert_eq!(look_ups(&source), Vec::<&str>::new(), "{}", path.display());
    }
}
