//! The daemon on a real broker, mosquitto, asked and read by clients that were not written here: mosquitto's own, and
//! Eclipse Paho. Where they are not installed the tests print why they are skipped; where `CI` is set they fail instead.

#![cfg(unix)]

#[path = "mqtt/rig.rs"]
mod rig;
mod support;

use std::{
    cell::{Cell, RefCell},
    collections::BTreeSet,
    fs,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    process::Command,
};

use rig::{Daemon, Ear, Mosquitto, ready, start};
use serde_json::{Value, json};
use support::{free_port, path, python_with, run};

const COMMAND: &str = "drived/drive/pump_1/command";
const STOP: &str = "drived/drive/pump_1/stop";

#[test]
fn state_is_retained_and_each_command_is_answered_with_its_outcome() {
    let Some(broker) = Mosquitto::start("mqtt-outcomes") else { return };
    let mut ear = broker.hear(&["drived/#", "reply/#"]);
    let mut daemon = Daemon::on("mqtt-outcomes", &broker);
    ready(&mut ear, 1);
    // Who comes late is told at once.
    let mut late = broker.hear(&["drived/status", "drived/drive/pump_1/availability"]);
    for topic in ["drived/status", "drived/drive/pump_1/availability"] {
        let (_, said, retained) = late.until(|to, _| to == topic);
        assert_eq!((said, retained), ("online".into(), true), "{topic}");
    }

    let reply =
        ["-q", "1", "-D", "publish", "response-topic", "reply/me", "-D", "publish", "correlation-data", "x"];
    broker.publish(COMMAND, &start("a"), &reply);
    for outcome in ["accepted", "confirmed"] {
        let (_, said, _) = ear.until(|to, _| to == "reply/me");
        assert_eq!((&said["id"], &said["outcome"]), (&"a".into(), &outcome.into()), "{said}");
    }
    assert!(daemon.turns());
    // Refused: by a rule of motion, and because nobody can read it.
    let forbidden = json!({ "id": "b", "action": "setpoint", "setpoint": { "frequency_hz": 21.0 } });
    broker.publish(COMMAND, &forbidden.to_string(), &[]);
    assert_eq!(ear.outcome("b")["reason"], "forbidden_band");
    broker.publish(COMMAND, "garbage", &[]);
    assert_eq!(
        ear.until(|to, said| to.ends_with("/outcome") && said["outcome"] == "refused").1["reason"],
        "malformed"
    );
    // Superseded: the newest of three wins.
    for (id, hertz) in [("c", 35.0), ("d", 36.0), ("e", 37.0)] {
        let body =
            json!({ "id": id, "action": "setpoint", "setpoint": { "frequency_hz": hertz } }).to_string();
        broker.publish(COMMAND, &body, &[]);
    }
    assert_eq!(ear.outcome("e")["outcome"], "confirmed");
    // Unknown: nobody can say whether a motor stands behind a cable that is cut, and it is settled when it is joined.
    daemon.sim.say("atv312@1 cable cut", "done");
    broker.publish(STOP, r#"{"id": "f"}"#, &["-q", "1"]);
    assert_eq!(ear.outcome("f")["outcome"], "unknown");
    // Expired: its second is over before anybody could send it.
    let body = json!({ "id": "g", "action": "reset" }).to_string();
    broker.publish(COMMAND, &body, &["-D", "publish", "message-expiry-interval", "1"]);
    let told = ear.outcome("g");
    assert!(["expired", "refused"].contains(&told["outcome"].as_str().expect("a word")), "{told}");
    // It was told once, perhaps before that.
    let mut late = broker.hear(&["drived/drive/pump_1/availability"]);
    late.until(|_, said| said == "offline");
    daemon.sim.say("atv312@1 cable join", "done");
    assert_eq!(ear.outcome("f")["outcome"], "confirmed");
    let running = daemon.running.take().expect("it runs");
    let (code, _) = running.interrupt();
    assert_eq!(code, Some(0));
    ear.until(|to, said| to == "drived/status" && said == "offline");
}

#[test]
fn a_retained_command_is_refused_and_moves_nothing_at_the_next_start_either() {
    let Some(broker) = Mosquitto::start("mqtt-retained") else { return };
    let mut ear = broker.hear(&["drived/#"]);
    let mut daemon = Daemon::on("mqtt-retained", &broker);
    ready(&mut ear, 1);
    broker.publish(COMMAND, &start("kept"), &["-q", "1", "-r"]);
    let told = ear.outcome("kept");
    assert_eq!((&told["outcome"], &told["reason"]), (&"refused".into(), &"retained".into()));
    daemon.kill();
    // The last will.
    ear.until(|to, said| to == "drived/status" && said == "offline");
    daemon.start_again();
    ready(&mut ear, 1);
    // What comes after the daemon has subscribed is answered; the retained one is not even sent.
    broker.publish("drived/drive/pump_1/set/frequency", "25", &[]);
    let told = ear.until(|to, said| to == "drived/drive/pump_1/outcome" && said["outcome"] == "confirmed").1;
    assert_eq!(told["action"], "setpoint");
    assert!(!daemon.turns());
}

#[test]
fn a_broker_that_dies_in_the_middle_of_a_command_changes_nothing_but_when_its_outcome_is_heard() {
    let Some(mut broker) = Mosquitto::start("mqtt-killed") else { return };
    let mut ear = broker.hear(&["drived/#"]);
    let mut daemon = Daemon::on("mqtt-killed", &broker);
    ready(&mut ear, 1);
    broker.publish(COMMAND, &start("a"), &["-q", "1"]);
    assert_eq!(ear.outcome("a")["outcome"], "confirmed");
    ear.until(|to, said| to.ends_with("pump_1/state") && said["reached"] == true);
    broker.publish(STOP, r#"{"id": "s"}"#, &["-q", "1"]);
    ear.until(|_, said| said["id"] == "s" && said["outcome"] == "accepted");
    broker.kill();
    broker.start_again();
    let mut ear = broker.hear(&["drived/#"]);
    assert_eq!(ear.outcome("s")["outcome"], "confirmed");
    ear.until(|to, said| to == "drived/drive/pump_1/state" && said["status"]["state"] == "ready");
    assert!(!daemon.turns());
    // Replayed after the reconnect: answered, not repeated.
    for more in [&["-q", "1"][..], &["-q", "2"]] {
        broker.publish(COMMAND, &start("a"), more);
        assert_eq!(ear.outcome("a")["outcome"], "confirmed");
    }
    assert!(!daemon.turns());
}

#[test]
fn nothing_waits_at_the_broker_for_a_daemon_that_is_away() {
    let Some(mut broker) =
        Mosquitto::with("mqtt-away", "allow_anonymous true\npersistence false\nqueue_qos0_messages true")
    else {
        return;
    };
    let mut ear = broker.hear(&["drived/#"]);
    let mut daemon = Daemon::on("mqtt-away", &broker);
    ready(&mut ear, 1);
    daemon.kill();
    ear.until(|to, said| to == "drived/status" && said == "offline");
    broker.publish(COMMAND, &start("late"), &["-q", "1"]);
    daemon.start_again();
    ready(&mut ear, 1);
    broker.publish(COMMAND, r#"{"id": "now", "action": "reset"}"#, &[]);
    let told = ear.until(|to, said| to.ends_with("/outcome") && said.get("id").is_some()).1;
    assert_eq!(told["id"], "now", "the first that it hears of");
    assert!(!daemon.turns());
    // Nor does a daemon wait for its broker.
    broker.kill();
    let (code, _) = daemon.running.take().expect("it runs").interrupt();
    assert_eq!(code, Some(0));
}

/// What a recorder of the broker has is out of reach of who has the daemon's folder.
#[test]
fn the_broker_is_told_how_the_audit_log_ends_and_by_that_a_log_is_known_that_was_put_back() {
    let Some(broker) = Mosquitto::start("mqtt-audit") else { return };
    let folder = path("mqtt-audit-state");
    let mut ear = broker.hear(&["drived/#"]);
    let mut daemon = Daemon::start_with(
        "mqtt-audit",
        &format!("state = {:?}\n", folder.to_str().expect("the path is text")),
        &format!("servers = [\"mqtt://127.0.0.1:{}\"]\nheartbeat = \"1s\"", broker.port),
    );
    let head = |ear: &mut Ear, unlike: &str| {
        let is_new = |to: &str, said: &Value| to == "drived/audit" && said["head"] != unlike;
        ear.until(is_new).1["head"].as_str().expect("a text").to_owned()
    };
    let first = head(&mut ear, "");
    ready(&mut ear, 1);
    // Kept as the thief will put it back, with its key and with what says how it ends.
    let copy = path("mqtt-audit-copy");
    let copied = |from: &Path, to: &Path| {
        let mut copying = Command::new("cp");
        assert!(copying.arg("-rT").args([from, to]).status().expect("cp runs").success());
    };
    copied(&folder, &copy);
    broker.publish(STOP, r#"{"id": "s"}"#, &["-q", "1"]);
    assert_eq!(ear.outcome("s")["outcome"], "confirmed");
    // The command, what was answered, and what became of it at the drive: until all is told.
    let log = || fs::read_to_string(folder.join("audit")).expect("it is kept there");
    let mut newest = head(&mut ear, &first);
    while !log().lines().last().is_some_and(|line| newest.starts_with(&number(line))) {
        newest = head(&mut ear, &newest);
    }
    daemon.kill();
    let file = folder.join("audit").display().to_string();
    let verify = |since: &str| run(&["audit", "verify", &file, "--since", since]);
    for told in [&first, &newest] {
        assert!(verify(told).assert_done().contains("unbroken"), "{told}");
    }
    // Whoever comes late reads the newest.
    let (_, said, retained) = broker.hear(&["drived/audit"]).until(|to, _| to == "drived/audit");
    assert_eq!((&said["head"], retained), (&newest.as_str().into(), true));
    // Put back whole, it is unbroken by itself, and not by what the broker was told.
    copied(&copy, &folder);
    assert!(run(&["audit", "verify", &file]).assert_done().contains("unbroken"));
    assert!(verify(&first).assert_done().contains("unbroken"));
    verify(&newest).assert_refused(1, "it was rewritten or put back as it was earlier");
    for folder in [folder, copy] {
        fs::remove_dir_all(folder).expect("it is ours");
    }
}

/// The number of a record, as a head begins with it.
fn number(line: &str) -> String {
    let record: Value = serde_json::from_str(line).expect("a record");
    format!("{}-", record["number"])
}

#[test]
fn a_broker_is_verified_and_its_access_list_as_the_manual_has_it_keeps_commanders_apart() {
    let tls = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tls");
    let folder = path("mqtt-tls-files");
    fs::create_dir_all(&folder).expect("it can be made");
    let place = |name: &str| folder.join(name).display().to_string();
    for name in ["certificate.pem", "key.pem"] {
        fs::copy(tls.join(name), folder.join(name)).expect("it can be copied");
    }
    let manual = include_str!("../docs/mqtt.md");
    let list =
        manual.split_once("```text\n# the daemon").expect("the list").1.split_once("```").expect("its end").0;
    fs::write(place("acl"), format!("# the daemon{list}")).expect("it can be written");
    fs::write(place("password"), "drived-secret\n").expect("it can be written");
    fs::set_permissions(place("password"), fs::Permissions::from_mode(0o600)).expect("it is ours");
    let mut users = Command::new("sh");
    let (port, file) = (free_port(), place("users"));
    let add = format!(
        "touch {file}; for user in drived hmi panel homeassistant; do mosquitto_passwd -b {file} $user $user-secret; done"
    );
    let added = users.args(["-c", &add]).status().is_ok_and(|status| status.success());
    if !drive_testing::peers::is_there(added, "mosquitto_passwd") {
        return;
    }
    let Some(broker) = Mosquitto::with(
        "mqtt-tls",
        &format!(
            "allow_anonymous false\npassword_file {file}\nacl_file {}\nlistener {port} 127.0.0.1\ncertfile {}\nkeyfile {}",
            place("acl"),
            place("certificate.pem"),
            place("key.pem")
        ),
    ) else {
        return;
    };
    let section = |authorities: &str| {
        format!(
            "servers = [\"mqtts://localhost:{port}\"]\n{authorities}user = \"drived\"\npassword = \"{}\"\nheartbeat = \"1s\"\n\
             discovery = \"device\"\n[mqtt.commanders]\nhmi = \"operate\"\npanel = \"stop\"\nhomeassistant = \"operate\"",
            place("password")
        )
    };
    // A broker that nobody vouches for is none.
    let mut strange = Daemon::start("mqtt-tls-strange", &section(""));
    strange.log_until("it is tried again");
    drop(strange);

    let mut daemon =
        Daemon::start("mqtt-tls", &section(&format!("authorities = \"{}\"\n", place("certificate.pem"))));
    daemon.log_until("MQTT: connected to localhost");
    let as_hmi = ["-u", "hmi", "-P", "hmi-secret"];
    let as_panel = ["-u", "panel", "-P", "panel-secret"];
    let mut ear = broker.hear_as(&["drived/#"], &as_hmi);
    ready(&mut ear, 1);
    // The panel cannot speak for another, and by its own name it may only stop.
    broker.publish("drived/drive/pump_1/command/hmi", &start("forged"), &as_panel);
    broker.publish("drived/drive/pump_1/command/panel", &start("own"), &as_panel);
    let told = ear.until(|to, _| to.ends_with("/outcome")).1;
    assert_eq!((&told["id"], &told["reason"]), (&"own".into(), &"no_right".into()), "{told}");
    broker.publish("drived/drive/pump_1/command/hmi", &start("right"), &as_hmi);
    assert_eq!(ear.outcome("right")["outcome"], "confirmed");
    assert!(daemon.turns());
    broker.publish("drived/all/stop/panel", "", &as_panel);
    let told = ear.until(|to, said| to == "drived/all/outcome" && said["outcome"] == "confirmed").1;
    assert_eq!(told["caller"], "panel");
    assert!(!daemon.turns());

    // Home Assistant finds the drive, says that it has begun, and commands by what it has found.
    let as_home = ["-u", "homeassistant", "-P", "homeassistant-secret"];
    let mut home = broker.hear_as(&["homeassistant/#", "drived/status", "drived/drive/+/outcome"], &as_home);
    let document = home.until(|to, _| to == "homeassistant/device/drived_pump_1/config").1;
    broker.publish("homeassistant/status", "online", &as_home);
    let (_, _, retained) = home.until(|to, said| to == "homeassistant/status" && said == "online");
    assert!(!retained);
    home.until(|to, said| to == "drived/status" && said == "online");
    for (component, action) in [("setpoint", "setpoint"), ("start", "start"), ("stop", "stop")] {
        let of = |key: &str| document["components"][component][key].as_str().map(str::to_owned);
        let payload = of("payload_press").unwrap_or_else(|| "30".to_owned());
        broker.publish(&of("command_topic").expect("a topic"), &payload, &as_home);
        let told = home.until(|to, said| to.ends_with("/outcome") && said["outcome"] == "confirmed").1;
        assert_eq!((&told["caller"], &told["action"]), (&"homeassistant".into(), &action.into()), "{told}");
    }
    assert!(!daemon.turns());
    let _ = fs::remove_dir_all(folder);
}

#[test]
fn a_paho_client_asks_and_is_answered_and_a_validator_that_is_not_ours_takes_the_documents() {
    let (Some(python), Some(_)) = (python_with("paho.mqtt.client"), python_with("ha_mqtt_models_pydantic"))
    else {
        return;
    };
    let Some(broker) = Mosquitto::start("mqtt-paho") else { return };
    let mut ear = broker.hear(&["drived/#"]);
    let section = format!(
        "servers = [\"mqtt://127.0.0.1:{}\"]\nheartbeat = \"1s\"\ndiscovery = \"device\"",
        broker.port
    );
    let mut daemon = Daemon::start("mqtt-paho", &section);
    for number in [1, 2] {
        ready(&mut ear, number);
    }
    ear.until(|to, said| to == "drived/drive/pump_2/measurements" && said["quality"] == "good");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mqtt/client.py");
    let output = Command::new(python).arg(script).arg(broker.port.to_string()).output().expect("python runs");
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(!daemon.turns());
}

/// What a drive leaves at the broker goes when the daemon next starts without it, whoever has killed it.
#[test]
fn a_drive_that_left_while_the_daemon_was_down_is_taken_back_at_its_next_start_and_nothing_of_others() {
    let Some(broker) = Mosquitto::start("mqtt-gone") else { return };
    let mut ear = broker.hear(&["drived/#", "homeassistant/#"]);
    let section = format!(
        "servers = [\"mqtt://127.0.0.1:{}\"]\nheartbeat = \"1s\"\ndiscovery = \"device\"",
        broker.port
    );
    let mut daemon = Daemon::start("mqtt-gone", &section);
    let is_told = |topic: &str, said: &Value| {
        topic == "homeassistant/device/drived_pump_2/config" && said["components"].get("stop").is_some()
    };
    ear.until(is_told);
    ready(&mut ear, 2);
    daemon.kill();
    ear.until(|topic, said| topic == "drived/status" && said == "offline");
    // Others have documents of names like it.
    let others =
        ["homeassistant/device/drived_pump_22/config", "homeassistant/sensor/drived_pump_2/power/config"];
    let document = json!({
        "origin": { "name": "drived" }, "availability": [{ "topic": "drived/north/status" }], "state_topic": "x",
    });
    for topic in others {
        broker.publish(topic, &document.to_string(), &["-r"]);
    }
    let text = fs::read_to_string(daemon.file.path()).expect("it is ours");
    fs::write(daemon.file.path(), text.replace("atv312@1-2", "atv312@1")).expect("it is ours");
    daemon.start_again();
    let own = "drived/drive/pump_2/";
    ear.until(|topic, said| topic == format!("{own}availability") && said == "offline");
    ear.until(|topic, said| topic == "homeassistant/device/drived_pump_2/config" && said == "");
    ear.until(|topic, said| topic == format!("{own}availability") && said == "");
    // What is left is what others have, and the drive that is there.
    let mut late = broker.hear(&["drived/#", "homeassistant/#"]);
    let (left, beats) = (RefCell::new(BTreeSet::new()), Cell::new(0));
    late.until(|topic, _| {
        if topic.contains("pump_2") {
            left.borrow_mut().insert(topic.to_owned());
        }
        beats.set(beats.get() + u8::from(topic == "drived/daemon"));
        beats.get() == 3
    });
    assert_eq!(left.into_inner().into_iter().collect::<Vec<_>>(), others);
}

#[test]
fn a_drive_that_was_renamed_while_the_daemon_was_down_keeps_its_topics_and_any_script_has_some() {
    let Some(broker) = Mosquitto::start("mqtt-names") else { return };
    let mut ear = broker.hear(&["drived/#", "homeassistant/#"]);
    let folder = path("mqtt-names-state");
    let section = format!(
        "servers = [\"mqtt://127.0.0.1:{}\"]\nheartbeat = \"1s\"\ndiscovery = \"device\"",
        broker.port
    );
    let head = format!("state = {:?}\n", folder.to_str().expect("the path is text"));
    let mut daemon = Daemon::start_with("mqtt-names", &head, &section);
    let document = "homeassistant/device/drived_pump_2/config";
    ear.until(|topic, said| topic == document && said["device"]["name"] == "pump 2");
    daemon.kill();
    let text = fs::read_to_string(daemon.file.path()).expect("it is ours");
    fs::write(daemon.file.path(), text.replace("pump {}", "насос {}")).expect("it is ours");
    daemon.start_again();
    let taken = Cell::new(false);
    ear.until(|topic, said| {
        taken.set(taken.get() || topic.contains("pump_2") && said == "");
        topic == document && said["device"]["name"] == "насос 2"
    });
    ear.until(|topic, said| topic == "drived/drive/pump_2/state" && said["name"] == "насос 2");
    assert!(!taken.get(), "nothing of it is taken back");
    // Where nothing is kept, two of one topic are told from each other all the same.
    daemon.kill();
    fs::remove_dir_all(&folder).expect("it is ours");
    let (before, _) = text.split_once("[[drives]]").expect("there are drives");
    let drive = |number: u8, name: &str| {
        format!("[[drives]]\nline = \"bench\"\ndrive = \"atv312@{number}\"\nname = \"{name}\"\n")
    };
    let both = format!("{before}{}{}", drive(1, "насос"), drive(2, "котёл"));
    fs::write(daemon.file.path(), both).expect("it is ours");
    daemon.start_again();
    for (name, topic) in [("насос", "_____-ac43"), ("котёл", "_____-3e36")] {
        let mut ear = broker.hear(&["drived/#"]);
        ear.until(|to, said| to == format!("drived/drive/{topic}/state") && said["name"] == name);
        broker.publish(&format!("drived/drive/{topic}/stop"), r#"{"id": "s"}"#, &["-q", "1"]);
        assert_eq!(ear.outcome("s")["outcome"], "confirmed");
    }
    let _ = fs::remove_dir_all(folder);
}

#[test]
fn two_daemons_of_one_name_are_named_and_do_not_throw_each_other_out_again_and_again() {
    let Some(broker) = Mosquitto::start("mqtt-two") else { return };
    let mut first = Daemon::on("mqtt-two-first", &broker);
    first.log_until("MQTT: connected");
    let mut second = Daemon::on("mqtt-two-second", &broker);
    second.log_until("this one stands aside");
    // The first tells on, and nobody throws it out: the beats after the second has gone.
    first.log_until("this one stays");
    let mut ear = broker.hear(&["drived/#"]);
    let (told, gone) = (Cell::new(0), Cell::new(0));
    ear.until(|topic, said| {
        gone.set(gone.get() + u8::from(topic == "drived/status" && said == "offline"));
        told.set(told.get() + u8::from(topic == "drived/daemon"));
        told.get() == 12
    });
    assert!(gone.get() <= 2, "{} times", gone.get());
}
