//! Every face beside what the drives themselves say: five families on one line, read through the gateway word by word and by the manuals, and
//! as the API, the page in Chromium, `drived status`, MQTT, Home Assistant itself, a host of Sparkplug, Prometheus' text and the virtual unit
//! tell them, with their ages; while drives are called otherwise, trip, are lost, leave and come back. `-- --nocapture` prints what each said.

use std::{
    collections::BTreeMap,
    env, fs,
    io::{BufRead as _, BufReader, Lines, Read as _, Write as _},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use crate::home::HomeAssistant;
use crate::page::Page;
use crate::rig::Mosquitto;
use crate::support::{Running, Sim, free_port, get, is_there, look_again, path, run};
use serde_json::Value;

/// How long something may take to come true: a guard against waiting for ever.
const PATIENCE: Duration = Duration::from_secs(120);
/// A status is no older than this, by the configuration's default, and this much may lie between two looks.
const OLDEST_S: f64 = 3.0 + 2.0;

/// A drive, and where its manual has its output frequency and its current.
struct Family {
    drive: &'static str,
    unit: u8,
    /// Register, and Hz of a count.
    frequency: (u16, f64),
    /// Register, and A of a count; `None`: it tells a share of its rated current.
    current: Option<(u16, f64)>,
}

/// ATV312: BBV51701 p. 21, 3202 rFr 0.1 Hz, 3204 LCr 0.1 A. ATV28: p. 57 there, W451 rFr 0.1 Hz, W453 LCr 0.1 A; the ATV58, whose
/// manual has neither, is read as that one unless its configuration says otherwise.
/// ATV21: §8.3, FD00 0.01 Hz, FE03 in 0.01 %. 3G3EV: §5.2, 0024h in the unit of n39, which is 0.1 Hz at 0, 0027h 0.1 A.
const FAMILIES: [Family; 5] = [
    Family { drive: "atv312@1", unit: 1, frequency: (3_202, 0.1), current: Some((3_204, 0.1)) },
    Family { drive: "atv28@2", unit: 2, frequency: (451, 0.1), current: Some((453, 0.1)) },
    Family { drive: "atv58@3", unit: 3, frequency: (451, 0.1), current: Some((453, 0.1)) },
    Family { drive: "atv21@4", unit: 4, frequency: (0xFD00, 0.01), current: None },
    Family { drive: "3g3ev@5", unit: 5, frequency: (0x0024, 0.1), current: Some((0x0027, 0.1)) },
];

/// A slow value, and where each has it.
struct Slow {
    /// Of which family.
    place: usize,
    /// Register, and how much a count is in the unit of the API.
    register: (u16, f64),
    api: &'static str,
    /// And how much of the API's unit its own is.
    prometheus: (&'static str, f64),
    sparkplug: &'static str,
    /// In whole units.
    page: &'static str,
    /// Home Assistant has no class for a share of a voltage.
    home: Option<&'static str>,
}

/// ATV312: BBV51701 p. 21, 3207 ULn 0.1 V; ATV28: p. 57 there, W454 ULn 0.1 V; ATV21: §8.3, FE04 in 0.01 %; 3G3EV: §5.2, 0031h in V.
const SLOW: [Slow; 4] = [
    LINE_VOLTAGE,
    Slow { place: 1, register: (454, 0.1), ..LINE_VOLTAGE },
    Slow {
        place: 3,
        register: (0xFE04, 0.01),
        api: "dc_bus_voltage_percent",
        prometheus: ("bus_voltage_ratio", 100.0),
        sparkplug: "DC Bus Voltage Share",
        page: "DC bus voltage",
        home: None,
    },
    Slow {
        place: 4,
        register: (0x0031, 1.0),
        api: "dc_bus_voltage_v",
        prometheus: ("bus_voltage_volts", 1.0),
        sparkplug: "DC Bus Voltage",
        page: "DC bus voltage",
        home: Some("dc_bus_voltage"),
    },
];

const LINE_VOLTAGE: Slow = Slow {
    place: 0,
    register: (3_207, 0.1),
    api: "line_voltage_v",
    prometheus: ("line_voltage_volts", 1.0),
    sparkplug: "Line Voltage",
    page: "Line voltage",
    home: Some("mains_voltage"),
};

/// What somebody says of a drive. Frequency and current in hundredths, so that they are the same or not.
#[derive(Debug, Clone, PartialEq)]
struct Said {
    frequency: Option<i64>,
    current: Option<i64>,
    state: Option<String>,
    /// When it was so, in seconds since 1970.
    at: Option<f64>,
}

impl Said {
    /// He says that nothing is known of it.
    const NOTHING: Self = Self { frequency: None, current: None, state: None, at: None };
}

fn hundredths(value: f64) -> i64 {
    (value * 100.0).round() as i64
}

/// What a person reads, such as `1.2 A`, where it is in this unit.
fn read(text: &str, unit: &str) -> Option<f64> {
    let (value, of) = text.trim().split_once(char::is_whitespace)?;
    (of.trim() == unit).then(|| value.parse().ok()).flatten()
}

/// A time of a few seconds, as a person reads it.
fn seconds(text: &str) -> Option<f64> {
    read(text, "s").or_else(|| Some(read(text, "ms")? / 1_000.0))
}

/// The short name of a family, of which its drive has its id, its topic and its entities.
fn short(family: &Family) -> &'static str {
    family.drive.split('@').next().unwrap_or_default()
}

fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("it is later than 1970").as_secs_f64()
}

