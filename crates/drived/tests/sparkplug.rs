//! The built program as an edge node at a real mosquitto: every packet of a long session is recorded between the two, and
//! judged by the specification's numbered assertions; a host that was not written here reads along and asks. Where mosquitto
//! is not installed the tests print why they are skipped; where `CI` is set they fail, because `.ci/run` installs it.

#![cfg(unix)]

#[path = "support/mosquitto.rs"]
mod mosquitto;
#[path = "sparkplug/outage.rs"]
mod outage;
#[path = "../../drive-sparkplug/tests/support/protobuf.rs"]
mod protobuf;
#[path = "../../drive-sparkplug/tests/support/recording.rs"]
mod recording;
#[path = "../../drive-sparkplug/tests/support/rules.rs"]
#[expect(dead_code, reason = "some of it is for other tests")]
mod rules;
mod support;

use std::{
    env,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Command, Stdio},
    time::{SystemTime, UNIX_EPOCH},
};

use drive_sparkplug::{Metric, Payload, Raw};
use drive_testing::peers;
use mosquitto::{Mosquitto, Tap};
use recording::{Packet, Recording};
use support::{File, Running, Sim, path};

const NODE: &str = "spBv1.0/plant/NCMD/hall 1";

fn unix_ms() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("it is later than 1970");
    u64::try_from(now.as_millis()).expect("it is not that late")
}

/// A command that writes one metric, as it was sent some time ago.
fn written(metric: &str, value: Raw, age_ms: u64) -> Vec<u8> {
    let metric = Metric { name: Some(metric.to_owned()), value: Some(value), ..Metric::default() };
    Payload { timestamp: Some(unix_ms() - age_ms), seq: None, metrics: vec![metric] }.encode()
}

/// Two simulated pumps, a broker, and a daemon that is seen.
struct Plant {
    broker: Mosquitto,
    tap: Tap,
    sim: Sim,
    config: File,
    daemon: Option<Running>,
}

impl Plant {
    /// Running, where the broker is installed.
    fn start(name: &str, more: &str) -> Option<Self> {
        let mut plant = Self::prepare(name, more)?;
        plant.run();
        Some(plant)
    }

    /// The same without the daemon.
    fn prepare(name: &str, more: &str) -> Option<Self> {
        Self::prepare_of("atv312@1-2", "", name, more)
    }

    /// The same of other drives, with what else their table says.
    fn prepare_of(drives: &str, says: &str, name: &str, more: &str) -> Option<Self> {
        Self::prepare_at("off", drives, says, name, more)
    }

    /// The same with an API that listens there.
    fn prepare_at(http: &str, drives: &str, says: &str, name: &str, more: &str) -> Option<Self> {
        let broker = Mosquitto::start(name)?;
        let tap = Tap::start(broker.port, "-sparkplug");
        let sim = Sim::serve(&format!("{name}-line"), &[drives]);
        let state = path(&format!("{name}-bd-seq"));
        let _ = std::fs::remove_file(&state);
        let text = format!(
            "[http]\nlisten = \"{http}\"\n[mqtt]\nservers = [\"mqtt://127.0.0.1:{}\"]\ninterval = \"250ms\"\n\
             [mqtt.sparkplug]\ngroup = \"plant\"\nedge_node = \"hall 1\"\nstate = \"{}\"\n{more}\n\
             [lines.north]\nport = \"{},19200,8E1\"\n[[drives]]\nline = \"north\"\ndrive = \"{drives}\"\n\
             name = \"pump {{}}\"\ncontrol = true\n{says}\n",
            tap.port,
            state.display(),
            sim.link()
        );
        let config = File::new(name, &text);
        Some(Self { broker, tap, sim, config, daemon: None })
    }

    fn run(&mut self) {
        self.daemon = Some(Running::start(&["run", "--config", self.config.path()]));
    }

