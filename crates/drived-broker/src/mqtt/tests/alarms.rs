//! The life of an alarm on the broker, after ISA-18.2 as `drive_fleet::alarms` has it.

use drive_fleet::{Order, alarms::AlarmState};

use super::*;

impl Bench {
    fn alarms_of(&self, whose: &str) -> Value {
        self.state(&format!("plant/north/{whose}alarms"))
    }

    /// Asks for something by whoever is named, and gives what is answered.
    async fn about_alarms(&self, commander: &str, body: &Value) -> Value {
        self.ask(&format!("alarms/command{commander}"), &body.to_string());
        sleep(Duration::from_secs(1)).await;
        self.answers_on("plant/north/alarms/outcome").pop().expect("it is answered")
    }

    async fn trip(&self) -> Value {
        self.plant.machines[0].trip(9);
        sleep(Duration::from_secs(5)).await;
        self.alarms_of("drive/pump_1/")
    }

    /// The alarms that came, as they came, on any topic.
    fn came(&self) -> Vec<(String, String)> {
        let published = self.broker.published().into_iter().filter(|(topic, _)| topic.ends_with("/alarm"));
        published
            .map(|(topic, told)| {
                let told: Value = serde_json::from_str(&told).expect("JSON");
                (topic.replace("plant/north/", ""), told["kind"].as_str().expect("a kind").to_owned())
            })
            .collect()
    }
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_told_from_its_coming_to_its_end_with_who_has_taken_note_of_it() {
    let bench = Bench::of(2).await;
    let none = bench.alarms_of("drive/pump_1/");
    assert_eq!((&none["problem"], &none["alarms"]), (&false.into(), &json!([])));
    let told = bench.trip().await;
    let alarm = &told["alarms"][0];
    assert_eq!((&alarm["kind"], &alarm["state"]), (&"tripped".into(), &"unacknowledged".into()));
    assert_eq!((&told["problem"], &told["active"], &alarm["count"]), (&true.into(), &1.into(), &1.into()));
    assert!(alarm["first_unix_ms"].is_u64() && alarm["remedy"].is_string(), "{alarm}");
    assert_eq!(told["waiting"], json!([{ "id": alarm["id"], "count": 1 }]));
    assert_eq!(bench.alarms_of("drive/pump_2/")["alarms"], json!([]));
    assert_eq!(bench.came(), [("drive/pump_1/alarm".to_owned(), "tripped".to_owned())]);
    let body =
        json!({ "id": "n-1", "action": "acknowledge", "alarms": told["waiting"], "note": "Anna looks" });
    let answer = bench.about_alarms("", &body).await;
    assert_eq!((&answer["id"], &answer["outcome"]), (&"n-1".into(), &"confirmed".into()), "{answer}");
    let told = bench.alarms_of("drive/pump_1/");
    let alarm = &told["alarms"][0];
    assert_eq!((&alarm["state"], &told["waiting"]), (&"acknowledged".into(), &json!([])));
    assert_eq!(
        (&alarm["acknowledged"]["by"], &alarm["acknowledged"]["note"]),
        (&"mqtt".into(), &"Anna looks".into())
    );
    assert_eq!(told["problem"], true, "it is still so");
    let pump = bench.plant.plant.fleet().drive("pump 1").unwrap();
    let _ = pump.order(Order::ResetFaults).await;
    sleep(Duration::from_secs(5)).await;
    let over = bench.alarms_of("drive/pump_1/");
    assert_eq!((&over["problem"], &over["alarms"]), (&false.into(), &json!([])));
    assert_eq!(bench.came().len(), 1, "what becomes of it is not told as its coming");
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_shelved_with_a_reason_and_comes_back_and_one_of_a_line_stands_for_its_drives() {
    let bench = Bench::of(3).await;
    let told = bench.trip().await;
    let body = json!({ "action": "shelve", "alarms": told["waiting"], "minutes": 60, "why": "being mended" });
    assert_eq!(bench.about_alarms("", &body).await["outcome"], "confirmed");
    let aside = bench.alarms_of("drive/pump_1/");
    assert_eq!((&aside["alarms"][0]["state"], &aside["problem"]), (&"shelved".into(), &false.into()));
    assert_eq!(aside["alarms"][0]["shelved"]["why"], "being mended");
    let body = json!({ "action": "unshelve", "alarms": [{ "id": aside["alarms"][0]["id"], "count": 1 }] });
    assert_eq!(bench.about_alarms("", &body).await["outcome"], "confirmed");
    assert_eq!(bench.alarms_of("drive/pump_1/")["problem"], true);
    for machine in &bench.plant.machines {
        machine.mute();
    }
    sleep(Duration::from_secs(60)).await;
    let lost = bench.alarms_of("drive/pump_2/");
    assert_eq!((&lost["alarms"][0]["state"], &lost["problem"]), (&"suppressed".into(), &true.into()));
    let line = bench.alarms_of("line/north/");
    assert_eq!(
        (&line["alarms"][0]["kind"], &line["alarms"][0]["members"]),
        (&"line_silent".into(), &3.into())
    );
    let came: Vec<_> = bench.came().into_iter().filter(|(_, kind)| kind != "tripped").collect();
    assert_eq!(came, [("line/north/alarm".to_owned(), "line_silent".to_owned())], "one, and not one a drive");
}

#[tokio::test(start_paused = true)]
async fn about_alarms_nothing_is_done_that_nobody_may_that_is_old_or_that_was_not_seen() {
    let commanders = [("panel", Role::Stop), ("hmi", Role::Operate)];
    let commanders = commanders.map(|(name, role)| (name.to_owned(), role)).into();
    let bench = Bench::with(TestPlant::of(1).await, MqttConfig { commanders, ..config() }).await;
    let told = bench.trip().await;
    let body = |alarms: &Value| json!({ "action": "acknowledge", "alarms": alarms });
    let seen = &told["waiting"];
    let number = &told["alarms"][0]["id"];
    let before = json!([{ "id": number, "count": 7 }]);
    for (commander, body, reason) in [
        ("/panel", body(seen), "no_right"),
        ("", body(seen), "no_right"),
        ("/hmi", body(&before), "came_again"),
        ("/hmi", body(&json!([{ "id": 4_711, "count": 1 }])), "not_found"),
        ("/hmi", body(&json!([{ "id": number }])), "malformed"),
        ("/hmi", json!({ "action": "acknowledge", "alarms": seen, "stop": true }), "ambiguous"),
        ("/hmi", json!({ "action": "silence", "alarms": seen }), "malformed"),
        ("/hmi", json!({ "action": "shelve", "alarms": seen, "minutes": 0, "why": "x" }), "malformed"),
        ("/hmi", json!({ "action": "acknowledge", "alarms": seen, "issued_unix_ms": 1_000 }), "expired"),
    ] {
        let answer = bench.about_alarms(commander, &body).await;
        assert_eq!(answer["reason"], reason, "{body}: {answer}");
    }
    let retained = publish("plant/north/alarms/command/hmi", &body(seen).to_string(), Qos::AtLeastOnce);
    bench.broker.deliver(Publish { retain: true, ..retained });
    a_while().await;
    assert_eq!(bench.answers_on("plant/north/alarms/outcome").pop().unwrap()["reason"], "retained");
    let state = |bench: &Bench| bench.plant.plant.alarms().alarms[0].state;
    assert_eq!(state(&bench), AlarmState::Unacknowledged);
    let answer = bench.about_alarms("/hmi", &body(seen)).await;
    assert_eq!((&answer["outcome"], &answer["caller"]), (&"confirmed".into(), &"hmi".into()), "{answer}");
    assert_eq!(state(&bench), AlarmState::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_document_is_the_same_whatever_is_known_of_its_drive() {
    let broker = TestBroker::default();
    let plant = TestPlant::of(1).await;
    let bench = Bench::on(broker, plant, config()).await;
    let topic = "homeassistant/device/plant_north_pump_1/config";
    let documents = |bench: &Bench| -> Vec<String> {
        let published = bench.broker.published().into_iter().filter(|(to, _)| to == topic);
        published.map(|(_, document)| document).collect()
    };
    assert!(!documents(&bench).is_empty());
    bench.trip().await;
    bench.plant.machines[0].mute();
    sleep(Duration::from_secs(60)).await;
    bench.plant.machines[0].unmute();
    bench.broker.deliver(publish("homeassistant/status", "online", Qos::AtMostOnce));
    sleep(Duration::from_secs(60)).await;
    let all = documents(&bench);
    assert!(all.len() > 1 && all.iter().all(|one| *one == all[0]), "{all:#?}");
}

#[tokio::test(start_paused = true)]
async fn a_document_is_there_before_its_drive_has_answered() {
    let line = TestPlant::with(1, DriveSettings::controlled).await;
    line.machines[0].mute();
    sleep(Duration::from_secs(60)).await;
    let bench = Bench::with(line, config()).await;
    let document = bench.state("homeassistant/device/plant_north_pump_1/config");
    assert!(document["components"]["torque_percent"].is_object(), "{document}");
    assert_eq!(bench.alarms_of("drive/pump_1/")["problem"], true, "it is lost");
}

#[tokio::test(start_paused = true)]
async fn what_became_of_the_last_command_is_kept_whoever_gave_it_and_also_that_it_was_refused() {
    let bench = Bench::of(1).await;
    assert!(!bench.broker.retained().contains_key("plant/north/drive/pump_1/last_command"));
    bench.command(&start("a-1"));
    a_while().await;
    let last = bench.drive("last_command");
    assert_eq!(
        (&last["action"], &last["outcome"], &last["caller"]),
        (&"start".into(), &"confirmed".into(), &"mqtt".into())
    );
    bench.ask("drive/pump_1/set/frequency", "fast");
    a_while().await;
    let last = bench.drive("last_command");
    assert_eq!((&last["outcome"], &last["reason"]), (&"refused".into(), &"malformed".into()));
    let caller = drived_doors::Caller::new("anna", "page", Role::Operate.rights());
    let stop = drived_plant::plant::commands::Request {
        id: None,
        target: drived_plant::plant::commands::Target::All,
        action: drived_plant::plant::commands::Action::Stop(drive_core::StopMode::Ramp.into()),
        expects: None,
        lifetime: LIFETIME,
        arrived: Instant::now(),
    };
    bench.plant.plant.begin(&caller, stop).expect("it is taken");
    sleep(Duration::from_secs(20)).await;
    let last = bench.drive("last_command");
    assert_eq!(
        (&last["action"], &last["outcome"], &last["caller"]),
        (&"stop".into(), &"confirmed".into(), &"anna".into())
    );
}

#[tokio::test(start_paused = true)]
async fn that_maintenance_was_done_is_said_of_maintenance_alone_and_to_a_history_that_counts_it() {
    let bench = Bench::of(1).await;
    bench.plant.plant.tell_maintenance("north", "pump 1", &[("bearings".to_owned(), "20 000 h".to_owned())]);
    sleep(Duration::from_secs(5)).await;
    let due = bench.alarms_of("drive/pump_1/");
    assert_eq!(due["alarms"][0]["kind"], "maintenance", "{due}");
    let done = |alarms: &Value| json!({ "action": "done", "alarms": alarms, "note": "greased" });
    let answer = bench.about_alarms("", &done(&due["waiting"])).await;
    assert_eq!(answer["alarms"][0]["reason"], "not_kept", "no history is kept here: {answer}");
    let told = bench.trip().await;
    let waiting = told["waiting"].as_array().unwrap();
    let trip: Vec<&Value> = waiting.iter().filter(|one| one["id"] != due["alarms"][0]["id"]).collect();
    let answer = bench.about_alarms("", &done(&json!(trip))).await;
    assert!(answer["alarms"][0]["text"].as_str().unwrap().contains("only maintenance"), "{answer}");
}
