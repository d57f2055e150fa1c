//! The face in virtual time, on a simulated plant and a broker in memory.

use drive_fleet::DriveSettings;
use drive_sparkplug::{Definition, Id, Metric, NodeName, Payload, Quality, Raw, Reading};
use serde_json::json;
use tokio::time::sleep;

mod historical;

use super::*;
use crate::{
    broker::testing::{TestBroker, publish},
    desk::testing::{NO_OBJECTS, REFUSED, STOPS},
};
use drived_doors::Role;
use drived_plant::plant::{alarms::Owner, testing::TestPlant};

/// A plant, its face, and the broker that it is on.
struct Bench {
    plant: TestPlant,
    broker: TestBroker,
    face: Sparkplug,
}

fn config(name: &str) -> SparkplugConfig {
    let state = std::env::temp_dir().join(format!("drived-sparkplug-{}-{name}", std::process::id()));
    let _ = std::fs::remove_file(&state);
    SparkplugConfig {
        name: NodeName { group: Id::new("plant").unwrap(), edge_node: Id::new("hall 1").unwrap() },
        primary_host: None,
        commands: Some(Role::Operate),
        lifetime: Duration::from_secs(1),
        rebirth_pause: Duration::from_secs(5),
        historical: false,
        state,
    }
}

impl Bench {
    async fn of(drives: u8, config: SparkplugConfig) -> Self {
        let (plant, broker) = (TestPlant::of(drives).await, TestBroker::default());
        let prepared = Sparkplug::prepare(config, broker.options(), Duration::from_secs(1));
        let face = prepared
            .unwrap_or_else(|failure| panic!("{failure}"))
            .open(plant.plant.clone(), Audit::default());
        sleep(Duration::from_secs(2)).await;
        Self { plant, broker, face }
    }

    /// The topics behind the group that were published since then, with their payloads.
    fn said(&self, since: usize) -> Vec<(String, Payload)> {
        let read = |publish: rumqttc::Publish| {
            let topic = String::from_utf8(publish.topic.to_vec()).unwrap();
            let topic = topic.replace("spBv1.0/plant/", "").replace("/hall 1", "");
            (topic, Payload::decode(&publish.payload).unwrap())
        };
        self.broker.publishes().into_iter().skip(since).map(read).collect()
    }

    fn topics(&self, since: usize) -> Vec<String> {
        self.said(since).into_iter().map(|(topic, _)| topic).collect()
    }

    fn mark(&self) -> usize {
        self.broker.publishes().len()
    }

    /// Writes a metric of a drive, as it is sent now.
    fn write(&self, drive: &str, name: &str, value: Raw) {
        self.write_metric(
            drive,
            Metric { name: Some(name.to_owned()), value: Some(value), ..Metric::default() },
        );
    }

    fn write_metric(&self, drive: &str, metric: Metric) {
        let payload = Payload { timestamp: Some(now().unix_ms), seq: None, metrics: vec![metric] };
        let mut message = publish(&format!("spBv1.0/plant/DCMD/hall 1/{drive}"), "", Qos::AtMostOnce);
        message.payload = payload.encode().into();
        self.broker.deliver(message);
    }

    /// The metrics of a drive by their names, as its births and data have told them.
    fn metrics(&self, drive: &str) -> HashMap<String, Metric> {
        let mut names: HashMap<Option<u64>, String> = HashMap::new();
        let mut metrics: HashMap<String, Metric> = HashMap::new();
        for (topic, payload) in self.said(0) {
            if topic != format!("DBIRTH/{drive}") && topic != format!("DDATA/{drive}") {
                continue;
            }
            for metric in payload.metrics {
                let name = metric.name.clone().unwrap_or_else(|| names[&metric.alias].clone());
                names.insert(metric.alias, name.clone());
                let quality = metric.quality.or_else(|| metrics.get(&name).and_then(|known| known.quality));
                metrics.insert(name, Metric { quality, ..metric });
            }
        }
        metrics
    }
}

