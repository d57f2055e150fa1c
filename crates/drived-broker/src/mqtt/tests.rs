mod alarms;

use std::collections::BTreeMap;

use drive_core::{Frequency, StopMode};
use drive_fleet::{Band, Commanders, DriveSettings, FrequencyLimits};
use rumqttc::{Packet, Publish, PublishProperties};
use serde_json::{Value, json};
use tokio::time::sleep;

use super::*;
use crate::{
    broker::config::Address,
    broker::testing::{Conduct, TestBroker, publish},
    desk::testing::{NO_OBJECTS, REFUSED, STOPS},
};
use drived_config::names::{Configured, Named};
use drived_doors::{Caller, Rights, Role};
use drived_plant::plant::{
    commands::{Action, LIFETIME, Request, Target},
    testing::TestPlant,
};

fn config() -> MqttConfig {
    MqttConfig {
        servers: vec![Address { host: "memory".to_owned(), port: 1883, tls: false }],
        authorities: None,
        identity: None,
        user: None,
        password: None,
        client_id: "drived".to_owned(),
        base: "plant/north".to_owned(),
        heartbeat: Duration::from_secs(30),
        interval: Duration::from_secs(1),
        measurements: Duration::from_secs(10),
        commands: true,
        commanders: BTreeMap::new(),
        needs_issued: false,
        discovery: Discovery::Device,
        discovery_prefix: "homeassistant".to_owned(),
    }
}

/// A plant, its face, and the broker that it is on.
struct Bench {
    plant: TestPlant,
    broker: TestBroker,
    mqtt: Mqtt,
}

impl Bench {
    async fn of(drives: u8) -> Self {
        Self::with(TestPlant::of(drives).await, config()).await
    }

    async fn with(plant: TestPlant, config: MqttConfig) -> Self {
        Self::on(TestBroker::default(), plant, config).await
    }

    /// The same on a broker that has something already.
    async fn on(broker: TestBroker, plant: TestPlant, config: MqttConfig) -> Self {
        Self::called(broker, plant, config, Names::default()).await
    }

    /// The same with what is kept of who is who.
    async fn called(broker: TestBroker, plant: TestPlant, config: MqttConfig, names: Names) -> Self {
        let mut prepared = Mqtt::prepare(config).unwrap_or_else(|failure| panic!("{failure}"));
        prepared.options.dial = broker.options().dial;
        let mqtt = prepared.open(plant.plant.clone(), Audit::default(), names);
        broker.until(|broker| broker.retained().contains_key("plant/north/status")).await;
        sleep(Duration::from_secs(2)).await;
        Self { plant, broker, mqtt }
    }

    /// A retained topic, as JSON.
    fn state(&self, topic: &str) -> Value {
        let retained = self.broker.retained();
        let publish = retained.get(topic).unwrap_or_else(|| panic!("{topic} is among {:?}", retained.keys()));
        serde_json::from_slice(&publish.payload)
            .unwrap_or_else(|_| Value::from(String::from_utf8(publish.payload.to_vec()).expect("text")))
    }

    fn drive(&self, what: &str) -> Value {
        self.state(&format!("plant/north/drive/pump_1/{what}"))
    }

    /// The answers so far, on a topic.
    fn answers_on(&self, topic: &str) -> Vec<Value> {
        let published = self.broker.published().into_iter().filter(|(to, _)| to == topic);
        published.map(|(_, payload)| serde_json::from_str(&payload).expect("answers are JSON")).collect()
    }

    fn answers(&self) -> Vec<Value> {
        self.answers_on("plant/north/drive/pump_1/outcome")
    }

    /// The outcomes so far, in their order.
    fn outcomes(&self) -> Vec<String> {
        self.answers()
            .iter()
            .map(|answer| answer["outcome"].as_str().expect("an outcome").to_owned())
            .collect()
    }

    /// Publishes as a client does that is content with QoS 0.
    fn ask_bytes(&self, topic: &str, payload: &'static [u8]) {
        let mut arrived = publish(&format!("plant/north/{topic}"), "", Qos::AtMostOnce);
        arrived.payload = payload.into();
        self.broker.deliver(arrived);
    }

    fn ask(&self, topic: &str, payload: &str) {
        self.broker.deliver(publish(&format!("plant/north/{topic}"), payload, Qos::AtMostOnce));
    }

    fn command(&self, body: &Value) {
        self.ask("drive/pump_1/command", &body.to_string());
    }

    fn runs(&self, number: usize) -> bool {
        self.plant.machines[number].observe().running
    }
}

fn start(id: &str) -> Value {
    json!({ "id": id, "action": "start", "setpoint": { "frequency_hz": 30.0 } })
}

async fn a_while() {
    sleep(Duration::from_secs(10)).await;
}

/// Behind a reload another face takes its place, with those that may command then.
#[tokio::test(start_paused = true)]
async fn a_start_that_waits_for_others_of_its_line_is_not_begun_behind_the_end_of_its_face() {
    for ends in [false, true] {
        let bench = Bench::of(4).await;
        for drive in &bench.plant.plant.fleet().drives()[..2] {
            let action = Action::Start {
                direction: drive_core::Direction::Forward,
                setpoint: Some(Frequency::from_hertz(20).into()),
                until: drive_fleet::Until::InForce,
            };
            let target = Target::Drive(drive.name().to_string());
            let arrived = Instant::now();
            let request = Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived };
            bench.plant.plant.begin(&Caller::new("anna", "test", Rights::ALL), request).unwrap();
        }
        bench.ask("drive/pump_4/command", &start("waits").to_string());
        sleep(Duration::from_millis(200)).await;
        assert!(!(0..4).any(|number| bench.runs(number)), "all wait or are begun");
        let Bench { plant, mqtt, .. } = bench;
        let mut open = Some(mqtt);
        if let Some(mqtt) = open.take_if(|_| ends) {
            mqtt.close().await;
        }
        a_while().await;
        let running = plant.machines.iter().map(|machine| machine.observe().running);
        assert_eq!(running.collect::<Vec<_>>(), [true, true, false, !ends]);
        drop(open);
    }
}

