//! The end of the program beside a drive that is silent: whoever has a motor beside it stops it by his own door, until the last drive is
//! done. Over a pty, in real time; nothing here asserts a duration. Where mosquitto is not installed it is said why this is skipped.
#![cfg(unix)]

#[path = "mqtt/rig.rs"]
mod rig;
mod support;

use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpStream,
    path::PathBuf,
    process::Command,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use drive_sparkplug::{Metric, Payload, Raw};
use rig::Mosquitto;
use serde_json::{Value, json};
use support::{File, Running, Sim, ask, free_port, path, run};

/// Pump 1 is stopped at the exit and falls silent, pumps 2 to 6 are left as they are, each stopped by another door, and pump 7 stands.
struct Plant {
    broker: Mosquitto,
    sim: Sim,
    http: u16,
    gateway: u16,
    socket: String,
    /// By which the page comes that operates.
    token: String,
    state: PathBuf,
    daemon: Running,
    _file: File,
}

impl Plant {
    /// Its motors turn, pump 1 does not answer any more, and the end has begun.
    fn ending(name: &str) -> Option<Self> {
        let broker = Mosquitto::start(name)?;
        let mut sim = Sim::serve(&format!("{name}-line"), &["atv312@1-7"]);
        // Its own watchdog ends nothing meanwhile, however long a busy machine takes for all of this.
        sim.say("atv312@1 set SLL 0", "done");
        let (http, gateway) = (free_port(), free_port());
        let state = path(&format!("{name}-state"));
        let bd_seq = path(&format!("{name}-bd-seq"));
        let text = format!(
            "snapshots = \"500ms\"\nstate = \"{}\"\n[http]\nlisten = \"127.0.0.1:{http}\"\n\
             [mqtt]\nservers = [\"mqtt://127.0.0.1:{}\"]\ncommands = true\nheartbeat = \"1s\"\n\
             [mqtt.sparkplug]\ngroup = \"plant\"\nedge_node = \"hall\"\nstate = \"{}\"\ncommands = \"operate\"\n\
             [[gateways]]\nlisten = \"127.0.0.1:{gateway}\"\nline = \"bench\"\nwrites = \"operate\"\npatience = \"20s\"\n\
             [defaults]\ncontrol = true\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump 1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@2-7\"\nname = \"pump {{}}\"\non_exit = \"leave\"\n",
            state.display(),
            broker.port,
            bd_seq.display(),
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock")).to_str().expect("the path is text").to_owned();
        let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", &socket]);
        for _ in 1..=7 {
            daemon.wait_for(r#""event":"identified""#);
        }
        let added = run(&[
            "token",
            "add",
            "panel",
            "--role",
            "operate",
            "--config",
            file.path(),
            "--socket",
            &socket,
        ]);
        let token = added.assert_done().trim().to_owned();
        let mut plant = Self { broker, sim, http, gateway, socket, token, state, daemon, _file: file };
        for pump in 1..=6 {
            plant.by_socket(&["start", &format!("pump {pump}"), "--setpoint", "20Hz"]).assert_done();
        }
        plant.sim.say("atv312@1 cable cut", "done");
        plant.daemon.wait_for(r#""event":"lost""#);
        plant.daemon.signal("-TERM");
        plant.daemon.wait_for_log("the exit waits for pump 1");
        (2..=6).for_each(|pump| assert!(plant.turns(pump), "pump {pump} is left as it is"));
        Some(plant)
    }

    /// Whether a motor turns, as somebody sees who stands beside it.
    fn turns(&mut self, pump: u8) -> bool {
        !self.sim.say(&format!("atv312@{pump} show"), "shaft").contains("shaft 0.00 Hz")
    }

    /// A stop of a pump has been asked: it stands before the program has gone.
    #[track_caller]
    fn comes_to_a_stand(&mut self, pump: u8) {
        while self.turns(pump) {
            assert!(!self.daemon.has_ended(), "the program has gone, and pump {pump} turns");
        }
        assert!(!self.daemon.has_ended(), "pump 1 is waited for");
    }

    fn by_socket(&self, subcommand: &[&str]) -> support::Ended {
        run(&[subcommand, &["--socket", &self.socket]].concat())
    }

    /// By HTTP, as the page asks: the problem or the command that is answered.
    fn by_http(&self, path: &str, body: &Value) -> Value {
        let body = body.to_string();
        let answer = ask(
            self.http,
            &format!(
                "POST /api/v1/{path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
                 Sec-Fetch-Site: same-origin\r\nAuthorization: Bearer {}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
                self.token,
                body.len()
            ),
        );
        let (_, body) = answer.split_once("\r\n\r\n").unwrap_or_else(|| panic!("it is answered: {answer:?}"));
        serde_json::from_str(body).unwrap_or_else(|error| panic!("{error}: {answer}"))
    }

    /// What `GET` is answered, with its head.
    fn get(&self, path: &str) -> String {
        ask(self.http, &format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"))
    }

    /// By Sparkplug, as its host does.
    fn by_sparkplug(&self, pump: u8, command: &Value) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("it is later than 1970");
        let timestamp = u64::try_from(now.as_millis()).expect("it is not that late");
        let value = Some(Raw::String(command.to_string()));
        let metric = Metric { name: Some("Control/Command".to_owned()), value, ..Metric::default() };
        let payload = Payload { timestamp: Some(timestamp), seq: None, metrics: vec![metric] }.encode();
        let file = path("end-command");
        fs::write(&file, payload).expect("the directory can be written");
        let (port, topic) = (self.broker.port.to_string(), format!("spBv1.0/plant/DCMD/hall/pump {pump}"));
        let published = Command::new("mosquitto_pub")
            .args(["-V", "5", "-p", &port, "-t", &topic, "-f", file.to_str().expect("the path is text")])
            .status();
        assert!(published.expect("mosquitto_pub runs").success());
        fs::remove_file(file).expect("it can be removed");
    }

    /// Writes a register of a pump by the gateway, over a connection of its own: what is answered behind the unit.
    fn by_gateway(&self, pump: u8, register: u16, word: u16) -> Vec<u8> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.gateway)).expect("the gateway listens");
        // So that a test that fails ends.
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out can be set");
        let [register, word] = [register, word].map(u16::to_be_bytes);
        let request = [&[0x15, 1, 0, 0, 0, 6, pump, 6][..], &register, &word].concat();
        stream.write_all(&request).expect("it is taken");
        let mut head = [0; 7];
        stream.read_exact(&mut head).expect("it is answered");
        let mut pdu = vec![0; usize::from(head[5]) - 1];
        stream.read_exact(&mut pdu).expect("it is answered");
        pdu
    }
}