#[tokio::test(start_paused = true)]
async fn births_tell_every_drive_that_answers_and_every_line() {
    let bench = Bench::of(2, config("births")).await;
    assert_eq!(bench.topics(0)[..3], ["NBIRTH", "DBIRTH/pump 1", "DBIRTH/pump 2"]);
    let node = &bench.said(0)[0].1;
    let names: Vec<_> = node.metrics.iter().filter_map(|metric| metric.name.as_deref()).collect();
    for name in ["Daemon/Version", "Lines/north/Utilisation", "bdSeq", "Node Control/Rebirth"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    let pump = bench.metrics("pump 1");
    assert_eq!(pump["Properties/Family"].value, Some(Raw::String("atv312".to_owned())));
    assert_eq!(pump["Status/State"].value, Some(Raw::String("disabled".to_owned())));
    assert_eq!(pump["Status/State"].quality, Some(Quality::Good));
    // What this family does not have.
    assert!(pump["Measurements/Input Power"].is_null);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_does_not_answer_any_more_dies_and_is_born_again_when_it_does() {
    let bench = Bench::of(1, config("stale")).await;
    let mark = bench.mark();
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(30)).await;
    let said = bench.said(mark);
    let dead = said.iter().position(|(topic, _)| topic == "DDEATH/pump 1").unwrap();
    assert!(!said[dead..].iter().any(|(topic, _)| topic == "DDATA/pump 1"));
    let mark = bench.mark();
    bench.plant.machines[0].unmute();
    sleep(Duration::from_secs(30)).await;
    assert!(bench.topics(mark).contains(&"DBIRTH/pump 1".to_owned()));
    assert_eq!(bench.metrics("pump 1")["Status/State"].quality, Some(Quality::Good));
}

/// When its line asks it next is no news of a drive that says nothing.
#[tokio::test(start_paused = true)]
async fn an_alarm_of_a_drive_that_does_not_answer_is_told_in_one_text_however_often_it_is_asked() {
    let bench = Bench::of(2, config("one-text")).await;
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(300)).await;
    let metrics = || bench.said(0).into_iter().filter(|(topic, _)| topic.starts_with('N'));
    let metrics = || metrics().flat_map(|(_, payload)| payload.metrics);
    for name in ["Drives/pump 1/Alarms/Text", "Drives/pump 1/Alarms/All"] {
        let alias = metrics().find(|metric| metric.name.as_deref() == Some(name)).unwrap().alias;
        let told = metrics().filter(|metric| metric.alias == alias && metric.name.is_none());
        let told: Vec<_> = told.filter_map(|metric| metric.value).collect();
        assert_eq!(told.len(), 1, "{name}: {told:#?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_is_told_under_its_id_from_pending_to_confirmed() {
    let bench = Bench::of(1, config("command")).await;
    let mark = bench.mark();
    let command = r#"{"id": "4711", "action": "start", "setpoint": {"frequency_hz": 20}}"#;
    bench.write("pump 1", "Control/Command", Raw::String(command.to_owned()));
    sleep(Duration::from_secs(10)).await;
    let outcomes: Vec<_> = bench
        .said(mark)
        .into_iter()
        .flat_map(|(_, payload)| payload.metrics)
        .filter_map(|metric| match metric.value {
            Some(Raw::String(text)) if text == "pending" || text == "confirmed" => Some(text),
            _ => None,
        })
        .collect();
    assert_eq!(outcomes, ["pending", "confirmed"]);
    let pump = bench.metrics("pump 1");
    assert_eq!(pump["Control/LastCommand/Id"].value, Some(Raw::String("4711".to_owned())));
    assert_eq!(pump["Status/State"].value, Some(Raw::String("running".to_owned())));
    assert_eq!(pump["Control/Setpoint"].value, Some(Raw::Double(20.0)));
}

#[tokio::test(start_paused = true)]
async fn before_the_births_a_start_is_refused_and_a_stop_is_not() {
    let waiting = SparkplugConfig { primary_host: Some(Id::new("scada").unwrap()), ..config("waiting") };
    let bench = Bench::of(1, waiting).await;
    assert!(bench.topics(0).is_empty());
    let drive = bench.plant.plant.fleet().drive("pump 1").unwrap();
    assert!(drive.start(drive_core::Direction::Forward).await.is_confirmed());
    sleep(Duration::from_secs(1)).await;
    let state = || drive.snapshot().status.as_ref().map(|status| status.value.state);
    assert_eq!(state(), Some(drive_core::State::Running));
    bench.write("pump 1", "Control/Command", Raw::String(r#"{"id": "a", "action": "stop"}"#.to_owned()));
    sleep(Duration::from_secs(30)).await;
    assert_eq!(state(), Some(drive_core::State::Ready));
    bench.write("pump 1", "Control/Command", Raw::String(r#"{"id": "b", "action": "start"}"#.to_owned()));
    sleep(Duration::from_secs(10)).await;
    assert_eq!(state(), Some(drive_core::State::Ready));
    let mut state = publish("spBv1.0/STATE/scada", r#"{"online":true,"timestamp":1}"#, Qos::AtMostOnce);
    state.retain = true;
    bench.broker.deliver(state);
    sleep(Duration::from_secs(2)).await;
    let pump = bench.metrics("pump 1");
    assert_eq!(pump["Control/LastCommand/Id"].value, Some(Raw::String("b".to_owned())));
    assert_eq!(pump["Control/LastCommand/Reason"].value, Some(Raw::String("not_born".to_owned())));
}

/// Who a device was before `names.json` was lost nobody knows.
#[tokio::test(start_paused = true)]
async fn a_device_whose_id_was_lost_is_not_started() {
    let folder = drived_config::testing::Folder::new("lost-devices");
    std::fs::write(folder.file("names.json"), "{").unwrap();
    let names = drived_config::names::Names::in_folder(Some(&folder.file("")));
    assert!(
        names
            .take_up(&drived_config::names::Configured {
                drives: vec![drived_config::names::Named {
                    name: "pump 1".to_owned(),
                    place: "a 1".to_owned(),
                    slot: None
                }],
                ..Default::default()
            })
            .is_err()
    );
    let bench = Bench::of(1, config("lost")).await;
    bench.plant.plant.set_names(names);
    bench.write("pump 1", "Control/Command", Raw::String(r#"{"id": "a", "action": "start"}"#.to_owned()));
    sleep(Duration::from_secs(5)).await;
    let [id, outcome, reason, text] = last(&bench);
    assert_eq!([&*id, &*outcome, &*reason], ["a", "refused", "names_lost"]);
    assert!(text.contains("names.json"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_only_read_is_not_moved_and_says_so() {
    let plant = TestPlant::with(1, DriveSettings::watched).await;
    let broker = TestBroker::default();
    let prepared = Sparkplug::prepare(config("read"), broker.options(), Duration::from_secs(1));
    let face =
        prepared.unwrap_or_else(|failure| panic!("{failure}")).open(plant.plant.clone(), Audit::default());
    sleep(Duration::from_secs(2)).await;
    let bench = Bench { plant, broker, face };
    bench.write("pump 1", "Control/Setpoint", Raw::Double(30.0));
    sleep(Duration::from_secs(2)).await;
    let pump = bench.metrics("pump 1");
    assert_eq!(pump["Control/Allowed"].value, Some(Raw::Boolean(false)));
    assert_eq!(pump["Control/LastCommand/Outcome"].value, Some(Raw::String("refused".to_owned())));
    assert_eq!(pump["Control/LastCommand/Reason"].value, Some(Raw::String("read_only".to_owned())));
}

/// What is told of the last command of a drive: its id, outcome, reason and text.
fn last(bench: &Bench) -> [String; 4] {
    let metrics = bench.metrics("pump 1");
    ["Id", "Outcome", "Reason", "Text"].map(|what| {
        match metrics[&format!("Control/LastCommand/{what}")].value.clone() {
            Some(Raw::String(text)) => text,
            _ => String::new(),
        }
    })
}

#[tokio::test(start_paused = true)]
async fn what_is_unclear_moves_no_motor_and_the_key_is_named() {
    let bench = Bench::of(1, config("unclear")).await;
    let command = |text: &str| bench.write("pump 1", "Control/Command", Raw::String(text.to_owned()));
    for (text, outcome, reason, key) in REFUSED {
        command(text);
        sleep(Duration::from_secs(3)).await;
        let told = last(&bench);
        let [id, was, why, words] = &told;
        assert_eq!((was.as_str(), why.as_str()), (outcome, reason), "{text}: {told:?}");
        assert!(words.contains(key), "{text}: {told:?}");
        assert_eq!(words.contains("no stop and no start"), reason == "ambiguous", "{text}: {told:?}");
        assert_eq!(*id, serde_json::from_str::<Json>(text).unwrap()["id"], "{text}: {told:?}");
        assert!(!bench.plant.machines[0].observe().running, "{text}");
    }
    for text in NO_OBJECTS {
        command(text);
        sleep(Duration::from_secs(3)).await;
        assert_eq!(last(&bench)[2], "malformed", "{text}");
        assert!(!bench.plant.machines[0].observe().running, "{text}");
    }
}

#[tokio::test(start_paused = true)]
async fn who_asks_afterwards_finds_a_command_that_was_refused() {
    let bench = Bench::of(1, SparkplugConfig { commands: Some(Role::Stop), ..config("refused") }).await;
    for id in ["a", "b"] {
        let start = format!(r#"{{"id": "{id}", "action": "start"}}"#);
        bench.write("pump 1", "Control/Command", Raw::String(start));
        sleep(Duration::from_secs(3)).await;
    }
    let events = bench.plant.plant.recent().into_iter().filter_map(|recent| recent.what.event());
    let told: Vec<String> = events.map(|event| event.text).filter(|text| text.contains("refused")).collect();
    let [once] = &told[..] else { panic!("{told:?}") };
    assert!(once.starts_with("pump 1: start by sparkplug from sparkplug plant: refused: "), "{once}");
    let last = bench.plant.plant.last_command("pump 1").unwrap();
    assert_eq!((last.id.as_deref(), last.reason.as_deref()), (Some("b"), Some("no_right")));
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_taken_whatever_else_it_says_and_under_its_id() {
    let bench = Bench::of(1, config("stops")).await;
    let command = |text: &str| bench.write("pump 1", "Control/Command", Raw::String(text.to_owned()));
    for (number, text) in STOPS.into_iter().enumerate() {
        command(&format!(
            r#"{{"id": "start-{number}", "action": "start", "setpoint": {{"frequency_hz": 20}}}}"#
        ));
        sleep(Duration::from_secs(10)).await;
        assert!(bench.plant.machines[0].observe().running, "{text}");
        command(text);
        sleep(Duration::from_secs(20)).await;
        assert!(!bench.plant.machines[0].observe().running, "{text}");
        let told = last(&bench);
        assert_eq!(told[1], "confirmed", "{text}: {told:?}");
        assert!(told[0] == "s" || !text.starts_with('{'), "{text}: {told:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_the_past_stops_and_a_start_of_the_past_starts_nothing() {
    let bench = Bench::of(1, config("past")).await;
    let command = |text: &str, is_historical| {
        let (name, value) = (Some("Control/Command".to_owned()), Some(Raw::String(text.to_owned())));
        bench.write_metric("pump 1", Metric { name, value, is_historical, ..Metric::default() });
    };
    let start = r#"{"id": "a", "action": "start", "setpoint": {"frequency_hz": 20}}"#;
    for (text, is_historical, runs) in [
        (start, true, false),
        (&*start.replace("\"a\"", "\"b\""), false, true),
        (r#"{"id": "c", "action": "stop"}"#, true, false),
    ] {
        command(text, is_historical);
        sleep(Duration::from_secs(20)).await;
        assert_eq!(bench.plant.machines[0].observe().running, runs, "{text}: {:?}", last(&bench));
    }
}

/// A host may send a value that has waited with it, in a payload of now (Sparkplug 3.0, 6.4.6: each metric has a time of its own).
#[tokio::test(start_paused = true)]
async fn a_start_that_waited_with_its_host_is_late_and_a_stop_never_is() {
    let bench = Bench::of(1, config("waited")).await;
    let command = |text: &str, waited_ms: u64| {
        let (name, value) = (Some("Control/Command".to_owned()), Some(Raw::String(text.to_owned())));
        let timestamp = Some(now().unix_ms - waited_ms);
        bench.write_metric("pump 1", Metric { name, value, timestamp, ..Metric::default() });
    };
    let start =
        |id: &str| format!(r#"{{"id": "{id}", "action": "start", "setpoint": {{"frequency_hz": 20}}}}"#);
    for (text, waited_ms, runs) in [
        (start("a"), 60_000, false),
        (start("b"), 0, true),
        (r#"{"id": "c", "action": "stop"}"#.to_owned(), 60_000, false),
    ] {
        command(&text, waited_ms);
        sleep(Duration::from_secs(20)).await;
        let told = last(&bench);
        assert_eq!(bench.plant.machines[0].observe().running, runs, "{text}: {told:?}");
        assert_eq!(told[1] == "expired", waited_ms > 0 && text.contains("start"), "{told:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_rejected_is_told_under_its_id() {
    let bench = Bench::of(1, SparkplugConfig { commands: Some(Role::View), ..config("view") }).await;
    bench.write("pump 1", "Control/Command", Raw::String(r#"{"id": "s-1", "action": "stop"}"#.to_owned()));
    sleep(Duration::from_secs(3)).await;
    let told = last(&bench);
    assert_eq!([&told[0], &told[1], &told[2]], ["s-1", "refused", "no_right"], "{told:?}");
}

#[tokio::test(start_paused = true)]
async fn while_the_daemon_ends_only_stops_are_taken_and_the_node_dies_last() {
    let bench = Bench::of(1, config("closing")).await;
    bench.plant.plant.close();
    bench.write("pump 1", "Control/Setpoint", Raw::Double(30.0));
    sleep(Duration::from_secs(2)).await;
    let pump = bench.metrics("pump 1");
    assert_eq!(pump["Control/LastCommand/Reason"].value, Some(Raw::String("closing".to_owned())));
    let Bench { broker, face, .. } = bench;
    face.close().await;
    let last = broker.publishes().pop().unwrap();
    assert!(last.topic.starts_with(b"spBv1.0/plant/NDEATH/"), "{last:?}");
    let packets = broker.packets();
    let goodbye = packets.iter().find_map(|packet| match packet {
        rumqttc::Packet::Disconnect(goodbye) => Some(goodbye.reason_code),
        _ => None,
    });
    assert_eq!(goodbye, Some(rumqttc::DisconnectReasonCode::DisconnectWithWillMessage));
}

#[test]
fn what_is_old_is_stale_with_its_last_value_and_what_was_never_read_is_bad_without_one() {
    let drive = json!({
        "setpoint": { "frequency_hz": 30 },
        "status": { "quality": "stale", "age_ms": 9_000, "output_frequency_hz": 29.5 },
        "measurements": { "quality": "missing" },
    });
    let read: HashMap<_, _> = metrics::read_drive(&drive, 100_000).collect();
    let told = |name: &str| (read[name].value.clone(), read[name].quality, read[name].unix_ms);
    let hertz = |number| Some(drive_sparkplug::Value::Double(number));
    assert_eq!(told("Status/Output Frequency"), (hertz(29.5), Quality::Stale, 100_000));
    assert_eq!(told("Measurements/Speed"), (None, Quality::Bad, 100_000));
    assert_eq!(told("Control/Setpoint"), (hertz(30.0), Quality::Good, 100_000));
    let live = json!({ "status": { "quality": "good", "age_ms": 9_000, "output_frequency_hz": 29.5 } });
    let read: HashMap<_, _> = metrics::read_drive(&live, 100_000).collect();
    let Reading { quality, unix_ms, .. } = &read["Status/Output Frequency"];
    assert_eq!((*quality, *unix_ms), (Quality::Good, 91_000), "the time at which it was read");
}

#[test]
fn the_manual_lists_every_metric_with_its_type() {
    let manual = include_str!("../../../drived/docs/sparkplug.md");
    let owners = [Owner::Program, Owner::Line("<line>".to_owned()), Owner::Drive("<drive>".to_owned())];
    let node = metrics::of_the_node(&["<line>".to_owned()], &owners);
    for Definition { name, data_type } in node.into_iter().chain(metrics::of_a_drive()) {
        let row = format!("| `{name}` | {data_type:?} | ");
        assert!(manual.contains(&row), "{row}");
    }
}
