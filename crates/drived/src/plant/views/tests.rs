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
    Caller { name: "hmi".to_owned(), origin: "test".to_owned(), rights: Rights::ALL }
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
    let stopped = begin(plant, Target::All, Action::Stop(drive_core::StopMode::Ramp));
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
        back(&plant.history("pump 1").unwrap());
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
    let stopped = begin(plant, Target::All, Action::Stop(drive_core::StopMode::Ramp));
    assert!(matches!(heard("drive", &plant.drive("pump 1")), Heard::Drive(_)));
    assert!(matches!(heard("line", &plant.lines()[0]), Heard::Line(_)));
    assert!(matches!(heard("command", &**stopped.borrow()), Heard::Command(_)));
    let notice = NoticeView::new("audit_log", true, "it cannot be written");
    let Heard::Event(read) = heard("event", &notice) else { panic!("an event") };
    assert_eq!(read, notice.into());
    assert!(matches!(heard("tick", &json!({})), Heard::Other));
    assert!(Heard::of("drive", json!({"name": "pump 1"})).is_none(), "what is no drive is none");
}
