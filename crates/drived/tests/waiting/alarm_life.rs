//! One alarm from its coming to its end, as everybody tells it who was not written here: a staged trip is told, taken note of by a SCADA host
//! with a note, and reset; the API, the page in Chromium on a screen and on a phone, a reader of MQTT, Home Assistant itself, a host of
//! Sparkplug, Prometheus with the rules of the program and the receiver of a webhook are asked at each step. `-- --nocapture` prints what
//! each said.

use std::{
    env,
    fmt::Debug,
    fs,
    io::{BufRead as _, BufReader, ErrorKind, Lines, Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::{Duration, Instant},
};

use crate::home::HomeAssistant;
use crate::page::Page;
use crate::prometheus::Prometheus;
use crate::rig::{Ear, Mosquitto};
use crate::support::{File, Running, Sim, free_port, get, is_there, look_again, path};
use serde_json::{Value, json};

/// How long something may take to come true: a guard against waiting for ever.
const PATIENCE: Duration = Duration::from_secs(120);
const NOTE: &str = "belt changed";
/// BBV51701, the codes of LFT: 9 is OCF, overcurrent.
const TRIP: &str = "OCF";

/// What an alarm is at one face: its state, and who has noted what.
fn told(alarm: &Value) -> String {
    let seen = &alarm["acknowledged"];
    let state = alarm["state"].as_str().unwrap_or("none");
    assert!(
        alarm.is_null() || alarm["text"].as_str().is_some_and(|text| text.contains("tripped")),
        "{alarm}"
    );
    match seen["by"].as_str() {
        Some(by) => format!("{state}, by {by}: {}", seen["note"].as_str().unwrap_or_default()),
        None => state.to_owned(),
    }
}

/// The trip among alarms, as a face lists them.
fn trip_of(alarms: &Value) -> Value {
    let mut alarms = alarms.as_array().into_iter().flatten();
    alarms.find(|alarm| alarm["kind"] == "tripped").cloned().unwrap_or_default()
}

/// What an alarm is that is shown on the page, in its plain words.
fn shown(alarms: &Value) -> String {
    let mut alarms = alarms.as_array().expect("a list").iter();
    let text = |alarm: &Value, key: &str| alarm[key].as_str().unwrap_or_default().to_owned();
    let Some(alarm) = alarms.find(|alarm| text(alarm, "title").contains("tripped")) else {
        return "none".to_owned();
    };
    assert!(alarm["isWhole"] == true, "it is cut off: {alarm}");
    let state = match text(alarm, "state").as_str() {
        "not acknowledged" => "unacknowledged".to_owned(),
        "over, not acknowledged" => "returned".to_owned(),
        other => other.to_owned(),
    };
    let all = text(alarm, "text");
    let who = all.lines().find_map(|line| line.split_once("acknowledged by ")).map(|(_, who)| who);
    match who.and_then(|who| Some((who.split_once(',')?.0, who.rsplit_once(": ")?.1))) {
        Some((who, note)) => format!("{state}, by {who}: {note}"),
        None => state,
    }
}

/// A host of Sparkplug: pysparkplug. Killed when dropped.
struct Host {
    child: Child,
    notes: ChildStdin,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Host {
    fn start(python: &str, broker: u16, drive: &str) -> Self {
        let mut child = Command::new(python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sparkplug_alarms.py"))
            .args([&broker.to_string(), drive])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the script starts");
        let notes = child.stdin.take().expect("it is piped");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        assert_eq!(lines.next().expect("it speaks").expect("it is text"), "ready");
        Self { child, notes, lines }
    }

    /// What it knows of the trip once that is as it should be.
    fn until(&mut self, is_so: impl Fn(&str) -> bool) -> String {
        loop {
            let line = self.lines.next().expect("it has ended").expect("it is text");
            let said: Value = serde_json::from_str(&line).expect("it is JSON");
            let told = told(&said["trip"]);
            if is_so(&told) {
                return told;
            }
        }
    }

    fn take_note(&mut self, note: &str) {
        writeln!(self.notes, "{note}").expect("it reads");
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The receiver of a webhook.
struct Receiver(TcpListener);

impl Receiver {
    fn start() -> (Self, u16) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("there is a port");
        listener.set_nonblocking(true).expect("it can be asked");
        let port = listener.local_addr().expect("it is bound").port();
        (Self(listener), port)
    }

    /// What is posted of the trip once that is as it should be; everything is taken.
    fn until(&self, is_so: impl Fn(&str) -> bool) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            match self.0.accept() {
                Ok((stream, _)) => {
                    let alarm = trip_of(&json!([taken(stream)["alarm"]]));
                    let told = told(&alarm);
                    if !alarm.is_null() && is_so(&told) {
                        return told;
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => look_again(),
                Err(error) => panic!("{error}"),
            }
            assert!(Instant::now() < end, "nothing such is posted");
        }
    }
}

/// The body of a POST that is taken.
fn taken(mut stream: TcpStream) -> Value {
    stream.set_nonblocking(false).expect("it waits");
    stream.set_read_timeout(Some(PATIENCE)).expect("it does not wait for ever");
    let mut request = Vec::new();
    loop {
        let mut bytes = [0; 4_096];
        let count = stream.read(&mut bytes).expect("it is posted whole");
        assert_ne!(count, 0, "it was cut");
        request.extend(&bytes[..count]);
        let text = String::from_utf8_lossy(&request);
        let Some((head, body)) = text.split_once("\r\n\r\n") else { continue };
        let head = head.to_ascii_lowercase();
        let length = head.lines().find_map(|line| line.strip_prefix("content-length: "));
        if length.is_some_and(|length| length.parse() == Ok(body.len())) {
            write!(stream, "HTTP/1.1 204 No Content\r\n\r\n").expect("it is read");
            return serde_json::from_str(body).expect("it is JSON");
        }
    }
}

/// What is said once it is as it should be.
#[track_caller]
fn until<T: Debug>(mut say: impl FnMut() -> T, is_so: impl Fn(&T) -> bool) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        let said = say();
        if is_so(&said) {
            return said;
        }
        assert!(Instant::now() < end, "it says {said:?}");
        look_again();
    }
}

/// Everybody who is told.
struct Faces {
    http: u16,
    ear: Ear,
    host: Host,
    home: Option<HomeAssistant>,
    page: Option<Page>,
    prometheus: Prometheus,
    receiver: Receiver,
}

impl Faces {
    /// Waits until everybody says this of the trip, and prints it.
    fn all_say(&mut self, step: &str, alarm: &str, is_firing: bool, posted: &str) {
        let api = || {
            let said: Value = serde_json::from_str(&get(self.http, "/api/v1/alarms", "*/*")).expect("JSON");
            told(&trip_of(&said["alarms"]))
        };
        let api = until(api, |said| said == alarm);
        let page = self.page.as_mut().map(|page| {
            until(
                || {
                    let said = page.shows("alarms");
                    (shown(&said["desk"]), shown(&said["phone"]))
                },
                |(desk, phone)| desk == alarm && phone == alarm,
            )
        });
        let home = self.home.as_mut().map(|home| {
            let state = |home: &mut HomeAssistant| {
                let now = home.entity("sensor.pump_alarms");
                let trip = trip_of(&now["attributes"]["alarms"]);
                assert!(
                    trip.is_null() || now["attributes"]["kind"] != "tripped" || now["state"] == trip["state"],
                    "{now}"
                );
                let problem = home.entity("binary_sensor.pump_problem")["state"].take();
                (told(&trip), problem.as_str() == Some("on"))
            };
            // There is a problem while it is so, whoever has seen it.
            until(|| state(home), |(trip, problem)| trip == alarm && *problem == is_firing)
        });
        let (_, said, retained) = self.ear.until(|_, said| told(&trip_of(&said["alarms"])) == alarm);
        let mqtt = format!("{}{}", told(&trip_of(&said["alarms"])), if retained { ", retained" } else { "" });
        let sparkplug = self.host.until(|told| told == alarm);
        let state = alarm.split(',').next().unwrap_or_default().to_owned();
        let firing = self.prometheus.wait(|prometheus| {
            let of_it = r#"drived_alarms{alarm="tripped",drive="pump",name="pump"}"#;
            let (states, alerts) = (prometheus.query(of_it)?, prometheus.firing()?);
            let is_there = match state.as_str() {
                "none" => !states.contains("\"state\""),
                state => states.contains(&format!("\"state\":\"{state}\"")),
            };
            let fires = alerts.contains("\"DrivedTripped\"");
            let word = if fires { ", DrivedTripped fires" } else { "" };
            (is_there && fires == is_firing).then(|| format!("{state}{word}"))
        });
        let webhook = self.receiver.until(|told| told == posted);
        let page = page.map_or("not there".to_owned(), |(desk, phone)| format!("{desk} | {phone}"));
        let home = home.map_or("not there".to_owned(), |(trip, problem)| {
            format!("{trip}{}", if problem { ", a problem" } else { "" })
        });
        println!("| {step} | {api} | {page} | {mqtt} | {home} | {sparkplug} | {firing} | {webhook} |");
    }
}

/// What is installed: a Python with pysparkplug, mosquitto and Prometheus.
fn peers() -> Option<(String, Mosquitto)> {
    let python = env::var("DRIVED_SPARKPLUG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let there = is_there(&python, &["-c", "import pysparkplug"]) && is_there("prometheus", &["--version"]);
    there.then(|| Some((python, Mosquitto::start("alarm-life")?))).flatten()
}

#[test]
fn a_trip_is_told_taken_note_of_and_over_the_same_at_every_face() {
    let Some((python, broker)) = peers() else { return };
    let folder = path("alarm-life-folder");
    fs::create_dir_all(&folder).expect("the directory can be written");
    let (mut sim, http) = (Sim::serve("alarm-life-line", &["atv312@1"]), free_port());
    let (receiver, posted_to) = Receiver::start();
    let file = File::new(
        "alarm-life",
        &format!(
            "state = \"{}\"\n[http]\nlisten = \"127.0.0.1:{http}\"\n[mqtt]\nservers = [\"mqtt://127.0.0.1:{}\"]\n\
             interval = \"250ms\"\nheartbeat = \"1s\"\ndiscovery = \"device\"\n[mqtt.sparkplug]\ngroup = \"plant\"\nedge_node = \"hall 1\"\ncommands = \"operate\"\n\
             [[webhooks]]\nurl = \"http://127.0.0.1:{posted_to}/\"\npause = \"0s\"\n\
             [lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump\"\ncontrol = true\n",
            folder.display(),
            broker.port,
            sim.link()
        ),
    );
    // It hears for as long as anything here takes.
    let ear = broker.hear_as(&["drived/drive/pump/alarms"], &["-W", "600"]);
    let host = Host::start(&python, broker.port, "pump");
    let home = HomeAssistant::python();
    let home = home.map(|python| HomeAssistant::start(&python, path("alarm-life-home"), &broker));
    let mut daemon = Running::start(&["run", "--config", file.path()]);
    daemon.wait_for(r#""event":"identified""#);
    let prometheus = Prometheus::start("alarm-life-prometheus", &[file.path()]);
    let page = Page::is_installed().then(|| Page::open(http));
    let mut faces = Faces { http, ear, host, home, page, prometheus, receiver };
    println!(
        "| Step | API | Page | Page on a phone | MQTT | Home Assistant | Sparkplug (pysparkplug) | Prometheus | Webhook |\n\
         |---|---|---|---|---|---|---|---|---|"
    );

    sim.say(&format!("atv312@1 trip {TRIP}"), "done");
    faces.all_say("it trips", "unacknowledged", true, "unacknowledged");
    faces.host.take_note(NOTE);
    let seen = format!("acknowledged, by sparkplug: {NOTE}");
    faces.all_say("a host takes note", &seen, true, &seen);
    sim.say("atv312@1 panel reset", "done");
    faces.all_say("it is reset", "none", false, &format!("over, by sparkplug: {NOTE}"));

    // One that returns before anybody has seen it waits for somebody.
    sim.say(&format!("atv312@1 trip {TRIP}"), "done");
    faces.all_say("it trips again", "unacknowledged", true, "unacknowledged");
    sim.say("atv312@1 panel reset", "done");
    faces.all_say("it is reset unseen", "returned", false, "returned");
    faces.page.take().into_iter().for_each(Page::close);
    drop(faces);
    assert_eq!(daemon.interrupt().0, Some(0));
    fs::remove_dir_all(folder).expect("it is there");
}