#[test]
fn until_the_last_drive_is_done_a_motor_is_stopped_by_every_door_and_none_is_started() {
    let Some(mut plant) = Plant::ending("end") else { return };
    let mut ear = plant.broker.hear(&["drived/drive/+/result", "drived/drive/+/last_command", "drived/#"]);

    let refused = plant.by_http("drives/pump%207/start", &json!({"setpoint": {"frequency_hz": 20.0}}));
    assert_eq!(
        (&refused["outcome"], &refused["reason"]),
        (&"refused".into(), &"closing".into()),
        "{refused}"
    );
    let stopped = plant.by_http("drives/pump%202/stop?wait=20s", &json!({}));
    assert_eq!(stopped["outcome"], "confirmed", "{stopped}");
    plant.comes_to_a_stand(2);
    let ready = plant.get("/readyz");
    assert!(ready.starts_with("HTTP/1.1 503") && ready.contains("about to end"), "{ready}");
    let lives = plant.get("/healthz");
    assert!(lives.starts_with("HTTP/1.1 200"), "{lives}");

    let started = plant.by_socket(&["start", "pump 7", "--setpoint", "20Hz"]);
    started.assert_refused(1, "the daemon is about to end");
    plant.by_socket(&["reload"]).assert_refused(2, "the daemon is about to end");
    plant.by_socket(&["stop", "pump 3"]).assert_done();
    plant.comes_to_a_stand(3);

    plant.broker.publish("drived/drive/pump_7/command", &rig::start("late"), &[]);
    let refused = ear.outcome("late");
    assert_eq!(
        (&refused["outcome"], &refused["reason"]),
        (&"refused".into(), &"closing".into()),
        "{refused}"
    );
    plant.broker.publish("drived/drive/pump_4/stop", "", &[]);
    plant.comes_to_a_stand(4);

    let start = json!({"id": "late too", "action": "start", "setpoint": {"frequency_hz": 20.0}});
    plant.by_sparkplug(7, &start);
    plant.by_sparkplug(5, &json!({"id": "s", "action": "stop"}));
    plant.comes_to_a_stand(5);

    // CMD: BBV51701 p. 19.
    assert_eq!(plant.by_gateway(7, 8_501, 6), [0x86, 4], "no step towards a run is written");
    assert_eq!(plant.by_gateway(7, 8_501, 15), [0x86, 4]);
    assert_eq!(plant.by_gateway(6, 8_501, 7), [6, 0x21, 0x35, 0, 7]);
    plant.comes_to_a_stand(6);

    assert!(!plant.turns(7), "nothing was started");
    plant.sim.say("atv312@1 cable join", "done");
    let Plant { daemon, mut sim, state, .. } = plant;
    let _ = fs::remove_dir_all(state);
    let (code, rest) = daemon.end();
    assert_eq!(code, Some(0), "{rest}");
    assert!(sim.say("atv312@1 show", "shaft").contains("shaft 0.00 Hz"), "{rest}");
}