#[tokio::test(start_paused = true)]
async fn what_there_is_is_retained_and_expires_with_the_daemon() {
    let bench = Bench::of(2).await;
    assert_eq!(bench.state("plant/north/status"), "online");
    assert_eq!(bench.drive("availability"), "online");
    let state = bench.drive("state");
    assert_eq!((&state["name"], &state["status"]["quality"]), (&"pump 1".into(), &"good".into()));
    assert!(state["time_unix_ms"].is_u64() && state["status"]["age_ms"].is_u64(), "{state}");
    assert_eq!(bench.drive("fault")["present"], false);
    // What is retained for good holds no verdict of the moment.
    let about = bench.drive("about");
    assert!(about["identity"].is_object() && about["identity"]["check"].is_null(), "{about}");
    assert!(about["watchdog"].is_null(), "{about}");
    assert!(state["identity"]["check"].is_string() && state["watchdog"]["check"].is_string(), "{state}");
    a_while().await;
    assert_eq!(bench.drive("measurements")["line_voltage_v"], 400.0);
    assert_eq!(bench.state("plant/north/line/north")["link"], "connected");
    let expires = |topic: &str| {
        let publish = bench.broker.retained()[topic].clone();
        publish.properties.and_then(|properties| properties.message_expiry_interval)
    };
    for what in ["state", "measurements", "fault"] {
        assert_eq!(expires(&format!("plant/north/drive/pump_2/{what}")), Some(90));
    }
    for holds in ["plant/north/status", "plant/north/drive/pump_1/availability"] {
        assert_eq!(expires(holds), None, "{holds}");
    }
    let Packet::Connect(_, Some(will), _) = &bench.broker.packets()[0] else { panic!("a will") };
    let will = (&will.topic[..], &will.message[..], will.retain, will.qos);
    assert_eq!(will, (&b"plant/north/status"[..], &b"offline"[..], true, rumqttc::QoS::AtLeastOnce));
}

#[tokio::test(start_paused = true)]
async fn a_stale_value_is_never_published_as_live() {
    let bench = Bench::of(1).await;
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(60)).await;
    assert_eq!(bench.drive("availability"), "offline");
    assert_eq!(bench.drive("state")["status"]["quality"], "stale");
    assert_eq!(bench.drive("measurements")["quality"], "stale");
    assert!(bench.drive("state")["status"]["age_ms"].as_u64().unwrap() > 1_000);
    bench.plant.machines[0].unmute();
    sleep(Duration::from_secs(60)).await;
    assert_eq!(
        (bench.drive("availability"), &bench.drive("state")["status"]["quality"]),
        ("online".into(), &"good".into())
    );
}

