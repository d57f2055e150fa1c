//! What was read while the broker was away reaches a host once it is back: all that the history has of it, once, as of the past.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{BufRead as _, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{Arc, Mutex},
    thread,
};

use drive_sparkplug::Raw;
use drived_history::{
    quantity::Quantity,
    read::{History, pieces},
};
use serde_json::Value;

use super::*;

/// The quantities of the history that are compared, with their metrics.
const COMPARED: [(&str, &str); 8] = [
    ("output_frequency_hz", "Status/Output Frequency"),
    ("current_a", "Status/Current"),
    ("state", "Status/State"),
    ("control", "Status/Control"),
    ("setpoint_hz", "Control/Setpoint"),
    ("motor_thermal_percent", "Measurements/Motor Thermal State"),
    ("torque_percent", "Measurements/Torque"),
    ("inputs", "Measurements/Inputs"),
];

/// A metric at a time, as JSON: `null` where nothing is known.
type Point = (String, String, i64, String);

/// A host in a program of its own.
struct Host {
    child: Child,
    heard: Arc<Mutex<Vec<(bool, Point)>>>,
}

impl Host {
    /// It listens when this returns.
    fn listen(python: &std::ffi::OsStr, port: u16) -> Self {
        let mut child = Command::new(python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sparkplug_historical.py"))
            .arg(port.to_string())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the script starts");
        let mut lines =
            BufReader::new(child.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        assert_eq!(lines.next().as_deref(), Some("ready"));
        let heard = Arc::<Mutex<Vec<_>>>::default();
        let hears = Arc::clone(&heard);
        thread::spawn(move || {
            for line in lines {
                let told: (bool, String, String, i64, Value) =
                    serde_json::from_str(&line).expect("it is what the script prints");
                let (is_past, device, name, at, value) = told;
                hears.lock().unwrap().push((is_past, (device, name, at, value.to_string())));
            }
        });
        Self { child, heard }
    }

    /// What it was told of the past, each with how often.
    fn past(&self) -> BTreeMap<Point, usize> {
        let mut times = BTreeMap::new();
        for (_, point) in self.heard.lock().unwrap().iter().filter(|(is_past, _)| *is_past) {
            *times.entry(point.clone()).or_default() += 1;
        }
        times
    }

    /// What is so now, as it was told last.
    fn now(&self, device: &str, name: &str) -> Option<String> {
        let heard = self.heard.lock().unwrap();
        let is_it = |(is_past, (of, metric, ..)): &&(bool, Point)| !is_past && of == device && metric == name;
        heard.iter().rev().find(is_it).map(|(_, (.., value))| value.clone())
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What the history has of both pumps behind a moment up to another, as a host is told it.
fn kept(file: &Path, from: i64, to: i64) -> BTreeSet<Point> {
    let history = History::open(file).expect("it is there");
    let mut all = BTreeSet::new();
    for pump in ["pump 1", "pump 2"] {
        for (value, metric) in COMPARED {
            let quantity = Quantity::named(value).expect("there is one");
            for piece in pieces(&history.0, pump, quantity, from, to).expect("it is read") {
                for point in piece.points.into_iter().filter(|point| point.at > from) {
                    let told = match point.count {
                        None => "null".to_owned(),
                        Some(count) if quantity.is_number() => {
                            Value::from(quantity.value(count as f64)).to_string()
                        }
                        Some(count) if value == "inputs" => count.to_string(),
                        Some(count) => Value::from(quantity.text(count).replace(' ', "_")).to_string(),
                    };
                    all.insert((pump.to_owned(), metric.to_owned(), point.at, told));
                }
            }
        }
    }
    all
}

/// The host is there, or says goodbye.
fn tell_state(plant: &Plant, is_online: bool) {
    let state = serde_json::json!({ "online": is_online, "timestamp": unix_ms() }).to_string();
    plant.broker.publish("spBv1.0/STATE/scada", state.as_bytes(), &["-r", "-q", "1"]);
}

/// Questions that were answered behind what was published before them.
fn signs(packets: &[Packet]) -> usize {
    packets
        .iter()
        .filter(|packet| matches!(packet, Packet::Subscribe { filter, .. } if filter == NODE))
        .count()
}

/// Two pumps with a history of their own, at a broker with a host, and where their API listens.
fn plant(name: &str) -> Option<(Plant, PathBuf, u16)> {
    let file = path(&format!("{name}.sqlite"));
    let _ = std::fs::remove_file(&file);
    let (says, port) = (format!("[history]\nfile = \"{}\"", file.display()), support::free_port());
    let more = "commands = \"operate\"\nprimary_host = \"scada\"\nhistorical = true";
    let plant = Plant::prepare_at(&format!("127.0.0.1:{port}"), "atv312@1-2", &says, name, more)?;
    Some((plant, file, port))
}

/// Waits until the broker has what was published before.
fn be_certain(plant: &Plant) {
    let asked = signs(&plant.tap.packets());
    plant.tap.wait_until("two signs of the broker", |packets| signs(packets) >= asked + 2);
}

/// When the births were told that come behind this place among the packets.
fn born(plant: &Plant, behind: usize) -> i64 {
    let place = plant.wait_for("NBIRTH", "hall 1", behind);
    plant.wait_for("DBIRTH", "pump 2", behind);
    let recording = Recording::of(plant.tap.packets());
    let birth = recording.said.iter().find(|said| said.place == place).expect("it was seen");
    birth.payload.timestamp.and_then(|at| i64::try_from(at).ok()).expect("it has a time")
}

/// Waits until a host has everything that the history has of a time, and sees that nothing of it came twice. What is kept has to be so.
#[track_caller]
fn expect_each_once(
    plant: &Plant,
    host: &Host,
    file: &Path,
    away: i64,
    back: i64,
    is_so: fn(&BTreeSet<Point>) -> bool,
) {
    let missing = || {
        let (past, kept) = (host.past(), kept(file, away, back));
        (is_so(&kept), kept.into_iter().filter(|point| !past.contains_key(point)).collect::<Vec<_>>())
    };
    let told = wait_until(|| {
        let (is_so, missing) = missing();
        is_so && missing.is_empty()
    });
    assert!(told, "{:?} of {:?}", missing(), kept(file, away, back));
    be_certain(plant);
    let past = host.past();
    let twice: Vec<_> = past.iter().filter(|(_, times)| **times > 1).collect();
    assert!(twice.is_empty(), "{twice:?}");
    println!(
        "{} values of the outage, each once; {} of the past in all",
        kept(file, away, back).len(),
        past.len()
    );
}

/// Whether a pump has tripped in it, and whether there was a gap.
fn has_trip_and_gap(kept: &BTreeSet<Point>) -> bool {
    let trip = |point: &Point| point.0 == "pump 1" && point.3 == "\"fault\"";
    kept.iter().any(trip) && kept.iter().any(|point| point.3 == "null")
}

/// While the world goes on.
#[expect(clippy::disallowed_methods, reason = "there is no runtime here")]
fn sleep(milliseconds: u64) {
    thread::sleep(std::time::Duration::from_millis(milliseconds));
}

#[test]
fn what_was_read_while_the_broker_was_away_reaches_the_host_once_and_as_of_the_past() {
    let Some(python) = python() else { return };
    let Some((mut plant, file, _)) = plant("sparkplug-outage") else { return };
    let host = Host::listen(&python, plant.broker.port);
    tell_state(&plant, true);
    plant.run();
    plant.wait_for("DBIRTH", "pump 2", 0);
    plant.wait_for_metric("pump 1", "Control/Start Refused", |metric| metric.is_null);
    plant.write("pump 1", "Control/Setpoint", Raw::Double(45.0));
    be_certain(&plant);
    assert!(host.past().values().all(|times| *times == 1));

    // The pump runs up and trips, and the other one loses its supply for a while.
    plant.ask("pump 1", "s-1", r#"{"id": "s-1", "action": "start"}"#, "confirmed");
    let (away, behind) = (i64::try_from(unix_ms()).unwrap(), plant.tap.packets().len());
    plant.broker.end();
    drop(host);
    sleep(2_000);
    plant.sim.say("atv312@1 trip OCF", "done");
    sleep(1_500);
    plant.sim.say("atv312@2 power off", "done");
    sleep(2_500);
    plant.sim.say("atv312@2 power on", "done");
    sleep(1_500);
    plant.broker.begin();
    let host = Host::listen(&python, plant.broker.port);
    tell_state(&plant, true);
    let back = born(&plant, behind);
    expect_each_once(&plant, &host, &file, away, back, has_trip_and_gap);
    // And what is so now is what is so now.
    assert_eq!(host.now("pump 1", "Fault/Mnemonic").as_deref(), Some("\"OCF\""));
    assert_eq!(host.now("pump 1", "Status/State").as_deref(), Some("\"fault\""));

    // The host goes for a while, in which the broker is there.
    let (away, behind) = (i64::try_from(unix_ms()).unwrap(), plant.tap.packets().len());
    tell_state(&plant, false);
    plant.wait_for("NDEATH", "hall 1", behind);
    plant.sim.say("atv312@2 trip OHF", "done");
    sleep(3_000);
    tell_state(&plant, true);
    let back = born(&plant, behind);
    let has_trip =
        |kept: &BTreeSet<Point>| kept.iter().any(|point| point.0 == "pump 2" && point.3 == "\"fault\"");
    expect_each_once(&plant, &host, &file, away, back, has_trip);

    let (code, _) = plant.daemon.take().expect("it runs").interrupt();
    assert_eq!(code, Some(0));
    plant.tap.wait_until("goodbye", |packets| {
        packets.iter().any(|packet| matches!(packet, Packet::Disconnect { .. }))
    });
    let (mut broken, _) = rules::judge_all(&Recording::of(plant.tap.packets()));
    // Of a connection that the broker did not take nothing is seen here, and it has a number too.
    broken.retain(|why| !why.contains("bdseq-increment"));
    assert!(broken.is_empty(), "{broken:#?}");
    let _ = std::fs::remove_file(file);
}

#[test]
fn what_a_daemon_had_not_told_when_it_was_killed_is_told_by_the_next_one() {
    let Some(python) = python() else { return };
    let Some((mut plant, file, port)) = plant("sparkplug-outage-killed") else { return };
    tell_state(&plant, true);
    plant.run();
    plant.wait_for("DBIRTH", "pump 2", 0);
    be_certain(&plant);
    let (away, behind) = (i64::try_from(unix_ms()).unwrap(), plant.tap.packets().len());
    plant.broker.end();
    plant.sim.say("atv312@1 trip OCF", "done");
    // So that it has been read when it goes.
    sleep(1_500);
    plant.sim.say("atv312@2 power off", "done");
    sleep(2_500);
    plant.sim.say("atv312@2 power on", "done");
    sleep(2_500);
    // Whoever asks for a story has written what was read: what is not written dies with the daemon.
    support::get(port, &format!("/api/v1/drives/pump%201/why?at_unix_ms={}", unix_ms()), "application/json");
    plant.daemon.take().expect("it runs").signal("-KILL");
    plant.run();
    sleep(2_000);
    plant.broker.begin();
    let host = Host::listen(&python, plant.broker.port);
    tell_state(&plant, true);
    let back = born(&plant, behind);
    expect_each_once(&plant, &host, &file, away, back, has_trip_and_gap);
    drop(plant.daemon.take());
    let _ = std::fs::remove_file(file);
}

/// Looks again and again; `false`: it has not become so in a time in which everything does.
fn wait_until(is_so: impl Fn() -> bool) -> bool {
    (0..600).any(|_| {
        let is_so = is_so();
        if !is_so {
            sleep(200);
        }
        is_so
    })
}