    /// Waits for a message behind this place among the packets, and says where it is.
    #[track_caller]
    fn wait_for(&self, verb: &str, device: &str, behind: usize) -> usize {
        let found = |packets: &[Packet]| {
            let is_it = |packet: &Packet| {
                matches!(packet, Packet::Sent(message)
                if message.topic.contains(&format!("/{verb}/")) && message.topic.ends_with(device))
            };
            packets.iter().skip(behind).position(is_it).map(|place| behind + place)
        };
        self.tap.wait_until(&format!("{verb} {device}"), |packets| found(packets).is_some());
        found(&self.tap.packets()).expect("it was seen")
    }

    /// Waits until a metric of a pump is as it should be, by its births and its data.
    #[track_caller]
    fn wait_for_metric(&self, pump: &str, name: &str, is_so: impl Fn(&protobuf::Metric) -> bool) {
        self.tap.wait_until(&format!("{pump} {name}"), |packets| {
            let recording = Recording::of(packets.to_vec());
            last(&recording, pump, name).is_some_and(|metric| is_so(&metric))
        });
    }

    /// Writes a metric of a pump.
    fn write(&self, pump: &str, metric: &str, value: Raw) {
        let topic = format!("spBv1.0/plant/DCMD/hall 1/{pump}");
        self.broker.publish(&topic, &written(metric, value, 0), &[]);
    }

    /// Asks a pump for something, and waits until its outcome is told.
    #[track_caller]
    fn ask(&self, pump: &str, id: &str, object: &str, outcome: &str) {
        self.write(pump, "Control/Command", Raw::String(object.to_owned()));
        self.wait_for_outcome(pump, id, outcome);
    }

    /// Publishes a command as it is, and waits until it is refused or expired by this reason.
    #[track_caller]
    fn publish_in_vain(&self, payload: &[u8], more: &[&str], outcome: &str, words: &str) {
        self.broker.publish("spBv1.0/plant/DCMD/hall 1/pump 1", payload, more);
        self.tap.wait_until(words, |packets| {
            let recording = Recording::of(packets.to_vec());
            let text =
                |name| last(&recording, "pump 1", name).and_then(|metric| metric.text()).unwrap_or_default();
            let is_it = text("Control/LastCommand/Outcome") == outcome;
            is_it && text("Control/LastCommand/Text").contains(words)
        });
    }

    #[track_caller]
    fn wait_for_outcome(&self, pump: &str, id: &str, outcome: &str) {
        self.tap.wait_until(&format!("{pump}: {id} {outcome}"), |packets| {
            let recording = Recording::of(packets.to_vec());
            let text = |name| last(&recording, pump, name).and_then(|metric| metric.text());
            let is_it = text("Control/LastCommand/Id").as_deref() == Some(id);
            is_it && text("Control/LastCommand/Outcome").as_deref() == Some(outcome)
        });
    }
}

/// A metric of a device as it was said last.
fn last(recording: &Recording, device: &str, name: &str) -> Option<protobuf::Metric> {
    let of_it = |said: &&recording::Said| said.device.as_deref() == Some(device);
    let birth = recording.verb("DBIRTH").filter(of_it).last()?;
    let born = birth.metric(name)?;
    let data = recording.verb("DDATA").filter(of_it).filter(|said| said.place > birth.place);
    let metrics = data.flat_map(|said| &said.payload.metrics);
    let later = metrics.filter(|metric| metric.alias == born.alias).last();
    Some(later.unwrap_or(born).clone())
}