/// A host of Sparkplug: pysparkplug. Killed when dropped.
struct Host {
    child: Child,
    asks: ChildStdin,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Host {
    fn start(python: &str, broker: u16) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sparkplug_values.py");
        let mut child = Command::new(python)
            .arg(script)
            .arg(broker.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the script starts");
        let asks = child.stdin.take().expect("it is piped");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        assert_eq!(lines.next().expect("it speaks").expect("it is text"), "ready");
        Self { child, asks, lines }
    }

    fn ask(&mut self) -> Value {
        writeln!(self.asks).expect("it reads");
        let line = self.lines.next().expect("it has not ended").expect("it is text");
        serde_json::from_str(&line).expect("it is JSON")
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The plant, and everybody who reads it.
struct Plant {
    sim: Sim,
    daemon: Running,
    broker: Mosquitto,
    host: Host,
    home: Option<HomeAssistant>,
    page: Option<Page>,
    http: u16,
    gateway: u16,
    folder: PathBuf,
    /// The names of the drives now, in the order of the families; an empty one is not in the file.
    names: [String; 5],
    /// The table has begun.
    has_head: bool,
}

impl Plant {
    fn start() -> Option<Self> {
        let python = env::var("DRIVED_SPARKPLUG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
        if !is_there(&python, &["-c", "import pysparkplug"]) {
            return None;
        }
        let broker = Mosquitto::start("values")?;
        let drives = FAMILIES.map(|family| family.drive);
        let sim = Sim::serve_with("values-line", &drives, &["--baud", "19200", "--format", "8N1"]);
        let folder = path("values-folder");
        fs::create_dir_all(&folder).expect("the directory can be written");
        let host = Host::start(&python, broker.port);
        let home = HomeAssistant::python();
        let home = home.map(|python| HomeAssistant::start(&python, path("values-home"), &broker));
        let names = FAMILIES.map(|family| format!("the {}", short(&family)));
        let (http, gateway) = (free_port(), free_port());
        configure(&folder, (sim.link(), broker.port, http, gateway), &names);
        let at = |name: &str| folder.join(name).display().to_string();
        let mut daemon = Running::start(&["run", "--config", &at("drives.toml"), "--socket", &at("socket")]);
        for _ in drives {
            daemon.wait_for(r#""event":"connected""#);
        }
        let page = Page::is_installed().then(|| Page::open(http));
        Some(Self { sim, daemon, broker, host, home, page, http, gateway, folder, names, has_head: false })
    }

    fn at(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// It is asked again where it was not ready, or too late on a busy machine, as a person does.
    fn start_motor(&self, name: &str, hertz: &str) {
        let end = Instant::now() + PATIENCE;
        loop {
            let started = run(&["start", name, "--setpoint", hertz, "--socket", &self.at("socket")]);
            if started.code == Some(0) {
                return;
            }
            assert!(Instant::now() < end, "{started:?}");
        }
    }

    /// Another configuration holds.
    fn reload(&self) {
        configure(&self.folder, (self.sim.link(), self.broker.port, self.http, self.gateway), &self.names);
        run(&["reload", "--socket", &self.at("socket")]).assert_done();
    }

    /// Registers of a unit, by somebody who speaks Modbus TCP; `None`: it does not answer. A gateway of which a reload has changed the units
    /// is opened anew: for a moment nobody listens.
    fn words(&self, unit: u8, address: u16, count: u16) -> Option<Vec<u16>> {
        let end = Instant::now() + PATIENCE;
        let connect = || TcpStream::connect(("127.0.0.1", self.gateway));
        let mut stream = loop {
            match connect() {
                Ok(stream) => break stream,
                Err(error) => assert!(Instant::now() < end, "{error}"),
            }
            look_again();
        };
        stream.set_read_timeout(Some(PATIENCE)).expect("it does not wait for ever");
        let [high, low] = address.to_be_bytes();
        stream.write_all(&[0, 1, 0, 0, 0, 6, unit, 3, high, low, 0, count as u8]).expect("it reads");
        let mut head = [0; 9];
        stream.read_exact(&mut head).expect("each request is answered");
        (head[7] == 3).then(|| {
            let mut words = vec![0; usize::from(head[8])];
            stream.read_exact(&mut words).expect("it is whole");
            words.chunks(2).map(|word| u16::from_be_bytes([word[0], word[1]])).collect()
        })
    }

    /// What a drive itself says, by its manual.
    fn itself(&self, family: &Family) -> (Option<i64>, Option<i64>) {
        let word = |(address, count): (u16, f64)| {
            let word = self.words(family.unit, address, 1)?[0];
            // rFr is signed; what a face tells is how fast, and the direction is a value of its own.
            Some(hundredths(f64::from((word as i16).unsigned_abs()) * count))
        };
        (word(family.frequency), family.current.and_then(word))
    }

    /// What each face says of the drive of this place.
    fn faces(&mut self, place: usize) -> Vec<(&'static str, Said)> {
        let short = short(&FAMILIES[place]);
        let (id, entities) = (format!("the {short}"), format!("the_{short}"));
        // Who is not in the file is looked for by the name that he had.
        let name = match self.names[place].as_str() {
            "" => id.clone(),
            name => name.to_owned(),
        };
        let mut faces = vec![("API", self.api(&id)), ("status", self.status(&name))];
        faces.extend(self.page.as_mut().map(|page| ("page", page_of(&page.shows("rows")[&name]))));
        faces.push(("MQTT", self.mqtt(&entities)));
        faces.extend(self.home.as_mut().map(|home| ("Home Assistant", home_of(home, &entities))));
        faces.push(("Sparkplug", self.sparkplug(&id)));
        faces.push(("Prometheus", self.prometheus(&id)));
        faces.push(("virtual unit", self.virtual_unit(place as u16)));
        faces
    }

    /// A drive of the API, and when that was so.
    fn drive(&self, id: &str) -> Option<(Value, Value)> {
        let mut state: Value =
            serde_json::from_str(&get(self.http, "/api/v1/state", "*/*")).expect("it is JSON");
        let drives = state["drives"].as_array_mut().expect("a list");
        let drive = drives.iter_mut().find(|drive| drive["id"] == id)?.take();
        Some((drive, state["time_unix_ms"].take()))
    }

    fn api(&self, id: &str) -> Said {
        self.drive(id).map_or(Said::NOTHING, |(drive, time)| live(&drive["status"], &time))
    }

    /// As `drived status` prints it for a person, who is told where that is not of now.
    fn status(&self, name: &str) -> Said {
        let told = run(&["status", name, "--socket", &self.at("socket")]).out;
        let row = |label: &str| {
            let mut rows = told.lines().map(str::trim);
            rows.find_map(|line| line.strip_prefix(label)?.strip_prefix("  ")).map(str::trim)
        };
        let Some(state) = row("state").filter(|_| row("status").is_none()) else { return Said::NOTHING };
        // Its direction, and what has tripped it, are values of their own.
        let is_of_it = |word: &&str| !["fwd", "rev"].contains(word) && word.chars().all(char::is_lowercase);
        let state: Vec<&str> = state.split_whitespace().filter(is_of_it).collect();
        Said {
            frequency: row("output frequency").and_then(|text| read(text, "Hz")).map(hundredths),
            current: row("motor current").and_then(|text| read(text, "A")).map(hundredths),
            state: Some(state.join("_")),
            at: row("age").and_then(seconds).map(|age| now() - age),
        }
    }

    /// What the broker has kept of these topics of a drive, by their last levels.
    fn kept(&self, short: &str, topics: &[&str]) -> BTreeMap<String, String> {
        let port = self.broker.port.to_string();
        let mut command = Command::new("mosquitto_sub");
        command.args(["-V", "5", "-p", &port, "-W", "3", "-F", "%t %p", "-C", &topics.len().to_string()]);
        for topic in topics {
            command.args(["-t", &format!("drived/drive/{short}/{topic}")]);
        }
        let told = command.output().expect("it comes with mosquitto");
        let told = String::from_utf8(told.stdout).expect("it is text");
        let told = told.lines().filter_map(|line| line.split_once(' '));
        told.map(|(topic, said)| (topic.rsplit('/').next().unwrap_or_default().to_owned(), said.to_owned()))
            .collect()
    }

    fn mqtt(&self, short: &str) -> Said {
        let kept = self.kept(short, &["state", "availability"]);
        if kept.get("availability").map(String::as_str) != Some("online") {
            return Said::NOTHING;
        }
        let state: Value =
            kept.get("state").and_then(|state| serde_json::from_str(state).ok()).unwrap_or_default();
        live(&state["status"], &state["time_unix_ms"])
    }

    fn sparkplug(&mut self, id: &str) -> Said {
        let all = self.host.ask();
        let Some(device) = all.get(id) else { return Said::NOTHING };
        let value = |name: &str| device[name][0].as_f64().map(hundredths);
        Said {
            frequency: value("Status/Output Frequency"),
            current: value("Status/Current"),
            state: device["Status/State"][0].as_str().map(str::to_owned),
            at: device["Status/State"][1].as_f64().map(|ms| ms / 1_000.0),
        }
    }

    fn prometheus(&self, id: &str) -> Said {
        let text = get(self.http, "/metrics", "*/*");
        let value = |metric: &str, more: &str| {
            let series = format!("drived_drive_{metric}{{line=\"bench\",drive=\"{id}\"{more}}} ");
            text.lines().find_map(|line| line.strip_prefix(&series)?.parse::<f64>().ok())
        };
        let states = [
            "not_ready",
            "disabled",
            "ready",
            "running",
            "stopping",
            "quick_stop",
            "fault_reaction",
            "fault",
        ];
        let state = states.iter().find(|state| value("state", &format!(",state=\"{state}\"")) == Some(1.0));
        Said {
            frequency: value("output_frequency_hertz", "").map(hundredths),
            current: value("motor_current_amperes", "").map(hundredths),
            state: state.map(|state| (*state).to_owned()),
            // That it answered last is told of one that is lost, too.
            at: state.and_then(|_| value("last_answer_timestamp_seconds", "")),
        }
    }

    /// As the manual has the overview: flags, frequency in 0.01 Hz, current in 0.1 A, age in 0.1 s.
    fn virtual_unit(&self, slot: u16) -> Said {
        let words = self.words(247, 16 + 4 * slot, 4).expect("it is answered without the line");
        let known = |word: u16| Some(word).filter(|word| *word != 0xFFFF).map(i64::from);
        let states = [
            "",
            "not_ready",
            "disabled",
            "ready",
            "running",
            "stopping",
            "quick_stop",
            "fault_reaction",
            "fault",
        ];
        if words[0] >> 8 & 3 != 2 {
            assert_eq!((known(words[1]), known(words[2])), (None, None), "what is not good is not told");
            return Said::NOTHING;
        }
        Said {
            frequency: known(words[1]),
            current: known(words[2]).map(|deciamperes| deciamperes * 10),
            state: states.get(usize::from(words[0] & 15)).map(|state| (*state).to_owned()),
            at: known(words[3]).map(|age| now() - age as f64 / 10.0),
        }
    }

    /// Waits until every face says of a drive what it says itself, and that it is so now.
    fn agree(&mut self, step: &str, place: usize, state: Option<&str>) {
        let family = &FAMILIES[place];
        let end = Instant::now() + PATIENCE;
        loop {
            let (before, begun) = (self.itself(family), now());
            let faces = self.faces(place);
            let (after, ended) = (self.itself(family), now());
            let is_right = |face: &str, said: &Said| match state {
                None => *said == Said::NOTHING,
                Some(state) => {
                    let is_state = match (said.state.as_deref(), state) {
                        (Some("ready" | "disabled" | "not_ready"), "at rest") => {
                            said.state == faces[0].1.state
                        }
                        (said, state) => said == Some(state),
                    };
                    // These have the time of the last change.
                    let of_change = matches!(face, "Sparkplug" | "Home Assistant");
                    let oldest = if of_change { 0.0 } else { begun - OLDEST_S };
                    let is_now = said.at.is_some_and(|at| (oldest..=ended + 0.2).contains(&at));
                    // A person is shown tenths.
                    let tenths = |value: Option<i64>| value.map(|value| (value + 5) / 10);
                    let is_same = match face {
                        "page" => {
                            tenths(said.frequency) == tenths(after.0)
                                && tenths(said.current) == tenths(after.1)
                        }
                        _ => (said.frequency, said.current) == after,
                    };
                    is_same && is_state && is_now
                }
            };
            // What moves between two looks shows nothing.
            let is_still = before == after && (state.is_none() || after.0.is_some());
            if is_still && faces.iter().all(|(face, said)| is_right(face, said)) {
                if !std::mem::replace(&mut self.has_head, true) {
                    let heads: Vec<&str> = faces.iter().map(|(face, _)| *face).collect();
                    println!("| Step | Drive | {} |\n|{}", heads.join(" | "), "---|".repeat(heads.len() + 2));
                }
                let told: Vec<String> = faces.iter().map(|(_, said)| told(said, ended)).collect();
                println!("| {step} | {} | {} |", family.drive, told.join(" | "));
                return;
            }
            assert!(
                Instant::now() < end,
                "{step}: {} says {before:?}, {after:?}, expected {state:?}: {faces:#?}",
                family.drive
            );
        }
    }

    /// Waits until every face says of a slow value what the drive says itself.
    fn agree_on_slow(&mut self, slow: &Slow) {
        let family = &FAMILIES[slow.place];
        let (id, short, end) =
            (format!("the {}", short(family)), format!("the_{}", short(family)), Instant::now() + PATIENCE);
        let (register, count) = slow.register;
        loop {
            let itself =
                self.words(family.unit, register, 1).map(|words| hundredths(f64::from(words[0]) * count));
            let number = |value: &Value| value.as_f64().map(hundredths);
            let api = self.drive(&id).and_then(|(drive, _)| number(&drive["measurements"][slow.api]));
            let kept = self.kept(&short, &["measurements"]);
            let kept = kept.get("measurements").and_then(|told| serde_json::from_str::<Value>(told).ok());
            let all = self.host.ask();
            let text = get(self.http, "/metrics", "*/*");
            let series = format!("drived_drive_{}{{line=\"bench\",drive=\"{id}\"}} ", slow.prometheus.0);
            let scraped = text.lines().find_map(|line| line.strip_prefix(&series)?.parse::<f64>().ok());
            let mut said = vec![
                ("API", api),
                ("MQTT", kept.and_then(|told| number(&told[slow.api]))),
                ("Sparkplug", number(&all[&id][format!("Measurements/{}", slow.sparkplug)][0])),
                ("Prometheus", scraped.map(|value| hundredths(value * slow.prometheus.1))),
            ];
            if let (Some(home), Some(entity)) = (&mut self.home, slow.home) {
                let state = home.entity(&format!("sensor.{short}_{entity}"))["state"].take();
                let state = state.as_str().and_then(|state| state.parse().ok());
                said.push(("Home Assistant", state.map(hundredths)));
            }
            if let Some(page) = &mut self.page {
                let shown = page.shows(&format!("drive {id}"))[slow.page].take();
                let unit = if slow.api.ends_with("percent") { "%" } else { "V" };
                let shown = shown.as_str().and_then(|text| read(text, unit)).map(hundredths);
                // It shows whole units: the same, rounded.
                let is_it = shown == itself.map(|value| (value + 50) / 100 * 100);
                said.push(("page", if is_it { itself } else { shown }));
            }
            if itself.is_some() && said.iter().all(|(_, said)| *said == itself) {
                let value = itself.unwrap_or_default() as f64 / 100.0;
                let faces: Vec<&str> = said.iter().map(|(face, _)| *face).collect();
                println!(
                    "| they run | {} | {} {value}: the same at {} |",
                    family.drive,
                    slow.api,
                    faces.join(", ")
                );
                return;
            }
            assert!(Instant::now() < end, "{id} says {} {itself:?}: {said:?}", slow.api);
        }
    }

    /// Waits until the page tells of a drive that is lost how old its last status is, as the API does.
    fn agree_on_age(&mut self, place: usize) {
        let Some(page) = &mut self.page else { return };
        let (name, end) = (self.names[place].clone(), Instant::now() + PATIENCE);
        loop {
            let row = page.shows("rows")[&name].take();
            let text = row["age"].as_str().unwrap_or_default();
            let shown = text.strip_suffix(" old").and_then(seconds);
            let state: Value =
                serde_json::from_str(&get(self.http, "/api/v1/state", "*/*")).expect("it is JSON");
            let mut drives = state["drives"].as_array().into_iter().flatten();
            let told = drives.find(|drive| drive["name"] == *name).expect("it is there");
            let age = told["status"]["age_ms"].as_f64().expect("it has answered once") / 1_000.0;
            // It counts on once a second, and what lies between the two looks is time.
            if row["quality"] == "stale"
                && shown.is_some_and(|shown| (age - OLDEST_S..=age + 1.0).contains(&shown))
            {
                println!("| one is lost | {name} | {age:.1} s old by the API, and the page says: {text} |");
                return;
            }
            assert!(Instant::now() < end, "{name} is {age} s old, and the page says {row}");
        }
    }

    fn all_agree(&mut self, step: &str, states: [Option<&str>; 5]) {
        for (place, state) in states.into_iter().enumerate() {
            self.agree(step, place, state);
        }
    }
}

/// What somebody has said, in a cell.
fn told(said: &Said, now: f64) -> String {
    let Some(state) = &said.state else { return "nothing".to_owned() };
    let hertz = said.frequency.map_or("?".to_owned(), |hertz| format!("{:.2} Hz", hertz as f64 / 100.0));
    let amperes = said.current.map_or(String::new(), |amperes| format!(", {:.1} A", amperes as f64 / 100.0));
    let age = said.at.map_or(String::new(), |at| format!(", {:.1} s old", (now - at).max(0.0)));
    format!("{state}, {hertz}{amperes}{age}")
}

/// What a row of the overview shows as of now; what is old is grey there, with its age.
fn page_of(row: &Value) -> Said {
    if row["quality"] != "good" || row["age"] != "live" {
        return Said::NOTHING;
    }
    let text = |cell: &str| row[cell].as_str().unwrap_or_default();
    Said {
        frequency: read(text("frequency"), "Hz").map(hundredths),
        current: read(text("current"), "A").map(hundredths),
        // The words of the API, as a person reads them.
        state: Some(text("state").to_lowercase().replace(' ', "_")),
        at: Some(now()),
    }
}

/// What the entities of a drive are at Home Assistant; a value that is not told again in time is none there.
fn home_of(home: &mut HomeAssistant, entities: &str) -> Said {
    let state = home.entity(&format!("sensor.{entities}_state"));
    let known = state["state"].as_str().filter(|state| !["-", "unavailable", "unknown"].contains(state));
    let mut number = |what: &str, unit: &str| {
        let entity = home.entity(&format!("sensor.{entities}_{what}"));
        let value = entity["state"].as_str()?.parse().ok()?;
        assert_eq!(entity["attributes"]["unit_of_measurement"], unit, "{entity}");
        Some(hundredths(value))
    };
    let (frequency, current) = (number("frequency", "Hz"), number("current", "A"));
    Said { frequency, current, state: known.map(str::to_owned), at: known.and(state["at"].as_f64()) }
}

/// What a status of the API says, where it is one of now.
fn live(status: &Value, time_unix_ms: &Value) -> Said {
    if status["quality"] != "good" {
        return Said::NOTHING;
    }
    let age_ms = status["age_ms"].as_f64().expect("each value has its age");
    Said {
        frequency: status["output_frequency_hz"].as_f64().map(hundredths),
        current: status["current_a"].as_f64().map(hundredths),
        state: status["state"].as_str().map(str::to_owned),
        at: time_unix_ms.as_f64().map(|time| (time - age_ms) / 1_000.0),
    }
}

fn configure(folder: &Path, (link, broker, http, gateway): (&str, u16, u16, u16), names: &[String; 5]) {
    let mut text = format!(
        "state = \"state\"\n[http]\nlisten = \"127.0.0.1:{http}\"\n[mqtt]\nservers = [\"mqtt://127.0.0.1:{broker}\"]\nheartbeat = \"1s\"\ndiscovery = \"device\"\n\
         [mqtt.sparkplug]\ngroup = \"plant\"\nedge_node = \"hall 1\"\n\
         [[gateways]]\nlisten = \"127.0.0.1:{gateway}\"\nvirtual_unit = 247\nunits = {{ "
    );
    let named = || FAMILIES.iter().zip(names).filter(|(_, name)| !name.is_empty());
    let units: Vec<String> = named().map(|(family, name)| format!("{} = \"{name}\"", family.unit)).collect();
    text += &format!("{} }}\n[lines.bench]\nport = \"{link},19200,8N1\"\n", units.join(", "));
    for (family, name) in named() {
        text += &format!(
            "[[drives]]\nline = \"bench\"\ndrive = \"{}\"\nname = \"{name}\"\ncontrol = true\n",
            family.drive
        );
    }
    fs::write(folder.join("drives.toml"), text).expect("it can be written");
}

#[test]
fn every_face_tells_what_the_drives_say_while_they_move_trip_are_renamed_lost_and_gone() {
    let Some(mut plant) = Plant::start() else { return };
    for (name, hertz) in plant.names.clone().iter().zip(["10Hz", "15Hz", "20Hz", "25Hz", "30Hz"]) {
        plant.start_motor(name, hertz);
    }
    plant.all_agree("they run", [Some("running"); 5]);
    for slow in &SLOW {
        plant.agree_on_slow(slow);
    }

    // Another name: the same device, series, topic and place, and the motor turns on.
    plant.names[1] = "the mixer".to_owned();
    plant.reload();
    plant.all_agree("one is called otherwise", [Some("running"); 5]);
    // Its counters go on with it, those of its commands too: it was started by the name that it had, and stopped by nobody.
    let text = get(plant.http, "/metrics", "*/*");
    let of_it = text
        .lines()
        .filter(|line| line.starts_with("drived_commands_total{") && line.contains("drive=\"the atv28\""));
    let actions: Vec<&str> =
        of_it.filter_map(|line| line.split("action=\"").nth(1)?.split('"').next()).collect();
    assert!(!actions.is_empty() && actions.iter().all(|action| *action == "start"), "{actions:?}: {text}");

    plant.sim.say("atv312@1 trip OCF", "done");
    plant.all_agree(
        "one trips",
        [Some("fault"), Some("running"), Some("running"), Some("running"), Some("running")],
    );

    plant.sim.say("atv58@3 power off", "done");
    plant.all_agree("one is lost", [Some("fault"), Some("running"), None, Some("running"), Some("running")]);

    plant.agree_on_age(2);

    let gone = std::mem::take(&mut plant.names[3]);
    plant.reload();
    plant.all_agree("one is taken out", [Some("fault"), Some("running"), None, None, Some("running")]);

    plant.sim.say("atv58@3 power on", "done");
    plant.names[3] = gone;
    plant.reload();
    // Who was stopped as he left stands, and so does who had no power.
    let states = [Some("fault"), Some("running"), Some("at rest"), Some("at rest"), Some("running")];
    plant.all_agree("both are back", states);
    plant.page.take().into_iter().for_each(Page::close);
    if let Some(mut home) = plant.home.take() {
        assert_eq!(home.complaints(), Vec::<String>::new());
    }
    assert_eq!(plant.daemon.interrupt().0, Some(0));
    // What became of it by either name is found by its id.
    let config = plant.folder.join("drives.toml").display().to_string();
    let audited = run(&["audit", "show", "--about", "the atv28", "--json", "--config", &config]);
    let rows =
        audited.assert_done().lines().map(|row| serde_json::from_str::<Value>(row).expect("an object"));
    let of_it: Vec<Value> = rows.filter(|row| row["drive"] == "the atv28").collect();
    for what in ["the atv28: start", "the mixer: exit"] {
        assert!(
            of_it.iter().any(|row| row["what"].as_str().is_some_and(|said| said.starts_with(what))),
            "{of_it:#?}"
        );
    }
    fs::remove_dir_all(&plant.folder).expect("it is there");
}