#[tokio::test(start_paused = true)]
async fn everything_is_told_again_at_each_heartbeat_and_after_each_connect() {
    let bench = Bench::of(1).await;
    a_while().await;
    let count = |topic: &str| bench.broker.published().iter().filter(|(to, _)| to == topic).count();
    let before = count("plant/north/drive/pump_1/fault");
    sleep(Duration::from_secs(300)).await;
    assert_eq!(count("plant/north/drive/pump_1/fault") - before, 10, "one each heartbeat");
    let told = bench.broker.published().len();
    bench.broker.cut();
    let connects = |broker: &TestBroker| {
        broker.packets().iter().filter(|packet| matches!(packet, Packet::Connect(..))).count()
    };
    bench.broker.until(|broker| connects(broker) == 2).await;
    sleep(Duration::from_secs(1)).await;
    let again: Vec<String> =
        bench.broker.published().split_off(told).into_iter().map(|(topic, _)| topic).collect();
    for topic in bench.broker.retained().keys() {
        assert!(again.contains(topic), "{topic} is among {again:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_is_accepted_first_and_its_outcome_follows_where_it_was_asked_for() {
    let bench = Bench::of(1).await;
    let properties = PublishProperties {
        response_topic: Some("reply/me".to_owned()),
        correlation_data: Some("42".into()),
        ..PublishProperties::default()
    };
    let asked = publish("plant/north/drive/pump_1/command", &start("a-1").to_string(), Qos::AtLeastOnce);
    bench.broker.deliver(Publish { properties: Some(properties), ..asked });
    a_while().await;
    assert!(bench.runs(0));
    for topic in ["plant/north/drive/pump_1/outcome", "reply/me"] {
        let answers = bench.answers_on(topic);
        let outcomes: Vec<_> = answers.iter().map(|answer| answer["outcome"].as_str().unwrap()).collect();
        assert_eq!(outcomes, ["accepted", "confirmed"], "{topic}");
        assert!(answers.iter().all(|answer| answer["id"] == "a-1" && answer["caller"] == "mqtt"));
        let sent = bench.broker.message(topic).await;
        assert_eq!((sent.retain, sent.properties.unwrap().correlation_data), (false, Some("42".into())));
    }
    bench.ask("drive/pump_1/stop", "");
    sleep(Duration::from_secs(20)).await;
    assert!(!bench.runs(0));
    assert_eq!(bench.outcomes(), ["accepted", "confirmed", "accepted", "confirmed"]);
}

#[tokio::test(start_paused = true)]
async fn plain_words_command_too() {
    let bench = Bench::of(1).await;
    bench.ask("drive/pump_1/set/frequency", "40.0");
    a_while().await;
    bench.ask("drive/pump_1/set/run", "reverse");
    a_while().await;
    let shown = bench.drive("state");
    assert_eq!(
        (&shown["status"]["direction"], &shown["setpoint"]["frequency_hz"]),
        (&"reverse".into(), &40.0.into())
    );
    bench.ask("drive/pump_1/set/run", "stop");
    sleep(Duration::from_secs(20)).await;
    assert_eq!(bench.outcomes(), ["accepted", "confirmed"].repeat(3));
    assert!(bench.answers().iter().all(|answer| answer["id"].as_str().unwrap().starts_with("c-")));
    for (topic, payload) in [
        ("set/frequency", "fast"),
        ("set/frequency", "40,\"x\":1"),
        ("set/run", "on"),
        ("set/speed", "-1"),
        ("command", "x"),
    ] {
        bench.ask(&format!("drive/pump_1/{topic}"), payload);
        sleep(Duration::from_secs(1)).await;
        assert_eq!(bench.answers().last().unwrap()["reason"], "malformed", "{topic} {payload}");
    }
    assert!(!bench.runs(0));
}

#[tokio::test(start_paused = true)]
async fn a_retained_command_is_refused_and_a_retained_stop_stops() {
    let bench = Bench::of(1).await;
    let retained = |topic: &str, payload: &str| Publish {
        retain: true,
        ..publish(&format!("plant/north/drive/pump_1/{topic}"), payload, Qos::AtLeastOnce)
    };
    bench.broker.deliver(retained("command", &start("kept").to_string()));
    bench.broker.deliver(retained("set/run", "forward"));
    a_while().await;
    assert!(!bench.runs(0));
    let reasons: Vec<_> = bench.answers().into_iter().map(|answer| answer["reason"].clone()).collect();
    assert_eq!(reasons, ["retained", "retained"]);
    assert_eq!(bench.answers()[0]["id"], "kept");
    bench.command(&start("b"));
    a_while().await;
    assert!(bench.runs(0));
    bench.broker.deliver(retained("stop", ""));
    a_while().await;
    assert!(!bench.runs(0));
}

#[tokio::test(start_paused = true)]
async fn what_comes_again_moves_no_motor() {
    let bench = Bench::of(1).await;
    let deliver = |body: &Value, repeated: bool, correlation: Option<&'static str>| {
        let properties = PublishProperties {
            correlation_data: correlation.map(Into::into),
            ..PublishProperties::default()
        };
        let asked = publish("plant/north/drive/pump_1/command", &body.to_string(), Qos::AtLeastOnce);
        bench.broker.deliver(Publish { dup: repeated, properties: Some(properties), ..asked });
    };
    let nameless = json!({ "action": "start", "setpoint": { "frequency_hz": 30.0 } });
    // Without an id nobody can say whether it has come before.
    deliver(&nameless, false, None);
    a_while().await;
    assert_eq!((bench.runs(0), &bench.answers()[0]["reason"]), (false, &"id_needed".into()));
    // By its id, and by its Correlation Data.
    for (body, correlation) in [(start("once"), None), (nameless, Some("\u{1}\u{2}"))] {
        deliver(&body, false, correlation);
        a_while().await;
        assert!(bench.runs(0));
        bench.ask("drive/pump_1/stop", "fast");
        a_while().await;
        for repeated in [false, true] {
            deliver(&body, repeated, correlation);
            a_while().await;
            assert!(!bench.runs(0), "it is answered and not repeated");
        }
        bench.broker.cut();
        a_while().await;
        deliver(&body, true, correlation);
        a_while().await;
        assert!(!bench.runs(0), "nor after a reconnect");
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_that_was_held_up_on_its_way_from_the_broker_moves_no_motor() {
    let bench = Bench::of(1).await;
    bench.broker.hold();
    bench.command(&start("late"));
    sleep(Duration::from_secs(8)).await;
    bench.broker.release();
    a_while().await;
    assert_eq!((bench.runs(0), &bench.answers()[0]["reason"]), (false, &"late".into()));
    bench.command(&start("in-time"));
    a_while().await;
    assert!(bench.runs(0), "{:?}", bench.answers());
    bench.broker.hold();
    bench.ask("drive/pump_1/stop", "");
    sleep(Duration::from_secs(8)).await;
    bench.broker.release();
    a_while().await;
    assert!(!bench.runs(0), "a stop is never too late");
}

#[tokio::test(start_paused = true)]
async fn a_start_that_a_stop_by_another_door_may_have_overtaken_on_its_way_is_not_begun() {
    let bench = Bench::of(1).await;
    let stop = || {
        let caller = Caller::new("operator", "page", Rights::ALL);
        let (target, action) = (Target::Drive("pump 1".to_owned()), Action::Stop(StopMode::Ramp.into()));
        let request =
            Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived: Instant::now() };
        bench.plant.plant.begin(&caller, request).unwrap();
    };
    for held in [1_000, 2_000] {
        bench.command(&start(&format!("runs-{held}")));
        a_while().await;
        // The way from the broker is held up, and somebody at the page stops the motor meanwhile.
        bench.broker.hold();
        bench.command(&start(&format!("overtaken-{held}")));
        sleep(Duration::from_millis(held / 2)).await;
        stop();
        sleep(Duration::from_millis(held / 2)).await;
        bench.broker.release();
        a_while().await;
        assert!(!bench.runs(0), "{:?}", bench.answers());
        let told = bench.answers().pop().unwrap();
        assert_eq!((&told["outcome"], &told["reason"]), (&"superseded".into(), &"stop".into()), "{told}");
    }
    bench.command(&start("behind"));
    a_while().await;
    assert!(bench.runs(0), "{:?}", bench.answers());
    // What comes through the same door comes in its order, however long its broker has said nothing.
    bench.ask("drive/pump_1/stop", "");
    sleep(Duration::from_secs(4)).await;
    bench.command(&start("again"));
    a_while().await;
    assert!(bench.runs(0), "{:?}", bench.answers());
}

#[tokio::test(start_paused = true)]
async fn a_command_lives_as_long_as_its_message_and_no_longer_than_ten_seconds() {
    let bench = Bench::of(1).await;
    let deliver = |seconds: Option<u32>, body: &Value| {
        let properties =
            PublishProperties { message_expiry_interval: seconds, ..PublishProperties::default() };
        let asked = publish("plant/north/drive/pump_1/command", &body.to_string(), Qos::AtLeastOnce);
        bench.broker.deliver(Publish { properties: Some(properties), ..asked });
    };
    // A first command holds the drive for longer than those after it may wait.
    for (number, (seconds, muted, body)) in [
        (None, 3, start("a")),
        (Some(2), 4, start("b")),
        (Some(3_600), 14, start("c")),
        (
            Some(8),
            3,
            json!({"id": "d", "action": "start", "expires_in_ms": 500, "setpoint": {"frequency_hz": 30.0}}),
        ),
    ]
    .into_iter()
    .enumerate()
    {
        bench.plant.machines[0].mute();
        bench.command(&json!({ "action": "setpoint", "setpoint": { "frequency_hz": 10.0 + number as f64 } }));
        sleep(Duration::from_millis(50)).await;
        deliver(seconds, &body);
        sleep(Duration::from_secs(muted)).await;
        bench.plant.machines[0].unmute();
        sleep(Duration::from_secs(30)).await;
        let last = bench.answers().into_iter().rfind(|answer| answer["id"] == body["id"]).unwrap();
        assert!(["expired", "refused"].contains(&last["outcome"].as_str().unwrap()), "{last}");
        assert!(!bench.runs(0), "{last}");
    }
    let old = json!({ "id": "e", "action": "start", "issued_unix_ms": drived_words::json::unix(Instant::now()) - 1_500 });
    bench.command(&old);
    a_while().await;
    assert_eq!((bench.runs(0), &bench.answers().last().unwrap()["outcome"]), (false, &"expired".into()));
}

#[tokio::test(start_paused = true)]
async fn what_is_unclear_moves_no_motor_and_the_key_is_named() {
    let bench = Bench::of(1).await;
    for (text, outcome, reason, key) in REFUSED {
        bench.ask("drive/pump_1/command", text);
        sleep(Duration::from_secs(3)).await;
        let told = bench.answers().pop().unwrap();
        assert_eq!((&told["outcome"], &told["reason"]), (&outcome.into(), &reason.into()), "{text}: {told}");
        assert!(told["text"].as_str().unwrap().contains(key), "{text}: {told}");
        let is_no_stop = told["text"].as_str().unwrap().contains("no stop and no start");
        assert_eq!(is_no_stop, reason == "ambiguous", "{text}: {told}");
        assert_eq!(told["id"], serde_json::from_str::<Value>(text).unwrap()["id"], "{text}");
        assert!(!bench.runs(0), "{text}");
    }
    for text in NO_OBJECTS {
        bench.ask("drive/pump_1/command", text);
        sleep(Duration::from_secs(3)).await;
        let told = bench.answers().pop().unwrap();
        assert_eq!(told["reason"], "malformed", "{text}: {told}");
        assert!(!bench.runs(0), "{text}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_taken_whatever_else_it_says_and_under_its_id() {
    let bench = Bench::of(1).await;
    for (number, text) in STOPS.into_iter().enumerate() {
        bench.command(&start(&format!("start-{number}")));
        a_while().await;
        assert!(bench.runs(0), "{text}");
        bench.ask("drive/pump_1/command", text);
        sleep(Duration::from_secs(20)).await;
        assert!(!bench.runs(0), "{text}");
        let told = bench.answers().pop().unwrap();
        assert_eq!(told["outcome"], "confirmed", "{text}: {told}");
        assert!(told["id"] == "s" || !text.starts_with('{'), "{text}: {told}");
    }
    // What is no text either, and where a direction is asked for.
    for (topic, payload) in [
        ("drive/pump_1/command", &b"{\"action\": \"stop\", \"id\": \"\xFF\"}"[..]),
        ("drive/pump_1/set/run", b"STOP\0"),
        ("drive/pump_1/set/run", br#"{"action": "stop""#),
    ] {
        bench.command(&start(&format!("start-{topic}-{}", payload.len())));
        a_while().await;
        assert!(bench.runs(0), "{topic}");
        bench.ask_bytes(topic, payload);
        sleep(Duration::from_secs(20)).await;
        assert!(!bench.runs(0), "{topic} {}", payload.escape_ascii());
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_that_says_when_it_was_issued_is_the_same_whenever_it_comes() {
    let bench = Bench::of(1).await;
    let mut again = start("same");
    again["issued_unix_ms"] = drived_words::json::unix(Instant::now()).into();
    again["expires_in_ms"] = 10_000.into();
    bench.command(&again);
    sleep(Duration::from_secs(2)).await;
    let first = bench.answers().pop().unwrap();
    bench.command(&again);
    sleep(Duration::from_secs(3)).await;
    let second = bench.answers().pop().unwrap();
    assert_eq!((&second["outcome"], &second["reason"]), (&first["outcome"], &first["reason"]), "{second}");
    assert!(bench.runs(0));
}

/// How long it has waited in a client that had no connection nobody but its publisher knows.
#[tokio::test(start_paused = true)]
async fn where_it_is_wanted_nothing_starts_or_gets_a_setpoint_that_does_not_say_when_it_was_issued() {
    let bench = Bench::with(TestPlant::of(1).await, MqttConfig { needs_issued: true, ..config() }).await;
    let setpoint = r#"{"id": "s", "action": "setpoint", "setpoint": {"frequency_hz": 20.0}}"#;
    let undated = [
        ("command", start("a").to_string()),
        ("command", setpoint.to_owned()),
        ("set/run", "forward".to_owned()),
        ("set/frequency", "20".to_owned()),
    ];
    for (topic, payload) in undated {
        bench.ask(&format!("drive/pump_1/{topic}"), &payload);
        sleep(Duration::from_secs(3)).await;
        let told = bench.answers().pop().expect("it is answered");
        assert_eq!(
            (&told["outcome"], &told["reason"]),
            (&"refused".into(), &"issued_needed".into()),
            "{told}"
        );
        assert!(!bench.runs(0), "{payload}");
    }
    let issued = |id: &str, ago: u64| {
        let mut start = start(id);
        start["issued_unix_ms"] = (drived_words::json::unix(Instant::now()) - ago).into();
        start
    };
    bench.command(&issued("late", 11_000));
    a_while().await;
    assert_eq!((bench.runs(0), &bench.answers().pop().unwrap()["reason"]), (false, &"expired".into()));
    bench.command(&issued("now", 0));
    a_while().await;
    assert!(bench.runs(0), "{:?}", bench.answers());
    // What starts nothing needs none, and a stop never does.
    bench.ask("drive/pump_1/set/run", "stop");
    sleep(Duration::from_secs(20)).await;
    assert!(!bench.runs(0));
    bench.ask("drive/pump_1/reset", "");
    a_while().await;
    assert_ne!(bench.answers().pop().unwrap()["outcome"], "refused");
}

/// By its own clock, when its button is pressed.
#[tokio::test(start_paused = true)]
async fn home_assistant_says_when_a_command_was_issued_where_that_is_wanted() {
    let bench = Bench::with(TestPlant::of(1).await, MqttConfig { needs_issued: true, ..config() }).await;
    a_while().await;
    let document = bench.state("homeassistant/device/plant_north_pump_1/config");
    for control in ["setpoint", "start", "start_reverse"] {
        let control = &document["components"][control];
        assert_eq!(control["command_topic"], "plant/north/drive/pump_1/command", "{control}");
        let template = control["command_template"].as_str().unwrap();
        assert!(template.contains("'issued_unix_ms': (now().timestamp() * 1000) | int"), "{control}");
    }
    for control in ["stop", "reset"] {
        assert!(document["components"][control].get("command_template").is_none(), "{control}");
    }
}

#[tokio::test(start_paused = true)]
async fn each_outcome_is_told_in_the_words_of_the_api() {
    let limited = |name: String| DriveSettings {
        limits: FrequencyLimits {
            forbidden: vec![Band { low: Frequency::from_hertz(20), high: Frequency::from_hertz(22) }],
            ..FrequencyLimits::default()
        },
        ..DriveSettings::controlled(name)
    };
    let bench = Bench::with(TestPlant::with(1, limited).await, config()).await;
    let at = |hertz: f64| json!({ "action": "setpoint", "setpoint": { "frequency_hz": hertz } });
    bench.command(&at(21.0));
    a_while().await;
    assert_eq!(bench.answers().last().unwrap()["reason"], "forbidden_band");
    bench.command(&start("a"));
    a_while().await;
    bench.command(&at(10.0));
    bench.command(&at(15.0));
    bench.command(&at(30.0));
    a_while().await;
    assert!(bench.outcomes().contains(&"superseded".to_owned()), "{:?}", bench.outcomes());
    // A stop that the drive cannot confirm is not known, and settled later under its id.
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(8)).await;
    bench.ask("drive/pump_1/stop", r#"{"id": "s"}"#);
    sleep(Duration::from_secs(40)).await;
    let of_stop = |answer: &Value| answer["id"] == "s";
    let told = |bench: &Bench| -> Vec<Value> {
        bench.answers().into_iter().filter(of_stop).map(|answer| answer["outcome"].clone()).collect()
    };
    assert_eq!(told(&bench), ["accepted", "unknown"]);
    bench.plant.machines[0].unmute();
    sleep(Duration::from_secs(60)).await;
    assert_eq!(told(&bench), ["accepted", "unknown", "confirmed"]);
}

#[tokio::test(start_paused = true)]
async fn who_may_what_stands_in_the_configuration_and_a_stop_is_a_right_of_its_own() {
    let commanders = [("hmi", Role::Operate), ("panel", Role::Stop), ("eye", Role::View)]
        .map(|(name, role)| (name.to_owned(), role));
    let config = MqttConfig { commanders: commanders.into(), ..config() };
    let chief = |name: String| match name.as_str() {
        "pump 2" => DriveSettings {
            commanders: Commanders::Only(vec!["chief".to_owned()]),
            ..DriveSettings::controlled(name)
        },
        "pump 3" => DriveSettings::watched(name),
        _ => DriveSettings::controlled(name),
    };
    let bench = Bench::with(TestPlant::with(3, chief).await, config).await;
    let last = |number: u8| {
        let answers = bench.answers_on(&format!("plant/north/drive/pump_{number}/outcome"));
        answers.last().cloned().unwrap_or_default()
    };
    for (id, (topic, number, reason)) in [
        ("drive/pump_1/command", 1, "no_right"),
        ("drive/pump_1/command/panel", 1, "no_right"),
        ("drive/pump_1/command/eye", 1, "no_right"),
        ("drive/pump_1/command/stranger", 1, "no_right"),
        ("drive/pump_2/command/hmi", 2, "no_right"),
        ("drive/pump_3/command/hmi", 3, "read_only"),
        ("drive/pump_9/command/hmi", 9, "not_found"),
    ]
    .into_iter()
    .enumerate()
    {
        bench.ask(topic, &start(&format!("x{id}")).to_string());
        sleep(Duration::from_secs(3)).await;
        assert_eq!(last(number)["reason"], reason, "{topic}: {}", last(number));
    }
    // Who asks afterwards finds what the plant never heard of, and each attempt once.
    bench.ask("drive/pump_1/command/panel", &start("x9").to_string());
    sleep(Duration::from_secs(3)).await;
    let told: Vec<String> = bench
        .plant
        .plant
        .recent()
        .into_iter()
        .filter_map(|recent| recent.what.event())
        .map(|told| told.text)
        .collect();
    let by_panel = told.iter().filter(|text| text.starts_with("pump 1: start by panel from mqtt: refused: "));
    assert_eq!(by_panel.count(), 1, "{told:?}");
    bench.ask("drive/pump_1/command/hmi", &start("y").to_string());
    a_while().await;
    assert_eq!((bench.runs(0), last(1)["caller"].clone()), (true, "hmi".into()));
    for who in ["eye", "stranger"] {
        bench.ask(&format!("drive/pump_1/stop/{who}"), "");
        sleep(Duration::from_secs(3)).await;
        assert!(bench.runs(0));
    }
    bench.ask("drive/pump_1/stop/panel", "whatever it says");
    a_while().await;
    assert!(!bench.runs(0));
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_with_its_meaning_as_it_happens_and_for_as_long_as_it_is_there() {
    let bench = Bench::of(1).await;
    bench.plant.machines[0].trip(9);
    a_while().await;
    let fault = bench.drive("fault");
    assert_eq!(
        (&fault["present"], &fault["code"], &fault["mnemonic"]),
        (&true.into(), &9.into(), &"OCF".into()),
        "{fault}"
    );
    assert!(fault["meaning"].is_string() && fault["at_trip"].is_object(), "{fault}");
    let events = bench.answers_on("plant/north/drive/pump_1/event");
    let trip = events.iter().find(|event| event["event"] == "tripped").expect("it is told");
    assert_eq!(trip["alarm"], true);
    assert!(!bench.broker.retained().contains_key("plant/north/drive/pump_1/event"), "it has happened once");
    let types =
        bench.state("homeassistant/device/plant_north_pump_1/config")["components"]["alarm"]["event_types"]
            .clone();
    assert!(types.as_array().unwrap().contains(&trip["event"]));
    bench.ask("drive/pump_1/reset", "");
    a_while().await;
    assert_eq!(bench.drive("fault")["present"], false);
}

#[tokio::test(start_paused = true)]
async fn groups_are_commanded_and_all_are_only_stopped() {
    let bench = Bench::of(3).await;
    bench.ask("group/pumps/command", &start("g").to_string());
    a_while().await;
    assert!((0..3).all(|number| bench.runs(number)));
    let told = bench.answers_on("plant/north/group/pumps/outcome");
    assert_eq!(
        told.last().map(|told| (told["outcome"].clone(), told["confirmed"].clone())),
        Some(("confirmed".into(), 3.into()))
    );
    bench.ask("all/stop", "");
    sleep(Duration::from_secs(20)).await;
    assert!((0..3).all(|number| !bench.runs(number)));
    bench.ask("all/command", &start("h").to_string());
    a_while().await;
    let told = bench.answers_on("plant/north/all/outcome");
    assert_eq!(told.last().unwrap()["reason"], "malformed");
    assert!((0..3).all(|number| !bench.runs(number)));
}

#[tokio::test(start_paused = true)]
async fn nobody_commands_unless_the_configuration_says_so() {
    let bench = Bench::with(TestPlant::of(1).await, MqttConfig { commands: false, ..config() }).await;
    let subscribed: Vec<String> = bench
        .broker
        .packets()
        .into_iter()
        .filter_map(|packet| if let Packet::Subscribe(asked) = packet { Some(asked.filters) } else { None })
        .flatten()
        .map(|filter| filter.path)
        .collect();
    let own = ["daemon", "drive/+/availability", "line/+"].map(|own| format!("plant/north/{own}"));
    let documents =
        ["device/plant_north", "+/plant_north/+"].map(|own| format!("homeassistant/{own}/config"));
    let expected: Vec<String> =
        ["homeassistant/status".to_owned()].into_iter().chain(own).chain(documents).collect();
    assert_eq!(subscribed, expected);
    let document = bench.state("homeassistant/device/plant_north_pump_1/config");
    for control in ["setpoint", "start", "start_reverse", "stop", "reset"] {
        let keys: Vec<_> = document["components"][control].as_object().unwrap().keys().collect();
        assert_eq!(keys, ["platform"], "{control} is taken back");
    }
}

#[tokio::test(start_paused = true)]
async fn an_answer_goes_to_no_topic_of_the_daemon() {
    let bench = Bench::of(2).await;
    bench.ask("drive/pump_2/command", &start("a").to_string());
    a_while().await;
    assert!(bench.runs(1));
    for topic in ["plant/north/drive/pump_2/stop", "homeassistant/status", "a/#", ""] {
        let properties =
            PublishProperties { response_topic: Some(topic.to_owned()), ..PublishProperties::default() };
        let asked = publish("plant/north/drive/pump_1/set/frequency", "20", Qos::AtMostOnce);
        bench.broker.deliver(Publish { properties: Some(properties), ..asked });
        a_while().await;
        assert!(bench.broker.published().iter().all(|(to, _)| to != topic), "{topic}");
    }
    assert!(bench.runs(1));
}

#[tokio::test(start_paused = true)]
async fn a_flood_of_commands_and_garbage_fills_no_queue_and_a_stop_gets_through() {
    let bench = Bench::of(2).await;
    bench.ask("drive/pump_2/command", &start("a").to_string());
    a_while().await;
    let writes = |machine: usize| {
        bench.plant.machines[machine].requests(6) + bench.plant.machines[machine].requests(16)
    };
    let before = writes(0);
    for number in 0..20_000_u32 {
        let garbage = [
            "drive/pump_1/command",
            "drive/pump_1/set/frequency",
            "x",
            "drive/pump_1/set/run/eve",
            "all/command",
        ];
        bench.ask(garbage[number as usize % garbage.len()], "\u{0}{{{");
        bench.ask("drive/nobody/set/run", "forward");
    }
    bench.ask("drive/pump_2/stop", "");
    sleep(Duration::from_secs(30)).await;
    assert!(!bench.runs(1));
    assert_eq!(writes(0), before, "the drive has heard of nothing");
    let counts = bench.mqtt.face.broker.counts();
    assert!(counts.waiting <= NEWS && counts.connected, "{counts:?}");
    assert!(counts.arrived + counts.lost.flood >= 40_002, "{counts:?}");
}

#[tokio::test(start_paused = true)]
async fn commands_wait_for_no_broker_and_the_daemon_ends_with_offline() {
    let bench = Bench::of(1).await;
    bench.plant.plant.close();
    bench.command(&start("late"));
    a_while().await;
    assert_eq!((bench.runs(0), &bench.answers()[0]["reason"]), (false, &"closing".into()));
    let Bench { broker, mqtt, .. } = bench;
    mqtt.close().await;
    assert_eq!(broker.retained()["plant/north/status"].payload, "offline");
    assert!(matches!(broker.packets().last(), Some(Packet::Disconnect(_))));

    let bench = Bench::of(1).await;
    bench.broker.behave(Conduct::Deaf);
    let begun = Instant::now();
    bench.mqtt.close().await;
    assert!(begun.elapsed() <= CLOSED_WITHIN);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_leaves_is_taken_back() {
    let bench = Bench::of(2).await;
    a_while().await;
    let topics = |broker: &TestBroker| -> Vec<String> {
        broker.retained().into_keys().filter(|topic| topic.contains("pump_2")).collect()
    };
    assert_eq!(topics(&bench.broker).len(), 7, "{:?}", topics(&bench.broker));
    let _ = bench.plant.plant.fleet().remove(&["pump 2"], Duration::from_secs(30)).await;
    a_while().await;
    assert_eq!(topics(&bench.broker), Vec::<String>::new());
    // Who reads the documents is rid of it before the values are gone.
    let taken: Vec<(String, String)> = bench
        .broker
        .published()
        .into_iter()
        .filter(|(topic, payload)| topic.contains("pump_2") && (payload.is_empty() || payload == "offline"))
        .collect();
    let place = |topic: &str, payload: &str| {
        taken.iter().position(|(to, said)| to.ends_with(topic) && said == payload).expect("it is told")
    };
    let document = place("plant_north_pump_2/config", "");
    assert!(
        document < place("state", "") && place("availability", "offline") < place("availability", ""),
        "{taken:?}"
    );
}

#[tokio::test(start_paused = true)]
async fn a_drive_by_another_name_keeps_its_topics_and_its_device() {
    let there = |name: &str| Configured {
        drives: vec![Named { name: name.to_owned(), place: "a 1".to_owned(), slot: None }],
        ..Configured::default()
    };
    let names = Names::default();
    names.take_up(&there("old")).unwrap();
    names.take_up(&there("pump 1")).unwrap();
    let broker = TestBroker::default();
    // As it was told by its old name.
    broker.retain("plant/north/drive/old/availability", "online");
    broker.retain("homeassistant/device/plant_north_old/config", &document("plant/north"));
    let bench = Bench::called(broker, TestPlant::of(1).await, config(), names.clone()).await;
    a_while().await;
    assert_eq!(bench.state("plant/north/drive/old/state")["name"], "pump 1");
    let told = bench.state("homeassistant/device/plant_north_old/config");
    assert_eq!(told["device"]["name"], "pump 1");
    assert!(
        bench
            .broker
            .published()
            .iter()
            .all(|(topic, payload)| !topic.contains("pump_1") && payload != "offline")
    );
    bench.ask("drive/old/command", &start("a").to_string());
    a_while().await;
    assert!(bench.runs(0), "{:?}", bench.answers_on("plant/north/drive/old/outcome"));
    bench.ask("drive/old/stop", "");
    sleep(Duration::from_secs(20)).await;
    assert!(!bench.runs(0));
}

/// Who a topic was before `names.json` was lost nobody knows: it moves no motor, and stops one.
#[tokio::test(start_paused = true)]
async fn a_topic_that_was_lost_starts_nobody_and_stops_whom_it_names() {
    let folder = drived_config::testing::Folder::new("lost-topics");
    std::fs::write(folder.file("names.json"), "{").unwrap();
    let names = Names::in_folder(Some(&folder.file("")));
    let there = Configured {
        drives: vec![Named { name: "pump 1".to_owned(), place: "a 1".to_owned(), slot: None }],
        ..Configured::default()
    };
    assert!(names.take_up(&there).is_err());
    let bench = Bench::called(TestBroker::default(), TestPlant::of(1).await, config(), names).await;
    a_while().await;
    bench.ask("drive/pump_1/command", &start("a").to_string());
    a_while().await;
    let [.., answer] = &bench.answers()[..] else { panic!("it is answered") };
    assert_eq!(
        (&answer["outcome"], &answer["reason"]),
        (&"refused".into(), &"names_lost".into()),
        "{answer}"
    );
    assert!(answer["text"].as_str().unwrap().contains("names.json"), "{answer}");
    assert!(!bench.runs(0));
    let drive = bench.plant.plant.fleet().drive("pump 1").unwrap();
    assert!(drive.start(drive_core::Direction::Forward).await.is_confirmed());
    a_while().await;
    assert!(bench.runs(0));
    bench.ask("drive/pump_1/stop", "");
    sleep(Duration::from_secs(20)).await;
    assert!(!bench.runs(0));
}

/// A document of Home Assistant as a daemon under this base makes it.
fn document(base: &str) -> String {
    let availability = json!([{ "topic": format!("{base}/status") }]);
    json!({
        "origin": { "name": "drived" }, "device": {},
        "components": { "state": { "platform": "sensor", "availability": availability } },
    })
    .to_string()
}

#[tokio::test(start_paused = true)]
async fn what_left_while_the_daemon_was_away_is_taken_back_once_and_nothing_of_anybody_else() {
    let far = TestBroker::default();
    let gone = [
        ("plant/north/drive/pump_7/availability", "online".to_owned()),
        ("plant/north/drive/pump_7/state", "{}".to_owned()),
        ("plant/north/line/south", "{}".to_owned()),
        ("homeassistant/device/plant_north_pump_7/config", document("plant/north")),
        ("homeassistant/sensor/plant_north_pump_7/state/config", {
            json!({ "origin": { "name": "drived" }, "state_topic": "x", "availability": [{ "topic": "plant/north/status" }] })
                .to_string()
        }),
        // As it was told before it was told by devices.
        ("homeassistant/binary_sensor/plant_north/connected/config", {
            json!({ "origin": { "name": "drived" }, "state_topic": "plant/north/status" }).to_string()
        }),
    ];
    let others = [
        ("plant/drive/pump_7/availability", "online".to_owned()),
        ("plant/north/south/drive/pump_7/availability", "online".to_owned()),
        ("homeassistant/device/plant_north_pump_8/config", document("plant/north")),
        ("homeassistant/sensor/plant_north_pump_7/other/config", document("plant_north")),
        ("homeassistant/sensor/plant_north_pump_7/strange/config", "no JSON".to_owned()),
    ];
    for (topic, payload) in gone.iter().chain(&others) {
        far.retain(topic, payload);
    }
    let bench = Bench::on(far, TestPlant::of(1).await, config()).await;
    a_while().await;
    let published = bench.broker.published();
    assert!(published.contains(&("plant/north/drive/pump_7/availability".into(), "offline".into())));
    let retained = bench.broker.retained();
    for (topic, _) in &gone {
        assert!(!retained.contains_key(*topic), "{topic}");
        let taken = published.iter().filter(|(to, payload)| to == topic && payload.is_empty()).count();
        assert_eq!(taken, 1, "{topic}");
    }
    for (topic, payload) in &others {
        assert_eq!(retained[*topic].payload, payload.as_bytes(), "{topic}");
        assert!(published.iter().all(|(to, _)| to != topic), "{topic}");
    }
    assert_eq!(bench.drive("availability"), "online");
    // Nor at the next connect.
    let told = bench.broker.published().len();
    bench.broker.cut();
    a_while().await;
    assert!(bench.broker.published()[told..].iter().all(|(topic, _)| !topic.contains("pump_7")));
    assert!(bench.broker.published().len() > told);
}

#[tokio::test(start_paused = true)]
async fn a_line_that_left_while_the_daemon_was_away_is_no_component_any_more() {
    for discovery in [Discovery::Device, Discovery::Component] {
        let far = TestBroker::default();
        let status = json!([{ "topic": "plant/north/status" }]);
        let old = json!({
            "origin": { "name": "drived" }, "device": {},
            "components": {
                "line_south": { "platform": "binary_sensor", "availability": status },
                "line_north": { "platform": "binary_sensor", "availability": status },
            },
        });
        let single = json!({ "origin": { "name": "drived" }, "availability": status });
        let topic = match discovery {
            Discovery::Device => "homeassistant/device/plant_north/config",
            _ => "homeassistant/binary_sensor/plant_north/line_south/config",
        };
        far.retain(topic, &if discovery == Discovery::Device { old } else { single }.to_string());
        let bench = Bench::on(far, TestPlant::of(1).await, MqttConfig { discovery, ..config() }).await;
        sleep(Duration::from_secs(60)).await;
        match discovery {
            Discovery::Device => {
                let document = bench.state(topic);
                assert_eq!(document["components"]["line_south"], json!({ "platform": "binary_sensor" }));
                assert_eq!(document["components"]["line_north"]["name"], "Line north");
            }
            _ => assert!(!bench.broker.retained().contains_key(topic)),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn while_another_daemon_may_tell_under_the_same_base_nothing_is_taken_back() {
    // It began later.
    let daemon = |host: &str| json!({ "host": host, "instance": "z", "time_unix_ms": 1 }).to_string();
    let availability = "plant/north/drive/pump_7/availability";
    let own = host_name().unwrap_or_default();
    for host in [&*own, "elsewhere"] {
        let far = TestBroker::default();
        far.retain(availability, "online");
        far.retain("plant/north/daemon", &daemon(host));
        let bench = Bench::on(far, TestPlant::of(1).await, config()).await;
        a_while().await;
        assert!(bench.broker.retained().contains_key(availability), "{host}");
        // It lives, and is heard; what it tells is its own.
        for _ in 0..10 {
            bench.broker.deliver(publish("plant/north/daemon", &daemon(host), Qos::AtMostOnce));
            bench.broker.deliver(publish("plant/north/drive/pump_8/availability", "online", Qos::AtMostOnce));
            sleep(Duration::from_secs(30)).await;
        }
        assert!(bench.broker.retained().contains_key(availability), "{host}");
        assert!(bench.broker.published().iter().all(|(topic, _)| !topic.contains("pump_8")));
        assert!(
            !bench.broker.packets().iter().any(|packet| matches!(packet, Packet::Disconnect(_))),
            "it stays"
        );
        // Or it was this one before its restart: then it says nothing any more.
        sleep(Duration::from_secs(120)).await;
        assert!(!bench.broker.retained().contains_key(availability), "{host}");
    }
}

#[tokio::test(start_paused = true)]
async fn home_assistant_is_told_the_real_limits_and_only_what_the_drive_has() {
    let settings = |name: String| match name.as_str() {
        "pump 2" => DriveSettings::watched(name),
        _ => DriveSettings {
            limits: FrequencyLimits {
                low: Some(Frequency::from_hertz(10)),
                high: Some(Frequency::from_centihertz(4_750)),
                ..FrequencyLimits::default()
            },
            ..DriveSettings::controlled(name)
        },
    };
    let bench = Bench::with(TestPlant::with(2, settings).await, config()).await;
    a_while().await;
    let document = bench.state("homeassistant/device/plant_north_pump_1/config");
    let number = &document["components"]["setpoint"];
    assert_eq!((&number["min"], &number["max"]), (&10.0.into(), &47.5.into()));
    assert_eq!(number["command_topic"], "plant/north/drive/pump_1/set/frequency");
    assert!(number["value_template"].as_str().unwrap().contains("10 <= hertz <= 47.5"), "{number}");
    for control in ["setpoint", "start", "start_reverse", "reset"] {
        assert_eq!(document["components"][control]["message_expiry_interval"], 2, "{control}");
    }
    assert!(
        document["components"]["stop"].get("message_expiry_interval").is_none(),
        "a stop is never too late"
    );
    assert!(document["components"].get("torque_percent").is_some());
    assert!(document["components"].get("output_power_kw").is_none(), "an Altivar 312 has none");
    let topics: Vec<_> = document["components"]["state"]["availability"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["topic"].clone())
        .collect();
    assert_eq!(topics, ["plant/north/status", "plant/north/drive/pump_1/availability"]);
    assert_eq!(document["components"]["state"]["availability_mode"], "all");
    assert_eq!(document["components"]["current_a"]["expire_after"], 90);
    let watched = bench.state("homeassistant/device/plant_north_pump_2/config");
    assert_eq!(watched["components"]["stop"], json!({ "platform": "button" }));
    // Home Assistant begins anew.
    let told = bench.broker.published().len();
    bench.broker.deliver(publish("homeassistant/status", "online", Qos::AtMostOnce));
    a_while().await;
    let again: Vec<String> =
        bench.broker.published().split_off(told).into_iter().map(|(topic, _)| topic).collect();
    for topic in
        ["plant/north/status", "plant/north/drive/pump_1/availability", "plant/north/drive/pump_2/state"]
    {
        assert!(again.iter().any(|to| to == topic), "{topic}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_and_the_alarms_of_a_lost_drive_are_there_for_as_long_as_the_daemon_is() {
    let bench = Bench::with(TestPlant::of(1).await, config()).await;
    a_while().await;
    let document = bench.state("homeassistant/device/plant_north_pump_1/config");
    for id in ["stop", "alarm", "answers"] {
        let needs = &document["components"][id]["availability"];
        assert_eq!(needs, &json!([{ "topic": "plant/north/status" }]), "{id}");
    }
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(60)).await;
    assert_eq!(bench.drive("availability"), "offline");
    let alarms = bench.broker.published();
    let lost =
        |(topic, text): &&(String, String)| topic.ends_with("pump_1/event") && text.contains("\"lost\"");
    assert!(alarms.iter().any(|told| lost(&told)), "it is told while it is lost");
}

#[tokio::test(start_paused = true)]
async fn the_documents_fit_the_schema_of_what_home_assistant_checks() {
    const SCHEMA: &str = include_str!("home_assistant.schema.json");
    let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    let validator = |part: &str| {
        let mut schema = schema.clone();
        schema["$ref"] = format!("#/$defs/{part}").into();
        jsonschema::validator_for(&schema).expect("the schema is one")
    };
    for (discovery, part) in
        [(Discovery::Device, "device_document"), (Discovery::Component, "component_document")]
    {
        for (commands, needs_issued) in [(true, false), (true, true), (false, false)] {
            let config = MqttConfig { discovery, commands, needs_issued, ..config() };
            let bench = Bench::with(TestPlant::of(1).await, config).await;
            a_while().await;
            let mut documents = 0;
            for (topic, publish) in bench.broker.retained() {
                if !topic.starts_with("homeassistant/") {
                    continue;
                }
                documents += 1;
                let mut document: Value =
                    serde_json::from_slice(&publish.payload).expect("documents are JSON");
                if discovery == Discovery::Component {
                    document["platform"] = topic.split('/').nth(1).expect("a platform").into();
                }
                let errors: Vec<String> =
                    validator(part).iter_errors(&document).map(|error| error.to_string()).collect();
                assert!(errors.is_empty(), "{topic}: {errors:?}\n{document:#}");
            }
            assert!(documents >= 2, "{documents}");
        }
    }
    // The schema is one that refuses.
    let refused = |document: &Value| !validator("device_document").is_valid(document);
    let bench = Bench::of(1).await;
    let right = bench.state("homeassistant/device/plant_north_pump_1/config");
    assert!(!refused(&right));
    for (path, value) in [
        ("/~", json!("plant")),
        ("/device/colour", json!("red")),
        ("/components/state/unit_of_measurement", json!("Hz")),
        ("/components/output_frequency_hz/unit_of_measurement", json!("rpm")),
        ("/components/current_a/entity_category", json!("config")),
    ] {
        let mut wrong = right.clone();
        let (parent, key) = path.rsplit_once('/').unwrap();
        wrong.pointer_mut(parent).unwrap()[key] = value;
        assert!(refused(&wrong), "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn of_two_daemons_under_one_base_the_one_that_began_later_stands_aside_and_looks_again() {
    let bench = Bench::of(1).await;
    let connects = |broker: &TestBroker| {
        broker.packets().iter().filter(|packet| matches!(packet, Packet::Connect(..))).count()
    };
    let other = |time: u64| json!({ "host": "elsewhere", "instance": "0", "time_unix_ms": time }).to_string();
    // The broker has thrown this one out for the other, which has told since.
    bench.broker.retain("plant/north/daemon", &other(1));
    bench.broker.cut();
    bench.broker.until(|broker| connects(broker) == 2).await;
    bench.broker.until(|broker| matches!(broker.packets().last(), Some(Packet::Disconnect(_)))).await;
    sleep(Duration::from_secs(25)).await;
    assert_eq!(connects(&bench.broker), 2, "it leaves the other alone");
    // What it finds later is old: the other is there no more.
    sleep(Duration::from_secs(60)).await;
    assert_eq!(connects(&bench.broker), 3);
    sleep(Duration::from_secs(60)).await;
    assert_eq!(connects(&bench.broker), 3);
    assert_eq!(bench.drive("availability"), "online");
}

#[tokio::test(start_paused = true)]
async fn of_a_drive_that_moves_only_what_has_changed_is_told_and_its_fault_does_not_expire() {
    let bench = Bench::of(1).await;
    bench.command(&start("a"));
    a_while().await;
    let told = bench.broker.published().len();
    for second in 0..120_u32 {
        let hertz = if second % 10 < 5 { 20.0 } else { 40.0 };
        bench.ask("drive/pump_1/set/frequency", &format!("{hertz}"));
        sleep(Duration::from_secs(1)).await;
    }
    let published = bench.broker.published().split_off(told);
    let count = |what: &str| published.iter().filter(|(topic, _)| topic.ends_with(what)).count();
    let (state, measurements, fault) = (count("/state"), count("/measurements"), count("/fault"));
    assert!((60..=160).contains(&state), "{state}: it moves");
    // They are read each 10 s, and all is told each 30 s, also while it moves: what is not told for three of these expires.
    assert!((4..=18).contains(&measurements), "{measurements} of measurements, {state} of state");
    assert!((4..=5).contains(&fault), "{fault} of fault");
}

/// A day on a broker that is cut off each hour, and away for ten minutes of it: nothing grows.
#[tokio::test(start_paused = true)]
async fn a_day_leaves_nothing_behind() {
    live_on(24, false).await;
}

#[tokio::test(start_paused = true)]
async fn an_hour_with_commands_leaves_nothing_behind() {
    live_on(1, true).await;
}

async fn live_on(hours: u64, commands: bool) {
    let seldom = |name| DriveSettings {
        periods: drive_fleet::Periods {
            running: Duration::from_secs(20),
            rest: Duration::from_secs(30),
            slow: Duration::from_secs(300),
            max_age: Duration::from_secs(120),
        },
        ..DriveSettings::controlled(name)
    };
    let heartbeat = Duration::from_secs(300);
    let bench =
        Bench::with(TestPlant::with(2, seldom).await, MqttConfig { commands, heartbeat, ..config() }).await;
    bench.broker.forget();
    a_while().await;
    let topics = bench.broker.retained().len();
    let tasks = || tokio::runtime::Handle::current().metrics().num_alive_tasks();
    let before = tasks();
    for hour in 0..hours {
        bench.ask("drive/pump_1/set/run", if hour % 2 == 0 { "forward" } else { "reverse" });
        sleep(Duration::from_secs(49 * 60)).await;
        assert_eq!(bench.runs(0), commands);
        bench.ask("drive/pump_1/stop", "");
        sleep(Duration::from_secs(60)).await;
        bench.broker.behave(Conduct::Away);
        bench.broker.cut();
        sleep(Duration::from_secs(10 * 60)).await;
        bench.broker.behave(Conduct::Usual);
        sleep(Duration::from_secs(60)).await;
        let counts = bench.mqtt.face.broker.counts();
        assert!(counts.connected && counts.waiting < 10, "{counts:?}");
        // And what became of the last command.
        assert_eq!(bench.broker.retained().len(), topics + 1);
        assert!(tasks() <= before + 2, "{} tasks, {before} before", tasks());
    }
    assert_eq!(bench.mqtt.face.broker.counts().lost.by_reason().map(|(_, lost)| lost), [0; 4]);
    // Eight topics of drives and two others each five minutes, what the daemon says to itself, and some more.
    let most = hours * (12 * 10 + 3_600) * 2;
    assert!((hours * 10 * 8..most).contains(&bench.broker.counted()), "{}", bench.broker.counted());
}