#[test]
fn every_rule_holds_on_the_packets_of_a_long_session() {
    let Some(mut plant) = Plant::start("sparkplug", "commands = \"operate\"") else { return };
    plant.wait_for("NBIRTH", "hall 1", 0);
    plant.wait_for("DBIRTH", "pump 1", 0);
    plant.wait_for("DBIRTH", "pump 2", 0);

    // A level, motion, and what becomes of each.
    plant.write("pump 1", "Control/Setpoint", Raw::Double(30.0));
    plant.wait_for_metric("pump 1", "Control/Setpoint", |metric| metric.double() == Some(30.0));
    plant.ask("pump 1", "s-1", r#"{"id": "s-1", "action": "start"}"#, "confirmed");
    plant.wait_for_metric("pump 1", "Status/Output Frequency", |metric| metric.double() == Some(30.0));
    plant.ask("pump 1", "s-2", r#"{"id": "s-2", "action": "jump"}"#, "refused");
    plant.ask("pump 1", "s-1", r#"{"id": "s-1", "action": "start", "direction": "reverse"}"#, "refused");
    plant.ask("pump 1", "s-1", r#"{"id": "s-1", "action": "start"}"#, "confirmed");

    // A trip, a loss, a return.
    plant.sim.say("atv312@2 trip OCF", "done");
    plant.wait_for_metric("pump 2", "Fault/Mnemonic", |metric| metric.text().as_deref() == Some("OCF"));
    let behind = plant.tap.packets().len();
    plant.sim.say("atv312@2 power off", "done");
    let dead = plant.wait_for("DDEATH", "pump 2", behind);
    plant.sim.say("atv312@2 power on", "done");
    plant.wait_for("DBIRTH", "pump 2", dead);

    // Births that are asked for.
    let behind = plant.tap.packets().len();
    plant.broker.publish(NODE, &written("Node Control/Rebirth", Raw::Boolean(true), 0), &[]);
    let born = plant.wait_for("NBIRTH", "hall 1", behind);
    plant.wait_for("DBIRTH", "pump 1", born);
    plant.wait_for("DBIRTH", "pump 2", born);
    plant.wait_for("NDATA", "hall 1", born);

    plant.ask("pump 1", "stop", r#"{"id": "stop", "action": "stop"}"#, "confirmed");
    let (code, _) = plant.daemon.take().expect("it runs").interrupt();
    assert_eq!(code, Some(0));
    plant.tap.wait_until("goodbye", |packets| {
        packets.iter().any(|packet| matches!(packet, Packet::Disconnect { .. }))
    });

    // The next run goes on with the next number, and is killed.
    let behind = plant.tap.packets().len();
    plant.run();
    plant.wait_for("DBIRTH", "pump 1", behind);
    drop(plant.daemon.take());

    let recording = Recording::of(plant.tap.packets());
    let (broken, untried) = rules::judge_all(&recording);
    assert!(broken.is_empty(), "{broken:#?}");
    assert!(untried.is_empty(), "{untried:#?}");
}

/// A WJ200, of whose file nothing shows the output, nor whose setpoint it goes by while it stands.
#[test]
fn a_drive_from_a_file_is_born_with_what_it_tells_and_takes_commands_as_the_others_do() {
    let says = "options = { highest = \"50Hz\" }";
    let Some(mut plant) = Plant::prepare_of("wj200@1-2", says, "sparkplug-profile", "commands = \"operate\"")
    else {
        return;
    };
    plant.run();
    plant.wait_for("DBIRTH", "pump 1", 0);
    let start = r#"{"id": "p-1", "action": "start", "setpoint": {"frequency_hz": 20}}"#;
    plant.ask("pump 1", "p-1", start, "confirmed");
    plant.wait_for_metric("pump 1", "Status/State", |metric| metric.text().as_deref() == Some("running"));
    plant.ask("pump 1", "p-2", r#"{"id": "p-2", "action": "stop"}"#, "confirmed");
    let recording = Recording::of(plant.tap.packets());
    let told = |name: &str| last(&recording, "pump 1", name).filter(|metric| !metric.is_null);
    assert!(told("Status/Output Frequency").is_some(), "it reads its output");
    assert!(told("Status/Warning").is_none(), "what it does not tell is no value");
    let unseen = last(&recording, "pump 1", "Properties/Not Known").and_then(|metric| metric.text());
    let unseen = unseen.unwrap_or_default();
    assert!(unseen.contains("whether the drive tells who commands it is not known; "), "{unseen:?}");
    let (code, _) = plant.daemon.take().expect("it runs").interrupt();
    assert_eq!(code, Some(0));
}

#[test]
fn what_is_late_retained_or_of_an_unknown_age_moves_no_motor_and_is_said_so() {
    let Some(plant) = Plant::start("sparkplug-late", "commands = \"operate\"") else { return };
    plant.wait_for("DBIRTH", "pump 1", 0);
    let start = |id: &str, more: &str| Raw::String(format!(r#"{{"id": "{id}", "action": "start"{more}}}"#));
    let command = "Control/Command";
    let ready = |metric: &protobuf::Metric| metric.is_null;
    plant.wait_for_metric("pump 1", "Control/Start Refused", ready);

    plant.publish_in_vain(
        &written(command, start("a", ""), 1_500),
        &[],
        "expired",
        "was to be carried out within 1000 ms",
    );
    let patient = start("b", r#", "expires_in_ms": 10000"#);
    plant.publish_in_vain(
        &written(command, patient, 11_000),
        &[],
        "expired",
        "was to be carried out within 10000 ms",
    );
    let for_ever = start("c", r#", "expires_in_ms": 60000"#);
    plant.publish_in_vain(&written(command, for_ever, 0), &[], "refused", "expected 1 to 10000");
    plant.publish_in_vain(
        &written("Control/Setpoint", Raw::Double(30.0), 2_000),
        &[],
        "expired",
        "within 1000 ms",
    );
    plant.publish_in_vain(&written(command, start("d", ""), 0), &["-r"], "refused", "retained");
    let metric = Metric { name: Some(command.to_owned()), value: Some(start("e", "")), ..Metric::default() };
    let ageless = Payload { metrics: vec![metric.clone()], ..Payload::default() };
    plant.publish_in_vain(&ageless.encode(), &[], "refused", "has no timestamp");
    let ahead = Payload { timestamp: Some(unix_ms() + 60_000), metrics: vec![metric], ..Payload::default() };
    plant.publish_in_vain(&ahead.encode(), &[], "refused", "in the future");
    let nameless = written(command, Raw::String(r#"{"action": "start"}"#.to_owned()), 0);
    plant.publish_in_vain(&nameless, &[], "refused", "expected an id");
    plant.publish_in_vain(
        &written(command, Raw::String("[\"start\"]".to_owned()), 0),
        &[],
        "refused",
        "expected an object",
    );
    plant.publish_in_vain(&written("Control/Setpoint", Raw::Double(-5.0), 0), &[], "refused", "-5");
    plant.publish_in_vain(
        &written("Status/State", Raw::String("running".to_owned()), 0),
        &[],
        "refused",
        "cannot be written",
    );
    plant.publish_in_vain(&written("Nothing", Raw::Double(1.0), 0), &[], "refused", "no birth has told");

    // Nothing of all that has reached the drive; a stop of any age does.
    let stop = written(
        command,
        Raw::String(r#"{"id": "z", "action": "stop", "nonsense": 1}"#.to_owned()),
        3_600_000,
    );
    plant.broker.publish("spBv1.0/plant/DCMD/hall 1/pump 1", &stop, &[]);
    plant.wait_for_outcome("pump 1", "z", "confirmed");
    let recording = Recording::of(plant.tap.packets());
    let said = recording.said.iter().filter(|said| said.device.as_deref() == Some("pump 1"));
    let texts: Vec<_> =
        said.flat_map(|said| &said.payload.metrics).filter_map(protobuf::Metric::text).collect();
    assert!(!texts.iter().any(|text| text == "running"), "{texts:?}");
}

#[test]
fn without_commands_none_are_heard_and_who_may_only_stop_starts_nothing() {
    let Some(plant) = Plant::start("sparkplug-stop", "commands = \"stop\"") else { return };
    plant.wait_for("DBIRTH", "pump 1", 0);
    plant.ask("pump 1", "a", r#"{"id": "a", "action": "start"}"#, "refused");
    plant.ask("pump 1", "b", r#"{"id": "b", "action": "stop"}"#, "confirmed");
    let Some(plant) = Plant::start("sparkplug-off", "") else { return };
    plant.wait_for("DBIRTH", "pump 1", 0);
    let filters: Vec<_> = plant
        .tap
        .packets()
        .into_iter()
        .filter_map(|packet| match packet {
            Packet::Subscribe { filter, .. } => Some(filter),
            _ => None,
        })
        .collect();
    assert_eq!(filters, [NODE]);
}

#[test]
fn a_daemon_that_is_killed_is_dead_by_its_will_to_whoever_listens() {
    let Some(mut plant) = Plant::start("sparkplug-killed", "") else { return };
    plant.wait_for("DBIRTH", "pump 2", 0);
    let mut listener = Command::new("mosquitto_sub")
        .args(["-h", "127.0.0.1", "-p", &plant.broker.port.to_string()])
        .args(["-q", "1", "-t", "spBv1.0/#", "-F", "%t %q %r %x"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("mosquitto_sub is installed beside mosquitto");
    let mut lines = BufReader::new(listener.stdout.take().expect("it is piped")).lines();
    // It listens when it hears what is asked for.
    plant.broker.publish(NODE, &written("Node Control/Rebirth", Raw::Boolean(true), 0), &[]);
    plant.broker.publish("spBv1.0/plant/NCMD/another", b"x", &["-r"]);
    let mut next = |verb: &str| {
        let is_it = |line: &std::io::Result<String>| line.as_ref().is_ok_and(|line| line.contains(verb));
        lines.find(is_it).expect("it is heard").expect("it is text")
    };
    next("/NCMD/another");
    plant.daemon.take().expect("it runs").signal("-KILL");
    let line = next("/NDEATH/");
    let _ = listener.kill();
    let _ = listener.wait();
    let (_, rest) = line.split_once("hall 1 ").expect("the topic ends with the edge node");
    let (flags, hex) = rest.split_at(4);
    assert_eq!(flags, "1 0 ", "quality of service and retain flag of the will");
    let bytes: Vec<u8> = (0..hex.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("it is hex"))
        .collect();
    let death = protobuf::read(&bytes).expect("it is a payload");
    let recording = Recording::of(plant.tap.packets());
    let birth = recording.verb("NBIRTH").last().expect("it was born");
    assert_eq!(death.metrics[0].number(), birth.metric("bdSeq").and_then(protobuf::Metric::number));
    assert_eq!((death.metrics.len(), death.seq), (1, None));
}

#[test]
fn a_host_that_was_not_written_here_reads_every_payload_asks_for_births_and_commands() {
    let Some(python) = python() else { return };
    let Some(mut plant) = Plant::prepare("sparkplug-host", "commands = \"operate\"") else { return };
    let mut host = Command::new(python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sparkplug.py"))
        .arg(plant.broker.port.to_string())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the script starts");
    let mut lines = BufReader::new(host.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
    assert_eq!(lines.next().as_deref(), Some("ready"));
    plant.run();
    assert_eq!(lines.next().as_deref(), Some("done"));
    assert!(host.wait().expect("it is a child").success());
}

/// A Python with pysparkplug, or `None` with the reason printed. `DRIVED_SPARKPLUG_PYTHON` names the interpreter.
fn python() -> Option<std::ffi::OsString> {
    let python = env::var_os("DRIVED_SPARKPLUG_PYTHON").unwrap_or_else(|| "python3".into());
    let found = peers::runs(&python, &["-c", "import pysparkplug"]);
    peers::is_there(found, "the Python module pysparkplug").then_some(python)
}
