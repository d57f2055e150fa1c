//! What is told, read back.

use std::time::Duration;

use drive_core::Direction;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};
use tokio::time::{Instant, sleep};

use super::*;
use crate::plant::{
    Plant,
    commands::{Action, LIFETIME, Request, Target, Told},
    testing::TestPlant,
};
use drived_config::rights::Caller;

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
    let request =
        Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived: Instant::now() };
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
